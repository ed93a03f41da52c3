"""Designs that cannot be evaluated: every optimizer shortens its step; jumps are crossed where that is allowed."""

import numpy as np
import pytest
import torch
from design_problems import AcceptsJumps, two_balls

import magshell as ms

METHODS = [ms.optim.MMA, ms.optim.GCMMA, ms.optim.LBFGS]


def adam(parameters, **bounds):
    return torch.optim.Adam(parameters, lr=1.0)


def design(*values):
    return torch.tensor(values, dtype=torch.float64, requires_grad=True)


def quiet(*arguments, **options):
    return ms.minimize(*arguments, progress=False, **options)


def bowl(x):
    return ((x - 2) ** 2).sum()


class NearbyBowl:
    """The quadratic objective `bowl`, which rejects designs farther than `reach` from the last accepted one."""

    def __init__(self, x, reach):
        self.x, self.reach, self.refused = x, reach, 0
        self.accept()

    def accept(self, record=None):
        """Take the current design as the accepted one; also the callback of ms.minimize."""
        self.accepted = self.x.detach().clone()

    def __call__(self, x):
        if (x.detach() - self.accepted).norm() > self.reach:
            self.refused += 1
            raise ms.NotConverged("too far")
        return bowl(x)


@pytest.mark.parametrize("method", METHODS)
def test_a_rejected_step_goes_less_far(method):
    x = design(-3.0, 4.0)
    nearby, optimizer = NearbyBowl(x, 0.9), method([x], lower=-5.0, upper=5.0)
    begin, closure = bowl(x).item(), lambda: nearby(x)
    value = optimizer.step(closure)
    assert nearby.refused > 0 and value == bowl(x).item() < begin
    for _ in range(60):
        nearby.accept()
        optimizer.step(closure)
    np.testing.assert_allclose(x.detach(), 2.0, atol=1e-4)


