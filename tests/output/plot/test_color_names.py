"""Names of values on a colour bar: all of them, at their values where there is room, within the picture."""

from itertools import pairwise

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot.legend import side_by_side

pytest.importorskip("matplotlib")
PAINTED = ms.Style(backend="matplotlib", arrows=False)
MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))


def texts_of(picture: ms.Picture) -> dict[str, object]:
    return {text.get_text(): text for axes in picture.figure.axes for text in axes.texts}


def test_names_stand_instead_of_numbers() -> None:
    halves = (MESH.face_barycenters[:, 0] > 0.05).astype(float)
    picture = ms.plot(MESH, color=ms.Color(halves, names={1: "ball", 0: "sheet"}), width=800, style=PAINTED)
    texts = texts_of(picture)
    assert {"sheet", "ball"} <= set(texts) and not {"0", "0.5", "1"} & set(texts)
    assert texts["sheet"].get_position()[0] < texts["ball"].get_position()[0]


def test_many_long_names_neither_overlap_nor_leave_the_picture() -> None:
    names = {k: f"material number {k}" for k in range(5)}
    parts = np.floor(5 * MESH.face_barycenters[:, 0] / 0.1)
    picture = ms.plot(MESH, color=ms.Color(parts, label="materials", names=names), width=600, style=PAINTED)
    texts = texts_of(picture)
    picture.figure.canvas.draw()
    boxes = [texts[name].get_window_extent() for name in names.values()]
    assert all(left.x1 <= right.x0 for left, right in pairwise(boxes))
    assert boxes[0].x0 >= 0 and boxes[-1].x1 <= picture.figure.bbox.width


def test_spread_texts_keep_their_places_where_there_is_room() -> None:
    assert side_by_side(np.array([1.0, 3.0]), np.array([1.0, 1.0]), 0.0, 4.0).tolist() == [1.0, 3.0]
    assert side_by_side(np.array([0.0, 4.0]), np.array([1.0, 1.0]), 0.0, 4.0).tolist() == [0.5, 3.5]
    assert side_by_side(np.array([2.0, 2.0]), np.array([1.0, 1.0]), 0.0, 4.0).tolist() == [2.0, 3.0]
    assert side_by_side(np.array([3.9, 4.0]), np.array([1.0, 1.0]), 0.0, 4.0).tolist() == [2.5, 3.5]


def test_page_has_the_names(tmp_path) -> None:
    color = ms.Color(np.arange(MESH.n_vertices) % 2, label="body", names={0: "sheet", 1: "ball"})
    page = ms.write_page(MESH, tmp_path / "page.html", color=color)
    assert "body (0: sheet, 1: ball)" in page.read_text()


@pytest.mark.parametrize(
    "names", ["sheet", {"a": "sheet"}, {0: 1}, {0: ""}, {np.nan: "a"}, {True: "a"}, [1, 2]]
)
def test_names_of_a_color_that_are_no_texts_are_refused(names) -> None:
    with pytest.raises(ValueError, match="the names of a color must be"):
        ms.Color("displacement", names=names)
