"""Every public function and class of magshell with arguments that work, for the fuzzing to spoil."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import magshell as ms


@dataclass
class Call:
    """A function to call, with valid arguments. cost: a call of cost c is drawn c times less often than one of cost 1."""

    name: str
    function: Callable
    arguments: dict = field(default_factory=dict)
    cost: int = 1


class Sample:
    """A small scene and its results, with which everything else is called."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.mesh = ms.meshes.rectangle(0.1, 0.05, cells=(3, 2))
        self.shell = ms.Shell(self.mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
        self.clamp = ms.Clamp(self.mesh.edges_at(x=0.0), displacement=(0, 0, 1e-4))
        self.load = ms.EdgeLoad(self.mesh.edges_at(x=0.1), (0, 0, 0.01))
        self.dipoles = ms.Dipoles([(0.05, 0, 0.1)], [(0, 0, 0.1)])
        self.grid = ms.SampledField((-1, -1, -1), (1, 1, 1), np.full((3, 3, 3, 3), 1e-3))
        self.scene = ms.Scene(self.shell, supports=[self.clamp], loads=[self.load], gravity=(0, 0, -0.1))
        field = [ms.UniformField(), self.dipoles, self.grid]
        self.magnetic = ms.Scene(self.shell, supports=[self.clamp], loads=[self.load], field=field)
        press = ms.EdgeLoad(self.mesh.edges_at(x=self.mesh.rest_positions[:, 0].max()), (-0.03, 0.0, 0.0))
        self.pressed = ms.Scene(self.shell, supports=[self.clamp], loads=[press], field=ms.UniformField())
        self.magnetization = np.tile((1e4, 0.0, 2e3), (self.mesh.n_faces, 1))
        self.field = np.array((0.0, 0.0, 1e-3))
        self.rest = ms.equilibrium(self.scene)
        self.state = ms.simulate(self.scene, steps=1, time_step=1e-3, progress=False).end
        self.path = ms.follow_path(self.scene, progress=False, max_points=5, max_step=1.0, first_step=1.0)
        self.positions = np.array(self.rest.positions)
        self.track = 1e-2 * np.cumsum(np.ones((6, 3)), axis=0)
        self.times = np.linspace(0.0, 1.0, 6)
        ms.write_mesh(folder / "mesh.ply", self.mesh)


def calls(s: Sample) -> Iterator[Call]:
    """Yield all calls of this file."""
    yield from _meshes(s)
    yield from _scenes(s)
    yield from _fields(s)
    yield from _solves(s)


def _meshes(s: Sample) -> Iterator[Call]:
    mesh, cells = s.mesh, (3, 2)
    grid = {"cells": cells, "diagonals": "alternating", "irregular": 0.1, "seed": 0}
    yield Call("TriangleMesh", ms.TriangleMesh, {"rest_positions": mesh.rest_positions, "faces": mesh.faces})
    yield Call("meshes.rectangle", ms.meshes.rectangle, {"length": 1.0, "width": 0.5, **grid})
    yield Call(
        "meshes.annulus",
        ms.meshes.annulus,
        {"inner_radius": 0.5, "outer_radius": 1.0, **grid, "cells": (2, 5)},
    )
    sector = {"inner_radius": 0.5, "outer_radius": 1.0, "angle": (0.1, 1.0), **grid}
    yield Call("meshes.sector", ms.meshes.sector, sector)
    yield Call("meshes.cylinder", ms.meshes.cylinder, {"radius": 1.0, "length": 1.0, "angle": 1.0, **grid})
    cap = {"radius": 1.0, "angle_from": 0.2, "angle_to": 1.0, "sector_angle": 1.0, **grid}
    yield Call("meshes.spherical_cap", ms.meshes.spherical_cap, cap)
    yield Call("meshes.disk", ms.meshes.disk, {"radius": 1.0, "cells": 3})
    yield Call("meshes.cut", ms.meshes.cut, {"mesh": mesh, "edges": mesh.interior_edges[:1]})
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)])
    hole, slit = 0.3 + 0.2 * square, np.array([(0.7, 0.2), (0.8, 0.8)])
    outline = {"outer": square, "holes": [hole], "slits": [slit], "size": 0.5}
    yield Call("meshes.outline", ms.meshes.outline, outline, cost=20)
    apart = mesh.transformed(translation=(0.1, 0, 0))
    yield Call(
        "weld",
        lambda meshes, tolerance: ms.weld(*meshes, tolerance=tolerance),
        {"meshes": [mesh, apart], "tolerance": 1e-6},
    )
    yield Call(
        "TriangleMesh.transformed", mesh.transformed, {"rotation": np.eye(3), "translation": (1, 0, 0)}
    )
    yield Call("TriangleMesh.scaled", mesh.scaled, {"factor": 2.0})
    at = {"x": 0.0, "y": 0.0, "z": 0.0, "tolerance": 1e-6}
    yield Call("TriangleMesh.vertices_at", mesh.vertices_at, at)
    yield Call("TriangleMesh.edges_at", mesh.edges_at, {"x": 0.0, "tolerance": 1e-6})
    yield Call("TriangleMesh.faces_at", mesh.faces_at, {"z": 0.0, "tolerance": 1e-6})
    left = {"predicate": lambda points: points[:, 0] < 0.05}
    yield Call("TriangleMesh.vertices_where", mesh.vertices_where, left)
    yield Call("TriangleMesh.edges_where", mesh.edges_where, {**left, "boundary_only": True})
    yield Call("TriangleMesh.faces_where", mesh.faces_where, left)
    yield Call("TriangleMesh.nearest_vertex", mesh.nearest_vertex, {"point": (0, 0, 0)})
    yield Call("TriangleMesh.edges_between", mesh.edges_between, {"vertex_indices": np.arange(5)})
    yield Call(
        "TriangleMesh.faces_between", mesh.faces_between, {"vertex_indices": np.arange(1, mesh.n_vertices)}
    )
    groups = {"A": mesh.edges_where(lambda p: p[:, 0] > -np.inf), "B": {"faces": np.arange(3)}}
    yield Call("TriangleMesh.with_groups", mesh.with_groups, {"groups": groups})
    named = mesh.with_groups(groups)
    for select in (named.vertices_in, named.edges_in, named.faces_in):
        yield Call(f"TriangleMesh.{select.__name__}", select, {"group": "B"})


