"""Tests of ms.control.receding_horizon: unstable motions that a single search loses, equal bits, trials, failures."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")
QUIET = {"progress": False}


def zeros(*shape):
    return torch.zeros(*shape, dtype=torch.float64)


class Stick:
    """An inverted pendulum: angle and rate under a push in each step. Noise grows by a factor of 1.1 a step."""

    def moved(self, pushes, state):
        angles, (angle, rate) = [], state
        for each in pushes:
            rate = rate + 0.02 * (25 * torch.sin(angle) + 50 * each)
            angle = angle + 0.02 * rate
            angles.append(angle)
        return torch.stack(angles), (angle, rate)

    def objective(self, pushes, part, state):
        angles, _ = self.moved(pushes, state)
        return {"lean": (angles**2).mean(), "cost": 1e-6 * (pushes**2).mean()}

    def advance(self, pushes, part, state):
        return self.moved(pushes, state)[1]


def upright(noise):
    return torch.tensor([noise, 0.0], dtype=torch.float64)


def test_unstable_stick_stays_upright() -> None:
    """Check 160 steps, over which noise grows 4e6-fold; one search of all steps, with as many iterations, lets the
    stick fall.
    """
    stick, start = Stick(), upright(1e-3)
    limits = {"lower": -1.0, "upper": 1.0, "start": start, **QUIET}
    found = ms.control.receding_horizon(
        stick.objective, stick.advance, zeros(160), prediction_horizon=32, control_horizon=16, **limits
    )
    angles, end = stick.moved(found.controls, start)
    assert angles.abs()[32:].max() < 1e-3 and found.reached == 160
    assert torch.equal(torch.stack(end), torch.stack(found.state))  # once more, the same
    direct = ms.control.receding_horizon(
        stick.objective,
        stick.advance,
        zeros(160),
        prediction_horizon=160,
        control_horizon=160,
        max_iterations=found.evaluations * 32 // 160,
        tolerance=0.0,
        **limits,
    )
    assert stick.moved(direct.controls, start)[0].abs().max() > 0.5


def test_parts_begin_where_the_one_before_led() -> None:
    seen = []

    def objective(rows, part, state):
        seen.append((part.first, part.settled, part.end, len(rows), state))
        return (rows.sum() - 1) ** 2

    def advance(rows, part, state):
        assert len(rows) == part.settled - part.first
        return (state or 0) + len(rows)

    found = ms.control.receding_horizon(
        objective, advance, zeros(7, 1), prediction_horizon=4, control_horizon=3, **QUIET
    )
    assert list(dict.fromkeys(seen)) == [(0, 3, 4, 4, None), (3, 6, 7, 4, 3), (6, 7, 7, 1, 6)]
    assert found.state == 7 and found.evaluations == len(seen) and not found.failures and not found.trials
    assert [part for part, _ in found.searches] == [
        ms.control.Horizon(0, 3, 4),
        ms.control.Horizon(3, 6, 7),
        ms.control.Horizon(6, 7, 7),
    ]


def compass():
    """Build a free magnet in water that points against the field, its most unstable orientation."""
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(2, 1))
    sheet = ms.Shell(
        mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3, remanent_magnetization=(4e4, 0, 0)
    )
    return ms.Scene(sheet, field=ms.UniformField(), water=ms.Water(), allow_rigid_motions=True)


def test_a_motion_by_simulate_is_held_and_repeated_with_the_same_bits() -> None:
    scene, steps = compass(), 240
    rest = scene.mesh.rest_positions
    start = rest + 1e-6 * np.random.default_rng(2).standard_normal(rest.shape)
    left, right = rest[:, 0].argmin(), rest[:, 0].argmax()

    def moved(side, before):
        field = torch.cat([torch.full((len(side), 1), -5e-3, dtype=torch.float64), side], dim=1)
        return ms.simulate(
            scene, steps=len(field), time_step=2e-3, start=before, applied_flux_density=field, **QUIET
        )

    def turned(positions):
        way = positions[:, right] - positions[:, left]
        return (way[:, 1:] ** 2).sum(1) / 0.02**2

    def objective(rows, part, before):
        return turned(torch.as_tensor(moved(rows, before).positions)[1:]).mean() + 1e-3 * (rows**2).mean()

    found = ms.control.receding_horizon(
        objective,
        lambda rows, part, before: ms.simulate(
            scene,
            steps=len(rows),
            time_step=2e-3,
            start=before,
            applied_flux_density=np.column_stack([np.full(len(rows), -5e-3), rows.numpy()]),
            **QUIET,
        ),
        zeros(steps, 2),
        prediction_horizon=40,
        control_horizon=20,
        start=start,
        lower=-5e-3,
        upper=5e-3,
        **QUIET,
    )
    again = moved(found.controls.requires_grad_(False), start)
    assert np.array_equal(detached(again.positions)[-1], found.state.positions[-1])
    held = float(turned(torch.as_tensor(again.positions)).max())
    free = float(turned(torch.as_tensor(moved(zeros(steps, 2), start).positions)).max())
    assert free > 0.5 and held < 0.01


def detached(values):
    return values.detach().numpy() if isinstance(values, torch.Tensor) else values


def squared_swim(rows, part=None, state=None):
    """Return an objective without a first-order term: the displacement is the square of the control's rate."""
    return -(rows[:, 0].diff() ** 2).sum() + 1e-2 * (rows**2).sum()


