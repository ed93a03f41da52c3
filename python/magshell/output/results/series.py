"""Series of VTU files of the states of a result, for ParaView, with the numbers of probes as field data of each file."""

from __future__ import annotations

import base64
import os
import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import named_values
from ..._input.path_first import check_path_first
from ..._input.quantity import quantity, shape_of
from ..._input.tensors import detached
from ..._runtime.files import replace_file, replacing
from ..._runtime.progress import SolveBar
from ...mesh.io.read_write import check_field_name, write_cells, write_mesh
from ...mesh.io.tetrahedra import cells_of
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ...model.shells.shell_stresses import ShellStresses
from ...model.solids.solid_stresses import SolidStates
from .probes import Probe, checked_probes
from .state import State, states_of, with_times
from .tables import is_result

if TYPE_CHECKING:
    from ..._input.kinds import Fielded, FilePath, Numbers, Shown


def element_fields(found: ShellStresses | SolidStates) -> dict[str, np.ndarray]:
    """Return the stresses and strains of elements as fields, {name: (n,) or (n, 9)}.

    Fields of solids are means over each element. The von Mises stress of a shell is the larger one of its two surfaces.
    """
    if isinstance(found, ShellStresses):
        return {
            "von_mises_stress": found.von_mises_stresses.max(axis=1),
            "membrane_force": found.in_space(found.membrane_forces).reshape(-1, 9),
            "bending_moment": found.in_space(found.bending_moments).reshape(-1, 9),
        }
    return {
        "von_mises_stress": found.mean(found.von_mises_stresses),
        "volume_ratio": found.mean(found.volume_ratios),
        "green_strain": found.mean(found.green_strains).reshape(-1, 9),
        "cauchy_stress": found.mean(found.cauchy_stresses).reshape(-1, 9),
        **(found.muscles or {}),
    }


def write_solids(
    path: Path,
    state: State,
    on_vertices: dict[str, np.ndarray],
    on_faces: dict[str, np.ndarray],
    on_tetrahedra: dict[str, np.ndarray],
) -> None:
    """Write the tetrahedra and triangles of several bodies to one VTU file.

    The triangles of a solid's surface are written only if they are magnetized or have fields, which tetrahedra cannot carry.
    on_vertices, on_faces, on_tetrahedra: name -> values with rows for all bodies, one after another.
    """
    meshes = [state.mesh] if isinstance(state.mesh, TetMesh) else state.mesh.meshes
    elements = {} if state.elements is None else {first: each for first, _, each in state.elements()}
    magnetization = state.magnetization
    cells, data = [], []
    vertex = face = tetrahedron = 0
    for mesh in meshes:
        rows, solid = slice(face, face + mesh.n_faces), isinstance(mesh, TetMesh)
        own = element_fields(elements[face]) if face in elements else {}
        if solid:
            ((kind, tetrahedra),) = cells_of(mesh)
            cells.append((kind, tetrahedra + vertex))
            inside = slice(tetrahedron, tetrahedron + mesh.n_tetrahedra)
            given = {name: values[inside] for name, values in on_tetrahedra.items()}
            data.append({"part": mesh.parts, **own, **given})
            tetrahedron = inside.stop
        if not solid or on_faces or magnetization[rows].any():
            cells.append(("triangle", mesh.faces + vertex))
            given = {name: values[rows] for name, values in on_faces.items()}
            data.append({"magnetization": magnetization[rows], **({} if solid else own), **given})
        vertex, face = vertex + mesh.n_vertices, face + mesh.n_faces
    missing: dict[str, float] = {"magnetization": 0.0, "part": -1}
    shapes = {name: values.shape[1:] for each in data for name, values in each.items()}
    if not any(mesh.parts.any() for mesh in meshes if isinstance(mesh, TetMesh)):
        del shapes["part"]
    if not state.is_magnetized:
        shapes.pop("magnetization", None)
    filled = {
        name: [
            each[name] if name in each else np.full((len(rows), *shape), missing.get(name, np.nan))
            for each, (_, rows) in zip(data, cells, strict=True)
        ]
        for name, shape in shapes.items()
    }
    write_cells(path, state.positions, cells, on_vertices, filled)


