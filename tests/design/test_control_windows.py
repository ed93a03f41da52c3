"""Tests of ms.control.time_windows: the changes of each window, a walker for which a direct search fails, and
failures.
"""

import functools

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")
QUIET = {"progress": False}


def zeros(*shape):
    return torch.zeros(*shape, dtype=torch.float64)


def sum_to_one(seen=None):
    """Return an objective by which the sum of the rows should be 1 in every window."""

    def objective(controls, window):
        if seen is not None:
            seen.append((window, controls.detach().clone()))
        return (controls.sum() - 1) ** 2 + 1e-3 * (controls**2).sum()

    return objective


def test_windows_and_smoothings_come_in_turn() -> None:
    seen = []
    found = ms.control.time_windows(sum_to_one(seen), zeros(6, 1), lengths=(2, 6), smoothings=(3, 1), **QUIET)
    asked = [(window.steps, window.first, window.smoothing) for window, _ in found.searches]
    assert asked == [(2, 0, 3.0), (2, 0, 1.0), (6, 0, 3.0), (6, 0, 1.0)]
    assert list(dict.fromkeys(window for window, _ in seen)) == [window for window, _ in found.searches]
    assert all(len(controls) == window.steps for window, controls in seen)
    assert found.controls.shape == (6, 1) and found.evaluations == len(seen) and not found.failures


def test_new_rows_hold_the_last_one_or_are_those_given() -> None:
    given = torch.arange(6.0, dtype=torch.float64)[:, None]
    for hold in (True, False):
        seen = []
        ms.control.time_windows(sum_to_one(seen), given, lengths=(2, 6), hold=hold, **QUIET)
        before = next(controls for window, controls in seen[::-1] if window.steps == 2)
        first = next(controls for window, controls in seen if window.steps == 6)
        assert hold == bool((first[2:] == first[1]).all())
        assert hold or torch.equal(first[2:], given[2:])
        assert torch.equal(given[:, 0], torch.arange(6.0, dtype=torch.float64))  # those of the caller stay
        assert before.shape == (2, 1)


def test_a_horizon_that_recedes_leaves_what_lies_before_it() -> None:
    seen = []
    found = ms.control.time_windows(sum_to_one(seen), zeros(6, 2), lengths=(2, 4, 6), depth=2, **QUIET)
    assert [window.first for window, _ in found.searches] == [0, 2, 4]
    for last in (4, 6):
        rows = [controls[: last - 2] for window, controls in seen if window.steps == last]
        assert all(torch.equal(each, rows[0]) for each in rows)
        assert torch.equal(found.controls[: last - 2], rows[0])


def test_bounds_hold_row_by_row() -> None:
    bounds = {"lower": (-1.0, -0.01), "upper": (0.05, 0.01)}
    found = ms.control.time_windows(sum_to_one(), zeros(6, 2), lengths=(3, 6), **bounds, **QUIET)
    assert found.controls[:, 0].max() == 0.05 and found.controls[:, 1].max() == 0.01


STEPS, LENGTH = 80, 0.04


@functools.cache
def walker() -> ms.Scene:
    """Build a strip on rough ground, magnetised to its middle from both ends, to one side stronger."""
    mesh = ms.meshes.rectangle(LENGTH, 0.01, cells=(8, 1))
    front = mesh.rest_positions[mesh.faces].mean(axis=1)[:, 0] >= LENGTH / 2
    magnetization = np.zeros((mesh.n_faces, 3))
    magnetization[:, 0] = np.where(front, -2.4e4, 4e4)
    sheet = ms.Shell(
        mesh,
        thickness=1e-3,
        young_modulus=5e5,
        mass_density=1.5e3,
        remanent_magnetization=magnetization,
    )
    ground = ms.Contact(
        ms.obstacles.Plane(center=(0, 0, -1e-4)),
        friction_coefficient=0.5,
        contact_stiffness=200.0,
        smoothing=2e-4,
        sticking_speed=5e-3,
    )
    return ms.Scene(
        sheet,
        field=ms.UniformField(),
        gravity=(0, 0, -9.81),
        contacts=[ground],
        allow_rigid_motions=True,
    )


