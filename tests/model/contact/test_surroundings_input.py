"""Errors of contacts, water and solves with them for bad input."""

import numpy as np
import pytest
from bad_input import refused
from blocks import block_on, block_sheet, simulated
from magshell.obstacles import Plane, Sphere

import magshell as ms

GROUND = Plane()
SHEET = block_sheet()


def contact(**changes):
    return ms.Contact(**{"obstacles": GROUND, **changes})


def moved(**changes):
    scene = block_on(changes.pop("obstacle", GROUND), 0.4)
    return simulated(scene, 2, 1e-3, **changes)


def with_values(**values):
    scene = block_on(GROUND, 0.4)
    return simulated(scene, 2, 1e-3, values={scene.contacts[0]: values})


def of_water(**values):
    scene = ms.Scene(SHEET, water=ms.Water(), allow_rigid_motions=True)
    return simulated(scene, 2, 1e-3, values={scene.water: values})


def of_obstacle(**values):
    scene = block_on(Plane(), 0.4)
    return simulated(scene, 2, 1e-3, values={scene.obstacles[0]: values})


def at_rest(**scene):
    return ms.equilibrium(ms.Scene(SHEET, allow_rigid_motions=True, gravity=(0, 0, -9.81), **scene))


def lowered(depth):
    return np.array(SHEET.mesh.rest_positions) - np.array([0, 0, depth])


def tilted(slope):
    x = np.array(SHEET.mesh.rest_positions)
    x[:, 2] -= slope * x[:, 0]
    return x


test_contacts_refuse = refused(
    [
        ("no obstacle", lambda: contact(obstacles=[]), "at least one obstacle"),
        ("something else", lambda: contact(obstacles="floor"), r"objects of ms\.obstacles, got str"),
        (
            "a class",
            lambda: contact(obstacles=Plane),
            r"objects of ms\.obstacles, got the class Plane: call it",
        ),
        (
            "twice the same",
            lambda: contact(obstacles=[GROUND, GROUND]),
            r"obstacles\[0\] and obstacles\[1\] are one Plane",
        ),
        (
            "negative stiffness",
            lambda: contact(contact_stiffness=-1.0),
            r"contact_stiffness \[N/m\] must be positive",
        ),
        (
            "no stiffness",
            lambda: contact(contact_stiffness=0.0),
            r"contact_stiffness \[N/m\] must be positive, got 0",
        ),
        ("nan", lambda: contact(contact_stiffness=np.nan), r"contact_stiffness \[N/m\] must be finite"),
        (
            "negative friction",
            lambda: contact(friction_coefficient=-0.1),
            r"friction_coefficient \[1\] must not be neg",
        ),
        (
            "an array of them",
            lambda: contact(friction_coefficient=[0.1, 0.2]),
            r"friction_coefficient.*must be a number",
        ),
        (
            "sticking at any speed",
            lambda: contact(sticking_speed=0.0),
            r"sticking_speed \[m/s\] must be positive",
        ),
        ("a hard edge", lambda: contact(smoothing=0.0), r"smoothing \[m\] must be positive"),
        ("negative offset", lambda: contact(offset=-1e-3), r"offset \[m\] must not be negative"),
        ("two samples", lambda: contact(face_samples=2), "face_samples must be 0, 1 or 3, got 2"),
        ("a true sample", lambda: contact(face_samples=True), "face_samples must be 0, 1 or 3, got True"),
        (
            "lagged by a word",
            lambda: contact(lagged_friction="yes"),
            "lagged_friction must be True or False, got 'yes'",
        ),
        ("vertices of another mesh", lambda: block_on(GROUND, vertices=[99]), "Contact vertices.*99"),
        (
            "no contact",
            lambda: ms.Scene(SHEET, contacts=GROUND),
            "contacts must hold Contact, BodyContact objects, got Plane",
        ),
        ("contact class", lambda: ms.Scene(SHEET, contacts=[ms.Contact]), "the class Contact: call it"),
        ("no water", lambda: ms.Scene(SHEET, water=1000.0), "water must be a Water, got float"),
    ]
)

