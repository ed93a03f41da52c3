"""Tables, refused input and copies of `ms.Water`. Its forces: test_water_kernel."""

import copy
import pickle

import numpy as np
import pytest

import magshell as ms

UNEVEN = np.pi / 2 * np.array([0.0, 0.1, 0.35, 0.4, 0.75, 1.0])
SINES = np.linspace(0, np.pi / 2, 9)
SMOOTH = {"attack_table": (SINES, 1.5 * np.sin(SINES) ** 2, (0, 0))}
KINKED = {"attack_table": (UNEVEN, 0.05 + UNEVEN), "thrust_table": (UNEVEN, 0.1 + UNEVEN**2)}


def make(tables):
    numbers = {
        "drag_coefficient": 0.7,
        "thrust_coefficient": 1.3,
        "added_mass": 2.5,
        "tangential_viscous_drag": 3.0,
    }
    return ms.Water(velocity=(0.3, -0.2, 0.4), **numbers, **tables)


@pytest.mark.parametrize(
    ("smooth", "tables"),
    [
        (True, {}),
        (True, SMOOTH),
        (False, KINKED),
        (False, {"attack_table": ([0, np.pi / 2], [0, 2])}),
        (True, {"attack_table": ([0, np.pi / 2], [0, 2], (0, 0))}),
        (False, {"attack_table": ([0, np.pi / 2], [0.1, 2], (0, 0))}),
        (True, {"attack_table": ([0, np.pi / 2], [0.1, 2], (0, 0)), "thrust_coefficient": 0}),
        (True, {"thrust_table": ([0, np.pi / 2], [0, 2], (1, 0))}),
        (False, {"thrust_table": ([0, np.pi / 2], [0, 2], (0, 1))}),
    ],
)
def test_is_smooth_follows_from_the_tables(smooth, tables):
    assert ms.Water(**{"drag_coefficient": 1, **tables}).is_smooth is smooth


def test_tables_go_through_their_values_twice_differentiably(rng):
    values, slopes = rng.uniform(0, 2, len(UNEVEN)), (0.3, -0.7)
    water = ms.Water(
        drag_coefficient=1,
        thrust_coefficient=1,
        attack_table=(UNEVEN, values, slopes),
        thrust_table=(UNEVEN, values),
    )
    for curve in water.coefficients(UNEVEN):
        np.testing.assert_allclose(curve, values, rtol=0, atol=1e-14)
    ends = water._drag_curve.samples(UNEVEN[[0, -1]])[:, 1]
    np.testing.assert_allclose(ends, slopes, rtol=0, atol=1e-13)
    for knot in UNEVEN[1:-1]:
        for curve in (water._drag_curve, water._thrust_curve):
            behind, at, ahead = curve.samples(knot + np.array([-1e-7, 0, 1e-7]))[:, 1]
            assert ahead - at == pytest.approx(at - behind, abs=1e-9)  # 1e-7 times the jump of the curvature


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fluid_density": -1}, r"fluid_density \[kg/m3\] must not be negative, got -1"),
        ({"drag_coefficient": -0.5}, r"drag_coefficient \[1\] must not be negative, got -0.5"),
        ({"thrust_coefficient": -0.5}, r"thrust_coefficient \[1\] must not be negative"),
        ({"normal_viscous_drag": -2}, r"normal_viscous_drag \[N s/m3\] must not be negative, got -2"),
        ({"tangential_viscous_drag": np.inf}, r"tangential_viscous_drag \[N s/m3\] must be finite"),
        ({"added_mass": -2}, r"added_mass \[kg/m2\] must not be negative"),
        ({"fluid_density": np.nan}, r"fluid_density \[kg/m3\] must be finite"),
        ({"drag_coefficient": [1, 2]}, r"drag_coefficient \[1\] must be a number, got shape \(2,\)"),
        ({"velocity": 1.0}, r"velocity \[m/s\] must have shape \(3,\), got \(\)"),
        ({"attack_table": np.sin}, r"attack_table must be None, \(angles, values\) or"),
        ({"attack_table": ([0, 45, 90], [0, 1, 2])}, r"must run from 0 to pi/2 = 1.5707963, got 0 to 90"),
        (
            {"attack_table": ([0.1, np.pi / 2], [0, 1])},
            r"must run from 0 to pi/2 = 1.5707963, got 0.1 to 1.5708",
        ),
        (
            {"thrust_table": ([0, 1, 0.5, np.pi / 2], [0] * 4)},
            r"must ascend, but angle 1 is 1 and angle 2 is 0.5",
        ),
        ({"thrust_table": ([0, np.pi / 2], [0, 1, 2])}, r"thrust_table values \[1\] must have shape \(2,\)"),
        ({"thrust_table": ([0], [1])}, r"thrust_table must have at least two angles, got 1"),
        ({"attack_table": ([0, np.pi / 2], [0, np.inf])}, r"attack_table values \[1\] must be finite"),
        (
            {"attack_table": ([0, np.pi / 2], [0, 2], 0)},
            r"attack_table slopes \[1/rad\] must have shape \(2,\)",
        ),
    ],
)
def test_bad_arguments_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        ms.Water(**changes)


def test_bad_input_of_the_methods():
    water = ms.Water()
    with pytest.raises(ValueError, match=r"attack_angle \[rad\] must lie in \[0, pi/2\], got 90"):
        water.coefficients([0.0, 90.0])
    with pytest.raises(
        ValueError, match=r"Water has no value 'attack_table' to be replaced: it has fluid_density,"
    ):
        water.replaced(attack_table=None)
    with pytest.raises(ValueError, match=r"velocities \[m/s\] must have shape \(2, 3, 3\), got \(1, 3, 3\)"):
        water.force(np.zeros((2, 3, 3)), np.zeros((1, 3, 3)))


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, lambda w: pickle.loads(pickle.dumps(w))])
@pytest.mark.parametrize("tables", [{}, SMOOTH, KINKED])
def test_copies_have_equal_forces(tables, duplicate, rng):
    faces, water = rng.standard_normal((3, 10, 3, 3)), make(tables)
    twin = duplicate(water)
    np.testing.assert_array_equal(twin.force(*faces), water.force(*faces))
    assert repr(twin) == repr(water)


def test_replaced_keeps_the_rest():
    water = make(KINKED)
    denser = water.replaced(fluid_density=1025.0)
    assert denser.fluid_density == 1025.0 and water.fluid_density == 1000.0
    assert denser.attack_table is not None and denser.added_mass == water.added_mass
    assert repr(denser) == (
        "Water(1025 kg/m3, velocity (0.3, -0.2, 0.4) m/s, drag_coefficient 0.7, thrust_coefficient 1.3, "
        "attack_table of 6 angles, thrust_table of 6 angles, added_mass 2.5 kg/m2, tangential_viscous_drag 3 N s/m3)"
    )
