"""Scenes of every kind that can be built turned, mirrored, moved, in other units, with other numbers, and twice.

A feature is a function of a Build, to which it adds bodies, forces and keywords through the Build's Frame.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from frames import DURATION, Build, Frame, Numbered, PositionedMesh

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

OBLIQUE = rotation_matrix(np.array([0.5, -1.1, 0.8]))
EXTENT, SPEED = 0.06, 0.3  # m, m/s
INTEGRATORS = {
    "ImplicitEuler": ms.ImplicitEuler(),
    "SDIRK2": ms.SDIRK2(),
    "TRBDF2": ms.TRBDF2(),
    "SDIRK3": ms.SDIRK3(),
    "implicit contact": ms.TRBDF2(implicit_contact=True),
}
# Orders of the rests of energy and angular momentum. Stiff parts leave SDIRK3 the second order (theory.md).
ORDERS = {"ImplicitEuler": 1, "SDIRK2": 2, "TRBDF2": 2, "SDIRK3": 2, "implicit contact": 2}
PAIRS = (
    "hanging + watered",
    "loaded + hinged",
    "flying_bar + rubbing_on_obstacles",
    "on_springs + spinning_top",
    "solid + linked",
    "actuated + hanging",
    "folding + meeting",
    "six_nodes + rubbing",
)


def _velocity(x):
    """Return a motion that turns, shears and stretches."""
    return SPEED * (np.array([0.2, -0.1, 0.3]) + np.cross((3.0, 5.0, -4.0), x - (0.03, 0.01, 0.0)))


SHEET = ms.meshes.rectangle(0.06, 0.02, cells=(4, 2), irregular=0.2, seed=5)


FLAT = ms.meshes.rectangle(0.06, 0.02, cells=(4, 2))
COARSE = ms.meshes.rectangle(0.06, 0.02, cells=(2, 1))


def sheet(
    build: Build,
    shift=(0.0, 0.0, 0.0),
    clamped: bool = True,
    velocity=None,
    modulus=1e6,
    own=SHEET,
    **options,
):
    """Add a sheet; clamped at its short side, with a clamp that moves and turns."""
    f = build.frame
    positioned = build.position(own.transformed(translation=shift))
    body = build.add(
        ms.Shell(
            positioned.mesh,
            thickness=f.scalar(1e-3, 1),
            young_modulus=f.modulus(modulus),
            poisson_ratio=0.4,
            mass_density=f.density(1e3),
            **options,
        ),
        positioned,
        velocity,
    )
    if clamped:
        build.parts["supports"].append(
            ms.Clamp(
                positioned.edges(own.edges_at(x=0.0)),
                displacement=f.vector((1e-4, 0.0, 3e-4), 1),
                rotation=f.axial((0.0, 0.05, 0.02)),
                center=f.point(np.add(shift, (0.0, 0.01, 0.0))),
                body=body,
            )
        )
        build.keywords["support_factor"] = lambda t: (t / f.time / DURATION) ** 2
    return body, positioned


def hanging(build: Build) -> None:
    """Add a clamped sheet with gravity, damping and Maxwell branches."""
    f = build.frame
    sheet(build)
    gravity(build)
    build.keywords |= {
        "damping": f.scalar(1e-4, 0, 1, -1),
        "stiffness_damping": f.time_of(1e-3),
        "maxwell_modulus": [0.3],
        "maxwell_time": [f.time_of(5e-3)],
    }


def gravity(build: Build) -> None:
    build.options["gravity"] = build.frame.vector((1.0, 2.0, -9.0), 1, 0, -2)


def hinged(build: Build) -> None:
    sheet(build, bending="hinge")
    gravity(build)


def loaded(build: Build) -> None:
    """Add a clamped sheet with every load."""
    f = build.frame
    body, positioned = sheet(build)
    end = positioned.edges(SHEET.edges_at(x=0.06))
    build.parts["loads"] += [
        ms.PointLoad(positioned.vertices(SHEET.vertices_at(x=0.06)), f.force((1e-3, 2e-3, 5e-3)), body=body),
        ms.EdgeLoad(end, f.vector((0.01, 0.02, 0.05), 0, 1, -2), body=body),
        ms.AreaLoad(f.vector((0.1, 0.2, 0.3), -1, 1, -2), body=body),
        ms.Pressure(pressure=f.modulus(2.0), body=body),
    ]


def magnetized(build: Build) -> None:
    """Add a magnetized clamped sheet in a uniform field, next to a magnet that moves and to dipoles."""
    f = build.frame
    sheet(build, remanent_magnetization=f.magnetic((2e4, 1e4, -1e4)))
    magnet = ms.CuboidMagnet(
        f.scalar((0.02, 0.03, 0.02), 1),
        remanent_magnetization=np.sqrt(f.modulus(1.0)) * np.array((4e5, 2e5, 9e5)),  # in its own frame
        center=f.point((0.05, 0.01, -0.12)),
        rotation=_rotation(_turned(f)),
    )
    dipoles = ms.Dipoles(
        f.point([(0.02, 0.09, 0.12), (0.08, -0.06, 0.1)]), f.magnetic([(0.1, 0.2, 0.5), (0.2, 0, 0.3)], 3)
    )
    build.parts["field"] += [magnet, dipoles, ms.UniformField()]
    build.keywords["applied_flux_density"] = lambda t: (
        f.magnetic((1e-3, -2e-3, 3e-3)) * (t / f.time / DURATION)
    )


def _turned(frame: Frame) -> np.ndarray:
    """Return the rotation of a frame, without its reflection through the origin."""
    return frame.turn * np.linalg.det(frame.turn)


def _rotation(matrix: np.ndarray) -> np.ndarray:
    """Return the rotation vector of a rotation matrix."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(matrix).as_rotvec()