def test_mma_halves_the_step():
    x, steps = design(4.0, 3.0, 2.0), []
    whole = x.detach().clone().requires_grad_()
    ms.optim.MMA([whole], lower=0.0, upper=5.0).step(lambda: two_balls(whole))
    full = (whole - x).detach()

    def objective(x):
        steps.append(x.detach().clone())
        if 1 < len(steps) < 4:
            raise ms.DesignRejected("twice")
        return two_balls(x)

    optimizer = ms.optim.MMA([x], lower=0.0, upper=5.0)
    optimizer.step(lambda: objective(x))
    for k, share in ((1, 1.0), (2, 0.5), (3, 0.25)):
        np.testing.assert_allclose(steps[k] - steps[0], share * full, atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_a_step_rejected_at_every_length_changes_nothing(method):
    x = design(-3.0, 4.0)
    optimizer = method([x], lower=-5.0, upper=5.0, max_backtracks=3)
    closure_calls = []

    def closure():
        closure_calls.append(x.detach().clone())
        if len(closure_calls) > 2:
            raise ms.NotConverged("nowhere")
        return bowl(x)

    optimizer.step(closure)
    before, gradient, state = x.detach().clone(), x.grad.clone(), str(optimizer.state_dict())
    tried = len(closure_calls)
    with pytest.raises(ms.NotConverged, match="nowhere"):
        optimizer.step(closure)
    assert len(closure_calls) == tried + 4
    assert x.detach().equal(before) and x.grad.equal(gradient) and str(optimizer.state_dict()) == state


@pytest.mark.parametrize("method", [*METHODS, adam])
def test_records_count_the_rejected(method):
    x = design(-3.0, 4.0)
    nearby = NearbyBowl(x, 0.3)
    found = quiet(
        nearby, [x], lambda p: method(p, lower=-5.0, upper=5.0), max_iterations=5, callback=nearby.accept
    )
    assert sum(record.rejected for record in found.history) == nearby.refused > 0
    assert found.history[0].rejected == 0 and not any(record.jumped for record in found.history)
    assert found.objective == min(record.objective for record in found.history) < bowl(design(-3.0, 4.0))


@pytest.mark.parametrize("method", [*METHODS, adam])
def test_an_unfound_equilibrium_at_every_length_ends_with_the_best(method):
    x = design(-3.0, 4.0)
    nearby = NearbyBowl(x, 1e-9)
    with pytest.raises(ms.ObjectiveFailed, match="7 designs rejected: too far") as caught:
        quiet(nearby, [x], lambda p: method(p, lower=-5.0, upper=5.0))
    assert isinstance(caught.value.__cause__, ms.NotConverged)
    assert caught.value.last_good.objective == bowl(x).item() and x.tolist() == [-3.0, 4.0]


def test_a_first_design_that_is_rejected_raises_as_it_is():
    def objective(x):
        raise ms.EquilibriumJumped("at once")

    with pytest.raises(ms.EquilibriumJumped, match="at once"):
        quiet(objective, [design(0.0)], ms.optim.LBFGS)


class Snapping(AcceptsJumps):
    """A state that follows x until it snaps at x = 0, and back at x = -1, like an equilibrium with hysteresis."""

    def __init__(self):
        self.branch = 0

    def __call__(self, x):
        branch = 1 if x.item() > 0 else 0 if x.item() < -1 else self.branch
        if branch != self.branch and not self.accepting:
            raise ms.EquilibriumJumped(f"snaps at {x.item():.3g}")
        self.branch = branch
        return ((x - 2) ** 2).sum() + 3.0 * branch

    def state_dict(self):
        return {"branch": self.branch}

    def load_state_dict(self, state):
        self.branch = state["branch"]


@pytest.mark.parametrize("as_objective", [True, False])
@pytest.mark.parametrize("method", [*METHODS, adam])
def test_a_jump_in_the_way_is_crossed(method, as_objective):
    x, snapping = design(-0.9), Snapping()
    objective, stateful = (snapping, ()) if as_objective else (lambda x: snapping(x), [snapping])
    found = quiet(
        objective,
        [x],
        lambda p: method(p, lower=-4.0, upper=4.0),
        stateful=stateful,
        max_iterations=40,
        tolerance=1e-12,
    )
    crossings = [record for record in found.history if record.jumped]
    assert len(crossings) == 1 and crossings[0].rejected == 7 and not snapping.accepting
    assert x.item() == pytest.approx(2.0, abs=0.2 if method is adam else 1e-3)
    assert found.objective == pytest.approx(3.0, abs=0.05)


def test_a_jump_to_a_worse_design_keeps_the_best():
    x, snapping = design(-0.05), Snapping()
    found = quiet(snapping, [x], lambda p: ms.optim.MMA(p, lower=-4.0, upper=0.5), max_iterations=10)
    assert any(record.jumped for record in found.history)
    assert found.objective == min(record.objective for record in found.history) and x.item() < 0


@pytest.mark.parametrize(("offered", "on_jump"), [(True, "stop"), (False, "cross")])
def test_a_jump_that_is_not_crossed_ends_with_the_best(offered, on_jump):
    x, snapping = design(-0.9), Snapping()
    objective = snapping if offered else lambda x: snapping(x)
    found = quiet(objective, [x], lambda p: ms.optim.MMA(p, lower=-4.0, upper=4.0), on_jump=on_jump)
    assert "the equilibrium jumps, however short the step: snaps at" in found.reason
    assert found.objective == min(record.objective for record in found.history)
    assert x.item() <= 0 and not any(record.jumped for record in found.history)


def test_resumed_after_a_crossing_gives_the_same_bits(tmp_path):
    def run(iterations, **options):
        snapping = Snapping()
        return quiet(
            lambda x: snapping(x),
            [design(-0.9)],
            lambda p: ms.optim.MMA(p, lower=-4.0, upper=4.0, move=0.05),
            stateful=[snapping],
            max_iterations=iterations,
            **options,
        )

    whole = run(20)
    crossed = next(record.iteration for record in whole.history if record.jumped)
    run(crossed + 2, checkpoint=tmp_path / "run.pt")
    found = run(20, checkpoint=tmp_path / "run.pt", resume=True)
    assert found.parameters[0].equal(whole.parameters[0])
    assert [(r.objective, r.rejected, r.jumped) for r in found.history] == [
        (r.objective, r.rejected, r.jumped) for r in whole.history
    ]


def test_unknown_limits_are_refused():
    for method in METHODS:
        with pytest.raises(ValueError, match="max_backtracks"):
            method([design(0.0)], lower=-1.0, upper=1.0, max_backtracks=-1)
    with pytest.raises(ValueError, match="first_step"):
        ms.optim.LBFGS([design(0.0)], first_step=0)