def _scenes(s: Sample) -> Iterator[Call]:
    mesh = s.mesh
    n_f, n_e = mesh.n_faces, mesh.n_edges
    material = {
        "mesh": mesh,
        "thickness": np.full(n_f, 1e-3),
        "young_modulus": 1e6,
        "poisson_ratio": np.full(n_f, 0.4),
        "mass_density": 1e3,
        "curvature_scale": np.full(n_e, 1.0),
        "bending": "midedge",
        "susceptibility": np.full(n_f, 0.5),
    }
    yield Call("Shell", ms.Shell, material)
    moved = {"displacement": (0, 0, 1e-3), "rotation": (0.1, 0, 0), "center": (0, 0, 0)}
    edges = mesh.edges_at(x=0.0)

    def scene(**arguments):
        return ms.Scene(s.shell, **arguments)

    yield Call(
        "Pin",
        lambda **a: scene(supports=[s.clamp, ms.Pin(**a)]),
        {"vertices": [11], "components": "xyz", **moved},
    )
    yield Call("Clamp", lambda **a: scene(supports=ms.Clamp(**a)), {"edges": edges, **moved})
    coating = ms.Shell(mesh, thickness=1e-4, young_modulus=1e6)
    tie = {"a": s.shell, "b": coating, "vertices": [0, 1], "tolerance": 1e-9}
    yield Call(
        "Tie", lambda **a: ms.Scene([s.shell, coating], ties=[ms.Tie(**a)], allow_rigid_motions=True), tie
    )
    yield Call(
        "EqualDisplacement",
        lambda **a: scene(supports=[s.clamp, ms.EqualDisplacement(**a)]),
        {
            "vertices": mesh.vertices_at(x=mesh.rest_positions[:, 0].max()),
            "direction": (0.6, 0, 0.8),
            "body": None,
        },
    )
    left, right = (mesh.vertices_at(x=each(mesh.rest_positions[:, 0])) for each in (np.min, np.max))
    yield Call(
        "Periodic",
        lambda **a: scene(supports=[ms.Periodic(**a)], allow_rigid_motions=True),
        {
            "vertices": left,
            "images": right,
            "components": "xyz",
            "displacement": (0, 0, 1e-3),
            "tolerance": 1e-9,
            "body": None,
        },
    )
    plane = {"normal": (1, 0, 0), "point": (0, 0, 0), "tolerance": 1e-9}
    yield Call(
        "SymmetryPlane", lambda **a: scene(supports=[ms.SymmetryPlane(**a)], allow_rigid_motions=True), plane
    )

    def loaded(kind):
        return lambda **a: scene(supports=s.clamp, loads=kind(**a))

    yield Call("PointLoad", loaded(ms.PointLoad), {"vertices": np.arange(4), "force": np.ones((4, 3))})
    far = mesh.edges_at(x=0.1)
    yield Call("EdgeLoad", loaded(ms.EdgeLoad), {"edges": far, "force_per_length": (0, 0, 1)})
    yield Call("AreaLoad", loaded(ms.AreaLoad), {"force_per_area": (0, 0, 1), "faces": np.arange(3)})
    yield Call("EdgeCouple", loaded(ms.EdgeCouple), {"edges": far, "couple_per_length": 1e-3})
    for kind, name in ((ms.SurfaceTension, "surface_tension"), (ms.Pressure, "pressure")):
        yield Call(kind.__name__, loaded(kind), {name: np.full(3, 0.02), "faces": np.arange(3)})
    spring = {"b": (0.05, 0.01, 0.1), "stiffness": 0.1, "rest_length": 0.05, "damping": 1e-3}
    yield Call(
        "Spring",
        lambda **a: scene(supports=s.clamp, loads=ms.Spring((s.shell, (0.05, 0.01, 0)), **a)),
        spring,
    )
    bed = {"stiffness": np.full(3, 10.0), "faces": np.arange(3), "direction": (0, 0, 1), "damping": 1e-3}
    yield Call("ElasticFoundation", loaded(ms.ElasticFoundation), bed)
    fold = {"edges": mesh.interior_edges[:2], "stiffness": [1e-5, 2e-5], "angle": 0.1}
    yield Call(
        "Crease",
        lambda **a: ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, creases=[ms.Crease(**a)]),
        fold,
    )
    whole = {
        "bodies": s.shell,
        "supports": [s.clamp],
        "loads": [s.load],
        "field": [s.dipoles],
        "gravity": (0, 0, -9.81),
        "allow_rigid_motions": True,
    }
    yield Call("Scene", ms.Scene, whole)


