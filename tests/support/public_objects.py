"""One object of every public class, each made from arrays of the caller's that are known."""

from __future__ import annotations

import importlib.util
import inspect
import pkgutil
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from public_names import public_names
from solid_materials import SAMPLES

import magshell as ms
from magshell._runtime.frozen import Frozen

# Classes whose objects change by their nature, with the reason.
STATEFUL = {
    **dict.fromkeys(
        ("optim.MMA", "optim.GCMMA", "optim.LBFGS", "optim.GaussNewton", "optim.NewtonCG"),
        "optimizers of torch, with a state",
    ),
    "LiveView": "a view in a browser, with its server",
    "envs.Environment": "an environment of gymnasium, with an episode under way",
    "envs.VectorEnv": "an environment of gymnasium, with episodes under way",
    "jax.JaxEquilibrium": "a tuple, which Python itself does not let change",
}


class Arrays:
    """Arrays that a caller hands over, and keeps."""

    def __init__(self):
        self.made: list[np.ndarray] = []

    def __call__(self, values, dtype=float) -> np.ndarray:
        self.made.append(np.array(values, dtype=dtype))
        return self.made[-1]

    def numbers(self, *values: int) -> np.ndarray:
        return self(values, np.int64)

    def change(self) -> None:
        """Writes other numbers into all of them; fails where one has become read-only."""
        for array in self.made:
            array[...] = array[::-1].copy() + 1 if array.ndim and array.dtype != bool else array * 0


def _bodies(given: Arrays) -> dict[str, object]:
    corners = [[0, 0, 0], [0.02, 0, 0], [0.02, 0.02, 0], [0, 0.02, 0], [0.04, 0, 0], [0.04, 0.02, 0]]
    flat = ms.TriangleMesh(given(corners), given([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]], np.int64))
    six = ms.QuadraticTriangleMesh.from_triangles(flat)
    box = ms.meshes.box((0.04, 0.02, 0.02), cells=(2, 1, 1))
    tets = ms.TetMesh(
        given(box.rest_positions),
        given(box.tetrahedra, np.int64),
        given(np.zeros(box.n_tetrahedra), np.int64),
        {"all": 0},
    )
    shell = ms.Shell(
        flat,
        thickness=given(np.full(4, 1e-3)),
        young_modulus=given(np.full(4, 1e6)),
        poisson_ratio=given(np.full(4, 0.3)),
        mass_density=given(np.full(4, 1e3)),
        curvature_scale=given(np.ones(flat.n_edges)),
        remanent_magnetization=given(np.full((4, 3), 1e3)),
        growth=given(np.ones(4)),
        rest_curvature=given(np.zeros(4)),
    )
    skin = ms.Skin(
        thickness=given([1e-3, 1e-3]),
        mass_density=given([1e3, 1e3]),
        faces=given.numbers(0, 1),
        remanent_magnetization=given(np.full((2, 3), 1e3)),
    )
    material = ms.NeoHookean(young_modulus=given(np.full(box.n_tetrahedra, 1e6)), poisson_ratio=0.4)
    solid = ms.Solid(
        tets,
        material=material,
        element="linear",
        mass_density=given(np.full(box.n_tetrahedra, 1e3)),
        remanent_magnetization=given(np.full((box.n_tetrahedra, 3), 1e3)),
    )
    link = ms.Link(mass=1.0, inertia=given([1.0, 2.0, 2.5]), center=given([0, 0, -1.0]))
    lower = ms.Link(mass=1.0, inertia=0.1, center=given([0, 0, -2.0]))
    hinge = ms.Revolute(
        link, origin=given([0, 0, 0]), axis=given([0, 1.0, 0]), torque=0.1, spring_stiffness=1.0
    )
    ball = ms.Ball(lower, link, origin=given([0, 0, -1.5]), torque=given([0, 0.1, 0]))
    return {
        "flat": flat,
        "six": ms.QuadraticTriangleMesh(given(six.rest_positions), given(six.elements, np.int64)),
        "tets": tets,
        "quality": flat.quality,
        "tet quality": tets.quality,
        "shell": shell,
        "skin": skin,
        "solid": solid,
        "balloon": ms.Shell(box.surface, thickness=1e-3, young_modulus=1e6),
        "NeoHookean": material,
        **{
            name: each.make(**each.options, **{key: given(value) for key, value in each.constants.items()})
            for name, each in SAMPLES.items()
        },
        "rigid": ms.RigidBody(
            mass=1.0,
            inertia=given(np.eye(3)),
            center=given([0, 0, 1.0]),
            magnetic_moment=given([0, 0, 1.0]),
            velocity=given([0, 0, 0.1]),
            angular_velocity=given([0, 0, 0.1]),
        ),
        "rigid vertices": ms.RigidBody(given.numbers(0, 1, 2), mass=1.0, body=shell),
        "link": link,
        "hinge": hinge,
        "ball": ball,
        "fixed": ms.Fixed(link, lower, given([0, 0, -1.5])),
        "slide": ms.Prismatic(link, origin=given([0, 0, 0]), axis=given([0, 1.0, 0]), force=0.1),
        "screw": ms.Screw(link, origin=given([0, 0, 0]), axis=given([0, 1.0, 0]), pitch=0.01),
        "closure": ms.LoopClosure(link, lower, origin=given([0, 0, -1.5]), stiffness=10.0),
        "skeleton": ms.Skeleton([link, lower], [hinge, ball]),
        "tie": ms.Tie(
            shell,
            ms.Shell(flat.transformed(translation=given([0.04, 0, 0])), thickness=1e-3, young_modulus=1e6),
            vertices=given.numbers(4, 5),
        ),
        "fibres": ms.Fibres(
            given.numbers(0, 1), given([[1.0, 0, 0], [1.0, 0, 0]]), given([1.0, 0.5]), given([0.0, 0.01])
        ),
    }


