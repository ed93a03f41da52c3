"""Rigid parts, links and joints with arguments that work, for the fuzzing to spoil."""

from __future__ import annotations

from collections.abc import Iterator

from fuzz_calls import Call, Sample

import magshell as ms


def rigid_calls(s: Sample) -> Iterator[Call]:
    mesh = s.mesh
    rigid = {
        "mass": 1e-3,
        "inertia": (1e-8, 1e-8, 2e-8),
        "center": (0.09, 0, 0),
        "magnetic_moment": (1e-3, 0, 0),
        "force": (0, 0, 1e-3),
        "torque": (0, 1e-5, 0),
    }
    yield Call(
        "RigidBody",
        lambda **a: ms.Scene([s.shell, ms.RigidBody(**a)], field=s.dipoles, allow_rigid_motions=True),
        {"vertices": mesh.vertices_where(lambda x: x[:, 0] > 0.05), "body": s.shell, **rigid},
    )
    spin = {"velocity": (0, 0, 1.0), "angular_velocity": (1.0, 0, 0)}
    yield Call(
        "RigidBody, free",
        lambda **a: ms.Scene(ms.RigidBody(**a), field=s.dipoles, allow_rigid_motions=True),
        {**rigid, **spin},
    )

    jointed = {**rigid, **spin}
    yield Call(
        "Link",
        lambda **a: ms.Scene(ms.Skeleton([ms.Link(**a)]), field=s.dipoles, allow_rigid_motions=True),
        {**jointed, "shape": mesh},
    )
    limits = {"lower_limit": -1.0, "upper_limit": 1.0, "limit_stiffness": 1.0, "limit_smoothing": 0.1}
    pulls = {"spring_stiffness": 1.0, "damping": 1.0, "servo_stiffness": 1.0, **limits}
    place = {"origin": (0, 0, 0), "axis": (0, 1, 0)}
    turns = {"rest_angle": 0.1, "torque": 1.0, "target_angle": 0.1, "torque_limit": 1.0}
    slides = {"rest_displacement": 0.1, "force": 1.0, "target_displacement": 0.1, "force_limit": 1.0}
    of_balls = {name: pulls[name] for name in ("spring_stiffness", "damping", *list(limits)[1:])}
    of_balls |= {"torque": (1.0, 0, 0), "rate": (1.0, 0, 0)}
    link, base = (ms.Link(mass=1e-3, inertia=1e-8, center=(x, 0, 0)) for x in (0.1, 0.2))
    for joint, own in (
        (ms.Revolute, {**place, **pulls, **turns}),
        (ms.Screw, {**place, "pitch": 0.01, **pulls, **turns}),
        (ms.Prismatic, {**place, **pulls, **slides}),
        (ms.Ball, {"origin": (0, 0, 0), **of_balls}),
        (ms.Revolute, {**place, "motor_angle": 0.1, "rate": 1.0}),
        (ms.Prismatic, {**place, "motor_displacement": 0.1, "rate": 1.0}),
        (ms.Fixed, {"origin": (0, 0, 0)}),
        (ms.LoopClosure, {"origin": (0, 0, 0), "stiffness": 1.0}),
    ):
        yield Call(
            joint.__name__,
            lambda joint=joint, **a: ms.Scene(
                ms.Skeleton([link, base], [joint(**a)]), allow_rigid_motions=True
            ),
            {"child": link, "parent": base, **own},
        )
    yield Call(
        "Skeleton", lambda **a: ms.Skeleton(**a), {"links": [link, base], "joints": [ms.Fixed(link, base)]}
    )
    hinges = [ms.Revolute(link, base, origin=(0.1, 0, 0), axis=(0, 1, 0)), ms.Fixed(base)]
    at = {"skeleton": ms.Skeleton([link, base], hinges), "coordinates": [0.3]}
    forces, gravity = {"rates": [1.0], "forces": [0.1]}, {"gravity": (0, 0, -9.81)}
    yield Call("coordinate_slices", ms.coordinate_slices, {"skeleton": at["skeleton"]})
    yield Call("mass_matrix", ms.mass_matrix, at)
    yield Call("bias_forces", ms.bias_forces, {**at, "rates": [1.0], **gravity})
    yield Call("forward_dynamics", ms.forward_dynamics, {**at, **forces, **gravity})
    yield Call(
        "inverse_dynamics", ms.inverse_dynamics, {**at, "rates": [1.0], "accelerations": [1.0], **gravity}
    )
