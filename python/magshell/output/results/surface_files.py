"""Surface files (STL and OBJ) of results, for 3D printers and renderers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import quantity
from ..._runtime.files import replace_file
from ...mesh.io.surface_formats import write_obj, write_stl
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.thickened import thickened
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ...model.scene.scene import Scene
from ...model.shells.shell import Shell
from ...model.solids.solid import Solid
from .state import State, states_of, thickness_of

if TYPE_CHECKING:
    from ..._input.kinds import FilePath, Numbers, Shown


_WRITERS = {".stl": write_stl, ".obj": write_obj}
_UNITS = {"m": 1.0, "mm": 1e3}


def write_surface(
    path: FilePath,
    what: Shown,
    *,
    thickness: Numbers | None = None,
    index: int = -1,
    unit: str = "m",
    positions: Numbers | None = None,
) -> None:
    """Write a shape as triangles to a binary STL or an OBJ file, for a 3D printer, a slicer or a renderer.

    path: ends in .stl or .obj.
    what: an Equilibrium, a Trajectory, an EquilibriumPath, an EquilibriumSet, a Scene, a Shell, a Solid or a mesh. Of a
        solid its closed surface is written; faces of quadratic elements become four triangles.
    thickness: None writes the middle surface of shells; "own" uses the shells' thickness; a number or (n_f,) in m is used
        instead of it. A shell with thickness becomes a closed surface: two sides, at half the thickness from the middle
        surface, and walls along the boundary.
    index: the state to write, by default the last.
    unit: of the numbers in the file, "m" or "mm". The formats do not store it: printers expect mm, read_mesh m.
    positions: (n_v, 3) m, instead of those of `what`.

    Each body is a separate closed surface. An existing file is replaced once the new one is complete.

    Raises ValueError on bad input, and, with the face, for a shell whose curvature is too large for its thickness; OSError
    if the file cannot be written.

    >>> import magshell as ms, tempfile
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> rest = ms.equilibrium(ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81)))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.write_surface(f"{folder}/strip.stl", rest, thickness="own", unit="mm")
    ...     ms.read_mesh(f"{folder}/strip.stl").boundary_edges.size
    0
    """
    path = Path(path)
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        raise ValueError(f"cannot write {path.name!r}: the ending must be {' or '.join(_WRITERS)}")
    if unit not in _UNITS:
        raise ValueError(f'unit must be "m" or "mm", got {unit!r}')
    states = states_of(what, positions=positions)
    if isinstance(index, bool) or not isinstance(index, int | np.integer):
        raise ValueError(f"index must be an integer, got {index!r}")
    if not -len(states) <= index < len(states):
        raise ValueError(f"index must be one of {len(states)} states, got {index}")
    state = states[index]
    points, faces = _surface(state, _thickness(what, state, thickness, index))
    replace_file(path, lambda file: write(file, _UNITS[unit] * points, faces))


def _surface(state: State, thickness: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Build the surface of all bodies, one after another: points (n, 3) m, faces (m, 3). thickness: (n_f,) m, or None."""
    parts, vertex, face = [], 0, 0
    for mesh in getattr(state.mesh, "meshes", [state.mesh]):
        there = state.positions[vertex : vertex + mesh.n_vertices]
        own = slice(face, face + mesh.n_faces)
        vertex, face = vertex + mesh.n_vertices, own.stop
        if isinstance(mesh, TetMesh):
            used = mesh.surface_vertices
            parts.append((there[used], np.searchsorted(used, mesh.faces)))
        elif thickness is None:
            parts.append((there, mesh.faces))
        else:
            sheet = mesh.surface if isinstance(mesh, QuadraticTriangleMesh) else mesh
            parts.append(thickened(sheet, there, thickness[own]))
    first = np.cumsum([0, *(len(points) for points, _ in parts)])
    numbered = [faces + before for (_, faces), before in zip(parts, first, strict=False)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(numbered)


def _thickness(what, state: State, given, index: int) -> np.ndarray | None:
    """Return the thickness of all faces, (n_f,) m, or None. Values on the faces of solids are not used."""
    if given is None:
        return None
    n_f = state.mesh.n_faces
    if not isinstance(given, str):
        shape = np.shape(given)
        wanted = shape if shape in ((), (n_f,)) else (n_f,)
        values = quantity("thickness", "m", given, wanted)
        if (values <= 0.0).any():
            raise ValueError(f"thickness [m] must be positive, but the smallest is {np.min(values):g}")
        return np.broadcast_to(values, (n_f,))
    if given != "own":
        raise ValueError(f'thickness must be None, "own", or m, got {given!r}')
    if isinstance(what, TriangleMesh | QuadraticTriangleMesh | TetMesh):
        raise ValueError('thickness="own" is that of a Shell, and a mesh has none: give a number, m')
    if isinstance(what, Shell | Solid):
        bodies = [what]
    elif isinstance(what, Scene):
        bodies = what.bodies
    elif hasattr(what, "_values_at"):
        bodies = what._values_at(index).deformable
    else:
        raise ValueError('thickness="own" needs a result, a Scene or a Shell: give a number, m')
    return thickness_of(bodies)
