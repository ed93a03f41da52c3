"""Ctrl-C in each of a caller's functions, at every call of it, in every solve: Interrupted, with the results so far."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(4, 1))
MAGNETIZATION = (4e3, 0, 0)
LAW = {"maxwell_modulus": 0.5, "maxwell_time": 1e-3}


class Caller:
    """Counts calls of its functions and presses Ctrl-C in one of them."""

    def __init__(self):
        self.calls = self.stop_at = 0

    def reset(self, stop_at=0):
        self.calls, self.stop_at = 0, stop_at

    def answer(self, value=None):
        self.calls += 1
        if self.calls == self.stop_at:
            raise KeyboardInterrupt
        return value

    def field(self, points):
        return self.answer(np.tile((0.0, 0.0, 5e-3), (len(points), 1)))


def scene_of(caller, **changes):
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    field = ms.CustomField(caller.field, length_scale=0.05)
    press = ms.EdgeLoad(MESH.edges_at(x=0.05), (-0.05, 0.0, 0.0))
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=[press], field=field, **changes)


def simulate(scene, **options):
    given = {"steps": 3, "time_step": 1e-3, "remanent_magnetization": MAGNETIZATION, "progress": False}
    return ms.simulate(scene, **{**given, **options})


def moving(caller, **options):
    return lambda scene: simulate(scene, **options)


def still(caller, function=ms.equilibrium, **options):
    return lambda scene: function(scene, remanent_magnetization=MAGNETIZATION, **options)


SOLVES = {
    "equilibrium": (ms.Equilibrium, still),
    "progress": (ms.Equilibrium, lambda c: still(c, progress=lambda *_: c.answer())),
    "positions": (ms.Equilibrium, lambda c: still(c, start=MESH.rest_positions)),
    "cases": (ms.EquilibriumSet, lambda c: still(c, load_factor=[0.5, 1.0])),
    "path": (
        ms.EquilibriumPath,
        lambda c: still(c, ms.follow_path, until=lambda t, _: c.answer(t > 0.1), progress=False),
    ),
    "motion": (ms.Trajectory, moving),
    "motion from positions": (ms.Trajectory, lambda c: moving(c, start=MESH.rest_positions, **LAW)),
    "every second state": (ms.Trajectory, lambda c: moving(c, record_every=2, integrator=ms.ImplicitEuler())),
    "linear response": (None, lambda c: still(c, ms.linear_response)),
    "linear buckling": (None, lambda c: still(c, ms.linear_buckling)),
}


@pytest.mark.filterwarnings("ignore::magshell.LinearTheoryWarning")
@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("name", SOLVES)
def test_interrupt_at_every_call(name):
    kind, make = SOLVES[name]
    caller = Caller()
    solve, scene = make(caller), scene_of(caller)
    solve(scene)
    assert caller.calls >= 1
    for call in range(1, caller.calls + 1):
        caller.reset(stop_at=call)
        with pytest.raises(ms.Interrupted) as caught:
            solve(scene)
        found = caught.value.last_good
        assert isinstance(found, kind or type(None))
        repr(found)
        if isinstance(found, ms.Equilibrium):
            assert np.isfinite(found.positions).all()
    caller.reset()
    solve(scene)  # nothing of it is left behind


@pytest.mark.parametrize("options", [{}, {"start": MESH.rest_positions, **LAW}], ids=["rest", "positions"])
def test_a_motion_goes_on_from_wherever_it_was_stopped(options):
    caller = Caller()
    scene = scene_of(caller, gravity=(0, 0, -9.81))
    whole = simulate(scene, **options)
    law = {name: value for name, value in options.items() if name != "start"}
    for call in range(1, caller.calls + 1):
        caller.reset(stop_at=call)
        with pytest.raises(ms.Interrupted) as caught:
            simulate(scene, **options)
        before = caught.value.last_good
        assert len(before) == before.steps_done + 1
        np.testing.assert_array_equal(before.positions, whole.positions[: len(before)])
        np.testing.assert_array_equal(before.kinetic_energy, whole.kinetic_energy[: len(before)])
        known = before.energies["bending"]
        assert np.isfinite(known[:-1]).all()
        np.testing.assert_array_equal(
            known, np.where(np.isnan(known), np.nan, whole.energies["bending"][: len(before)])
        )
        caller.reset()
        if before.steps_done < 3:
            after = simulate(scene, steps=3 - before.steps_done, start=before, **law)
            np.testing.assert_array_equal(after.positions[-1], whole.positions[-1])
            np.testing.assert_array_equal(after.times, whole.times[before.steps_done :])


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_rotations_that_are_still_to_be_put_to_rest_are_saved_so(tmp_path):
    caller = Caller()
    scene = scene_of(caller)
    bent = np.array(MESH.rest_positions)
    bent[:, 2] = 2.0 * bent[:, 0] ** 2
    whole = simulate(scene, start=bent)
    caller.reset(stop_at=1)
    with pytest.raises(ms.Interrupted) as caught:
        simulate(scene, start=bent)
    caught.value.last_good.end.save(tmp_path / "state.npz")
    again = simulate(scene, start=ms.MotionState.load(tmp_path / "state.npz"))
    np.testing.assert_array_equal(again.positions, whole.positions)
    np.testing.assert_array_equal(again.edge_rotations, whole.edge_rotations)


@pytest.mark.parametrize("what", ["control", "obstacle", "vibration"])
def test_functions_called_before_there_is_anything(what):
    caller = Caller()
    plane = ms.obstacles.Plane(center=(0, 0, -1), motion=lambda time: caller.answer((0.0, 0.0, 0.0)))
    touching = what == "obstacle"
    scene = scene_of(caller, contacts=[ms.Contact(plane)] if touching else [])
    rest = ms.equilibrium(scene, remanent_magnetization=MAGNETIZATION)
    caller.reset(stop_at=1)
    with pytest.raises(ms.Interrupted, match="before there was a result") as caught:
        if what == "vibration":
            ms.vibration_modes(scene, rest, count=2)
        else:
            simulate(scene, load_factor=lambda time: caller.answer(1.0))
    assert caught.value.last_good is None
    assert isinstance(caught.value.__cause__, KeyboardInterrupt)