def _fields(s: Sample) -> Iterator[Call]:
    points = s.mesh.rest_positions
    magnet = {"remanent_magnetization": (0, 0, 1e6), "center": (0, 0, 0.5), "rotation": (0.1, 0, 0)}
    yield Call("CuboidMagnet", ms.CuboidMagnet, {"dimensions": (0.1, 0.1, 0.2), **magnet})
    yield Call("CylinderMagnet", ms.CylinderMagnet, {"radius": 0.1, "height": 0.2, **magnet})
    yield Call("Dipoles", ms.Dipoles, {"positions": np.ones((2, 3)), "moments": np.ones((2, 3))})
    sampled = {"origin": (0, 0, 0), "spacing": (1, 1, 1), "flux_density": np.ones((2, 3, 4, 3))}
    yield Call("SampledField", ms.SampledField, sampled)
    grid = ms.SampledField((0, 0, 0), (1, 1, 1), np.ones((2, 3, 4, 3)))
    place = {"center": (0, 0, 0.5), "rotation": (0.1, 0, 0)}
    yield Call("PlacedField", ms.PlacedField, {"field": grid, **place})
    function = {"function": lambda x: 0.1 * x, "lower": (0, 0, 0), "upper": (1, 1, 1), "counts": (2, 2, 3)}
    yield Call("SampledField.from_function", ms.SampledField.from_function, function)

    def custom(**arguments):
        return ms.CustomField(**arguments).gradient(points)

    gradient = {"gradient": lambda x: np.tile(0.1 * np.eye(3), (len(x), 1, 1))}
    yield Call("CustomField", custom, {"function": lambda x: 0.1 * x, "length_scale": 0.1, **gradient})
    yield Call("MagpylibField", _magpylib_field, {"length_scale": 0.1}, cost=5)
    for name, each in (("Dipoles", s.dipoles), ("SampledField", s.grid)):
        yield Call(f"{name}.flux_density", each.flux_density, {"points": points})
        yield Call(f"{name}.gradient", each.gradient, {"points": points})
    yield Call("SampledField.contains", s.grid.contains, {"points": points})
    yield Call("elastomer", ms.elastomer, {"name": "Ecoflex 00-30"})
    rubber = {
        "young_modulus": 1e5,
        "young_modulus_range": (9e4, 2e5),
        "poisson_ratio": 0.5,
        "mass_density": 1e3,
    }
    texts = {"name": "ink", "source": "own", "note": "tension", "remanent_magnetization": 1e4}
    yield Call("Elastomer", ms.Elastomer, {**texts, **rubber})
    yield Call(
        "magnetization_from_remanence",
        ms.magnetization_from_remanence,
        {"residual_flux_density": np.ones((2, 3))},
    )


def _magpylib_field(length_scale):
    """Make the field of a magnetized ball; magpylib is imported only if this call is drawn."""
    import magpylib

    ball = magpylib.magnet.Sphere(polarization=(0, 0, 1), diameter=0.01)
    return ms.MagpylibField([ball], length_scale=length_scale)


