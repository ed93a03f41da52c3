"""Inputs that have no gradient, or only in some cases: a request raises an error, and no partial gradient is
returned.
"""

import math

import numpy as np
import pytest
from gradient_scenes import SETTINGS_OF

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
SCENE = ms.Scene(SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
MAGNETIC = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": (0, 0, 3e-3)}
TIME_STEP = 2e-3


def number(value):
    return torch.tensor(value, dtype=torch.float64, requires_grad=True)


def moved(scene=SCENE, **given):
    return ms.simulate(scene, **{"steps": 5, "time_step": TIME_STEP, **MAGNETIC, "progress": False, **given})


def height(found):
    return 1e3 * torch.as_tensor(found.positions)[..., -1, 2].sum()


def slope(function, at, step):
    return float(function(at + step) - function(at - step)) / (2.0 * step)


def growing(t):
    return (
        3e-3 * torch.sin(300 * torch.as_tensor(t, dtype=torch.float64)) * torch.eye(3, dtype=torch.float64)[2]
    )


LOAD_PARAMETERS_OUTSIDE_TORCH = {
    "applied_flux_density": lambda t: (0, 0, 3e-3 * math.sin(300 * float(t))),
    "field_factor": lambda t: math.sin(300 * float(t)),
    "load_factor": lambda t: number(0.1) * float(t),  # has a graph, without the time in it
}


@pytest.mark.filterwarnings("ignore:Converting a tensor with requires_grad")
@pytest.mark.parametrize("name", LOAD_PARAMETERS_OUTSIDE_TORCH)
def test_a_load_parameter_that_leaves_torch_leaves_the_time_step_without_a_gradient(name):
    found = moved(time_step=number(TIME_STEP), **{name: LOAD_PARAMETERS_OUTSIDE_TORCH[name]})
    with pytest.raises(ms.NoGradient, match=f"by time_step: {name} is a function of the time"):
        height(found).backward()


def test_a_load_parameter_made_by_torch_has_its_share_in_the_gradient_by_the_time_step():
    step = number(TIME_STEP)
    height(moved(time_step=step, applied_flux_density=growing)).backward()
    expected = slope(lambda dt: height(moved(time_step=dt, applied_flux_density=growing)), TIME_STEP, 1e-7)
    assert float(step.grad) == pytest.approx(expected, rel=1e-6)


def test_a_load_parameter_that_is_the_same_at_all_times_needs_no_torch():
    step = number(TIME_STEP)
    height(moved(time_step=step, applied_flux_density=lambda t: (0, 0, 3e-3))).backward()
    expected = slope(lambda dt: height(moved(time_step=dt)), TIME_STEP, 1e-7)
    assert float(step.grad) == pytest.approx(expected, rel=1e-6)


def test_obstacles_that_move_leave_the_time_step_without_a_gradient():
    belt = ms.obstacles.Plane(center=(0, 0, -1e-3), motion=lambda t: (0.1 * t, 0, 0))
    scene = ms.Scene(SHEET, supports=SCENE.supports, field=SCENE.fields, contacts=[ms.Contact(belt)])
    found = moved(scene, time_step=number(TIME_STEP))
    with pytest.raises(ms.NoGradient, match="by time_step: obstacles move"):
        height(found).backward()


def from_rest(thickness, **given):
    """Return a motion from an equilibrium, both of this thickness."""
    rest = ms.equilibrium(SCENE, **MAGNETIC, thickness=thickness)
    return moved(thickness=thickness, start=rest, applied_flux_density=(0, 0, 1e-3), **given)


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=repr)
def test_a_motion_from_an_equilibrium_has_the_gradient_of_both(integrator):
    thickness = number(1e-3)
    height(from_rest(thickness, integrator=integrator)).backward()
    expected = slope(lambda h: height(from_rest(h, integrator=integrator)), 1e-3, 1e-8)
    assert float(thickness.grad) == pytest.approx(expected, rel=1e-6)


def test_a_motion_that_goes_on_from_another_one_is_not_differentiated_through_it():
    thickness = number(1e-3)
    first = moved(thickness=thickness)
    second = moved(thickness=thickness, start=first)
    with pytest.raises(ms.NoGradient, match=r"by start: .*start=first.end"):
        height(second).backward()
    height(moved(thickness=thickness, start=first.end)).backward()
    expected = slope(lambda h: height(moved(thickness=h, start=first.end)), 1e-3, 1e-8)
    assert float(thickness.grad) == pytest.approx(expected, rel=1e-6)


SETTINGS = [
    (solve, name) for solve, names in SETTINGS_OF.items() for name in sorted(names - {"scene", "values"})
]


@pytest.mark.parametrize("solve, name", SETTINGS, ids=lambda each: getattr(each, "__name__", each))
def test_a_setting_takes_no_tensor_that_asks_for_a_gradient(solve, name):
    given = {"steps": 2, "time_step": TIME_STEP} if solve is ms.simulate else {}
    with pytest.raises(ValueError, match=name):
        solve(SCENE, **{**given, **MAGNETIC, name: number(1.0)})


def test_the_tip_moves_in_all_of_this():
    assert np.abs(moved().displacements[-1]).max() > 1e-3
