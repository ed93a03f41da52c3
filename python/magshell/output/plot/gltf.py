"""The function ms.write_gltf, which writes states as a binary glTF file with morph targets."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ..._runtime.files import check_replaceable, replace_file
from ..._runtime.solver_entry_point import grouped
from .moving_parts import Motion, Part, moving_parts
from .style import Color

if TYPE_CHECKING:
    from ..._input.kinds import Fielded, FilePath, Numbers, Shown
    from ...model.contact.obstacles.obstacle import Obstacle

MOST_STATES = 200  # the weights of an animation grow with the square of their number
# Numbers of the glTF 2.0 specification
_FLOAT, _UNSIGNED_INT, _ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 5126, 5125, 34962, 34963
_Z_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # quaternion (x, y, z, w) from z up to the y up of glTF
_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942


@grouped(color=Color)
def write_gltf(
    path: FilePath,
    what: Shown,
    *,
    positions: Numbers | None = None,
    times: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    field: Fielded | None = None,
    obstacles: Obstacle | Sequence[Obstacle] | None = None,
    color: Any = "auto",
    speed: float | None = None,
) -> Path:
    """Write bodies as a binary glTF file for the web, presentations and game engines, with an animation of the states.

    The bodies, obstacles, magnets, links, tendons and rigid bodies are meshes in metres, turned to glTF's y up. Each state
    after the first one is a morph target, and an animation runs through them; between states points move along straight
    lines. Points have single precision. Colours are those of the last state, because viewers do not animate colours.

    path: ends in .glb.
    what, color: as in `plot`; at most 200 states, of one mesh.
    positions, times, remanent_magnetization, applied_flux_density, field, obstacles: as in `animate`.
    speed: seconds of the motion per second of the animation, by default as in `animate`. States without times are shown at
        ten per second.

    An existing file is replaced once the new one is complete. Raises ValueError on bad input, OSError if the file cannot be
    written.

    >>> import magshell as ms, numpy as np, tempfile
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> rising = np.stack([mesh.rest_positions + np.array([0, 0, height]) for height in (0, 0.01)])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.write_gltf(f"{folder}/rise.glb", mesh, positions=rising).name
    'rise.glb'
    """
    path = Path(path)
    if path.suffix.lower() != ".glb":
        raise ValueError(f"cannot write {path.name!r}: the ending must be .glb")
    check_replaceable(path)
    motion = moving_parts(
        what,
        positions=positions,
        times=times,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
        obstacles=obstacles,
        color=color,
        speed=speed,
    )
    if len(motion.times) > MOST_STATES:
        raise ValueError(
            f"a glTF file has at most {MOST_STATES} states, got {len(motion.times)}: record fewer (record_every=), "
            "or write USD"
        )
    document = _Document(motion)
    replace_file(path, document.write)
    return path


class _Document:
    """The JSON part and the binary part of a file."""

    def __init__(self, motion: Motion):
        self._bytes: list[bytes] = []
        self._length = 0
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        meshes, nodes, materials, channels, samplers = [], [], [], [], []
        moving = len(motion.times) > 1 and motion.times[-1] > motion.times[0]
        clock = self._array(motion.times.astype(np.float32), "SCALAR", ends=True) if moving else None
        for number, part in enumerate(motion.parts):
            materials.append(_material(part))
            meshes.append(self._mesh(part, number))
            nodes.append({"name": part.name, "mesh": number})
            if clock is not None and len(part.points) > 1:
                weights = np.eye(len(part.points), dtype=np.float32)[:, 1:]
                output = self._array(weights.ravel(), "SCALAR")
                channels.append({"sampler": len(samplers), "target": {"node": number, "path": "weights"}})
                samplers.append({"input": clock, "output": output, "interpolation": "LINEAR"})
        nodes.append({"name": "z up", "rotation": _Z_UP, "children": list(range(len(meshes)))})
        self._json: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "magshell"},
            "scene": 0,
            "scenes": [{"nodes": [len(meshes)]}],
            "nodes": nodes,
            "meshes": meshes,
            "materials": materials,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": self._length}],
        }
        if channels:
            self._json["animations"] = [{"name": "states", "channels": channels, "samplers": samplers}]

    def write(self, file: BinaryIO) -> None:
        """Write the header, the JSON chunk and the binary chunk."""
        text = json.dumps(self._json, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + self._length
        file.write(np.array([_MAGIC, 2, total, len(text), _JSON], "<u4").tobytes() + text)
        file.write(np.array([self._length, _BIN], "<u4").tobytes() + b"".join(self._bytes))

    def _mesh(self, part: Part, material: int) -> dict[str, Any]:
        """Return the mesh of a part; colours of faces need vertices of their own for each face."""
        points, faces, shades = part.points, part.faces, np.array(part.colors[-1], dtype=float)
        if len(shades) == len(faces):
            points, shades = points[:, faces.ravel()], np.repeat(shades, 3, axis=0)
            faces = np.arange(faces.size).reshape(-1, 3)
        points = points.astype(np.float32)
        primitive: dict[str, Any] = {
            "attributes": {
                "POSITION": self._array(points[0], "VEC3", _ARRAY_BUFFER, ends=True),
                "COLOR_0": self._array(_linear(shades).astype(np.float32), "VEC3", _ARRAY_BUFFER),
            },
            "indices": self._array(faces.ravel().astype(np.uint32), "SCALAR", _ELEMENT_ARRAY_BUFFER),
            "material": material,
            "mode": 4,
        }
        if len(points) > 1:
            moved = points[1:] - points[0]
            primitive["targets"] = [
                {"POSITION": self._array(each, "VEC3", _ARRAY_BUFFER, ends=True)} for each in moved
            ]
            return {"name": part.name, "primitives": [primitive], "weights": [0.0] * len(moved)}
        return {"name": part.name, "primitives": [primitive]}

    def _array(self, array: np.ndarray, kind: str, target: int | None = None, ends: bool = False) -> int:
        """Append an array and return the number of its accessor. ends: store its smallest and largest values."""
        data = np.ascontiguousarray(array).tobytes()
        view = {"buffer": 0, "byteOffset": self._length, "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self._views.append(view)
        self._bytes.append(data)
        self._length += len(data)  # of four bytes each, so that every view begins at a multiple of four
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": _UNSIGNED_INT if array.dtype == np.uint32 else _FLOAT,
            "count": len(array),
            "type": kind,
        }
        if ends:
            rows = array.reshape(len(array), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self._accessors.append(accessor)
        return len(self._accessors) - 1


def _material(part: Part) -> dict[str, Any]:
    rough = {"metallicFactor": 0.0, "roughnessFactor": 0.8, "baseColorFactor": [1.0, 1.0, 1.0, part.opacity]}
    found: dict[str, Any] = {"name": part.name, "doubleSided": True, "pbrMetallicRoughness": rough}
    return found if part.opacity == 1.0 else found | {"alphaMode": "BLEND"}


def _linear(shades: np.ndarray) -> np.ndarray:
    """Convert colours of the screen (sRGB) to the linear ones of glTF."""
    return np.where(shades <= 0.04045, shades / 12.92, ((shades + 0.055) / 1.055) ** 2.4)