def test_trials_begin_where_the_gradient_says_nothing() -> None:
    options = {"prediction_horizon": 20, "control_horizon": 10, "lower": -1.0, "upper": 1.0, **QUIET}

    def nothing(rows, part, state):
        return None

    still = ms.control.receding_horizon(squared_swim, nothing, zeros(40, 2), **options)
    assert not still.controls.any()
    tried = ms.control.receding_horizon(
        squared_swim,
        nothing,
        zeros(40, 2),
        trials=4,
        trial_amplitude=(0.5, 0.0),
        trial_periods=(4, 8),
        **options,
    )
    assert float(squared_swim(tried.controls)) < -1.0 and tried.trials == 4 * 5
    assert not tried.controls[:, 1].any()  # an entry with zero amplitude, and its gradient is zero too
    assert tried.controls.abs().max() <= 1.0


def test_without_iterations_the_best_trial_is_done_and_no_gradient_asked_for() -> None:
    def objective(rows, part, state):
        assert not rows.requires_grad
        return squared_swim(rows)

    found = ms.control.receding_horizon(
        objective,
        lambda *_: None,
        zeros(40, 1),
        prediction_horizon=20,
        control_horizon=10,
        max_iterations=0,
        trials=8,
        trial_amplitude=0.5,
        trial_periods=(4, 8),
        **QUIET,
    )
    assert float(squared_swim(found.controls)) < 0 and found.trials == 4 * 9
    assert not found.searches and not found.evaluations and found.reached == 40


def test_trials_are_the_plan_then_swings_or_repeats_within_bounds() -> None:
    seen = []

    def objective(rows, part, state):
        if not rows.requires_grad:
            seen.append((part, rows.clone()))
        return ((rows - torch.arange(len(rows))[:, None] % 5) ** 2).sum()

    found = ms.control.receding_horizon(
        objective,
        lambda rows, part, state: None,
        zeros(60, 1) + 1.0,
        prediction_horizon=20,
        control_horizon=20,
        trials=6,
        trial_amplitude=0.7,
        trial_periods=(5, 5),
        upper=1.5,
        lower=0.0,
        **QUIET,
    )
    assert all(rows.max() <= 1.5 and rows.min() >= 0.0 for _, rows in seen)
    last = [rows for part, rows in seen if part.first == 40]
    planned, others = last[0], last[1:]
    done = torch.cat([found.controls[:40], planned])
    repeated = 0
    for rows in others:
        differ = torch.nonzero((rows != planned).any(1))
        begin = int(differ[0]) if len(differ) else len(rows)
        assert torch.equal(rows[:begin], planned[:begin])
        whole = torch.cat([done[:40], rows])
        repeated += begin < 20 and torch.equal(whole[40 + begin :], whole[35 + begin : -5])
    assert repeated >= 2 and len(others) == 6


def test_search_ends_at_until_and_leaves_later_controls() -> None:
    found = ms.control.receding_horizon(
        lambda rows, part, state: ((rows - 2) ** 2).sum(),
        lambda rows, part, state: part.settled,
        zeros(30, 1),
        prediction_horizon=6,
        control_horizon=3,
        until=lambda state: state >= 9,
        **QUIET,
    )
    assert found.reached == found.state == 9 and len(found.searches) == 3
    assert (found.controls[:12] - 2).abs().max() < 1e-6 and not found.controls[12:].any()