def watered(build: Build) -> None:
    f = build.frame
    sheet(build, clamped=False, velocity=_velocity)
    build.options["water"] = ms.Water(
        f.density(800.0),
        f.vector((0.05, -0.02, 0.01), 1, 0, -1),
        drag_coefficient=0.9,
        thrust_coefficient=0.7,
    )


def with_added_mass(build: Build) -> None:
    f = build.frame
    sheet(build, clamped=False, velocity=_velocity)
    build.options["water"] = ms.Water(
        f.density(800.0), drag_coefficient=0.0, thrust_coefficient=0.0, added_mass=f.scalar(0.6, -2, 1)
    )


def rubbing_on_obstacles(build: Build) -> None:
    """Add a sheet that falls on an oblique plane, a sphere and a rounded box, with friction."""
    f = build.frame
    body, _ = sheet(build, clamped=False, velocity=lambda x: np.broadcast_to((0.2, 0.1, -0.3), x.shape))
    gravity(build)
    rotation = _rotation(_turned(f) @ rotation_matrix(np.array([0.1, 0.2, 0.3])))
    obstacles = [
        ms.obstacles.Plane(f.vector((0.02, 0.01, 1.0)), center=f.point((0.03, 0.01, -1e-3))),
        ms.obstacles.Sphere(float(f.scalar(0.02, 1)), center=f.point((0.01, 0.0, -0.021))),
        ms.obstacles.Box(
            f.scalar((0.01, 0.01, 0.01), 1),
            rounding=float(f.scalar(2e-3, 1)),
            center=f.point((0.05, 0.02, -7e-3)),
            rotation=rotation,
        ),
    ]
    build.parts["contacts"].append(
        ms.Contact(
            obstacles,
            body=body,
            contact_stiffness=f.scalar(50.0, 0, 1, -2),
            friction_coefficient=0.4,
            smoothing=f.scalar(1e-4, 1),
            sticking_speed=f.scalar(1e-2, 1, 0, -1),
        )
    )


def _meeting(build: Build, **contact) -> None:
    f = build.frame
    lower, _ = sheet(build, clamped=False, velocity=lambda x: np.broadcast_to((0.0, 0.0, 0.1), x.shape))
    upper, _ = sheet(
        build,
        (3e-3, 2e-3, 1.5e-3),
        clamped=False,
        velocity=lambda x: np.add(np.cross((0.5, 0.3, 2.0), x - (0.03, 0.01, 0.0)), (0.1, 0.05, -0.2)),
        modulus=2e6,
    )
    build.parts["contacts"].append(
        ms.Contact(
            lower,
            upper,
            contact_stiffness=f.modulus(5e3),
            activation_distance=f.scalar(4e-4, 1),
            **{
                name: value if name == "friction_coefficient" else f.scalar(value, 1, 0, -1)
                for name, value in contact.items()
            },
        )
    )


def meeting(build: Build) -> None:
    """Add two sheets that collide without friction."""
    _meeting(build)


def rubbing(build: Build) -> None:
    """Add two sheets that collide and rub."""
    _meeting(build, friction_coefficient=0.4, sticking_speed=1e-2)


