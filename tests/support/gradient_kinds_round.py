"""Kinds of scene for test_every_gradient.py in which smooth shapes of rigid bodies touch."""

import numpy as np
from gradient_kinds_attached import LAW, PLACE, RUBS
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms
from magshell import obstacles as ob

_RADIUS = 0.02


def _ball(center, **motion):
    body = ms.RigidBody(mass=5e-3, inertia=(8e-7, 9e-7, 1e-6), center=center, **motion)
    return body, ob.Attached(ob.Sphere(_RADIUS), to=body, center=np.add(center, (1e-3, -5e-4, 2e-3)))


def _arm(origin=(0.1, 0.0, 0.0), **others):
    """Build a capsule on a sprung hinge."""
    link = ms.Link(mass=4e-3, inertia=(1.2e-6, 2e-6, 1.5e-6), center=(0.06, 0.005, 0.0))
    hinge = ms.Revolute(link, origin=origin, axis=(0.1, 1, 0.2), spring_stiffness=0.05, **others)
    rod = ob.Attached(ob.Capsule(0.06, 0.01), to=link, center=(0.05, 0.006, 1e-3), rotation=(0.1, -0.05, 0.3))
    return ms.Skeleton([link], [hinge]), rod


def thrown(integrator, in_time=0, **contact) -> Kind:
    """Build two spinning balls that fall on a capsule on an arm and on each other, and on a fixed ellipsoid."""
    skeleton, rod = _arm()
    one, round_one = _ball(
        (0.045, 0.006, 0.0302), velocity=(0.05, -0.02, -0.3), angular_velocity=(2.0, 3.0, -1.0)
    )
    other, round_other = _ball(
        (0.0053, 0.008, 0.0335), velocity=(0.1, 0.05, -0.2), angular_velocity=(-3.0, 2.0, 4.0)
    )
    egg = ob.Ellipsoid((0.03, 0.02, 0.01), center=(-0.002, 0.01, 4.7e-3), rotation=(0.05, -0.02, 0.2))
    touch = ms.Contact(
        [rod, egg, round_other], shapes=[round_one, round_other], **{**LAW, "smoothing": 2e-4, **contact}
    )
    scene = ms.Scene(
        [one, other, skeleton], contacts=[touch], gravity=(0, 0.3, -9.81), allow_rigid_motions=True
    )
    inputs = {"time_step": 2e-3, "gravity_factor": 0.9}
    fixed = {**EXACT, "steps": 6, "integrator": integrator, "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach={**REACH, **PLACE}, in_time=in_time)


def crossing(integrator, **contact) -> Kind:
    """Build a capsule that falls across another on an arm and over the edge of a fixed rounded box."""
    skeleton, rod = _arm()
    center = (0.045, 0.015, 0.0215)
    body = ms.RigidBody(
        mass=5e-3,
        inertia=(2e-6, 9e-7, 2e-6),
        center=center,
        velocity=(0.05, -0.02, -0.3),
        angular_velocity=(2.0, 3.0, -1.0),
    )
    bar = ob.Attached(
        ob.Capsule([[0, -0.04, 0], [0, 0.04, 0]], 0.01), to=body, center=center, rotation=(0.1, 0.02, 0.2)
    )
    block = ob.Box((0.04, 0.02, 0.03), rounding=4e-3, center=(0.04, 0.047, -6e-4), rotation=(0.05, 0.1, 0.1))
    touch = ms.Contact([rod, block], shapes=bar, **{**LAW, "smoothing": 2e-4, **contact})
    scene = ms.Scene([body, skeleton], contacts=[touch], gravity=(0, 0.3, -9.81), allow_rigid_motions=True)
    inputs = {"time_step": 2e-3, "gravity_factor": 0.9}
    fixed = {**EXACT, "steps": 6, "integrator": integrator, "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach={**REACH, **PLACE})


def pressing() -> Kind:
    """Build two arms with capsules that lean on each other, and one of them on a plane with one end."""
    one, rod = _arm()
    link = ms.Link(mass=4e-3, inertia=(1.2e-6, 2e-6, 1.5e-6), center=(0.04, 0.0, 0.02))
    hinge = ms.Revolute(link, origin=(0.04, -0.06, 0.03), axis=(1, 0.1, 0.1), spring_stiffness=0.02)
    bar = ob.Attached(
        ob.Capsule([[0, -0.04, 0], [0, 0.04, 0]], 0.01),
        to=link,
        center=(0.045, 0.0, 0.0206),
        rotation=(0.1, 0, 0.1),
    )
    floor = ob.Plane(center=(0.02, 0, -0.0115), rotation=(0.02, 0.0, 0))
    touch = ms.Contact([rod, floor], shapes=[bar, rod], **{**LAW, "smoothing": 2e-4})
    scene = ms.Scene([one, ms.Skeleton([link], [hinge])], contacts=[touch], gravity=(0.1, 0.2, -9.81))
    return Kind(scene, {"gravity_factor": 0.9}, fixed=EXACT, step=5e-5, reach={**REACH, **PLACE})


def tumbling(integrator, in_time=0, **contact) -> Kind:
    """Build two spinning ellipsoids that fall on each other, on a capsule on an arm, and on a plane."""
    skeleton, rod = _arm()
    eggs = []
    for center, turn, velocity in (
        ((0.045, 0.006, 0.0213), (0.3, 0.2, 0.1), (0.05, -0.02, -0.3)),
        ((0.0053, 0.008, 0.0212), (0.1, -0.4, 0.6), (0.1, 0.05, -0.2)),
    ):
        body = ms.RigidBody(
            mass=5e-3,
            inertia=(8e-7, 9e-7, 1e-6),
            center=center,
            velocity=velocity,
            angular_velocity=(2.0, 3.0, -1.0),
        )
        place = {"center": np.add(center, (1e-3, -5e-4, 2e-3)), "rotation": turn}
        eggs.append((body, ob.Attached(ob.Ellipsoid((0.021, 0.015, 0.012)), to=body, **place)))
    (one, first), (other, second) = eggs
    floor = ob.Plane(center=(0.0, 0.0, 9.2e-3), rotation=(0.02, 0.03, 0.0))
    touch = ms.Contact([rod, floor, second], shapes=[first, second], **{**LAW, "smoothing": 2e-4, **contact})
    scene = ms.Scene(
        [one, other, skeleton], contacts=[touch], gravity=(0, 0.3, -9.81), allow_rigid_motions=True
    )
    inputs = {"time_step": 2e-3, "gravity_factor": 0.9}
    fixed = {**EXACT, "steps": 6, "integrator": integrator, "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach={**REACH, **PLACE}, in_time=in_time)


ROUND_MAKERS = {
    "balls that touch": lambda: thrown(ms.ImplicitEuler()),
    "balls that touch, rubbing, tr_bdf2": lambda: thrown(ms.TRBDF2(), **RUBS),
    "balls that touch, rubbing, contact implicit": lambda: thrown(ms.TRBDF2(implicit_contact=True), **RUBS),
    "balls that touch a moving obstacle": lambda: thrown(ms.ImplicitEuler(), in_time=6, **RUBS),
    "capsules that cross, rubbing": lambda: crossing(ms.TRBDF2(), **RUBS),
    "capsules at rest on each other": pressing,
    "balls that touch, rubbing late": lambda: thrown(ms.TRBDF2(), lagged_friction=True, **RUBS),
    "ellipsoids that touch, rubbing": lambda: tumbling(ms.TRBDF2(), **RUBS),
    "ellipsoids that touch, rubbing late, contact implicit": lambda: tumbling(
        ms.TRBDF2(implicit_contact=True), in_time=6, lagged_friction=True, **RUBS
    ),
}
