"""What writes results and reads tables, with arguments that work, for the fuzzing to spoil."""

from __future__ import annotations

from collections.abc import Iterator

from fuzz_calls import Call, Sample

import magshell as ms


def file_calls(s: Sample) -> Iterator[Call]:
    shape = {"thickness": 1e-3, "index": 0, "unit": "mm", "positions": s.positions}
    yield Call("write_surface", ms.write_surface, {"path": s.folder / "out.stl", "what": s.mesh, **shape})
    ms.save(s.folder / "rest.npz", s.rest)
    yield Call("save", ms.save, {"path": s.folder / "again.npz", "result": s.rest})
    yield Call("load", ms.load, {"path": s.folder / "rest.npz", "scene": s.rest.scene})
    yield Call("to_pandas", ms.to_pandas, {"result": s.rest, "per": "state"})
    yield Call("to_xarray", ms.to_xarray, {"result": s.rest})
    table = s.folder / "field.txt"
    table.write_text("\n".join(f"{x} {y} {z} 0 0 {x}" for x in range(3) for y in range(3) for z in range(2)))
    units = {"length_unit": "mm", "flux_density_unit": "mT", "columns": (0, 1, 2, 3, 4, 5)}
    yield Call("SampledField.from_table", ms.SampledField.from_table, {"path": table, **units})
    s.state.save(s.folder / "saved.npz")
    yield Call("MotionState.load", ms.MotionState.load, {"path": s.folder / "saved.npz"})
    yield Call("MotionState.save", s.state.save, {"path": s.folder / "state.npz"})