def write_series(
    path: FilePath,
    what: Shown,
    *,
    positions: Numbers | None = None,
    times: Numbers | None = None,
    velocities: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    field: Fielded | None = None,
    vertex_fields: dict[Any, Any] | None = None,
    face_fields: dict[Any, Any] | None = None,
    tetrahedron_fields: dict[Any, Any] | None = None,
    probes: Probe | Sequence[Probe] = (),
    progress: bool = True,
) -> Path:
    """Write a series of states for ParaView: strip.pvd, and a folder strip/ with one VTU file per state (the extra `io`).

    what: a Trajectory, an EquilibriumPath, an EquilibriumSet, a mesh with positions, or anything else that `plot` takes.
    positions: (n, n_v, 3) m, for a mesh. times: (n,) s; by default those of `what`, or 0, 1, 2, ...
    velocities: (n, n_v, 3) m/s; by default those of `what`.
    remanent_magnetization, applied_flux_density, field: as in `plot`.
    vertex_fields, face_fields, tetrahedron_fields: name -> (n, n_v) or (n, n_v, k), (n, n_f) or (n, n_f, k), and (n, n_t)
        or (n, n_t, k), additional fields. Their rows are those of one body after another; faces include those of solids.
    probes: of a result; the numbers of each ms.Probe are field data of the states' files, "tip.z [m]" and alike, which
        ParaView plots over time.
    progress: show a progress bar once writing has taken two seconds.

    Fields on tetrahedra of a result are element means of `volume_ratio` (J), `von_mises_stress` and `cauchy_stress` [Pa] and
    `green_strain`, and with muscles `activation`, `fibre_stretch` and `fibre_tension` [Pa]. Fields on the triangles of
    shells are `membrane_force` [N/m] and `bending_moment` [N] in the deformed configuration, and the larger
    `von_mises_stress` [Pa] of the two surfaces. Matrices are stored row by row. Values that an element does not have are
    NaN.

    Fields on points are `displacement` [m], `velocity` [m/s], in a field `flux_density` [T], and for scenes with contacts
    `contact_pressure` [Pa], the normal forces on both sides of a shell over a third of the adjacent faces' area, and
    `contact_force` [N], with friction. The forces of the supports of an equilibrium or a motion are `reaction` [N], with
    inertia and damping, NaN where a motion starts; point, edge and area loads are `load` [N]. The magnetization F_0 M_r or
    R M_r in the deformed configuration is a field on faces, `magnetization` [A/m].

    Returns the path of the PVD file. An earlier series of the same name is replaced. The PVD file is complete at the end;
    after an error, a full disk or Ctrl-C it lists the states that were written in full.

    Raises ValueError on bad input, FileNotFoundError if the folder does not exist, ImportError without meshio, and OSError,
    with the number of states written, if a file cannot be written.

    >>> import magshell as ms, tempfile
    >>> strip = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> rising = [strip.rest_positions + (0, 0, height) for height in (0, 0.01, 0.02)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.write_series(f"{folder}/rise.pvd", strip, positions=rising, times=(0, 0.1, 0.2)).name
    'rise.pvd'
    """
    check_path_first("write_series(path, result)", path, what)
    path = Path(path)
    if path.suffix.lower() != ".pvd":
        raise ValueError(f"a series is saved as .pvd, got {path.name!r}; write_mesh writes one state as .vtu")
    if not path.name.isprintable():
        raise ValueError(f"the name of a series must be printable, got {path.name!r}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path.name!r}: there is no folder {str(path.parent)!r}")
    states = states_of(
        what,
        positions=positions,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
    )
    states = with_times(states, times)
    velocities = getattr(what, "velocities", None) if velocities is None else velocities
    more = {
        "vertex": _by_state(vertex_fields, "vertex", states),
        "face": _by_state(face_fields, "face", states),
        "tetrahedron": _by_state(tetrahedron_fields, "tetrahedron", states),
    }
    if velocities is not None:
        row = (states[0].mesh.n_vertices, 3)
        more["vertex"]["velocity"] = quantity("velocities", "m/s", detached(velocities), (len(states), *row))
    in_field = any(state.flux_density is not None or state.has_sources for state in states)
    magnetized = any(state.is_magnetized for state in states)
    probed = probe_columns(what, probes, positions)
    digits = len(str(len(states) - 1))
    names = [f"{path.stem}/{path.stem}_{k:0{digits}}.vtu" for k in range(len(states))]
    with _listed(path, names, states) as done, SolveBar("write_series", progress) as bar:
        for k, state in enumerate(bar.through(states)):
            on_vertices = {"displacement": state.displacements}
            on_vertices |= {name: values[k] for name, values in more["vertex"].items()}
            if (pressures := state.contact_pressures) is not None:
                forces = {"contact_pressure": pressures, "contact_force": state.loads().forces}
                on_vertices = {**forces, **on_vertices}
            if state.forces is not None:
                on_vertices = {**state.forces(), **on_vertices}
            if in_field:
                on_vertices["flux_density"] = state.flux_density_at(state.positions)
            on_faces, on_tetrahedra = (
                {name: values[k] for name, values in more[kind].items()} for kind in ("face", "tetrahedron")
            )
            if isinstance(state.mesh, TriangleMesh | QuadraticTriangleMesh):
                on_faces = _of_sheets(state, magnetized) | on_faces
                flat = state.mesh if isinstance(state.mesh, TriangleMesh) else state.mesh.surface
                write_mesh(path.parent / names[k], flat, state.positions, on_vertices, on_faces)
            else:
                write_solids(path.parent / names[k], state, on_vertices, on_faces, on_tetrahedra)
            if probed:
                add_field_data(
                    path.parent / names[k], {name: float(values[k]) for name, values in probed.items()}
                )
            done.append(k)
    return path


