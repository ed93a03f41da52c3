"""Functions that write and draw results or read files, with arguments that work, for the fuzzing to spoil."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from fuzz_calls import Call, Sample

import magshell as ms


def file_calls(s: Sample) -> Iterator[Call]:
    yield from _meshes_and_pictures(s)
    shape = {"thickness": 1e-3, "index": 0, "unit": "mm", "positions": s.positions}
    yield Call("write_surface", ms.write_surface, {"path": s.folder / "out.stl", "what": s.mesh, **shape})
    ms.save(s.folder / "rest.npz", s.rest)
    yield Call("save", ms.save, {"path": s.folder / "again.npz", "result": s.rest})
    yield Call("load", ms.load, {"path": s.folder / "rest.npz", "scene": s.rest.scene})
    ms.save_scene(s.folder / "s.scene", s.rest.scene)
    yield Call("save_scene", ms.save_scene, {"path": s.folder / "again.scene", "scene": s.rest.scene})
    yield Call("load_scene", ms.load_scene, {"path": s.folder / "s.scene"})
    yield Call("to_pandas", ms.to_pandas, {"result": s.rest, "per": "state"})
    yield Call("to_xarray", ms.to_xarray, {"result": s.rest})
    yield Call("Probe", ms.Probe, {"name": "tip", "of": np.array([0, 1]), "what": "distance", "body": None})
    twice = ms.EquilibriumSet([s.rest, s.rest])
    curve = {"result": twice, "columns": ["tip.z"], "against": None, "probes": [ms.Probe("tip", [0])]}
    yield Call("plot_history", ms.plot_history, curve, cost=30)
    points = ms.study(lambda a: a, {"a": [1.0, 2.0]}, ThreadPoolExecutor(1), progress=False)
    yield Call("plot_study", ms.plot_study, {"study": points, "outputs": "output", "against": ["a"]}, cost=30)
    table = s.folder / "field.txt"
    table.write_text("\n".join(f"{x} {y} {z} 0 0 {x}" for x in range(3) for y in range(3) for z in range(2)))
    units = {"length_unit": "mm", "flux_density_unit": "mT", "columns": (0, 1, 2, 3, 4, 5)}
    yield Call("SampledField.from_table", ms.SampledField.from_table, {"path": table, **units})
    s.state.save(s.folder / "saved.npz")
    yield Call("MotionState.load", ms.MotionState.load, {"path": s.folder / "saved.npz"})
    yield Call("MotionState.save", s.state.save, {"path": s.folder / "state.npz"})


def _meshes_and_pictures(s: Sample) -> Iterator[Call]:
    n_v, n_f = s.mesh.n_vertices, s.mesh.n_faces
    there = s.folder / "mesh.ply"
    yield Call("read_mesh", ms.read_mesh, {"path": there, "drop_unused": False, "unit": "mm"})
    yield Call("read_fields", ms.read_fields, {"path": there, "drop_unused": False})
    fields = {"vertex_fields": {"u": np.zeros(n_v)}, "face_fields": {"m": np.zeros((n_f, 3))}}
    yield Call(
        "write_mesh",
        ms.write_mesh,
        {"path": s.folder / "out.ply", "mesh": s.mesh, "positions": s.positions, **fields},
    )
    states = {"positions": np.stack([s.positions] * 2), "times": (0.0, 1.0)}
    probes = {"what": s.rest, "probes": [ms.Probe("tip", [0])]}
    series = {"path": s.folder / "probed.pvd", **probes, "progress": False}
    yield Call("write_series of probes", ms.write_series, series, cost=3)
    page = {"path": s.folder / "probed.html", **probes}
    yield Call("write_page of probes", ms.write_page, page, cost=10)
    yield Call(
        "write_series",
        ms.write_series,
        {
            "path": s.folder / "out.pvd",
            "what": s.mesh,
            **states,
            "velocities": np.zeros((2, n_v, 3)),
            "vertex_fields": {"u": np.zeros((2, n_v))},
            "face_fields": {"m": np.zeros((2, n_f, 3))},
            "progress": False,
        },
        cost=3,
    )
    painted = ms.Style(backend="matplotlib")
    look = {
        "remanent_magnetization": None,
        "applied_flux_density": None,
        "view": None,
    }
    yield Call("AdjointStorage", ms.AdjointStorage, {"what": "stages", "memory_budget": 1e6})
    yield Call("View", ms.View, {"elevation": 20.0, "azimuth": 30.0, "frame": [(0, 0, 0), (1, 1, 1)]})
    color = {
        "values": np.zeros(n_f),
        "label": "u",
        "range": (0.0, 1.0),
        "scale": "diverging",
        "names": {0: "low"},
    }
    yield Call("Color", lambda **a: ms.plot(s.mesh, color=ms.Color(**a), style=painted), color, cost=30)
    shown = ("show_field", "rest", "mesh_lines", "ticks", "thickness")
    style = {"arrows": 3, **dict.fromkeys(shown, True), "contacts": False, "backend": "matplotlib"}
    yield Call("Style", ms.Style, style)
    yield Call(
        "plot",
        ms.plot,
        {
            "what": s.mesh,
            "positions": s.positions,
            **look,
            "color": np.zeros(n_f),
            "width": 400,
            "columns": 1,
            "style": painted,
        },
        cost=30,
    )
    yield Call(
        "write_page",
        ms.write_page,
        {
            "what": s.mesh,
            "path": s.folder / "out.html",
            **states,
            **look,
            "obstacles": (),
            "color": None,
            "size_limit": 1e7,
        },
        cost=10,
    )
    yield Call(
        "animate",
        ms.animate,
        {
            "what": s.mesh,
            "path": s.folder / "out.gif",
            **states,
            **look,
            "fps": 5.0,
            "speed": 1.0,
            "width": 400,
            "style": painted,
            "progress": False,
        },
        cost=60,
    )
    arguments = {"what": s.mesh, **states, **look}
    yield Call("show", lambda **a: ms.show(**a, browser=False).close(), arguments, cost=100)
    moving = {name: value for name, value in arguments.items() if name != "view"}
    moving |= {"obstacles": (), "color": None, "speed": 1.0}
    yield Call("write_gltf", ms.write_gltf, {"path": s.folder / "out.glb", **moving}, cost=5)
    yield Call("write_usd", ms.write_usd, {"path": s.folder / "out.usda", **moving, "fps": 5.0}, cost=5)