def _around(given: Arrays, bodies: dict[str, object]) -> dict[str, object]:
    """Supports, loads, actuators, contacts, fields and obstacles."""
    shell, solid, flat, balloon = (bodies[name] for name in ("shell", "solid", "flat", "balloon"))
    other = ms.Shell(flat.transformed(translation=(0, 0, 0.01)), thickness=1e-3, young_modulus=1e6)
    plane = ms.obstacles.Plane(given([0, 0, 1.0]), center=given([0, 0, -0.1]), rotation=given([0, 0.0, 0]))
    sampled = ms.SampledField(given([-1.0, -1, -1]), given([2.0, 2, 2]), given(np.ones((2, 2, 2, 3))))
    ball = ms.meshes.spherical_cap(0.1, 0.0, np.pi, cells=(8, 4))
    place = {"center": given([0, 0, -0.1]), "rotation": given([0, 0.1, 0])}
    attached = ms.obstacles.Attached(
        ms.obstacles.Sphere(0.1), ms.RigidBody(mass=1.0, inertia=1.0), center=given([0, 0, 1.0])
    )
    found = {
        "pin": ms.Pin(
            given.numbers(0, 3),
            displacement=given([0, 0, 1e-3]),
            rotation=given([0, 0.1, 0]),
            center=given([0.0, 0, 0]),
        ),
        "clamp": ms.Clamp(flat.edges_at(x=0.0).copy(), displacement=given([0, 0, 1e-3])),
        "clamp by numbers": ms.Clamp(given(flat.edges_at(x=0.0), np.int64)),
        "symmetry": ms.SymmetryPlane(given([1.0, 0, 0]), given([0.0, 0, 0])),
        "equal displacement": ms.EqualDisplacement(given.numbers(4, 5), given([1.0, 0, 0])),
        "periodic": ms.Periodic(
            given.numbers(0, 3), given.numbers(2, 5), "x", displacement=given([1e-3, 0, 0])
        ),
        "point load": ms.PointLoad(given.numbers(4, 5), given([[0, 0, 1e-3], [0, 0, 2e-3]])),
        "point load by mask": ms.PointLoad(given([0, 0, 0, 0, 1, 1], bool), given([0, 0, 1e-3])),
        "edge load": ms.EdgeLoad(given(flat.edges_at(x=0.04), np.int64), given([0, 0, 1e-3])),
        "area load": ms.AreaLoad(given([0, 0, 1e-3]), given.numbers(0, 1)),
        "couple": ms.EdgeCouple(given(flat.edges_at(x=0.04), np.int64), given([0, 1e-3, 0])),
        "pressure": ms.Pressure(given([1.0, 2.0]), faces=given.numbers(0, 1)),
        "tension": ms.SurfaceTension(given([0.01, 0.02]), faces=given.numbers(0, 1)),
        "spring": ms.Spring((shell, given([0.01, 0.005, 0.0])), given([0.01, 0.005, 0.1]), stiffness=0.1),
        "foundation": ms.ElasticFoundation(given([10.0, 20.0]), faces=given.numbers(0, 1)),
        "muscle": ms.Muscle(
            solid,
            given([1.0, 0, 0]),
            peak_stress=1e3,
            activation=0.1,
            force_length=given([[0.5, 0.0], [1.0, 1.0], [1.5, 0.0]]),
            elements=given.numbers(0, 1),
            weights=given([1.0, 0.5]),
            segments=given.numbers(0, 1),
        ),
        "cavity": ms.Cavity(balloon, given(np.arange(balloon.mesh.n_faces), np.int64), pressure=10.0),
        "cells": ms.PneumaticCells(
            solid, [given.numbers(0, 1), given.numbers(2, 3)], stiffness=given([1e3, 1e3])
        ),
        "tendon": ms.Tendon(given([[0.0, 0.0, 0.0], [0.04, 0.0, 0.0]]), solid, tension=0.1),
        "crease": ms.Crease(given(flat.interior_edges[:2], np.int64), given([1e-5, 2e-5])),
        "contact": ms.Contact([plane], vertices=given.numbers(0, 1)),
        "contact of shapes": ms.Contact(plane, shapes=[attached]),
        "body contact": ms.Contact(shell, other),
        "self contact": ms.SelfContact(shell),
        "uniform": ms.UniformField(),
        "own field": ms.OwnField(shell),
        "dipoles": ms.Dipoles(given([[0, 0, -0.1]]), given([[0, 0, 1.0]])),
        "sampled": sampled,
        "custom": ms.CustomField(_same, length_scale=1.0),
        "placed": ms.PlacedField(sampled, **place),
        "cuboid": ms.CuboidMagnet(given([0.01, 0.01, 0.01]), given([0, 0, 1e6]), **place),
        "cylinder": ms.CylinderMagnet(0.01, 0.02, given([0, 0, 1e6]), **place),
        "water": ms.Water(
            velocity=given([0.1, 0, 0]),
            attack_table=(given([0, 0.5, np.pi / 2]), given([0, 1.0, 2.0])),
        ),
        "parameter of a fit": ms.FitParameter(given([1.0, 2.0]), prior=(given([1.0, 2.0]), 0.1)),
        "plane": plane,
        "sphere": ms.obstacles.Sphere(0.1, **place),
        "ellipsoid": ms.obstacles.Ellipsoid(given([0.1, 0.2, 0.1]), **place),
        "attached": attached,
        "box": ms.obstacles.Box(given([0.1, 0.1, 0.1]), **place),
        "capsule": ms.obstacles.Capsule(given([[0, 0, 0], [0.1, 0, 0]]), 0.01, **place),
        "tube": ms.obstacles.Tube(given([[0, 0, 0], [0.1, 0, 0], [0.2, 0.1, 0]]), 0.05, **place),
        "ground": ms.obstacles.HeightField(
            given([0.0, 0.1, 0.2, 0.3]), given([0.0, 0.1, 0.2, 0.3]), given(np.zeros((4, 4))), **place
        ),
        "mesh obstacle": ms.obstacles.MeshObstacle(
            given(ball.rest_positions), given(ball.faces, np.int64), 8, **place
        ),
    }
    if importlib.util.find_spec("torch"):
        found["own energy"] = ms.CustomEnergy(
            _squared, of=given.numbers(0, 1), values={"stiffness": given([1.0])}
        )
    if importlib.util.find_spec("magpylib"):
        import magpylib

        source = magpylib.magnet.Sphere(polarization=(0, 0, 1), diameter=0.01, position=(0, 0, -0.05))
        found["magpylib"] = ms.MagpylibField(source, length_scale=0.04)
    return found