def _by_state(fields: dict[Any, Any] | None, kind: str, states: list[State]) -> dict[str, np.ndarray]:
    fields = named_values(f"{kind}_fields", fields)
    mesh = states[0].mesh
    if kind == "tetrahedron" and fields and isinstance(mesh, TriangleMesh | QuadraticTriangleMesh):
        raise ValueError("tetrahedron_fields: there are no tetrahedra")
    rows = _counts(mesh)[kind]
    for name, values in fields.items():
        check_field_name(kind, name)
        shape = shape_of(f"{kind} field {name!r}", values)
        if len(shape) not in (2, 3) or shape[:2] != (len(states), rows):
            raise ValueError(
                f"{kind} field {name!r} must have shape ({len(states)}, {rows}) or ({len(states)}, {rows}, k), "
                f"got {shape}"
            )
    return {name: np.asarray(detached(values)) for name, values in fields.items()}


def _counts(mesh) -> dict[str, int]:
    bodies = getattr(mesh, "meshes", [mesh])
    tetrahedra = sum(each.n_tetrahedra for each in bodies if isinstance(each, TetMesh))
    return {"vertex": mesh.n_vertices, "face": mesh.n_faces, "tetrahedron": tetrahedra}


def _of_sheets(state: State, magnetized: bool) -> dict[str, np.ndarray]:
    """Return the fields of a state on the faces of shells: stresses, and the magnetization if `magnetized`."""
    found: dict[str, np.ndarray] = {}
    if state.elements is not None:
        fields = [element_fields(each) for _, _, each in state.elements()]
        found |= (
            {name: np.concatenate([each[name] for each in fields]) for name in fields[0]} if fields else {}
        )
    if magnetized:
        found["magnetization"] = state.magnetization
    return found