def test_a_search_that_fails_is_told_and_the_plan_is_done() -> None:
    def fragile(rows, part, state):
        if part.first == 2 and rows.requires_grad:
            raise ms.DesignRejected("it broke")
        return ((rows - 1) ** 2).sum()

    found = ms.control.receding_horizon(
        fragile, lambda *_: None, zeros(6, 1), prediction_horizon=2, control_horizon=2, **QUIET
    )
    [(part, why)] = found.failures
    assert part.first == 2 and "it broke" in why and found.reached == 6
    assert found.controls[:, 0].round().tolist() == [1, 1, 0, 0, 1, 1]


def test_trials_that_cannot_be_evaluated_are_not_taken() -> None:
    def fragile(rows, part, state):
        if not rows.requires_grad and rows.any():
            raise ms.DesignRejected("too far")
        return ((rows - 1) ** 2).sum()

    options = {
        "prediction_horizon": 2,
        "control_horizon": 2,
        "trials": 3,
        "trial_amplitude": 1.0,
        "trial_periods": (2, 3),
        **QUIET,
    }
    found = ms.control.receding_horizon(fragile, lambda *_: None, zeros(2, 1), **options)
    assert (found.controls - 1).abs().max() < 1e-6


@pytest.mark.parametrize("where", ["objective", "advance", "until"])
def test_errors_and_interrupts_hand_back_what_was_settled(where) -> None:
    def run(error, first):
        def fails(name):
            return lambda part_first: name == where and part_first >= first

        def objective(rows, part, state):
            if fails("objective")(part.first):
                raise error
            return ((rows - 1) ** 2).sum()

        def advance(rows, part, state):
            if fails("advance")(part.first):
                raise error
            return part.settled

        def until(state):
            if fails("until")(state):
                raise error
            return False

        return ms.control.receding_horizon(
            objective, advance, zeros(6, 1), prediction_horizon=2, control_horizon=2, until=until, **QUIET
        )

    with pytest.raises(ms.Interrupted, match="of 6 rows") as caught:
        run(KeyboardInterrupt(), 2)
    assert caught.value.last_good.reached == 2
    with pytest.raises(ms.ObjectiveFailed, match="no such thing") as caught:
        run(TypeError("no such thing"), 2)
    assert caught.value.last_good.reached == 2 and isinstance(caught.value.__cause__, TypeError)
    assert (caught.value.last_good.controls[:2] - 1).abs().max() < 1e-6
    if where != "until":
        with pytest.raises(TypeError, match="no such thing"):
            run(TypeError("no such thing"), 0)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"prediction_horizon": 0}, "prediction_horizon must be an integer"),
        ({"control_horizon": 5}, "control_horizon must be no more than the prediction_horizon"),
        ({"trials": 2}, "2 trials need a trial_amplitude and trial_periods"),
        (
            {"trials": 2, "trial_amplitude": 0.0, "trial_periods": (2, 3)},
            "trial_amplitude must be finite, not negative",
        ),
        (
            {"trials": 2, "trial_amplitude": -1.0, "trial_periods": (2, 3)},
            "trial_amplitude must be finite, not negative",
        ),
        (
            {"trials": 2, "trial_amplitude": 1.0, "trial_periods": (3, 2)},
            "trial_periods must be two numbers of rows",
        ),
        (
            {"trials": 2, "trial_amplitude": 1.0, "trial_periods": (2.5, 3.5)},
            "trial_periods must hold integer",
        ),
        ({"trials": -1}, "trials must be an integer"),
        ({"lower": np.nan}, "lower must be numbers"),
        ({"upper": (1.0, 2.0)}, "upper must be a number or have the shape of a row"),
        ({"controls": [1.0, np.nan]}, "controls must be finite"),
        ({"max_iterations": -1}, "max_iterations must be an integer"),
        ({"max_iterations": 0}, "max_iterations and trials are both 0"),
        ({"tolerance": -1.0}, "tolerance must not be negative"),
        ({"seed": -1}, "seed must be an integer"),
        ({"advance": None}, "advance must be a function"),
        ({"until": 3}, "until must be a function"),
        ({"progress": 1}, "progress must be True or False"),
    ],
)
def test_bad_input_is_refused(changes, complaint) -> None:
    def unasked(*_):
        raise AssertionError("work began")

    given = {
        "objective": unasked,
        "advance": unasked,
        "controls": zeros(8, 1),
        "prediction_horizon": 4,
        "control_horizon": 2,
    }
    with pytest.raises(ValueError, match=complaint):
        ms.control.receding_horizon(**{**given, **QUIET, **changes})
