"""Kinds of scene with skeletons, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import DEFAULTS, DIPOLES, MESH, N_V
from gradient_kinds_bodies import CORNER
from gradient_scenes import Kind
from gradient_world import EXACT, FACTORS, IN_TIME, MIDDLE, REACH, RNG, STEPS, under

import magshell as ms
from magshell import obstacles as ob

_LIMITS = {"lower_limit": -1.0, "upper_limit": -1e-3, "limit_stiffness": 1e-2, "limit_smoothing": 5e-3}


def _skeleton_on_a_sheet(free: bool):
    """Build a skeleton on the free end of a sheet: a hinge, a slide, a ball joint, a fixed link, and a loop closed
    to the world.
    """
    base = MESH.rest_positions[CORNER].mean(axis=0)

    def link(*off, **own):
        own = {"mass": 2e-3, "inertia": (4e-7, 5e-7, 6e-7), "magnetic_moment": (1e-3, 2e-3, 5e-3), **own}
        return ms.Link(center=base + np.array(off), **own)

    wrench = {"force": (1e-3, -5e-4, 5e-4), "torque": (2e-5, -1e-5, 3e-5)}
    root = ms.Link(CORNER, mass=1e-3, inertia=1e-7, center=np.add(base, (0.001, 0, 0.002)), **wrench)
    arm, slider, bob = link(0.02, 0, 0.01), link(0.0, 0.02, 0.01), link(0.04, 0.0, 0.02)
    stone, sled = link(0.02, 0, 0.03), link(0.01, 0.03, 0.02)
    springs = {"spring_stiffness": 3e-3, "servo_stiffness": 2e-3}
    hinge = ms.Revolute(
        arm,
        root,
        origin=np.add(base, (0.005, 0, 0)),
        axis=(-0.1, -1, -0.3),
        rest_angle=0.02,
        torque=1e-5,
        target_angle=0.05,
        torque_limit=2e-4,
        **springs,
        **_LIMITS,
    )
    slide = ms.Prismatic(
        slider,
        root,
        origin=base,
        axis=(0.2, 1, 0),
        rest_displacement=1e-3,
        force=1e-3,
        target_displacement=2e-3,
        force_limit=1e-2,
        spring_stiffness=5.0,
        servo_stiffness=3.0,
        lower_limit=-1e-2,
        upper_limit=-1e-4,
        limit_stiffness=2.0,
        limit_smoothing=1e-3,
    )
    ball = ms.Ball(
        bob,
        arm,
        origin=np.add(base, (0.03, 0, 0.01)),
        axis=(1, 0.2, 0.3),
        spring_stiffness=2e-3,
        target_rotation=(0.02, -0.01, 0.03),
        servo_stiffness=1e-3,
        torque_limit=1e-4,
        upper_limit=1.1e-3,
        cone_limit=1.2e-3,
        limit_stiffness=1e-3,
        limit_smoothing=1e-2,
    )
    loop = ms.LoopClosure(bob, origin=np.add(base, (0.05, 0.001, 0.02)), stiffness=0.5)
    turn = {"lower_limit": 0.05, "limit_stiffness": 1e-2, "limit_smoothing": 0.02, "spring_stiffness": 1e-3}
    lever = ms.Revolute(stone, arm, origin=np.add(base, (0.02, 0, 0.02)), axis=(0, 1, 0), **turn)
    push = {"lower_limit": 1e-3, "limit_stiffness": 5.0, "limit_smoothing": 1e-3, "spring_stiffness": 5.0}
    rail = ms.Prismatic(sled, slider, origin=base, axis=(0, 0.3, 1), **push)
    if free:
        hinge, slide, ball = (
            joint._again({**joint._given, "damping": amount})
            for joint, amount in ((hinge, 2e-5), (slide, 2e-2), (ball, 1e-5))
        )
    links, joints = [arm, root, slider, bob, stone, sled], [hinge, slide, ball, lever, rail, loop]
    skeleton = ms.Skeleton(links, joints)
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    return ms.Scene(
        [sheet, skeleton],
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        field=[ms.UniformField(), DIPOLES],
        gravity=(0.1, 0.2, -9.81),
        allow_rigid_motions=free,
    )


def _motorized_skeleton(moves: bool, **more):
    """Build a skeleton with motors on the free end of a sheet, and a moment in a ball joint; dampers if it moves."""
    base = MESH.rest_positions[CORNER].mean(axis=0)

    def link(*off):
        inertia = (4e-7, 5e-7, 6e-7)
        return ms.Link(
            center=base + np.array(off), mass=2e-3, inertia=inertia, magnetic_moment=(1e-3, 2e-3, 5e-3)
        )

    def damped(amount, **rest):
        return {"damping": amount, **rest} if moves else rest

    root = ms.Link(CORNER, mass=1e-3, inertia=1e-7)
    arm, sled, bob = link(0.02, 0, 0.01), link(0.01, 0.03, 0.02), link(0.04, 0.0, 0.02)
    crane = ms.Revolute(
        arm,
        root,
        origin=np.add(base, (0.005, 0, 0)),
        axis=(0.2, 1, 0.1),
        motor_angle=0.0 if moves else 0.2,
        spring_stiffness=1e-3,
    )
    rail = ms.Prismatic(
        sled, arm, origin=base, axis=(0, 0.3, 1), motor_displacement=0.0 if moves else 4e-3, **damped(1e-2)
    )
    socket = ms.Ball(
        bob,
        arm,
        origin=np.add(base, (0.03, 0, 0.01)),
        spring_stiffness=2e-3,
        torque=(3e-5, -1e-5, 2e-5),
        **damped(1e-5),
    )
    wheel = link(0.02, 0.02, 0.03)
    axle = ms.Revolute(
        wheel,
        sled,
        origin=np.add(base, (0.02, 0.02, 0.03)),
        axis=(1, 0, 1),
        spring_stiffness=1e-3,
        **damped(2e-5),
    )
    eye, tail = link(0.02, 0.03, 0.04), link(0.03, 0.03, 0.05)
    gimbal = ms.Ball(
        eye,
        wheel,
        origin=np.add(base, (0.02, 0.02, 0.04)),
        motor_rotation=(0.0, 0.0, 0.0) if moves else (0.2, -0.1, 0.3),
    )
    fin = ms.Ball(tail, eye, origin=np.add(base, (0.02, 0.03, 0.05)), spring_stiffness=1e-3)
    links, joints = [root, arm, sled, bob, wheel, eye, tail], [crane, rail, socket, axle, gimbal, fin]
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    return ms.Scene(
        [sheet, ms.Skeleton(links, joints)],
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        field=[ms.UniformField(), DIPOLES],
        gravity=(0.1, 0.2, -9.81),
        allow_rigid_motions=moves,
        **more,
    )


_REACH = {**REACH, "motor_rotation": 0.3}


def motorized_skeleton_at_rest() -> Kind:
    return Kind(_motorized_skeleton(False), {**DEFAULTS, **FACTORS}, fixed=EXACT, reach=_REACH)


def motorized_skeleton_in_motion(integrator, **options) -> Kind:
    inputs = {**IN_TIME, "time_step": 5e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": integrator, "progress": False, **options}
    in_time = {"in_time": STEPS} if "adjoint_storage" in options else {}
    step = 3e-4 if in_time else 1e-5
    return Kind(
        _motorized_skeleton(True), inputs, ms.simulate, fixed=fixed, step=step, reach=_REACH, **in_time
    )


def motorized_skeleton_on_a_plane() -> Kind:
    """Build the same in contact with a plane, which the corner of the sheet on the root link touches too."""
    floor = ms.Contact(
        under(ob.Plane, -3e-3),
        contact_stiffness=20.0,
        offset=1.6e-3,
        smoothing=1e-3,
        friction_coefficient=0.4,
    )
    inputs = {**IN_TIME, "time_step": 3e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": ms.TRBDF2(implicit_contact=True), "progress": False}
    scene = _motorized_skeleton(True, contacts=[floor])
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach=_REACH)


def skeleton_at_rest() -> Kind:
    return Kind(_skeleton_on_a_sheet(False), {**DEFAULTS, **FACTORS}, fixed=EXACT, step=3e-4, reach=REACH)


def skeleton_in_motion(integrator, **options) -> Kind:
    scene = _skeleton_on_a_sheet(True)
    turning = np.cross([2.0, 5.0, -1.0], MESH.rest_positions - MIDDLE)
    moves = np.array([0.02, 0.01, -0.1]) + turning + 0.05 * RNG.standard_normal((N_V, 3))
    moves[CORNER] = (np.array([0.02, 0.01, -0.1]) + turning)[CORNER]
    inputs = {**IN_TIME, "velocities": moves, "time_step": 5e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": integrator, "progress": False, **options}
    in_time = {"in_time": STEPS} if "adjoint_storage" in options else {}
    # The small first steps of TR-BDF2 leave their round-off in velocities: longer differences feel less of it.
    step = 1e-3 if in_time else 1e-5
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=step, reach=REACH, **in_time)


def thrown_skeleton() -> Kind:
    """Build two links on a hinge in the air, which start as one rigid body."""
    arm = ms.Link(
        mass=2e-3,
        inertia=(4e-7, 5e-7, 6e-7),
        center=(0.01, 0.02, 0.0),
        velocity=(0.02, 0.01, -0.1),
        angular_velocity=(2.0, 5.0, -1.0),
        force=(1e-3, -2e-3, 5e-3),
        torque=(2e-5, 1e-5, -3e-5),
    )
    hand = ms.Link(mass=1e-3, center=(0.03, 0.02, 0.01), magnetic_moment=(1e-3, 2e-3, 5e-3))
    spring = {"spring_stiffness": 1e-4, "torque": 1e-5}
    wrist = ms.Revolute(
        hand, arm, origin=(0.02, 0.02, 0.0), axis=(0, 1, 0.2), rate=-8.0, damping=1e-6, **spring
    )
    weight = ms.Link(mass=1e-3, inertia=1e-7, center=(0.0, 0.03, 0.01))
    rail = ms.Prismatic(weight, hand, origin=(0, 0.03, 0), axis=(1, 0, 1), rate=0.05, spring_stiffness=1.0)
    eye = ms.Link(mass=1e-3, inertia=1e-7, center=(0.0, 0.0, 0.01))
    socket = ms.Ball(
        eye, arm, origin=(0.01, 0, 0), rate=(1.0, -3.0, 2.0), torque=(1e-6, 2e-6, 0), damping=1e-6
    )
    ring = ms.Link(mass=1e-4, inertia=1e-9, center=(0.03, 0.025, 0.01))
    field = [ms.UniformField(), DIPOLES]
    scene = ms.Scene(
        ms.Skeleton([hand, arm, ring, weight, eye], [wrist, rail, ms.Fixed(ring, hand), socket]),
        field=field,
        gravity=(0, 0, -2.0),
        allow_rigid_motions=True,
    )
    inputs = {"applied_flux_density": (1e-3, -5e-4, 2e-3), "time_step": 3e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": ms.ImplicitEuler(), "progress": False}
    reach = {**REACH, "velocity": 0.1, "angular_velocity": 10.0, "center": 0.01, "rate": 5.0}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=reach)


def turning_screw() -> Kind:
    """Build a nut on a screw in the air that turns against its lower limit and a damper."""
    nut = ms.Link(mass=2e-3, inertia=4e-7, center=(0.01, 0.0, 0.01), magnetic_moment=(1e-3, 2e-3, 5e-3))
    stop = {"lower_limit": 0.1, "upper_limit": 2.0, "limit_stiffness": 1e-3, "limit_smoothing": 0.05}
    at = {"origin": (0.0, 0.0, 0.0), "axis": (0.1, 0.2, 1.0), "pitch": 4e-3}
    screw = ms.Screw(nut, **at, rate=-5.0, damping=1e-4, **stop)
    scene = ms.Scene(
        ms.Skeleton([nut], [screw]), field=ms.UniformField(), gravity=(0, 0, -2.0), allow_rigid_motions=True
    )
    inputs = {"applied_flux_density": (1e-3, -5e-4, 2e-3), "time_step": 3e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": ms.ImplicitEuler(), "progress": False}
    reach = {**REACH, "center": 0.01, "rate": 5.0}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=reach)


def _screws(moves: bool):
    """Build a sheet that carries a screw with a spring and limits, and on it one with a motor."""
    base = MESH.rest_positions[CORNER].mean(axis=0)
    inertia = (4e-7, 5e-7, 6e-7)
    root = ms.Link(CORNER, mass=1e-3, inertia=1e-7)
    nut, arm = (
        ms.Link(center=base + np.array(off), mass=2e-3, inertia=inertia, magnetic_moment=(1e-3, 2e-3, 5e-3))
        for off in ((0.01, 0.0, 0.01), (0.02, 0.02, 0.01))
    )
    law = {"spring_stiffness": 1e-3, "rest_angle": 0.2, "torque": 1e-5, "target_angle": 0.3}
    law |= {"servo_stiffness": 1e-3, "torque_limit": 1e-3, **_LIMITS}
    if moves:
        law |= {"damping": 2e-6, "upper_limit": 0.05}
    screws = [
        ms.Screw(nut, root, origin=np.add(base, (0.01, 0, 0)), axis=(0.2, 1, 0.1), pitch=2e-3, **law),
        ms.Screw(
            arm,
            nut,
            origin=np.add(base, (0.02, 0.01, 0)),
            axis=(0, 0.3, 1),
            pitch=-3e-3,
            motor_angle=0.0 if moves else 0.4,
        ),
    ]
    links = [root, nut, arm]
    if moves:  # one in the air that turns against its lower limit and a damper
        wheel = ms.Link(center=base + np.array((0.0, 0.01, 0.01)), mass=2e-3, inertia=inertia)
        spin = {"rate": -5.0, "damping": 1e-4, "lower_limit": 0.1, "limit_stiffness": 1e-3}
        spin |= {"limit_smoothing": 0.05, "upper_limit": 2.0}
        places = {"origin": np.add(base, (0, 0.01, 0)), "axis": (0.1, 0, 1), "pitch": 4e-3}
        links, screws = [*links, wheel], [*screws, ms.Screw(wheel, **places, **spin)]
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    return ms.Scene(
        [sheet, ms.Skeleton(links, screws)],
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        field=[ms.UniformField(), DIPOLES],
        gravity=(0.1, 0.2, -9.81),
        allow_rigid_motions=moves,
    )


def screws_at_rest() -> Kind:
    return Kind(_screws(False), {**DEFAULTS, **FACTORS}, fixed=EXACT, reach=_REACH)


def screws_in_motion() -> Kind:
    inputs = {**IN_TIME, "time_step": 5e-3}
    fixed = {
        **EXACT,
        "steps": STEPS,
        "integrator": ms.TRBDF2(),
        "progress": False,
        "adjoint_storage": "stages",
    }
    return Kind(_screws(True), inputs, ms.simulate, fixed=fixed, step=3e-4, reach=_REACH, in_time=STEPS)
