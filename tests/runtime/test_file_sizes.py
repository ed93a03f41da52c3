"""Files whose header claims more data than the file holds: refused with both numbers, before memory is allocated."""

import io
import re
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.02, 0.01, cells=(2, 1))
GIANT = 10**11


def saved(tmp_path, kind="result"):
    """Return (path, function that reads it) of each kind of .npz that magshell reads."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))])
    path = tmp_path / f"{kind}.npz"
    if kind == "result":
        ms.save(path, ms.equilibrium(scene))
        return path, lambda: ms.load(path, scene)
    ms.simulate(scene, steps=1, time_step=1e-3).end.save(path)
    return path, lambda: ms.MotionState.load(path)


def claimed(array: np.ndarray, shape: tuple[int, ...]) -> bytes:
    """Return an array as numpy writes it, with another shape in its header."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return file.getvalue() + array.tobytes()


def rewritten(path, changes: dict[str, bytes]):
    """Write the archive with other contents of some of its members."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()} | changes
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)


@pytest.mark.parametrize("kind, name", [("result", "positions.npy"), ("state", "velocity.npy")])
def test_saved_results_whose_arrays_claim_more_than_the_file_holds_are_refused(tmp_path, kind, name):
    path, read = saved(tmp_path, kind)
    for shape in ((GIANT, 3), (2**40,), (7,)):
        rewritten(path, {name: claimed(np.zeros(6), shape)})
        with pytest.raises(
            ValueError, match=rf"the array {name} claims shape .* bytes, but the file holds 48 of it"
        ):
            read()


def test_archives_of_anything_else_are_refused(tmp_path):
    path, read = saved(tmp_path)
    rewritten(path, {"positions.npy": b"hello"})
    with pytest.raises(ValueError, match=r"positions.npy is no array of numpy's"):
        read()
    path.write_bytes(b"PK\x03\x04 and then something else")
    with pytest.raises(ValueError, match=r"is not a saved result: it is no .npz archive"):
        read()
    with path.open("wb") as file:  # one array, which np.load reads as well
        np.save(file, np.zeros(3))
    with pytest.raises(ValueError, match=r"is not a saved result: it is no .npz archive"):
        read()


@pytest.mark.parametrize("seed", range(60))
def test_spoiled_archives_are_refused_or_read(tmp_path, seed):
    """Change a few bytes of the file: it gives a ValueError or a result, nothing else."""
    path, read = saved(tmp_path, "state")
    rng, data = np.random.default_rng(seed), bytearray(path.read_bytes())
    for at in rng.integers(len(data), size=3):
        data[at] = rng.integers(256)
    path.write_bytes(data[: rng.integers(len(data) // 2, len(data) + 1)] if seed % 2 else data)
    try:
        read()
    except ValueError as error:
        assert "is not a saved MotionState" in str(error)


TRIANGLES = ms.meshes.rectangle(1.0, 1.0, cells=(3, 3))
SOLID = ms.meshes.box((1.0, 1.0, 1.0), cells=(2, 2, 2))
LIMIT = 32e6  # bytes: hundred times what any of these files needs


def by_meshio(path, mesh, **options):
    meshio = pytest.importorskip("meshio")
    cells = [("tetra", mesh.tetrahedra)] if isinstance(mesh, ms.TetMesh) else [("triangle", mesh.faces)]
    data = (
        {}
        if "binary" in options and not options["binary"]
        else {"point_data": {"u": np.ones(mesh.n_vertices)}}
    )
    meshio.Mesh(mesh.rest_positions, cells, **data).write(path, **options)


def text_ply(path, mesh):
    rows = [" ".join(map(str, row)) for row in mesh.rest_positions.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in mesh.faces.tolist()]
    axes = "\n".join(f"property double {axis}" for axis in "xyz")
    counts = f"element vertex {mesh.n_vertices}\n{axes}\nelement face {mesh.n_faces}"
    header = f"ply\nformat ascii 1.0\n{counts}\nproperty list uchar int vertex_indices\nend_header"
    path.write_text("\n".join([header, *rows, ""]))


WRITERS = {
    "binary.stl": lambda path: ms.write_surface(path, TRIANGLES),
    "text.stl": lambda path: by_meshio(path, TRIANGLES, binary=False),
    "sheet.obj": lambda path: ms.write_surface(path, TRIANGLES),
    "binary.ply": lambda path: ms.write_mesh(path, TRIANGLES, vertex_fields={"u": np.ones(16)}),
    "text.ply": lambda path: text_ply(path, TRIANGLES),
    "sheet.vtu": lambda path: ms.write_mesh(path, TRIANGLES, vertex_fields={"u": np.ones(16)}),
    "solid.vtu": lambda path: ms.write_mesh(
        path, SOLID, tetrahedron_fields={"u": np.ones(SOLID.n_tetrahedra)}
    ),
    **{
        f"{name}{version}{kind}.msh": lambda path, mesh=mesh, version=version, kind=kind: by_meshio(
            path, mesh, file_format=f"gmsh{version}", binary=kind == "binary"
        )
        for name, mesh in (("sheet", TRIANGLES), ("solid", SOLID))
        for version in ("", "22")
        for kind in ("binary", "text")
    },
}


@pytest.fixture(params=WRITERS)
def written(request, tmp_path):
    path = tmp_path / request.param
    WRITERS[request.param](path)
    ms.read_mesh(path)
    return path


def peak_of(read) -> float:
    """Return the peak memory of numpy and Python while something is read, bytes."""
    tracemalloc.start()
    try:
        read()
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < LIMIT, f"{peak / 1e6:.0f} MB"
    return peak


def spoiled(data: bytes, rng: np.random.Generator) -> bytes:
    """Return data with other bytes, another number in the text at its beginning, a large integer somewhere, or cut
    off.
    """
    found = bytearray(data)
    kind = rng.integers(4)
    if kind == 0:
        for at in rng.integers(len(found), size=3):
            found[at] = rng.integers(256)
    elif kind == 1:
        if numbers := list(re.finditer(rb"\b\d+\b", data[:2000])):
            chosen = numbers[rng.integers(len(numbers))]
            found[chosen.start() : chosen.end()] = str(10 ** int(rng.integers(1, 14))).encode()
    elif kind == 2:
        at = int(rng.integers(len(found) - 8))
        found[at : at + 8] = (10 ** int(rng.integers(6, 18))).to_bytes(8, "little")
    else:
        found = found[: rng.integers(len(found))]
    return bytes(found)


@pytest.mark.filterwarnings("ignore")
def test_spoiled_mesh_files_are_refused_or_read_and_take_no_more_memory_than_they_may(written):
    good = written.read_bytes()
    for seed in range(120):
        written.write_bytes(spoiled(good, np.random.default_rng(seed)))
        try:
            peak_of(lambda: ms.read_mesh(written, drop_unused=True))
        except ValueError as error:
            assert written.name in str(error) and "allocate" not in str(error), seed


def test_a_binary_stl_says_how_many_triangles_its_header_claims_and_how_many_bytes_there_are(tmp_path):
    path = tmp_path / "sheet.stl"
    ms.write_surface(path, TRIANGLES)
    data = path.read_bytes()
    for count, kept in ((19, 984), (17, 984), (2**32 - 1, 984), (18, 500)):
        path.write_bytes(data[:80] + struct.pack("<I", count) + data[84:kept])
        words = f"its header says {count:,} triangles, which take {84 + 50 * count:,} bytes, but the file has {kept}"
        with pytest.raises(ValueError, match=words):
            ms.read_mesh(path)
    path.write_bytes(data[:40])
    with pytest.raises(
        ValueError, match="a binary file has 84 bytes before its triangles, but this one has 40"
    ):
        ms.read_mesh(path)
    path.write_bytes(b"solid of a program".ljust(80) + data[80:])  # a binary file may begin like a text
    assert ms.read_mesh(path).n_faces == 18


@pytest.mark.parametrize("version, kind", [("", "binary"), ("", "text"), ("22", "text"), ("22", "binary")])
def test_an_msh_with_a_giant_count_of_nodes_or_elements_is_refused_without_the_memory(
    tmp_path, version, kind
):
    path = tmp_path / "sheet.msh"
    by_meshio(path, TRIANGLES, file_format=f"gmsh{version}", binary=kind == "binary")
    data = path.read_bytes()
    for section in (b"$Nodes\n", b"$Elements\n"):
        at = data.index(section) + len(section)
        if kind == "binary" and not version:
            changed = data[: at + 8] + struct.pack("<Q", GIANT) + data[at + 16 :]
        else:
            end = at + re.match(rb"(1 )?\d+", data[at:]).end()
            changed = data[:at] + (b"1 " if not version else b"") + str(GIANT).encode() + data[end:]
        path.write_bytes(changed)
        if section == b"$Elements\n" and not version:
            continue  # the total of elements is not used
        with pytest.raises(
            ValueError, match=rf"\{section[:-1].decode()} says that .* follow, but it has room for"
        ):
            peak_of(lambda: ms.read_mesh(path))


def test_a_ply_whose_first_face_claims_more_corners_than_the_file_holds_is_refused(tmp_path):
    path = tmp_path / "sheet.ply"
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    header += "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n"
    path.write_bytes(header.encode() + bytes(12) + struct.pack("<I", 4 * 10**9) + bytes(12))
    with pytest.raises(
        ValueError, match="the first face says that it has 4,000,000,000 entries, but only 12 bytes"
    ):
        ms.read_mesh(path)
