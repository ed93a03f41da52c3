"""Meshes of tetrahedra, their generators and shapes with arguments that work, for the fuzzing to spoil."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from fuzz_calls import Call, Sample
from solid_materials import SAMPLES

import magshell as ms
from magshell import meshes, shapes

POINT = (0.1, 0.0, 0.0)


def solid_calls(s: Sample) -> Iterator[Call]:
    yield from _generators(s)
    yield from _shapes()
    yield from _solids()
    yield from _muscles()
    yield from _actuators()
    block = meshes.box((1.0, 1.0, 1.0), cells=(2, 1, 1))
    parts = np.arange(block.n_tetrahedra) % 2
    given = {"rest_positions": block.rest_positions, "tetrahedra": block.tetrahedra, "parts": parts}
    given["part_names"] = {"odd": 1}
    flat = ms.meshes.rectangle(0.1, 0.05, cells=(3, 2))
    six = ms.QuadraticTriangleMesh.from_triangles(flat)
    yield Call(
        "QuadraticTriangleMesh",
        ms.QuadraticTriangleMesh,
        {"rest_positions": six.rest_positions, "elements": six.elements},
    )
    yield Call(
        "QuadraticTriangleMesh.from_triangles",
        ms.QuadraticTriangleMesh.from_triangles,
        {"mesh": flat, "project": lambda points: points},
    )
    yield Call(
        "QuadraticTriangleMesh.from_triangles with a finer mesh",
        ms.QuadraticTriangleMesh.from_triangles,
        {"mesh": flat, "surface": flat},
    )
    yield Call("QuadraticTriangleMesh.refined", six.refined, {"project": lambda points: points})
    yield Call(
        "QuadraticTriangleMesh.transformed",
        six.transformed,
        {"rotation": np.eye(3), "translation": (1, 0, 0)},
    )
    yield Call("TetMesh", ms.TetMesh, given)
    ten = block.second_order()
    yield Call(
        "TetMesh of ten", ms.TetMesh, {"rest_positions": ten.rest_positions, "tetrahedra": ten.tetrahedra}
    )
    yield Call("TetMesh.repaired", ms.TetMesh.repaired, {**given, "merge_tolerance": 1e-6})
    yield Call("TetMesh.with_parts", block.with_parts, {"parts": parts, "names": {"odd": 1}})
    yield Call("TetMesh.transformed", block.transformed, {"rotation": np.eye(3), "translation": (1, 0, 0)})
    yield Call("TetMesh.scaled", block.scaled, {"factor": 2.0})
    yield Call("TetMesh.second_order", block.second_order, {"surface": shapes.ball(1.0)})
    yield Call("TetMesh.refined", block.refined, {"surface": shapes.ball(1.0)})
    yield Call("TetMesh.tetrahedra_at", block.tetrahedra_at, {"x": 0.0, "tolerance": 1e-6})
    left = {"predicate": lambda points: points[:, 0] < 0.5}
    yield Call("TetMesh.tetrahedra_where", block.tetrahedra_where, left)
    named = block.with_parts(parts, names={"odd": 1})
    for select in (named.tetrahedra_in, named.vertices_in, named.faces_in):
        yield Call(f"TetMesh.{select.__name__}", select, {"group": "odd"})
    yield Call("TetQuality.worst", block.quality.worst, {"count": 2})
    apart = block.transformed(translation=(1.0, 0, 0))
    yield Call(
        "weld of solids",
        lambda meshes, tolerance: ms.weld(*meshes, tolerance=tolerance),
        {"meshes": [block, apart], "tolerance": 1e-6},
    )
    fields = {
        "vertex_fields": {"u": np.zeros(block.n_vertices)},
        "tetrahedron_fields": {"J": np.zeros((block.n_tetrahedra, 3))},
    }
    path = s.folder / "solid.vtu"
    yield Call(
        "write_mesh",
        ms.write_mesh,
        {"path": path, "mesh": block, "positions": block.rest_positions, **fields},
    )


def _generators(s: Sample) -> Iterator[Call]:
    box = {"size": (1.0, 1.0, 1.0), "cells": (2, 1, 1), "diagonals": "alternating", "order": 1}
    yield Call("meshes.box", meshes.box, box)
    yield Call("meshes.ball", meshes.ball, {"radius": 1.0, "cells": 2, "order": 2}, cost=2)
    bar = {"radius": 1.0, "length": 1.0, "cells": (2, 1), "order": 1}
    yield Call("meshes.solid_cylinder", meshes.solid_cylinder, bar)
    tube = {"inner_radius": 1.0, "outer_radius": 2.0, "length": 1.0, "angle": 1.0, "cells": (1, 2, 1)}
    yield Call("meshes.tube", meshes.tube, {**tube, "diagonals": "crossed", "order": 2})
    plate = {"sheet": s.mesh, "height": 0.1, "layers": 1, "order": 1}
    yield Call("meshes.extruded", meshes.extruded, plate)
    stuffed = {"shape": shapes.ball(1.0), "spacing": 0.5, "bounds": [(-1.0, -1, -1), (1.0, 1, 1)], "order": 1}
    yield Call("meshes.from_distance", meshes.from_distance, stuffed, cost=4)
    wanted = {"shape": shapes.ball(1.0), "n_tetrahedra": 300}
    yield Call("meshes.from_distance of a number", meshes.from_distance, wanted, cost=10)
    closed = {"surface": meshes.box((1.0, 1.0, 1.0), cells=(2, 2, 2)).surface, "size": 0.5, "order": 1}
    yield Call("meshes.tetrahedralize", meshes.tetrahedralize, closed, cost=20)


def _actuators() -> Iterator[Call]:
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(2, 1, 1))
    solid = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), element="linear")
    sheet = ms.Shell(mesh.surface, thickness=1e-3, young_modulus=1e6)

    def acting(body, kind):
        return lambda **a: ms.Scene(body, actuators=[kind(body, **a)], allow_rigid_motions=True)

    around = {"faces": np.arange(mesh.n_faces), "close_rims": False}
    gas = {"gas_pressure": 1e5, "outside_pressure": 1e5}
    yield Call("Cavity", acting(sheet, ms.Cavity), {**around, "pressure": 1e3})
    yield Call("Cavity of gas", acting(sheet, ms.Cavity), {**around, **gas})
    yield Call("Cavity of liquid", acting(sheet, ms.Cavity), {**around, "volume": 1e-4, "bulk_modulus": 1e5})
    groups = np.arange(mesh.n_tetrahedra) % 2
    yield Call(
        "PneumaticCells",
        acting(solid, ms.PneumaticCells),
        {"groups": groups, "stiffness": 1e4, "volume_ratio": [1.1, 0.9]},
    )
    path = [(0.01, 0.01, 0.01), (0.05, 0.01, 0.015), (0.09, 0.01, 0.01)]
    spring = {"tension": 1.0, "stiffness": 10.0, "rest_length": 0.05, "smoothing": 1e-3, "sliding": True}

    def tendon(body, points, **a):
        return ms.Tendon(points, body, **a)

    yield Call("Tendon", acting(solid, tendon), {"points": path, **spring})


def _shapes() -> Iterator[Call]:
    points = np.random.default_rng(0).normal(size=(5, 3))
    ball, other = shapes.ball(1.0).named("a"), shapes.box((1.0, 1.0, 1.0))

    def probed(kind):
        def probe(**arguments):
            shape = kind(**arguments)
            shape(points)
            shape.nearest(points)
            return repr(shape), shape.bounds

        return probe

    makers = {
        "ball": {"radius": 1.0, "center": POINT},
        "capsule": {"start": POINT, "end": (1.0, 0, 0), "radius": 0.2, "end_radius": 0.1},
        "box": {"size": (1.0, 1.0, 1.0), "center": POINT, "rounding": 0.1},
        "cylinder": {"start": POINT, "end": (1.0, 0, 0), "radius": 0.2},
        "half_space": {"normal": (0.0, 0, 1.0), "point": POINT},
        "ellipsoid": {"radii": (1.0, 0.5, 0.2), "center": POINT},
    }
    for name, arguments in makers.items():
        yield Call(f"shapes.{name}", probed(getattr(shapes, name)), arguments)

    def of_several(kind):
        return lambda several, **more: probed(lambda: kind(*several, **more))()

    for name in ("union", "intersection", "difference"):
        yield Call(f"shapes.{name}", of_several(getattr(shapes, name)), {"several": [ball, other]})
    yield Call(
        "shapes.smooth_union", of_several(shapes.smooth_union), {"several": [ball, other], "radius": 0.1}
    )
    yield Call("Shape.smooth_union", of_several(ball.smooth_union), {"several": [other], "radius": 0.1})
    yield Call("Shape", ball, {"points": points})
    yield Call("Shape.named", ball.named, {"name": "b"})
    yield Call("Shape.translated", probed(ball.translated), {"translation": POINT})
    yield Call("Shape.rotated", probed(ball.rotated), {"rotation": np.eye(3), "center": POINT})
    yield Call("Shape.scaled", probed(ball.scaled), {"factor": 2.0})
    yield Call("Shape.offset", probed(ball.offset), {"distance": 0.1})
    yield Call("Shape.hollow", probed(ball.hollow), {"thickness": 0.1})


def _solids() -> Iterator[Call]:
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(2, 1, 1))
    moduli = {"young_modulus": 1e5, "poisson_ratio": 0.45}
    solid = {"mesh": mesh, "mass_density": 1e3, "element": "quadratic", "mean_volume": True}
    skin = {"thickness": 1e-3, "faces": [0, 3], "remanent_magnetization": (1e4, 0, 0)}
    magnetized = {"skin": ms.Skin(**skin), "remanent_magnetization": (1e4, 0, 0)}
    yield Call("Solid", ms.Solid, {**solid, **magnetized, "material": ms.NeoHookean(**moduli)})
    yield Call("Skin", lambda **a: ms.Solid(mesh, material=ms.NeoHookean(**moduli), skin=ms.Skin(**a)), skin)
    for sample in SAMPLES.values():
        yield Call(sample.make.__name__, sample.make, {**sample.options, **sample.constants})


def _muscles() -> Iterator[Call]:
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(2, 1, 1))
    body = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), element="linear")
    pins = [ms.Pin(mesh.vertices_at(x=0.0))]
    line = {"line": [(0, 0.01, 0.01), (0.1, 0.01, 0.01)], "body": body, "reach": 0.01}
    yield Call("fibres_along", ms.fibres_along, {**line, "elements": np.arange(12)})
    some = {"elements": [0, 3], "directions": np.ones((2, 3)), "weights": (1.0, 0.5)}
    yield Call("Fibres", ms.Fibres, {**some, "coordinates": (0.0, 0.05), "length": 0.1})

    def pulled(**arguments):
        muscle = ms.Muscle(**arguments)
        return ms.Scene(body, supports=pins, actuators=[muscle]), muscle.places

    common = {"body": body, "fibres": ms.fibres_along(**line), "activation": 0.5, "segments": 3}
    yield Call("Muscle", pulled, {**common, "stiffness": 1e4, "weights": 1.0})
    table = [(0.5, 0.2), (1.0, 1.0), (1.5, 0.2)]
    hill = {"peak_stress": 1e4, "force_length": table, "passive": table, "shortening_rate": 1.0}
    hill["force_velocity"] = [(-1, 0.0), (0, 1), (1, 1.5)]
    yield Call("Muscle of Hill's", pulled, {**common, **hill})
    one = {"body": body, "fibres": (1, 0, 0), "elements": [0, 1], "stiffness": 1e4}
    yield Call("Muscle in some", lambda **a: repr(ms.Muscle(**a)), one)