def _same(points):
    return 0.1 * points


def _squared(x, stiffness):
    return stiffness * (x[1] - x[0]).square().sum()


def _options(given: Arrays) -> dict[str, object]:
    """Return the objects that users pass to functions together with a scene."""
    ball = ms.shapes.ball(0.1, given([0.0, 0, 0]))
    found = {
        **{
            cls.__name__: cls()
            for cls in (ms.Newton, ms.MixedNewton, ms.ProjectiveDynamics, ms.AdjointStorage)
        },
        **{cls.__name__: cls() for cls in (ms.ImplicitEuler, ms.TRBDF2, ms.SDIRK2, ms.SDIRK3)},
        "adaptive": ms.Adaptive(1e-3),
        "ink": ms.PrintableSet(
            5e4, given([[1.0, 0, 0], [0, 1.0, 0]]), levels=given([0.0, 1.0]), frames=given([np.eye(3)] * 4)
        ),
        "elastomer": ms.Elastomer(
            "ink", 1e5, (9e4, 2e5), "own", "tension", mass_density=2e3, remanent_magnetization=1e4
        ),
        "view": ms.View(30, -60, frame=given([[0.0, 0, 0], [0.1, 0.02, 0.01]])),
        "style": ms.Style(),
        "probe": ms.Probe("tip", given.numbers(0, 1, 2)),
        "color": ms.Color(given([0.0, 1.0, 2.0])),
        "primitive": ball,
        "moved": ball.translated(given([0.1, 0, 0])),
        "offset": ball.offset(0.01),
        "named": ball.named("ball"),
        "union": ball | ball.scaled(2.0),
        "smooth union": ball.smooth_union(ball.scaled(2.0), radius=0.01),
        "intersection": ball & ball.scaled(2.0),
        "difference": ball - ball.scaled(0.5),
    }
    if importlib.util.find_spec("torch"):
        line = ms.control.Polyline(given([[0, 0, 0], [1.0, 0, 0]]))
        arc = ms.control.Arc(
            given([1.0, 1, 0]), start=given([1.0, 0, 0]), axis=given([0, 0, 1.0]), angle=np.pi / 2
        )
        found |= {"polyline": line, "arc": arc, "chain": ms.control.Chain([line, arc])}
        mesh, density = ms.meshes.rectangle(0.04, 0.02, cells=(2, 1)), ms.parametrize.density
        found |= {"filter": density.HelmholtzFilter(mesh, 0.1), "cone filter": density.ConeFilter(mesh, 0.1)}
        found["matter"] = density.Matter(mesh, given([1.0, 1.0, 0.5, 0.0]), given.numbers(0, 1))
        found["robust densities"] = density.robust(given([0.2, 0.6]), 8.0, 0.7)
        found |= _outlines(given)
    return found


