"""Reading and writing of meshes, with fields on them."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from ..._input.arrays import index_array, named_values
from ..._input.path_first import check_path_first
from ..._input.quantity import quantity, shape_of
from ..._input.tensors import detached
from ..._runtime.files import replacing
from ..._runtime.solver_entry_point import grouped
from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshGroupWarning, UnitWarning
from ..connected import connected_groups
from ..groups import counts, renumbered
from ..selection import RELATIVE_TOLERANCE
from ..tetrahedra.tet_mesh import TetMesh
from ..triangles.six_node_mesh import QuadraticTriangleMesh
from ..triangles.triangle_mesh import TriangleMesh, checked_mesh
from .file_counts import check_counts
from .group_cells import side_group_fields, vertex_group_fields, with_group_cells
from .inp import read_inp
from .msh import check_names, write_msh
from .named_groups import (
    Named,
    check_no_group_field,
    drop_group_fields,
    groups_of_meshio,
    lost_members,
    warn_of_left_out,
)
from .ply import read_ply, write_ply
from .surface_formats import TriangleContent, read_obj, solids_of_stl
from .tetrahedra import TetContent, TetFields, cell_data_of, cells_of, tetrahedra_of

if TYPE_CHECKING:
    from ..._input.kinds import FilePath, Numbers


_MESHIO_MODULES = {".stl": "stl", ".vtu": "vtu", ".vtk": "vtk", ".msh": "gmsh"}
_READABLE = (".obj", ".ply", ".inp", *_MESHIO_MODULES)
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}  # m
# [m] Sizes of a mesh beyond these limits are taken as a wrong unit of the file; test_sizes_of_a_wrong_unit_are_warned_of.
_PLAUSIBLE_SIZES = (1e-5, 3.0)
_WRITERS = (".vtu", ".msh", ".ply")
_LOWER_CELLS = ("vertex", "line", "line3")  # gmsh writes them in addition to the surface
_TRIANGLES = ("triangle", "triangle6")


class Fields(NamedTuple):
    """The fields in a file of triangles: `vertex` name -> (n_v,) or (n_v, k), `face` name -> (n_f,) or (n_f, k)."""

    vertex: dict[str, np.ndarray]
    face: dict[str, np.ndarray]


@grouped()
def read_mesh(path: FilePath, drop_unused: bool = False, unit: str = "m") -> TriangleMesh | Any:
    """Read a mesh from an OBJ, PLY, Abaqus INP, STL, VTU, legacy VTK or gmsh MSH file (the last four need the extra `io`).

    Returns a TetMesh if the file has tetrahedra, a QuadraticTriangleMesh if it has triangles of six points (gmsh's second
    order), and otherwise a TriangleMesh.

    None of the formats stores the unit, and CAD programs often write mm: then give `unit`. Points with two coordinates get
    z = 0. An STL file stores each triangle separately: corners within 1e-6 of the mesh's size become one vertex.

    Tetrahedra have 4 or 10 points; triangles and lines in the same file without a name are ignored. Names become groups of
    the mesh (`mesh.faces_in("FIXED")`): gmsh's physical groups of points, curves and surfaces, the sets and surfaces of an
    INP file, the solids of an STL file in text, the groups of an OBJ file, and the groups that `write_mesh` writes. Those of
    gmsh without a name are called "point 7", "curve 7" and "surface 7". gmsh's physical groups of volumes become parts with
    their names; an integer cell field `part` becomes parts as well.

    Args:
        path: the file; its ending determines the format.
        drop_unused: drop points that no triangle, or no tetrahedron, uses, instead of raising an error.
        unit: the unit of the coordinates in the file: "m", "cm", "mm", "um" or "inch".

    Warns:
        MeshGroupWarning: once, of all that is not read: keywords of an INP file, members of groups that are not in the mesh.
        UnitWarning: if the mesh is larger than 3 m or smaller than 10 um.

    Raises:
        FileNotFoundError: if there is no such file.
        ValueError: for an unknown ending, a file that cannot be read, that has other faces than triangles or none,
            or whose mesh is refused by `TriangleMesh` or `TetMesh`.
        ImportError: if meshio is needed and not installed.

    >>> import magshell as ms, tempfile
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.write_mesh(f"{folder}/sheet.ply", mesh)
    ...     ms.read_mesh(f"{folder}/sheet.ply").n_faces
    40
    """
    if not isinstance(unit, str) or unit not in UNITS:
        raise ValueError(f"unit must be one of {', '.join(map(repr, UNITS))}, got {unit!r:.60}")
    mesh, _, left_out = _read(path, drop_unused)
    warn_of_left_out(Path(path), left_out)
    mesh = mesh if unit == "m" else mesh.scaled(UNITS[unit])
    if not _PLAUSIBLE_SIZES[0] <= mesh.size <= _PLAUSIBLE_SIZES[1]:
        warnings.warn(
            f"the mesh of {Path(path).name!r} has a size of {mesh.size:.3g} m with unit={unit!r}: if its coordinates are in "
            f"another unit, give read_mesh(..., unit=...), one of {', '.join(map(repr, UNITS))}",
            UnitWarning,
            stacklevel=callers_level(),
        )
    return mesh


def read_fields(path: FilePath, drop_unused: bool = False) -> Fields | TetFields:
    """Read the fields in a file, on the vertices and faces, or tetrahedra, of `read_mesh` with the same arguments.

    path, drop_unused: as in `read_mesh`.

    >>> import magshell as ms, tempfile
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.write_mesh(f"{folder}/sheet.ply", mesh, vertex_fields={"height": mesh.rest_positions[:, 2]})
    ...     list(ms.read_fields(f"{folder}/sheet.ply").vertex)
    ['height']
    """
    _, fields, left_out = _read(path, drop_unused)
    warn_of_left_out(Path(path), left_out)
    return fields


def write_mesh(
    path: FilePath,
    mesh: TriangleMesh | QuadraticTriangleMesh | TetMesh,
    positions: Numbers | None = None,
    vertex_fields: Mapping[str, Numbers] | None = None,
    face_fields: Mapping[str, Numbers] | None = None,
    tetrahedron_fields: Mapping[str, Numbers] | None = None,
) -> None:
    """Write a mesh to a VTU file (needs the extra `io`), gmsh's MSH or, for three-node triangles, a binary PLY file.

    Args:
        path: the file, which ends in .vtu, .msh (format 4.1, in text, without fields) or .ply.
        mesh: the mesh to write. The parts of tetrahedra are written as the cell field `part`, their names as fields of zeros
            and ones, `part:` and the name. Fields on the faces of a solid are written with the mesh's `surface`. The curved
            elements of a QuadraticTriangleMesh are written, and `face_fields` belong to them; fields on its flat faces are
            written with its `surface` as well.
            Named groups are written as fields of zeros and ones, `group:` and the name; a VTU file gets cells for edges
            and for faces of a solid in groups, where other fields are NaN or -1. PLY has no groups of edges. An MSH file
            has physical groups with these names, and with those of the parts.
        positions: (n_v, 3), m, the positions to write instead of the rest positions.
        vertex_fields: name -> (n_v,) or (n_v, k).
        face_fields: name -> (n_f,) or (n_f, k).
        tetrahedron_fields: name -> (n_t,) or (n_t, k).

    Raises:
        ValueError: for an unknown ending, wrong shapes, or names with spaces or one of " < > &.
        OSError: if the file cannot be written; an existing file then stays as it was.

    >>> import magshell as ms, tempfile
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.write_mesh(f"{folder}/sheet.ply", mesh, vertex_fields={"height": mesh.rest_positions[:, 2]})
    ...     ms.read_mesh(f"{folder}/sheet.ply").n_faces
    40
    """
    check_path_first("write_mesh(path, mesh)", path, mesh)
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in _WRITERS:
        other = "; write_surface writes .stl and .obj" if ending in (".stl", ".obj") else ""
        raise ValueError(
            f"cannot write {path.name!r}: the ending must be one of {', '.join(_WRITERS)}{other}"
        )
    solid, six = isinstance(mesh, TetMesh), isinstance(mesh, QuadraticTriangleMesh)
    if not (solid or six or isinstance(mesh, TriangleMesh)) and hasattr(mesh, "surface"):
        raise ValueError(
            "mesh is that of several bodies, some of tetrahedra: write all of them by write_series, or the mesh of one "
            "body, result[body].mesh"
        )
    if six and ending == ".ply":
        raise ValueError("PLY holds no triangles of six nodes: write .vtu, or the mesh's `surface`")
    points = mesh.rest_positions if solid or six else checked_mesh(mesh).rest_positions
    if positions is not None:
        points = quantity("positions", "m", detached(positions), (mesh.n_vertices, 3))
    _refuse_misplaced(solid, ending, face_fields, tetrahedron_fields)
    if ending == ".msh":
        if vertex_fields or face_fields or tetrahedron_fields:
            raise ValueError("fields are not written to MSH: write .vtu")
        check_names(mesh)
        write_msh(path, mesh, points)
        return
    on_vertices = _checked_fields("vertex", vertex_fields, mesh.n_vertices) | vertex_group_fields(mesh)
    if solid:
        on_cells = _checked_fields("tetrahedron", tetrahedron_fields, mesh.n_tetrahedra)
        cells, cell_data = cells_of(mesh), cell_data_of(mesh, on_cells)
    else:
        on_faces = _checked_fields("face", face_fields, mesh.n_elements)
        cells = [(_TRIANGLES[mesh.order - 1], mesh.elements)]
        cell_data = {name: [values] for name, values in on_faces.items()}
    if ending == ".ply":
        if lost := [name for name, group in mesh._groups.items() if len(group.edges)]:
            warnings.warn(
                f"PLY holds no groups of edges: {', '.join(map(repr, lost))} are not in {path.name!r}; write .vtu",
                MeshGroupWarning,
                stacklevel=callers_level(),
            )
        write_ply(path, points, mesh.faces, on_vertices, on_faces | side_group_fields(mesh))
        return
    with_group_cells(mesh, cells, cell_data, solid)
    write_cells(path, points, cells, on_vertices, cell_data)


def write_cells(
    path: Path,
    points: Numbers,
    cells: list[Any],
    on_vertices: dict[Any, Any],
    cell_data: dict[str, list[Any]],
) -> None:
    """Write a VTU file without further checks.

    cells: [(meshio's name of a kind of cell, rows)]. cell_data: name -> [the values for each entry of `cells`].
    """
    meshio = _meshio("vtu")
    content = _meshio().Mesh(points, cells, point_data=on_vertices, cell_data=cell_data)
    with replacing(path) as part:
        meshio.write(part, content)


def _refuse_misplaced(solid: bool, ending: str, face_fields, tetrahedron_fields) -> None:
    """Raise ValueError for a kind of mesh that the format cannot store, and for fields on cells that the mesh lacks."""
    if solid and ending == ".ply":
        raise ValueError("PLY holds no tetrahedra: write .vtu, or the mesh's `surface`")
    if solid and face_fields:
        raise ValueError(
            "face_fields: a file of tetrahedra has no faces; write those of the mesh's `surface`"
        )
    if not solid and tetrahedron_fields:
        raise ValueError("tetrahedron_fields: a TriangleMesh has no tetrahedra")


def _read(path, drop_unused: bool) -> tuple[Any, Any, list[str]]:
    """Read a file as (mesh, fields, what of the file is not read)."""
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in _READABLE:
        raise ValueError(f"cannot read {path.name!r}: the ending must be one of {', '.join(_READABLE)}")
    if not path.is_file():
        raise FileNotFoundError(f"no file {str(path)!r}")
    reader = {".obj": read_obj, ".ply": _read_ply, ".inp": _read_inp}.get(ending, _read_with_meshio)
    try:
        found = reader(path)
    except ImportError:
        raise
    except Exception as error:  # readers may raise any error for an invalid file
        raise ValueError(f"cannot read {str(path)!r} as {ending[1:].upper()}: {_reason(error)}") from error
    mesh, fields = (
        _solid(path, found, drop_unused)
        if isinstance(found, TetContent)
        else _sheet(path, found, drop_unused)
    )
    kept = mesh._existing(found.named.groups)
    left_out = found.named.left_out + lost_members(found.named.groups, kept)
    kept = {name: group for name, group in kept.items() if counts(group)}
    return mesh._with_members(kept), fields, left_out


def _sheet(
    path: Path, found: TriangleContent, drop_unused: bool
) -> tuple[TriangleMesh | QuadraticTriangleMesh, Fields]:
    """Build the mesh of triangles and its fields from the content of a file."""
    if len(found.faces) == 0:
        saved = (
            ": gmsh writes only members of physical groups once there is one, so add one of the surfaces"
            if path.suffix.lower() == ".msh"
            else ""
        )
        raise ValueError(f"{str(path)!r} holds no triangles{saved}")
    found.faces = index_array(f"the faces of {str(path)!r}", found.faces)
    if found.points.shape[1] == 2:
        found.points = np.column_stack([found.points, np.zeros(len(found.points))])
    found.take_groups()
    if path.suffix.lower() == ".stl":
        _merge_coincident(found)
    faces = _used(path, "triangle", found, found.faces, drop_unused)
    try:
        mesh = (TriangleMesh if faces.shape[1] == 3 else QuadraticTriangleMesh)(found.points, faces)
    except ValueError as error:
        raise ValueError(f"{str(path)!r}: {error}") from error
    return mesh, Fields(found.vertex_fields, found.face_fields)


def _reason(error: Exception) -> str:
    """Return the reason why a file could not be read; the text of some readers' errors does not suffice alone."""
    text = str(error)
    if text and not isinstance(error, LookupError | TypeError | AssertionError | AttributeError):
        return text
    return f"its contents do not fit together ({type(error).__name__}{': ' + text if text else ''})"


def _solid(path: Path, found: TetContent, drop_unused: bool) -> tuple[TetMesh, TetFields]:
    """Build the mesh of tetrahedra and its fields from the content of a file."""
    nodes = index_array(f"the tetrahedra of {str(path)!r}", found.tetrahedra)
    found.tetrahedra = _used(path, "tetrahedron", found, nodes, drop_unused)
    try:
        return found.build()
    except ValueError as error:
        raise ValueError(f"{str(path)!r}: {error}") from error


def _used(
    path: Path, cell: str, found: TriangleContent | TetContent, cells: np.ndarray, drop_unused: bool
) -> np.ndarray:
    """Leave out the points that no cell uses, with their fields and members of groups. Returns the renumbered cells.

    Raises ValueError if there are such points and drop_unused is False.
    """
    used = np.unique(cells)
    within = used.size == 0 or (used[0] >= 0 and used[-1] < len(found.points))
    if not within or len(used) == len(found.points):
        return cells
    if not drop_unused:
        unused = np.setdiff1d(np.arange(len(found.points)), used)
        raise ValueError(
            f"{str(path)!r} has {len(unused)} points that no {cell} uses, the first one {unused[0]}; "
            "read_mesh(..., drop_unused=True) leaves them out"
        )
    numbers = np.full(len(found.points), -1)
    numbers[used] = np.arange(len(used))
    groups = renumbered(found.named.groups, numbers)
    found.named.left_out += lost_members(found.named.groups, groups)
    found.named.groups = groups
    found.vertex_fields = {name: values[used] for name, values in found.vertex_fields.items()}
    found.points = found.points[used]
    return numbers[cells]


def _meshio(module: str | None = None):
    """Import meshio, or one of its modules. Raises ImportError, which says how to install it."""
    try:
        return importlib.import_module(f"meshio.{module}" if module else "meshio")
    except ImportError as error:
        raise ImportError('this file format needs meshio: pip install "magshell[io]"') from error


def _read_ply(path: Path) -> TriangleContent:
    """Read a PLY file."""
    return TriangleContent(*read_ply(path))


def _read_inp(path: Path) -> TriangleContent | TetContent:
    """Read an Abaqus INP file."""
    found = read_inp(path)
    content = SimpleNamespace(
        points=found.points,
        cells=[SimpleNamespace(type=kind, data=nodes) for kind, nodes in found.blocks],
        **{name: {} for name in ("point_data", "cell_data", "field_data")},
    )
    return _content(content, lambda kind: found.named)


def _read_with_meshio(path: Path) -> TriangleContent | TetContent:
    """Read an STL, VTU, VTK or MSH file."""
    check_counts(path)
    # meshio.read exits the interpreter on a file it cannot read; the readers of the formats raise an error
    with np.errstate(over="ignore"):  # its STL reader multiplies the claimed count before it checks it
        content = _meshio(_MESHIO_MODULES[path.suffix.lower()]).read(path)
    data = path.read_bytes() if path.suffix.lower() == ".msh" else b""
    found = _content(content, lambda kind: groups_of_meshio(content, data, kind))
    if path.suffix.lower() == ".stl" and isinstance(found, TriangleContent):
        found.named.groups = solids_of_stl(path, found.faces)
    return found


def _content(content: Any, named: Callable[[str], Named]) -> TriangleContent | TetContent:
    """Return the tetrahedra, or else the triangles, of meshio's mesh. Raises ValueError if it has other cells.

    named: returns the named groups if cells of the given kind are read.
    """
    solid = tetrahedra_of(content, named)
    if solid is not None:
        return solid
    there = {block.type for block in content.cells}
    kind = next((each for each in _TRIANGLES if each in there), _TRIANGLES[0])
    others = {
        block.type: len(block.data) for block in content.cells if block.type not in (kind, *_LOWER_CELLS)
    }
    if others:
        other, count = next(iter(others.items()))
        raise ValueError(
            f"the file has {count} cells of type {other!r}; only triangles, all of 3 points or all of 6, are supported"
        )
    triangles = [k for k, block in enumerate(content.cells) if block.type == kind]
    if not triangles:
        return TriangleContent(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), {}, {})
    groups = named(kind)
    faces = np.concatenate([content.cells[k].data for k in triangles])
    face_fields = {
        name: np.concatenate([blocks[k] for k in triangles])
        for name, blocks in drop_group_fields(content.cell_data).items()
    }
    points = np.asarray(content.points, dtype=np.float64)
    return TriangleContent(points, faces, dict(content.point_data), face_fields, groups)


def _merge_coincident(found: TriangleContent) -> None:
    """Merge points closer than RELATIVE_TOLERANCE of the bounding-box diagonal."""
    points = found.points
    tolerance = RELATIVE_TOLERANCE * float(np.linalg.norm(np.ptp(points, axis=0)))
    pairs = scipy.spatial.cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    _, first, vertex = np.unique(connected_groups(len(points), pairs), return_index=True, return_inverse=True)
    vertex = vertex.ravel()
    found.points, found.faces = points[first], vertex[found.faces]
    found.named.groups = renumbered(found.named.groups, vertex)


def check_field_name(kind: str, name: str) -> None:
    """Raise ValueError for a name that a format cannot store: PLY ends a name at a space, XML reserves some characters.

    kind: the kind of field that the message names.
    """
    if not (isinstance(name, str) and name and name.isprintable()) or set(name) & set(' "<>&'):
        raise ValueError(
            f'{kind} field names must be printable words without spaces and without any of " < > &, got {name!r}'
        )


def _checked_fields(kind: str, fields, rows: int) -> dict[str, np.ndarray]:
    """Return the fields as arrays (rows,) or (rows, k) of int32 or float64. Raises ValueError for other shapes or types."""
    checked = {}
    for name, values in named_values(f"{kind}_fields", fields).items():
        check_field_name(kind, name)
        check_no_group_field(kind, name)
        shape = shape_of(f"{kind} field {name!r}", values)
        if len(shape) not in (1, 2) or shape[0] != rows or 0 in shape:
            raise ValueError(f"{kind} field {name!r} must have shape ({rows},) or ({rows}, k), got {shape}")
        array = np.asarray(detached(values))
        if array.dtype.kind not in "biuf":
            raise ValueError(f"{kind} field {name!r} must hold real numbers, got dtype {array.dtype}")
        fits = array.dtype.kind == "b" or (array.dtype.kind in "iu" and np.abs(array).max() < 2**31)
        checked[name] = array.astype(np.int32 if fits else np.float64)
    return checked
