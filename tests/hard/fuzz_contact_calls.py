"""Obstacles, contact and water with arguments that work, for the fuzzing to spoil."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from fuzz_calls import Call, Sample

import magshell as ms
from magshell import obstacles

PLACED = {
    "center": (0, 0, -0.1),
    "rotation": (0.1, 0, 0),
    "motion": lambda time: ((0.0, 0.0, time), (0.0, 0.0, 0.0)),
}


def contact_calls(s: Sample) -> Iterator[Call]:
    yield from _shapes(s)
    yield from _in_scenes(s)


def _shapes(s: Sample) -> Iterator[Call]:
    points = s.mesh.rest_positions

    def probed(kind):
        return lambda **arguments: kind(**arguments).signed_distance(points, 0.1)

    shapes = {
        "Plane": (obstacles.Plane, {"normal": (0, 0, 1)}),
        "slope": (obstacles.slope, {"angle": 0.1, "uphill": (1, 0)}),
        "Sphere": (obstacles.Sphere, {"radius": 0.1, "inside": False}),
        "Ellipsoid": (obstacles.Ellipsoid, {"semi_axes": (0.1, 0.2, 0.1), "inside": False}),
        "Box": (obstacles.Box, {"size": (0.1, 0.1, 0.1), "rounding": 0.01, "inside": False}),
        "Capsule": (
            obstacles.Capsule,
            {"ends": np.array([(0, 0, 0), (0.1, 0, 0)]), "radius": 0.1, "inside": False},
        ),
        "HeightField": (
            obstacles.HeightField,
            {"x": np.linspace(0, 1, 4), "y": np.linspace(0, 1, 3), "heights": np.zeros((4, 3))},
        ),
        "bump": (obstacles.bump, {"height": 0.01, "length": 0.1, "ridge": True}),
        "Tube": (
            obstacles.Tube,
            {"points": 0.1 * np.eye(3), "radius": 0.05, "inside": True, "closed": False},
        ),
    }
    for name, (kind, arguments) in shapes.items():
        yield Call(f"obstacles.{name}", probed(kind), {**arguments, **PLACED})
    ball = ms.meshes.spherical_cap(0.1, 0.0, np.pi, cells=(8, 6))
    body = {"mesh": ball.rest_positions, "faces": ball.faces, "resolution": 8, **PLACED}
    yield Call("obstacles.MeshObstacle", probed(obstacles.MeshObstacle), body, cost=2)
    part = ms.RigidBody(mass=1e-3, inertia=1e-8, center=(0, 0, -0.1))
    placed = {name: PLACED[name] for name in ("center", "rotation")}
    yield Call(
        "obstacles.Attached",
        probed(obstacles.Attached),
        {"obstacle": obstacles.Sphere(0.1), "to": part, **placed},
    )
    plane = obstacles.Plane(**PLACED)
    yield Call("Obstacle.signed_distance", plane.signed_distance, {"points": points, "time": 0.1})
    yield Call("Obstacle.normals", plane.normals, {"points": points, "time": 0.1})
    yield Call("Obstacle.pose", plane.pose, {"time": 0.1})
    yield Call("Obstacle.rates", plane.rates, {"time": 0.1})
    yield Call("Obstacle.surface", plane.surface, {"time": 0.1, "extent": 1.0})


def _in_scenes(s: Sample) -> Iterator[Call]:
    def moved(**parts):
        scene = ms.Scene(s.shell, supports=[s.clamp], **parts)
        return ms.simulate(scene, steps=1, time_step=1e-3, progress=False)

    touch = {
        "obstacles": [obstacles.Plane(center=(0, 0, -1e-4))],
        "contact_stiffness": 10.0,
        "friction_coefficient": 0.5,
        "sticking_speed": 1e-3,
        "smoothing": 1e-5,
        "offset": 1e-4,
        "lagged_friction": False,
        "vertices": np.arange(4),
        "face_samples": 1,
    }
    yield Call("Contact", lambda **a: moved(contacts=ms.Contact(**a)), touch)
    body = ms.RigidBody(mass=1e-3, inertia=1e-8, center=(0, 0, 0.01), velocity=(0, 0, -0.1))
    ball = obstacles.Attached(obstacles.Sphere(0.01, center=(0, 0, 0.01)), to=body)

    def rolled(**a):
        scene = ms.Scene(body, contacts=ms.Contact(**a), allow_rigid_motions=True)
        return ms.simulate(scene, steps=1, time_step=1e-3, progress=False)

    of_shapes = {"obstacles": [obstacles.Plane()], "shapes": [ball], "friction_coefficient": 0.5}
    yield Call("Contact of shapes", rolled, of_shapes)
    other = ms.Shell(
        s.mesh.transformed(translation=(0, 0, 5e-3)), thickness=1e-3, young_modulus=1e6, mass_density=1e3
    )
    law = {
        "min_distance": 1e-3,
        "activation_distance": 1e-4,
        "contact_stiffness": 1e5,
        "law": "penalty",
        "smoothing": 1e-5,
        "friction_coefficient": 0.3,
        "static_friction_coefficient": 0.5,
        "sticking_speed": 1e-3,
        "lagged_friction": False,
    }

    def together(make, **a):
        scene = ms.Scene(
            [s.shell, other],
            supports=[ms.Clamp(s.mesh.edges_at(x=0.0), body=s.shell)],
            contacts=make(**a),
            allow_rigid_motions=True,
        )
        return ms.simulate(scene, steps=1, time_step=1e-3, progress=False)

    yield Call("BodyContact", lambda **a: together(ms.BodyContact, **a), {"a": s.shell, "b": other, **law})
    yield Call("SelfContact", lambda **a: together(ms.SelfContact, **a), {"a": other, **law})

    def with_own_field(**a):
        clamp = ms.Clamp(s.mesh.edges_at(x=0.0))
        return ms.Scene(s.shell, supports=clamp, own_field=ms.OwnField(**a))

    yield Call("OwnField", with_own_field, {"bodies": s.shell, "accuracy": 1e-6, "max_points": 100})
    table = (np.linspace(0.0, np.pi / 2, 4), np.arange(4.0))
    flow = {
        "fluid_density": 1e3,
        "velocity": (0.1, 0, 0),
        "drag_coefficient": 1.0,
        "thrust_coefficient": 1.0,
        "attack_table": table,
        "thrust_table": table,
        "added_mass": 0.1,
        "normal_viscous_drag": 1.0,
        "tangential_viscous_drag": 0.5,
    }
    yield Call("Water", lambda **a: moved(water=ms.Water(**a)), flow)
    water = ms.Water()
    yield Call("Water.coefficients", water.coefficients, {"attack_angle": np.array([0.1, 0.2])})
    triangles = s.positions[s.mesh.faces[:2]]
    motion = {"positions": triangles, "velocities": triangles}
    yield Call("Water.force", water.force, {**motion, "accelerations": None})
    yield Call("Water.momentum", water.momentum, motion)
    yield Call("Water.kinetic_energy", water.kinetic_energy, motion)
    strip = {"viscosity": 1e-3, "length": 1e-2, "width": 1e-3}
    yield Call("Water.viscous", lambda **a: ms.Water.viscous(**a), strip)
