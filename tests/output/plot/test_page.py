"""A page holds the data it shows, and needs nothing from elsewhere."""

import base64
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from motions import lifted_strip

import magshell as ms

VOID = {"meta", "input", "br", "link"}


class Page(HTMLParser):
    """The data of a page; `open` is what is left open, `links` what it refers to."""

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.ids: list[str] = []
        self.heading = ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.links += [attributes[name] for name in ("src", "href", "action") if name in attributes]
        self.ids += [attributes["id"]] if "id" in attributes else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        if self.open[-1:] == ["script"] and text.startswith("{"):
            self.data = json.loads(text)
        if self.open[-1:] == ["h1"]:
            self.heading += text


def numbers(text: str, dtype: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype=dtype)


@pytest.fixture(scope="module")
def mesh() -> ms.TriangleMesh:
    return ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))


@pytest.fixture
def path_(mesh) -> dict:
    """Return three states of a sheet that rises, in a growing field."""
    rise = mesh.rest_positions[:, :1] ** 2 * (0.0, 0.0, 1.0)
    return {
        "positions": mesh.rest_positions + np.arange(3)[:, None, None] * rise,
        "remanent_magnetization": (4e4, 0.0, 0.0),
        "applied_flux_density": np.arange(3)[:, None] * (0.0, 0.0, 2e-3),
    }


def test_a_page_holds_the_mesh_and_its_states(mesh, path_, tmp_path) -> None:
    file = ms.write_page(
        mesh, tmp_path / "a.html", titles=["one", "two", "</script> three"], title="1 < 2 & 3", **path_
    )
    page = Page(file.read_text(encoding="utf-8"))
    assert page.open == [] and page.heading == "1 < 2 & 3" and len(set(page.ids)) == len(page.ids)
    data = page.data
    np.testing.assert_array_equal(numbers(data["faces"], "<u4").reshape(-1, 3), mesh.faces)
    np.testing.assert_array_equal(numbers(data["rest"], "<f4"), mesh.rest_positions.ravel().astype("<f4"))
    assert [state["title"] for state in data["states"]] == ["one", "two", "</script> three"]
    for state, positions, flux_density in zip(
        data["states"], path_["positions"], path_["applied_flux_density"], strict=True
    ):
        np.testing.assert_array_equal(numbers(state["positions"], "<f4"), positions.ravel().astype("<f4"))
        assert state["fluxDensity"] == flux_density.tolist()
    assert data["states"][2]["fluxDensityLabel"] == "B = 4 mT"


def test_arrows_and_scalars(mesh, path_, tmp_path) -> None:
    color = np.arange(mesh.n_faces)
    data = Page(
        ms.write_page(mesh, tmp_path / "a.html", color=ms.Color(color, label="number"), **path_).read_text()
    ).data
    assert [scalar["label"] for scalar in data["scalars"]] == [
        "number",
        "Mᵣ along x [kA/m]",
        "displacement [mm]",
    ]
    np.testing.assert_array_equal(numbers(data["scalars"][0]["values"][0], "<f4"), color)
    assert [len(scalar["values"]) for scalar in data["scalars"]] == [
        1,
        1,
        3,
    ]  # what does not change is held once
    displacement = numbers(data["scalars"][2]["values"][2], "<f4")
    np.testing.assert_allclose(displacement, 2e3 * mesh.rest_positions[:, 0] ** 2, rtol=1e-6, atol=1e-9)
    arrows = numbers(data["states"][2]["magnetization"]["arrows"], "<f4").reshape(-1, 6)
    slope = arrows[:, 5] / arrows[:, 3]  # dz/dx = 4 x along the sheet, at the middle of the arrow
    middle = arrows[:, 0] + 0.5 * arrows[:, 3]
    assert len(arrows) > 10 and np.abs(slope - 4 * middle).max() < 0.05