def walked(controls, window):
    """Return minus the displacement of the mean vertex in lengths, as if all steps were like those of the window."""
    scene = walker()
    [ground] = scene.contacts
    field = 1e-2 * torch.stack([controls[:, 0], torch.zeros_like(controls[:, 0]), controls[:, 1]], dim=1)
    motion = ms.simulate(
        scene,
        steps=window.steps,
        time_step=5e-3,
        applied_flux_density=field,
        values={ground: {"smoothing": 2e-4 * window.smoothing, "sticking_speed": 5e-3 * window.smoothing}},
        integrator=ms.ImplicitEuler(),
        progress=False,
    )
    way = (motion.positions[-1].mean(0)[0] - LENGTH / 2) / LENGTH
    return 1e-3 * (controls**2).mean() - way * (STEPS / window.steps)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_windows_take_a_walker_farther_than_one_search_of_as_many_steps() -> None:
    start = zeros(STEPS, 2)
    start[:, 1] = 0.3 * torch.sin(torch.arange(STEPS) * 2 * np.pi / 20)
    simulated = {}

    def counting(name):
        def objective(controls, window):
            simulated[name] = simulated.get(name, 0) + window.steps
            return walked(controls, window)

        return objective

    options = {"lower": -1.0, "upper": 1.0, "hold": False, **QUIET}
    windows = ms.control.time_windows(
        counting("windows"),
        start,
        lengths=(20, 40, 60, 80),
        smoothings=(4.0, 1.0),
        max_iterations=5,
        **options,
    )
    direct = ms.control.time_windows(
        counting("direct"), start, lengths=(STEPS,), max_iterations=45, **options
    )
    assert simulated["direct"] >= 0.9 * simulated["windows"]
    whole = ms.control.Window(STEPS, 0, 1.0)
    far, near = (-float(walked(found.controls, whole)) for found in (windows, direct))
    assert far > 1.1 and far > near + 0.2
    assert windows.controls.abs().max() <= 1.0


def test_a_search_that_fails_hands_on_what_it_had() -> None:
    def fragile(controls, window):
        if window.steps == 4:
            raise ms.DesignRejected("it broke")
        return (controls.sum() - 1) ** 2

    found = ms.control.time_windows(fragile, zeros(6, 1), lengths=(2, 4, 6), **QUIET)
    assert [window.steps for window, _ in found.searches] == [2, 6]
    [(window, why)] = found.failures
    assert window.steps == 4 and "it broke" in why
    with pytest.raises(ms.DesignRejected, match="it broke"):
        ms.control.time_windows(fragile, zeros(4, 1), lengths=(4,), **QUIET)


def test_errors_and_interrupts_come_through_with_what_was_found() -> None:
    def stopped(controls, window):
        if window.steps == 4:
            raise KeyboardInterrupt
        return (controls.sum() - 1) ** 2

    with pytest.raises(ms.Interrupted, match="window 2 of 2") as caught:
        ms.control.time_windows(stopped, zeros(4, 1), lengths=(2, 4), **QUIET)
    assert float(caught.value.last_good.controls[:2].sum()) == pytest.approx(1.0, abs=1e-3)

    def wrong(controls, window):
        raise TypeError("no such thing")

    with pytest.raises(TypeError, match="no such thing"):
        ms.control.time_windows(wrong, zeros(4, 1), lengths=(4,), **QUIET)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"lengths": (2, 3)}, "lengths must rise to the 4 rows"),
        ({"lengths": (3, 2, 4)}, "lengths must rise"),
        ({"lengths": ()}, "lengths must rise"),
        ({"smoothings": (1.0, 2.0)}, "smoothings must be positive and fall"),
        ({"smoothings": (-1.0,)}, "smoothings must be positive"),
        ({"depth": 1}, "depth must be no less than what a window adds"),
        ({"lower": np.nan}, "lower must be numbers"),
        ({"upper": (1.0, 2.0)}, r"upper must be a number or have the shape of a row, \(1,\), got \(2,\)"),
        ({"controls": [1.0, np.inf, 0.0, 0.0]}, "controls must be finite"),
        ({"max_iterations": 0}, "max_iterations must be an integer"),
        ({"lengths": 4.0}, "lengths must hold integer"),
        ({"smoothings": 1.0}, "smoothings must have shape"),
        ({"tolerance": "a"}, "tolerance"),
        ({"hold": 1}, "hold must be True or False"),
        ({"objective": 3}, "must be a function"),
    ],
)
def test_bad_input_is_refused(changes, complaint) -> None:
    given = {"objective": sum_to_one(), "controls": zeros(4, 1), "lengths": (2, 4), **QUIET}
    with pytest.raises(ValueError, match=complaint):
        ms.control.time_windows(**{**given, **changes})