def on_springs(build: Build) -> None:
    """Add a sheet on springs, dampers and a foundation, and a rigid weight that hangs on it."""
    f = build.frame
    body, _ = sheet(build, clamped=False, velocity=_velocity)
    weight = build.add(
        ms.RigidBody(
            mass=f.scalar(2e-3, 0, 1),
            inertia=_inertia(f, (1e-6, 2e-6, 1.5e-6)),
            center=f.point((0.05, 0.01, -0.03)),
            velocity=f.vector((0.1, 0.0, 0.05), 1, 0, -1),
            angular_velocity=f.axial((2.0, 1.0, -3.0), 0, 0, -1),
        )
    )
    stiffness, damping = f.scalar(2.0, 0, 1, -2), f.scalar(0.02, 0, 1, -1)
    build.parts["loads"] += [
        ms.Spring(
            (body, f.point((0.01, 0.01, 0.0))),
            f.point((0.0, 0.02, 0.03)),
            stiffness=stiffness,
            damping=damping,
        ),
        ms.Spring(
            (weight, f.point((0.05, 0.012, -0.028))),
            (body, f.point((0.04, 0.01, 0.0))),
            stiffness=stiffness,
            damping=damping,
        ),
        ms.ElasticFoundation(f.scalar(300.0, -2, 1, -2), body=body),
    ]


def _inertia(frame: Frame, principal) -> np.ndarray:
    return frame.scalar(frame.turn @ np.diag(principal) @ frame.turn.T, 2, 1)


BAR = ms.meshes.box((0.06, 0.02, 0.02), cells=(3, 1, 1))


def bar(build: Build, held: bool = True, velocity=None, **options):
    """Add a bar of a nearly incompressible solid; held at its end."""
    f = build.frame
    positioned = build.position(BAR)
    options = {"material": ms.NeoHookean(young_modulus=f.modulus(1e5), poisson_ratio=0.45), **options}
    body = ms.Solid(positioned.mesh, mass_density=f.density(1e3), **options)
    own = ms.Solid(BAR, material=options["material"], element=options["element"]).mesh
    nodes = Numbered(body.mesh, own, f)
    build.add(body, nodes, velocity)
    if held:
        build.parts["supports"].append(ms.Pin(nodes.number[own.vertices_at(x=0.0)], body=body))
    return body, positioned


def solid(build: Build) -> None:
    """Add a magnetized bar of quadratic elements in a field."""
    f = build.frame
    bar(
        build,
        element="quadratic",
        velocity=lambda x: x[:, :1] * (1.0, 3.0, -4.0),
        remanent_magnetization=f.magnetic((2e4, 1e4, 0)),
    )
    gravity(build)
    build.parts["field"].append(ms.UniformField())
    build.keywords["applied_flux_density"] = f.magnetic((2e-3, -3e-3, 8e-3))


def flying_bar(build: Build) -> None:
    """Add a bar that flies and turns."""
    bar(build, held=False, element="linear", velocity=_velocity)


def actuated(build: Build) -> None:
    """Add a bar with muscle fibres, a pneumatic cell and a tendon."""
    f = build.frame
    body, positioned = bar(build, element="linear")
    some = np.flatnonzero(BAR.tetrahedron_barycenters[:, 0] < 0.03)
    elements = np.flatnonzero(np.isin(positioned.elements, some))
    muscle = ms.Muscle(body, f.vector((1.0, 0.2, -0.1)), stiffness=f.modulus(5e4), activation=0.1)
    points = [(body, f.point(x)) for x in ((0.0, 0.018, 0.01), (0.03, 0.019, 0.012), (0.06, 0.018, 0.01))]
    build.parts["actuators"] += [
        muscle,
        ms.PneumaticCells(body, [elements], stiffness=f.modulus(2e5), volume_ratio=1.1),
        ms.Tendon(points, tension=f.scalar(0.1, 1, 1, -2)),
    ]


def six_nodes(build: Build) -> None:
    """Add a flying sheet of six-node elements."""
    f = build.frame
    flat = ms.meshes.rectangle(0.06, 0.02, cells=(2, 1))
    coarse = PositionedMesh(f, flat, len(build.bodies))
    mesh = ms.QuadraticTriangleMesh.from_triangles(coarse.mesh)
    own = ms.QuadraticTriangleMesh.from_triangles(flat)
    positioned = Numbered(mesh, own, f)
    build.add(
        ms.Shell(
            mesh,
            thickness=f.scalar(1e-3, 1),
            young_modulus=f.modulus(1e6),
            poisson_ratio=0.4,
            mass_density=f.density(1e3),
        ),
        positioned,
        _velocity,
    )