def _outlines(given: Arrays) -> dict[str, object]:
    """Return borders of flat sheets, and with gmsh an outline of them."""
    parametrize = ms.parametrize
    found = {
        "polygon": parametrize.Polygon(given([[0.0, 0], [1, 0], [1, 1], [0, 1]])),
        "spline": parametrize.ClosedSpline(given([[0.0, 0], [1, 0], [1, 1], [0, 1]])),
        "round border": parametrize.Circle(given([0.3, 0.5]), radius=0.2),
        "slit": parametrize.Slit(given([[0.6, 0.2], [0.6, 0.9]])),
    }
    if importlib.util.find_spec("gmsh"):
        borders = [found["polygon"], found["round border"]]
        found["meshed outline"] = parametrize.MeshedOutline(borders, found["slit"], size=0.2)
    return found


def made_objects(given: Arrays) -> dict[str, object]:
    """Return the objects that users make, with a scene of many of them."""
    found = _bodies(given)
    found |= _around(given, found)
    found |= _options(given)
    found["scene"] = scene = ms.Scene(
        found["shell"],
        supports=[found["clamp by numbers"]],
        loads=[
            *(found["point load"], found["area load"], found["tension"], found["pressure"]),
            *(found["spring"], found["foundation"]),
        ],
        field=[found["uniform"], found["dipoles"]],
        gravity=given([0, 0, -9.81]),
        contacts=[found["contact"]],
        water=found["water"],
    )
    found["env actuator"] = ms.envs.Action(
        scene, "applied_flux_density", lower=given([-1.0, -1, -1]), upper=given([1.0, 1, 1])
    )
    found["steered"] = ms.envs.ParametricAction(found["hinge"], "torque", 1, _former_value)
    return found