@contextmanager
def _listed(path: Path, names: list[str], states: list[State]) -> Iterator[list[int]]:
    """Write the PVD file of the states whose numbers the caller appends to the yielded list, also after an error."""
    done: list[int] = []
    stopped = None
    try:
        with replacing(path) as part:
            (path.parent / path.stem).mkdir(exist_ok=True)
            _clear(path)
            # written in full at first, so that its space is reserved if the states fill the disk
            part.write_bytes(_contents(names, states, range(len(states))))
            try:
                yield done
            except BaseException as error:
                if not done:
                    raise
                stopped = error
            with part.open("r+b") as file:
                file.write(_contents(names, states, done))
                file.truncate()
        if stopped is not None:
            raise stopped
    except OSError as error:
        kept = "no state is" if not done else f"{len(done)} of {len(states)} states are"
        where = f", listed in {path.name!r}" if done else ""
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise OSError(
            error.errno, f"cannot write the series {str(path)!r}: {reason}; {kept} on disk{where}"
        ) from error


def _clear(path: Path) -> None:
    """Remove an earlier series of this name: its PVD file, and the VTU files with names of its states."""
    path.unlink(missing_ok=True)
    state = re.compile(rf"\.?{re.escape(path.stem)}_\d+(\.[0-9a-f]+)?\.vtu")
    for file in (path.parent / path.stem).glob("*.vtu"):
        if state.fullmatch(file.name):
            file.unlink()


def _time(states: list[State], number: int) -> float:
    time = states[number].time
    return float(number) if time is None else time


def _contents(names: list[str], states: list[State], chosen) -> bytes:
    from xml.sax.saxutils import quoteattr  # late, as it loads all of urllib

    rows = [
        f'    <DataSet timestep="{_time(states, k)!r}" part="0" file={quoteattr(names[k])}/>' for k in chosen
    ]
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n  <Collection>'
    return "\n".join([head, *rows, "  </Collection>\n</VTKFile>\n"]).encode()


_GRID = b"<UnstructuredGrid>"
_BLOCK = 32768  # bytes of the blocks that meshio compresses


def probe_columns(what: Any, probes: Probe | Sequence[Probe], positions: Any) -> dict[str, np.ndarray]:
    """Return the numbers of probes in all states of a result, {name with unit: (n,)}.

    Raises ValueError for probes of what is no result, and if a caller shows other positions than those of the result.
    """
    chosen = checked_probes(probes)
    if not chosen:
        return {}
    if not is_result(what):
        raise ValueError(f"probes are of one result, got a {type(what).__name__}")
    if positions is not None:
        raise ValueError("probes are of the result's own states: leave out positions=")
    return {
        f"{name} [{unit}]": np.atleast_1d(np.asarray(values, dtype=np.float64))
        for probe in chosen
        for name, (unit, values) in probe.columns(what).items()
    }


def add_field_data(path: Path, numbers: dict[str, float]) -> None:
    """Add numbers to a VTU file as its field data, where ParaView finds them under their names."""
    from xml.sax.saxutils import quoteattr  # late, as it loads all of urllib

    arrays = [
        f'<DataArray type="Float64" Name={quoteattr(name)} NumberOfTuples="1" format="binary">{_packed(value)}</DataArray>'
        for name, value in numbers.items()
    ]
    before, grid, after = path.read_bytes().partition(_GRID)
    if not grid:
        raise ValueError(f"{path.name!r} is not a VTU file of an unstructured grid")
    data = f"<FieldData>{''.join(arrays)}</FieldData>".encode()
    replace_file(path, lambda file: file.writelines([before, grid, data, after]))


def _packed(value: float) -> str:
    """Encode a number as the files of meshio do: one compressed block behind its header. Text could not be NaN."""
    number = np.array([value], dtype=np.float64).tobytes()
    block = zlib.compress(number)
    header = np.array([1, _BLOCK, len(number), len(block)], dtype=np.uint32).tobytes()
    return (base64.b64encode(header) + base64.b64encode(block)).decode()
