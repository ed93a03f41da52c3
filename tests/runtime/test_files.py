"""Atomicity of files: a file is the old one or the new one; whatever stops the writing, no partial file is left."""

import errno
import json
import os
import resource
import stat
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from motions import lifted_strip

import magshell as ms
from benchmarks.report import writable_path, write_json
from magshell._runtime.files import check_replaceable, replace_file, replacing

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(40, 8))
OLD = b"the older one"


def write_vtu(path):
    pytest.importorskip("meshio")
    ms.write_mesh(path, MESH, vertex_fields={"noise": np.random.default_rng(0).random(MESH.n_vertices)})


def write_figure(path):
    from matplotlib.figure import Figure

    ms.Picture(Figure()).save(path)


def write_gif(path):
    moved = MESH.rest_positions + np.array([0.0, 0.01])[:, None, None]
    ms.animate(MESH, path, positions=moved, width=400, progress=False, style=ms.Style(backend="matplotlib"))


def write_checkpoint(path):
    torch = pytest.importorskip("torch")
    x = torch.ones(1000, dtype=torch.float64, requires_grad=True)
    ms.minimize(
        lambda x: (x**2).sum(), [x], ms.optim.LBFGS, max_iterations=1, checkpoint=path, progress=False
    )


WRITERS = {
    "mesh.vtu": write_vtu,
    "mesh.msh": lambda path: ms.write_mesh(path, MESH),
    "mesh.ply": lambda path: ms.write_mesh(path, MESH),
    "page.html": lambda path: ms.write_page(MESH, path),
    "plot.png": lambda path: ms.plot(MESH, width=400, style=ms.Style(backend="matplotlib")).save(path),
    "figure.png": write_figure,
    "movie.gif": write_gif,
    "sheet.stl": lambda path: ms.write_surface(path, MESH),
    "sheet.glb": lambda path: ms.write_gltf(path, MESH),
    "sheet.obj": lambda path: ms.write_surface(path, MESH),
    "result.npz": lambda path: ms.save(path, lifted_strip(MESH, steps=1)),
    "state.npz": lambda path: lifted_strip(MESH, steps=1).end.save(path),
    "run.pt": write_checkpoint,
    "bench.json": lambda path: write_json(path, "kernels", {"many": list(range(3000))}),
}


@contextmanager
def disk_of(n_bytes):
    """Limit the size of files: like on a full disk, the write that exceeds it fails half way."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_the_older_file(name, tmp_path):
    if name.endswith((".png", ".gif")):
        pytest.importorskip("matplotlib")
    path = tmp_path / name
    WRITERS[name](path)  # it can be written, and what is needed is imported
    assert path.stat().st_size > 1000 and list(tmp_path.iterdir()) == [path]
    path.write_bytes(OLD)
    kind = ms.ObjectiveFailed if name == "run.pt" else OSError
    with disk_of(500), pytest.raises(kind) as caught:
        WRITERS[name](path)
    assert f"cannot write {str(path)!r}: " in str(caught.value)
    assert path.read_bytes() == OLD and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("before", [OLD, None])
def test_a_writer_that_stops_half_way(error, before, tmp_path):
    path = tmp_path / "file.txt"
    if before:
        path.write_bytes(before)

    def half(file):
        file.write(b"half of")
        file.flush()
        raise error

    with pytest.raises(type(error)) as caught:
        replace_file(path, half)
    assert list(tmp_path.iterdir()) == ([path] if before else [])
    assert not before or path.read_bytes() == before
    if isinstance(error, OSError):
        assert caught.value.errno == errno.ENOSPC and str(path) in str(caught.value)


def new(path):
    replace_file(path, lambda file: file.write(b"new"))


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_permissions_are_those_of_the_file_before_or_the_usual_ones(tmp_path):
    path, usual = tmp_path / "file", tmp_path / "usual"
    new(path)
    usual.write_bytes(b"")
    assert mode(path) == mode(usual)
    path.chmod(0o640)
    new(path)
    assert mode(path) == 0o640


def test_a_link_stays_and_its_file_is_replaced(tmp_path):
    (tmp_path / "far").mkdir()
    file, link = tmp_path / "far" / "file.txt", tmp_path / "link.txt"
    file.write_bytes(OLD)
    link.symlink_to(Path("far") / "file.txt")
    new(link)
    assert link.is_symlink() and file.read_bytes() == b"new" and os.listdir(tmp_path / "far") == ["file.txt"]
    file.unlink()
    new(link)  # a link to what is not there yet
    assert file.read_bytes() == b"new"


def test_names_of_every_kind(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = ["plain", "a.b.c", ".hidden", "ü" * 100 + ".txt", "x" * 255]
    for name in names:
        new(name)
    assert sorted(os.listdir()) == sorted(names)


def test_devices_are_written_to_as_they_are():
    new("/dev/null")
    check_replaceable("/dev/null")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    if os.path.exists("/dev/full"):
        with pytest.raises(OSError, match="cannot write '/dev/full': No space left"):
            new("/dev/full")


@contextmanager
def nobody():
    """Change to an unprivileged user for a while, because root may write anywhere."""
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(user)


@pytest.mark.parametrize("check", [new, check_replaceable])
def test_unwritable_paths_are_refused(check, tmp_path):
    with pytest.raises(IsADirectoryError, match="cannot write"):
        check(tmp_path)
    with pytest.raises(FileNotFoundError, match=r"cannot write .*there is no folder .*none'"):
        check(tmp_path / "none" / "file")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file"
        path.write_bytes(OLD)
        path.chmod(0o444)
        os.chmod(folder, 0o777)
        with nobody(), pytest.raises(PermissionError, match="the file that is there may not be written to"):
            check(path)
        path.chmod(0o666)
        os.chmod(folder, 0o555)
        with nobody(), pytest.raises(PermissionError, match=r"no file may be made in .* beside its place"):
            check(path)
        assert path.read_bytes() == OLD and os.listdir(folder) == ["file"]
        os.chmod(folder, 0o777)


def test_the_bench_asks_without_leaving_a_file(tmp_path):
    path = tmp_path / "new" / "numbers.json"
    assert writable_path(str(path)) == path and list(path.parent.iterdir()) == []
    write_json(path, "kernels", {"a": 1})
    assert json.loads(path.read_text())["results"] == {"a": 1}


def test_the_file_beside_has_the_ending(tmp_path):
    with replacing(tmp_path / "film.mp4") as part:
        assert part.suffix == ".mp4" and part.parent == tmp_path and not (tmp_path / "film.mp4").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]


def test_the_next_save_removes_what_a_killed_one_left_behind(tmp_path):
    left, others = ".rest.0123abcd.npz", [".rest.0123abcd.json", ".rests.0123abcd.npz", "rest.0123abcd.npz"]
    for name in (left, ".rest.89abcdef.npz", *others):
        (tmp_path / name).write_bytes(b"part")
    os.utime(tmp_path / left, (0, 0))  # the other one may be somebody's who writes now
    replace_file(tmp_path / "rest.npz", lambda file: file.write(b"all"))
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        ["rest.npz", ".rest.89abcdef.npz", *others]
    )