def _former_value(number, time, before):
    return before


def _from_fields(cls) -> object:
    """Return a result with dummy numbers, in place of one that takes long to compute."""
    return cls(**{name: np.zeros(3) for name, each in inspect.signature(cls).parameters.items()})


def _stored_study() -> ms.StoredStudy:
    """Return a study of two points on the disk, in a temporary folder that stays."""
    folder = tempfile.mkdtemp()
    with ThreadPoolExecutor(1) as executor:
        return ms.stream_study(lambda x: x, {"x": [1.0, 2.0]}, folder, executor, progress=False)


def found_results(given: Arrays, made: dict[str, object]) -> dict[str, object]:
    """Return the results of functions."""
    mesh = made["flat"]
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    tip = mesh.vertices_at(x=0.04)
    clamp, load = ms.Clamp(mesh.edges_at(x=0.0)), ms.PointLoad(tip, (-1e-3, 0, 1e-4))
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, -0.1)))
    scene = ms.Scene(sheet, supports=[clamp], loads=[load], field=ms.UniformField(), contacts=[floor])
    asked = {
        "remanent_magnetization": given(np.full((4, 3), 1e3)),
        "applied_flux_density": given([0, 0, 1e-4]),
    }
    start = given(mesh.rest_positions)
    values = {load: {"force": given([-1e-3, 0, 2e-4])}}
    rest = ms.equilibrium(scene, start=start, values=values, **asked)
    move = ms.simulate(
        scene, steps=2, time_step=1e-3, velocities=given(np.zeros((6, 3))), values=values, **asked
    )
    moves = ms.simulate(scene, steps=2, time_step=1e-3, batch=2, **asked)
    path = ms.follow_path(scene, **asked)
    solid, muscle = made["solid"], made["muscle"]
    actuated = ms.Scene(
        solid,
        supports=[ms.Pin(solid.mesh.vertices_at(x=0.0))],
        actuators=[muscle, made["cells"], made["tendon"]],
        field=ms.UniformField(),
    )
    held = ms.Pin(made["balloon"].mesh.vertices_at(x=0.0))
    blown = ms.Scene(made["balloon"], supports=[held], actuators=[made["cavity"]])
    spring, bed = ms.Spring((sheet, (0.01, 0.005, 0.0)), stiffness=0.1), ms.ElasticFoundation(10.0)
    on_springs = ms.equilibrium(ms.Scene(sheet, supports=[clamp], loads=[spring, bed]))
    of_solid = ms.equilibrium(actuated, applied_flux_density=(0, 0, 0))
    swing = ms.simulate(ms.Scene(made["skeleton"], gravity=(0, 0, -9.81)), steps=1, time_step=1e-3)
    welded = ms.weld(mesh, mesh.transformed(translation=(0.04, 0, 0)))
    joined = ms.weld(made["tets"], made["tets"].transformed(translation=(0.04, 0, 0)))
    unheld = ms.Scene(sheet, supports=[clamp], field=ms.UniformField())
    moved = ms.equilibrium(unheld, values={sheet: {"rest_positions": given(mesh.rest_positions)}}, **asked)
    record = ms.MinimizeResult([np.zeros(3)], 1.0, 0.0)
    found = {
        "equilibrium": rest,
        "magnetic state": ms.field_of(rest),
        "equilibria": ms.EquilibriumSet([rest, rest]),
        "batch of motions": moves,
        "batch": ms.equilibrium(scene, **asked, batch=2),
        "branch": ms.Branch(mesh.rest_positions + 0.0, mesh.rest_positions + 1e-3, "other side"),
        "log of a solve": rest.log,
        "step of a solve": rest.log[0],
        "trajectory": move,
        "state of motion": move.end,
        "path": path,
        "body result": rest[sheet],
        "solid result": of_solid[solid],
        "muscle result": of_solid[muscle],
        "cavity result": ms.equilibrium(blown)[made["cavity"]],
        "cells result": of_solid[made["cells"]],
        "tendon result": of_solid[made["tendon"]],
        "spring result": on_springs[spring],
        "foundation result": on_springs[bed],
        "rigid result": swing[made["link"]],
        "joint result": swing[made["hinge"]],
        "strains": rest.strains(),
        "stresses": rest[sheet].stresses(),
        "states of a solid": of_solid[solid].stresses(),
        "states of fibres": of_solid[muscle].states(),
        "touching": rest.contact_state(floor),
        "reaction": rest.reaction(clamp),
        "response": ms.linear_response(scene, **asked),
        "batch of responses": ms.linear_response(scene, **asked, batch=2),
        "modes": ms.vibration_modes(scene, rest, count=1),
        "weld": welded,
        "weld of solids": joined,
        "mended": ms.TetMesh.repaired(made["tets"].rest_positions, made["tets"].tetrahedra),
        "warm start": ms.WarmStart(scene),
        "picture": ms.plot(rest, width=400, style=ms.Style(backend="matplotlib")),
        "snapshot": ms.envs.Snapshot(move, 0, given(np.zeros(3))),
        "minimum": record,
        "window": ms.control.Window(1, 0, 1.0),
        "scene of other rest positions": moved.scene,
        "windows": ms.control.Windows(np.zeros(3), [(ms.control.Window(1, 0, 1.0), record)]),
        "horizon": ms.control.Horizon(0, 1, 2),
    }
    if importlib.util.find_spec("torch"):
        fit = ms.fit(lambda a: a.expand(3), given([1.0, 1.1, 0.9]), {"a": 1.0}, noise=0.1, progress=False)
        prediction = fit.predict(lambda a: a.expand(2))
        found |= {"fit": fit, "prediction": prediction, "residual tests": fit.tests}
        found["uncertainty of a fit"] = fit.uncertainty
    rare = (
        ms.envs.EnvState,
        ms.Buckling,
        ms.CriticalPoint,
        ms.EnergyBalance,
        ms.ErrorEstimate,
        ms.Extrapolation,
        ms.MotionBalance,
        ms.MultistartResult,
        ms.PathEvent,
        ms.PrintableMinimum,
        ms.PrintableStage,
        ms.RefinedResult,
        ms.Study,
        ms.StudyRow,
    )
    found["StoredStudy"] = _stored_study()
    return found | {
        cls.__name__: _from_fields(cls) for cls in (*rare, ms.control.RecedingHorizonResult, ms.envs.Episode)
    }


def public_classes() -> dict[str, type]:
    """Return the public classes by their names, without errors and warnings, which Python itself modifies."""
    found = {name: _named(name) for name in public_names()}
    return {
        name: each
        for name, each in found.items()
        if isinstance(each, type) and not issubclass(each, BaseException)
    }


def frozen_classes() -> set[type]:
    """Return the immutable classes, once every module is loaded, without those that only the package itself builds."""
    for module in pkgutil.walk_packages(ms.__path__, "magshell."):
        if ".bench" not in module.name and "__main__" not in module.name:
            importlib.import_module(module.name)
    every, found = [Frozen], set()
    while every:
        own = [each for each in every.pop().__subclasses__() if each.__module__.startswith("magshell")]
        every += own
        found.update(own)
    return found


def _named(name: str):
    found = ms
    for part in name.split("."):
        found = getattr(found, part)
    return found
