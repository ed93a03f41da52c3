"""Pictures have a largest size, which is asked for before a painter is: one without memory ends the process."""

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def mesh() -> ms.TriangleMesh:
    return ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))


@pytest.mark.parametrize("backend", [None, "matplotlib"])  # before it is chosen
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"width": 20_000}, "width must be at least 400 pixels and at most 8000, got 20000"),
        ({"width": 1e9}, "width must be"),
        ({"width": np.inf}, r"width \[pixels\] must be finite"),
        ({"width": "wide"}, r"width \[pixels\] must be an array of real numbers"),
        ({"columns": 0}, "columns must be an integer of at least 1, and at most 40"),
        ({"columns": 10**9}, "columns must be an integer"),
        ({"columns": 1.5}, "columns must be an integer"),
    ],
)
def test_sizes_are_limited(mesh, backend, arguments, message) -> None:
    with pytest.raises(ValueError, match=message):
        ms.plot(mesh, **arguments, style=ms.Style(backend=backend))


@pytest.mark.parametrize(
    ("dpi", "message"),
    [(1e6, "too large: ask for fewer dots an inch"), (0, "dpi must be pos"), (np.nan, "dpi")],
)
def test_a_picture_has_so_many_pixels(mesh, tmp_path, dpi, message) -> None:
    picture = ms.plot(mesh, width=400, style=ms.Style(backend="matplotlib"))
    with pytest.raises(ValueError, match=message):
        picture.save(tmp_path / "a.png", dpi=dpi)
    assert list(tmp_path.iterdir()) == []
    picture.save(tmp_path / "a.png", dpi=100)
    assert (tmp_path / "a.png").read_bytes()[16:20] == bytes([0, 0, 0, 200])
    with pytest.raises(ValueError, match=r"a picture of 2000 x \d+ pixels is too large: .*more `columns`"):
        ms.plot([mesh] * 100, states=range(100), columns=1, width=2000, style=ms.Style(backend="matplotlib"))