def test_varying_fields_surround_the_sheet(mesh, tmp_path) -> None:
    field = ms.Dipoles([[0.05, 0.01, -0.05]], [[0.0, 0.0, 1.0]])
    [state] = Page(ms.write_page(mesh, tmp_path / "a.html", field=field).read_text()).data["states"]
    arrows = numbers(state["field"]["arrows"], "<f4").reshape(-1, 6)
    along = field.flux_density(arrows[:, :3] + 0.5 * arrows[:, 3:])
    cosine = (
        np.einsum("ki,ki->k", along, arrows[:, 3:])
        / np.linalg.norm(along, axis=1)
        / np.linalg.norm(arrows[:, 3:], axis=1)
    )
    assert len(arrows) > 10 and cosine.min() > 1 - 1e-5
    assert "magnetization" not in state and "fluxDensity" not in state


def decoded(packed, rows: int) -> np.ndarray:
    """Decode the numbers of a state as the page's script does."""
    if isinstance(packed, str):
        return numbers(packed, "<f4").reshape(rows, -1)
    return (packed["low"] + packed["step"] * numbers(packed["u2"], "<u2")).reshape(rows, -1)


def test_a_page_plays_a_motion(mesh, tmp_path) -> None:
    move = lifted_strip(mesh)
    page = Page(ms.write_page(move, tmp_path / "a.html", color="magnetic_energy").read_text())
    assert {"play", "slider", "speed"} <= set(page.ids)
    data = page.data
    assert data["speed"] == 0.005 and data["recorded"] == 9
    assert [state["time"] for state in data["states"]] == move.times.tolist()
    assert data["states"][2]["title"] == "10.0 ms"
    for k, state in enumerate(data["states"]):
        assert state["fluxDensity"] == move.applied_flux_density[k].tolist()
        np.testing.assert_array_equal(
            decoded(state["positions"], mesh.n_vertices), move.positions[k].astype("<f4")
        )
    assert data["states"][4]["fluxDensityLabel"] == "B = 2 mT"
    assert len(data["scalars"][0]["values"]) == 9
    still = Page(ms.write_page(mesh, tmp_path / "b.html", positions=move.positions).read_text()).data
    assert still["speed"] is None and "time" not in still["states"][0]
    given = Page(
        ms.write_page(mesh, tmp_path / "c.html", positions=move.positions, times=2 * move.times).read_text()
    ).data
    assert given["states"][-1]["time"] == 0.08 and given["speed"] == 0.01


def test_long_motions_are_kept_within_a_limit(mesh, tmp_path) -> None:
    move = lifted_strip(mesh, steps=40)
    alone = ms.write_page(mesh, tmp_path / "a.html").stat().st_size
    kept = []
    for limit in (1e6, 75e3, 20e3):
        path = ms.write_page(move, tmp_path / "a.html", size_limit=limit)
        assert path.stat().st_size < alone + limit + 3e3
        data = Page(path.read_text()).data
        kept.append(len(data["states"]))
        assert data["recorded"] == 41 and len(data["scalars"][-1]["values"]) == kept[-1]
        numbers_of = [round(state["time"] / 1e-3) for state in data["states"]]
        assert numbers_of[0] == 0 and numbers_of[-1] == 40
        for k, state in zip(numbers_of, data["states"], strict=True):
            found = decoded(state["positions"], mesh.n_vertices)
            assert found == pytest.approx(move.positions[k], abs=0.1 / 65535 if limit < 1e6 else 1e-8)
    assert kept[0] == kept[1] == 41 and 2 <= kept[2] < 20


