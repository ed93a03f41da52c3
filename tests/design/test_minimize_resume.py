"""Resumed minimizations: a checkpoint is accepted for its own problem only, and messages name the difference."""

import numpy as np
import pytest
import torch
from design_problems import AcceptsJumps, rosenbrock

import magshell as ms


def bowl(x):
    return ((x - 1) ** 2).sum()


def started(path, make, objective=bowl, **options):
    """Minimize with a checkpoint for five iterations; with resume=True, continue from the checkpoint."""
    x = torch.tensor([0.0, 0.1, 0.15], dtype=torch.float64, requires_grad=True)
    options = {"max_iterations": 5, "progress": False, "checkpoint": path, **options}
    return ms.minimize(objective, [x], make, **options), x


def lbfgs(**options):
    return lambda parameters: ms.optim.LBFGS(parameters, **{"upper": 0.5, **options})


def mma(**options):
    return lambda parameters: ms.optim.MMA(parameters, **{"lower": 0.0, "upper": 0.5, **options})


def torch_optimizer(kind, **options):
    return lambda parameters: getattr(torch.optim, kind)(parameters, **options)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        (lbfgs(), lbfgs(upper=0.2), r"upper of entry 0 \(3 of 3 differ\) was 0.5 and is 0.2"),
        (lbfgs(), lbfgs(lower=0.0), "lower of entry 0 .* was -inf and is 0"),
        (
            lbfgs(),
            lbfgs(upper=torch.tensor([0.5, 0.5, 0.4])),
            r"upper of entry 2 \(1 of 3 differ\) was 0.5 and is 0.4",
        ),
        (lbfgs(), lbfgs(scale=0.1), "scale of entry 0 .* was nan and is 0.1"),
        (lbfgs(), lbfgs(memory=3), "memory was 10 and is 3"),
        (lbfgs(), lbfgs(max_backtracks=3), "max_backtracks was 6 and is 3"),
        (mma(), mma(move=0.1), "move of group 0 was 1 and is 0.1"),
        (mma(), mma(penalty=10.0), "penalty was 1000 and is 10"),
        (torch_optimizer("SGD", lr=0.1), torch_optimizer("SGD", lr=0.2), "lr of group 0 was 0.1 and is 0.2"),
        (
            torch_optimizer("Adam"),
            torch_optimizer("Adam", amsgrad=True),
            "amsgrad of group 0 was False and is True",
        ),
        (
            torch_optimizer("Adam"),
            torch_optimizer("Adam", betas=(0.5, 0.999)),
            r"betas of group 0.* was 0.9 and is 0.5",
        ),
    ],
)
def test_resuming_with_other_options_is_refused(before, after, words, tmp_path):
    path = tmp_path / "run.pt"
    started(path, before)
    with pytest.raises(ValueError, match=f"the checkpoint is of a run with other options: {words}"):
        started(path, after, resume=True)
    assert started(path, before, resume=True, max_iterations=7)[0].iterations >= 1


def test_the_same_bounds_in_another_form_are_the_same(tmp_path):
    started(tmp_path / "run.pt", lbfgs())
    found, _ = started(tmp_path / "run.pt", lbfgs(upper=torch.full((3,), 0.5)), resume=True)
    assert found.objective == 0.75


def test_resuming_with_other_feasibility_or_dtype_is_refused(tmp_path):
    path = tmp_path / "run.pt"
    started(path, lbfgs())
    with pytest.raises(ValueError, match=r"feasibility was 1e-06 and is 0\.1"):
        started(path, lbfgs(), resume=True, feasibility=0.1)
    x = torch.zeros(3, requires_grad=True)
    with pytest.raises(
        ValueError, match=r"parameters of \['torch.float64'\], and this problem has \['torch.float32'\]"
    ):
        ms.minimize(bowl, [x], lbfgs(), checkpoint=path, resume=True, progress=False)


@pytest.mark.parametrize(
    "other", [lambda x: 2 * bowl(x), lambda x: bowl(x) + 1e-4, lambda x: (bowl(x), (x[:1] + 1))]
)
def test_resuming_with_another_objective_is_refused(other, tmp_path):
    path = tmp_path / "run.pt"
    started(path, mma())
    with pytest.raises(
        ValueError, match=r"the best design of the checkpoint has the \w+ [0-9.]+ there and .* now"
    ):
        _, x = started(path, mma(), other, resume=True)
    x = torch.tensor([0.3, 0.3, 0.3], dtype=torch.float64, requires_grad=True)
    with pytest.raises(ValueError, match="another one"):
        ms.minimize(other, [x], mma(), checkpoint=path, resume=True, progress=False)
    assert x.tolist() == [0.3, 0.3, 0.3]  # as it was


def test_an_objective_that_fails_there_is_refused(tmp_path):
    def failing(x):
        raise ms.NotConverged("too soft")

    started(tmp_path / "run.pt", mma())
    with pytest.raises(ValueError, match="the best design of the checkpoint cannot be evaluated: too soft"):
        started(tmp_path / "run.pt", mma(), failing, resume=True)


def test_resuming_with_other_constraints_is_refused(tmp_path):
    def run(limit, **options):
        return started(tmp_path / "run.pt", mma(), lambda x: (bowl(x), limit - x.sum()[None]), **options)[0]

    assert run(2.0).violation == pytest.approx(0.5)  # more than the bounds allow
    with pytest.raises(ValueError, match=r"has the violation 0\.5\d* there and 0\.4\d* now"):
        run(1.9, resume=True)


class Drifting(AcceptsJumps):
    """A state that every evaluation moves on, as a warm start's equilibrium or a generator of random numbers."""

    def __init__(self):
        self.state = np.array([0.0])

    def __call__(self, x):
        self.state += 1.0  # in place
        if self.state[0] > 9 and not self.accepting:
            raise ms.EquilibriumJumped("past nine")
        return rosenbrock(x) - 100.0 * float(self.state[0])

    def state_dict(self):
        return {"state": self.state}

    def load_state_dict(self, state):
        self.state = state["state"]


@pytest.mark.parametrize("iterations", [3, 10])  # the best of the second was found in a jump
def test_an_objective_with_a_state_is_compared_from_the_state_it_had(iterations, tmp_path):
    def run(iterations, scale=1.0, **options):
        drifting = Drifting()
        x = torch.tensor([-1.2, 1.0], dtype=torch.float64, requires_grad=True)
        optimizer = ms.optim.MMA([x], lower=-2.0, upper=2.0, move=0.01)
        options = {"max_iterations": iterations, "progress": False, "stateful": [drifting], **options}
        return ms.minimize(lambda x: scale * drifting(x), [x], optimizer, **options), drifting

    path = tmp_path / "run.pt"
    first, _ = run(iterations, checkpoint=path)
    assert first.history[-1].jumped == (iterations == 10) and first.objective == first.history[-1].objective
    (whole, end), (found, again) = run(12), run(12, checkpoint=path, resume=True)
    assert found.parameters[0].equal(whole.parameters[0]) and again.state == end.state
    assert [r.evaluations for r in found.history] == [r.evaluations for r in whole.history]
    with pytest.raises(ValueError, match="has the objective"):
        run(12, scale=2.0, checkpoint=path, resume=True)


def test_a_file_of_another_kind_is_refused(tmp_path):
    torch.save({"parameters": [torch.zeros(3)]}, tmp_path / "run.pt")
    with pytest.raises(
        ValueError, match="is not a checkpoint of a minimization, or one of an earlier magshell"
    ):
        started(tmp_path / "run.pt", mma(), resume=True)