def _solves(s: Sample) -> Iterator[Call]:
    n_v, n_f, n_e = s.mesh.n_vertices, s.mesh.n_faces, s.mesh.n_edges
    magnetic = {
        "scene": s.magnetic,
        "remanent_magnetization": s.magnetization,
        "applied_flux_density": s.field,
        "load_factor": 0.5,
        "gravity_factor": 1.0,
        "field_factor": 0.5,
        "support_factor": 0.5,
    }
    replaced = {
        "thickness": np.full(n_f, 1.1e-3),
        "young_modulus": 1.1e6,
        "poisson_ratio": 0.3,
        "mass_density": None,
        "curvature_scale": np.full(n_e, 1.1),
        "vertex_loads": np.zeros((n_v, 3)),
        "values": {s.clamp: {"displacement": (0, 0, 2e-4)}, s.dipoles: {"moments": [(0, 0, 0.2)]}},
    }
    places = {"positions": s.positions, "edge_rotations": np.zeros(n_e), "body": None}
    yield Call("energies", ms.energies, {**magnetic, **replaced, **places, "by": "face"})
    there = {name: value for name, value in places.items() if name != "body"}
    yield Call("energy", ms.energy, {**magnetic, **replaced, **there})
    yield Call("forces", ms.forces, {**magnetic, **replaced, **there})
    yield Call("hessian", ms.hessian, {**magnetic, **replaced, **there, "reduced": True})
    yield Call("free_motions", ms.free_motions, {"scene": s.magnetic})
    quick = ms.MixedNewton(max_iterations=10, max_relaxation_steps=5)
    search = dict(
        start=s.positions, require_stable=True, ignore_velocity_forces=False, solver=quick, progress=False
    )
    yield Call("equilibrium", ms.equilibrium, {**magnetic, **replaced, **search})
    yield Call(
        "equilibrium of cases",
        ms.equilibrium,
        {**magnetic, "applied_flux_density": [s.field, -s.field], "solver": quick},
    )
    fields = [s.field, -s.field]
    several = {**magnetic, "applied_flux_density": fields, "batch": 2, "threads": 1, "solver": quick}
    yield Call("equilibrium of a batch", ms.equilibrium, several)
    hunt = dict(
        start=s.positions,
        include_unstable=True,
        attempts=1,
        distinct_tolerance=1e-3,
        ignore_velocity_forces=False,
        seed=0,
        solver=quick,
    )
    yield Call("find_equilibria", ms.find_equilibria, {**magnetic, **replaced, **hunt}, cost=3)
    meshes = [s.mesh, s.mesh.refined()]
    yield Call(
        "richardson_extrapolation",
        ms.richardson_extrapolation,
        {"solve": lambda mesh: mesh.size, "meshes": meshes, "order": 2.0},
    )
    yield Call(
        "richardson_extrapolation",
        ms.richardson_extrapolation,
        {"solve": lambda step: 1.0 + step, "time_step": 1e-3, "order": 2.0},
    )
    yield Call("TriangleMesh.refined", s.mesh.refined, {"surface": ms.shapes.ball(1.0)})
    options = {"start": None, "until": None, "first_step": 0.5, "max_step": 0.5, "min_parameter": -1.0}
    yield Call(
        "follow_path",
        ms.follow_path,
        {**magnetic, **options, "max_points": 3, "locate_critical": True, "solver": quick, "progress": False},
        cost=2,
    )
    yield Call("linear_response", ms.linear_response, {**magnetic, "equilibrium": None})
    of_members = {**magnetic, "applied_flux_density": fields, "batch": 2, "threads": 1}
    yield Call("linear_response of a batch", ms.linear_response, of_members)
    yield Call(
        "linear_buckling",
        ms.linear_buckling,
        {**magnetic, "scene": s.pressed, "equilibrium": None, "modes": 1},
        cost=2,
    )
    modes = {"scene": s.scene, "equilibrium": s.rest, "count": 2, "mass": "consistent"}
    yield Call("vibration_modes", ms.vibration_modes, modes, cost=2)
    viscous = {
        "damping": 1e-3,
        "stiffness_damping": 1e-4,
        "maxwell_modulus": (0.1, 0.2),
        "maxwell_time": (1e-2, 0.1),
    }
    motion = {
        **magnetic,
        "applied_flux_density": np.tile(s.field, (3, 1)),
        "steps": 2,
        "time_step": 1e-3,
        **viscous,
        "start": s.positions,
        "velocities": np.zeros((n_v, 3)),
        **replaced,
        "integrator": ms.TRBDF2(),
        "record_every": 1,
        "adjoint_storage": ms.AdjointStorage("stages", memory_budget=1e6),
        "solver": quick,
        "progress": False,
    }
    yield Call("simulate", ms.simulate, motion)
    twice = {"scene": s.scene, "steps": 3, "time_step": 1e-3, "batch": 2, "threads": 1, "progress": False}
    yield Call("simulate a batch", ms.simulate, {**twice, "gravity_factor": [0.5, 1.0]})
    listed = {"scene": s.scene, "steps": 2, "time_step": [1e-3, 2e-3], "progress": False}
    yield Call("simulate in given steps", ms.simulate, listed)
    adaptive = {"interval": 1e-3, "tolerance": 1e-5, "max_halvings": 3}
    yield Call(
        "Adaptive",
        lambda **a: ms.simulate(s.scene, steps=1, time_step=ms.Adaptive(**a), progress=False),
        adaptive,
    )
    yield Call(
        "simulate on",
        ms.simulate,
        {"scene": s.scene, "steps": 1, "time_step": 1e-3, "start": s.state, "progress": False},
    )
    newton = {
        "tolerance": 1e-9,
        "max_iterations": 5,
        "first_load_step": 1.0,
        "min_load_step": 0.1,
        "max_relaxation_steps": 50,
        "max_factorizations": 1000,
    }
    for kind in (ms.Newton, ms.MixedNewton):
        yield Call(kind.__name__, lambda kind=kind, **a: ms.equilibrium(s.scene, solver=kind(**a)), newton)
    yield Call("TRBDF2", ms.TRBDF2, {"implicit_contact": True})
    yield Call(
        "ProjectiveDynamics",
        ms.ProjectiveDynamics,
        {"iterations": 20, "tolerance": 1e-6, "history": 4, "contact": "coulomb"},
    )
    yield Call(
        "WarmStart",
        lambda start, **a: ms.WarmStart(s.magnetic, start=start, solver=quick)(**a),
        {"start": None, **{k: v for k, v in magnetic.items() if k != "scene"}},
    )
    yield Call(
        "WarmStart of a batch",
        lambda start, batch, threads, **a: ms.WarmStart(
            s.magnetic, start=start, solver=quick, batch=batch, threads=threads
        )(**a),
        {"start": None, **{k: v for k, v in of_members.items() if k != "scene"}},
    )
    yield Call("EquilibriumPath.equilibrium", s.path.equilibrium, {"index": 0})
    yield Call("EquilibriumSet", ms.EquilibriumSet, {"cases": [s.rest, s.rest]})
    state = {
        "time": 0.0,
        "state": s.state.state,
        "velocity": s.state.velocity,
        "angle_branches": s.state.angle_branches,
        "acceleration": s.state.acceleration,
    }
    yield Call(
        "MotionState",
        lambda **a: ms.simulate(s.scene, steps=1, time_step=1e-3, start=ms.MotionState(**a), progress=False),
        state,
    )
    yield Call("set_num_threads", ms.set_num_threads, {"count": 1})
    yield Call("random_starts", ms.random_starts, {"count": 3, "lower": (0, 0), "upper": (1, 1), "seed": 0})
    yield Call(
        "multistart",
        ms.multistart,
        {
            "run": math.sqrt,
            "starts": [1.0, 2.0],
            "executor": _one_thread(),
            "workers": None,
            "attempts": 1,
            "feasibility": 1e-6,
            "checkpoint": None,
            "resume": False,
            "progress": False,
        },
    )
    yield Call(
        "study",
        ms.study,
        {
            "function": _root,
            "parameters": {"x": [1.0, 4.0]},
            "executor": _one_thread(),
            "workers": None,
            "attempts": 1,
            "checkpoint": None,
            "resume": False,
            "progress": False,
        },
    )
    yield Call(
        "stream_study",
        ms.stream_study,
        {
            "function": _root,
            "parameters": {"x": [1.0, 4.0]},
            "folder": s.folder / "streamed",
            "executor": _one_thread(),
            "chunk": 2,
            "workers": None,
            "attempts": 1,
            "resume": True,
            "progress": False,
        },
    )
    yield Call("StoredStudy", ms.StoredStudy, {"folder": s.folder / "streamed"})
    bounds = {"x": (1.0, 2.0), "y": (0.1, 10.0)}
    yield Call(
        "latin_hypercube", ms.latin_hypercube, {"count": 3, "bounds": bounds, "logarithmic": "y", "seed": 0}
    )


def _root(x: float) -> float:
    """Return the square root: the function of the studies."""
    return math.sqrt(x)


def _one_thread():
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(1)