def test_curves_of_probes_hold_every_recorded_state(mesh, tmp_path) -> None:
    move = lifted_strip(mesh, steps=40)
    probe = ms.Probe("tip", mesh.vertices_at(x=0.1))
    page = Page(ms.write_page(move, tmp_path / "a.html", probes=probe, size_limit=25e3).read_text())
    history = page.data["history"]
    assert len(page.data["states"]) < 41 and {"history", "column", "curve"} <= set(page.ids)
    assert [each["name"] for each in history["columns"]] == ["tip.x [m]", "tip.y [m]", "tip.z [m]"]
    assert history["along"]["name"] == "time [s]"
    np.testing.assert_array_equal(numbers(history["along"]["values"], "<f4"), move.times.astype("<f4"))
    wanted = move.displacements[:, mesh.vertices_at(x=0.1), 2].mean(axis=1)
    np.testing.assert_array_equal(numbers(history["columns"][2]["values"], "<f4"), wanted.astype("<f4"))
    for number, state in zip(history["numbers"], page.data["states"], strict=True):
        assert state["time"] == move.times[number]
    assert Page(ms.write_page(move, tmp_path / "b.html").read_text()).data["history"] is None
    with pytest.raises(ValueError, match="probes are of one result, got a TriangleMesh"):
        ms.write_page(mesh, tmp_path / "c.html", probes=probe)


def test_a_page_needs_no_network(mesh, path_, tmp_path) -> None:
    text = ms.write_page(mesh, tmp_path / "a.html", **path_).read_text()
    assert Page(text).links == []
    assert not re.search(
        r"(https?:)?//[a-z]|@import|url\(|fetch\(|XMLHttp|WebSocket|\bimport\b", text.replace("// ", "")
    )
    assert "{{" not in text


@pytest.mark.parametrize(
    "words",
    ["</script><script>alert(1)</script>", "<!--<script>", '"><img src=x onerror=alert(1)>', "{{data}}"],
)
def test_names_are_text_and_nothing_else(mesh, path_, tmp_path, words) -> None:
    plain = Page(ms.write_page(mesh, tmp_path / "a.html", **path_, color=np.arange(mesh.n_faces)).read_text())
    color = ms.Color(np.arange(mesh.n_faces), label=words)
    named = {"title": words, "titles": [words, "b", "c"], "color": color}
    path = ms.write_page(mesh, tmp_path / "b.html", **path_, **named)
    page = Page(path.read_text())
    assert page.heading == words and page.data["states"][0]["title"] == words
    assert page.data["scalars"][0]["label"] == words
    assert page.open == plain.open == [] and page.links == plain.links and page.ids == plain.ids
    assert path.read_text().count("<script") == 2
    assert page.data["states"][0]["positions"] == plain.data["states"][0]["positions"]


def test_a_page_is_as_large_as_its_mesh(tmp_path) -> None:
    sizes = []
    for cells in ((40, 40), (80, 80)):
        mesh = ms.meshes.rectangle(0.1, 0.1, cells=cells)
        sizes.append((mesh.n_vertices, ms.write_page(mesh, tmp_path / "a.html").stat().st_size))
    (n0, s0), (n1, s1) = sizes
    assert (s1 - s0) / (n1 - n0) == pytest.approx(
        4 / 3 * (24 + 24 + 24), rel=0.02
    )  # faces, edges, two positions
    assert s0 - 96 * n0 < 30e3  # the viewer itself


def test_bad_input_is_refused(mesh, tmp_path) -> None:
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        ms.write_page(mesh, tmp_path / "none" / "a.html")
    with pytest.raises(ValueError, match=r"saved as \.html"):
        ms.write_page(mesh, tmp_path / "a.png")
    with pytest.raises(ValueError, match="different faces"):
        ms.write_page([mesh, mesh.flipped()], tmp_path / "a.html")
    with pytest.raises(ValueError, match="titles must be 1 strings"):
        ms.write_page(mesh, tmp_path / "a.html", titles=["a", "b"])
    with pytest.raises(ValueError, match="color must be"):
        ms.write_page(mesh, tmp_path / "a.html", color="colour")
    with pytest.raises(ValueError, match=r"size_limit \[bytes\] must be positive"):
        ms.write_page(mesh, tmp_path / "a.html", size_limit=0)
    with pytest.raises(ValueError, match="speed must be positive"):
        ms.write_page(mesh, tmp_path / "a.html", speed=0)
    assert list(tmp_path.iterdir()) == []