test_solves_refuse = refused(
    [
        (
            "negative friction",
            lambda: with_values(friction_coefficient=-0.1),
            r"friction_coefficient \[1\] must not be",
        ),
        (
            "negative stiffness",
            lambda: with_values(contact_stiffness=-5.0),
            r"contact_stiffness \[N/m\] must be positive",
        ),
        ("what cannot change", lambda: with_values(face_samples=1), "face_samples"),
        ("no smoothing", lambda: with_values(smoothing=0.0), r"smoothing \[m\] must be positive"),
        ("unknown value", lambda: with_values(stickiness=1.0), "stickiness"),
        (
            "negative density",
            lambda: of_water(fluid_density=-1.0),
            r"fluid_density \[kg/m3\] must not be negative",
        ),
        ("unknown of water", lambda: of_water(viscosity=1.0), "viscosity"),
        ("unknown of an obstacle", lambda: of_obstacle(radius=1.0), "radius"),
        (
            "two numbers for a place",
            lambda: of_obstacle(center=(0, 0)),
            r"center \[m\] must have shape \(3,\)",
        ),
        (
            "another contact",
            lambda: moved(values={contact(): {"contact_stiffness": 1.0}}),
            "a key that is not the scene, nor an object of it",
        ),
        (
            "friction at rest",
            lambda: at_rest(contacts=[contact(friction_coefficient=0.5)]),
            "friction or water.*ms.simulate",
        ),
        ("water at rest", lambda: at_rest(water=ms.Water()), "friction or water.*ms.simulate"),
        (
            "a motion of two numbers",
            lambda: Plane(motion=lambda t: (0.0, t)),
            "the displacement of motion.0.",
        ),
        (
            "a motion that ends",
            lambda: moved(obstacle=Plane(motion=lambda t: (0, 0, np.nan if t > 1.5e-3 else 0.0))),
            r"motion\(.*finite",
        ),
    ]
)


@pytest.mark.parametrize("solve", [ms.simulate, ms.equilibrium])
def test_start_inside_an_obstacle_reports_depth_and_vertex(solve):
    scene = block_on(GROUND)
    options = {"steps": 1, "time_step": 1e-3} if solve is ms.simulate else {}
    with pytest.raises(
        ValueError, match=r"starts inside Plane\(.*\): vertices 0, 1, 2, 3, 4 and 4 more"
    ) as caught:
        solve(scene, start=lowered(5e-3), **options)
    assert "the deepest 0.005 m deep" in str(caught.value)
    with pytest.raises(ValueError, match=r"vertices 6, 7, 8, the deepest 0.002 m deep at vertex 6"):
        solve(scene, start=tilted(0.1), **options)


def test_a_start_inside_a_body():
    ball = Sphere(0.004, center=SHEET.mesh.rest_positions[4])
    with pytest.raises(
        ValueError, match=r"starts inside Sphere.* vertices 4, the deepest 0.004 m deep at vertex 4"
    ):
        moved(obstacle=ball)


def test_a_start_inside_where_a_value_moves_the_obstacle():
    scene = block_on(GROUND)
    with pytest.raises(ValueError, match=r"the deepest 0[.]01 m deep"):
        simulated(scene, 1, 1e-3, values={scene.obstacles[0]: {"center": (0, 0, 0.01)}})


def test_a_start_inside_where_a_value_moves_the_surface():
    scene = block_on(GROUND)
    with pytest.raises(ValueError, match=r"the deepest 0[.]01 m deep"):
        simulated(scene, 1, 1e-3, values={scene.contacts[0]: {"offset": 0.01}})


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_touching_is_not_inside():
    simulated(block_on(GROUND), 2, 1e-3, start=lowered(0.9e-3))