def spinning_top(build: Build) -> None:
    """Add a free rigid body with a force and a torque."""
    f = build.frame
    build.add(
        ms.RigidBody(
            mass=f.scalar(2e-3, 0, 1),
            inertia=_inertia(f, (0.7e-6, 1.0e-6, 1.4e-6)),
            center=f.point((0.05, 0.03, 0.04)),
            velocity=f.vector((0.1, -0.2, 0.1), 1, 0, -1),
            angular_velocity=f.axial((3.0, 40.0, -5.0), 0, 0, -1),
            force=f.force((2e-3, 1e-3, -3e-3)),
            torque=f.torque((1e-5, 2e-5, -4e-5)),
        )
    )
    gravity(build)


def linked(build: Build) -> None:
    """Add a skeleton on the ground with a motor, a spring and a damper, under gravity."""
    f = build.frame

    def link(*center):
        return ms.RigidBody(
            mass=f.scalar(2e-3, 0, 1), inertia=_inertia(f, (4e-7, 5e-7, 6e-7)), center=f.point(center)
        )

    upper, lower = link(0.02, 0.0, 0.0), link(0.05, 0.01, 0.0)
    turned = ms.Revolute(
        upper, origin=f.point((0.0, 0.0, 0.0)), axis=f.axial((0.1, 1.0, 0.2)), motor_angle=0.0
    )
    hinge = ms.Revolute(
        lower,
        upper,
        origin=f.point((0.04, 0.0, 0.0)),
        axis=f.axial((0.0, 0.3, 1.0)),
        spring_stiffness=f.scalar(1e-3, 2, 1, -2),
        damping=f.scalar(1e-5, 2, 1, -1),
    )
    build.add(ms.Skeleton([upper, lower], [turned, hinge]))
    build.values[turned] = {"motor_angle": lambda t: 0.3 * (t / f.time / DURATION) ** 2}
    gravity(build)


def attracting(build: Build) -> None:
    """Add two free sheets that attract each other by their own field."""
    f = build.frame
    for z, law in ((0.0, "stretches"), (0.012, "rotates")):
        sheet(
            build,
            (3e-3 if z else 0.0, 2e-3 if z else 0.0, z),
            clamped=False,
            own=COARSE,
            velocity=_velocity,
            remanent_magnetization=f.magnetic((6e4, 0, 0)),
            magnetization_law=law,
        )
    build.options["own_field"] = ms.OwnField()


def flying(build: Build) -> None:
    """Add a sheet that flies and turns."""
    sheet(build, clamped=False, velocity=_velocity)


def folding(build: Build) -> None:
    """Add a flying sheet with a crease under tension and growth in its faces."""
    f = build.frame
    edges = PositionedMesh(f, FLAT, len(build.bodies)).edges(FLAT.edges_at(x=0.03))
    crease = ms.Crease(edges, stiffness=f.scalar(1e-4, 1, 1, -2), angle=0.3)
    sheet(build, clamped=False, velocity=_velocity, own=FLAT, creases=[crease], growth=1.02)


# Features that SDIRK2 and SDIRK3 refuse, as they hold rigid parts by joints.
JOINTED = ("linked", "solid + linked")

FEATURES: dict[str, Callable[[Build], None]] = {
    each.__name__: each
    for each in (
        *(
            hanging,
            hinged,
            loaded,
            magnetized,
            watered,
            with_added_mass,
            rubbing_on_obstacles,
            meeting,
            rubbing,
        ),
        *(
            on_springs,
            solid,
            flying_bar,
            actuated,
            six_nodes,
            spinning_top,
            linked,
            attracting,
            flying,
            folding,
        ),
    )
}


def build(name: str, frame: Frame | None = None) -> Build:
    """Return the scene of one feature, or of several whose names are joined by " + ", in a frame."""
    made = Build(frame or Frame())
    for each in name.split(" + "):
        FEATURES[each](made)
    return made


def orders_of(name: str, integrator: str) -> int:
    """Return the order of a method in a scene: contact that acts implicitly over a step has the first."""
    touching = any(each in name for each in ("rubbing", "meeting"))
    return 1 if integrator == "implicit contact" and touching else ORDERS[integrator]


def names(pairs: bool = False, integrator: str = "TRBDF2") -> list[str]:
    """Return the scenes of one feature, or of pairs, that an integrator can move."""
    refused = JOINTED if integrator.startswith("SDIRK") else ()
    return [name for name in (PAIRS if pairs else FEATURES) if name not in refused]
