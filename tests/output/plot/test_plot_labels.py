"""Texts in pictures and movies: none crosses another, none leaves the figure; they are broken, moved or made smaller."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from text_boxes import texts, wrong_texts

import magshell as ms
from magshell.output.plot import frames
from magshell.output.plot.colors import Scalar, scalar_of
from magshell.output.plot.label_layout import Box, Room, candidate_centers
from magshell.output.plot.legend import ticks_of
from magshell.output.plot.panels import Drawing, Label, Options, Panel, size_of
from magshell.output.plot.picture import paint
from magshell.output.plot.solids import sheet
from magshell.output.plot.texts import Ruler
from magshell.output.plot.view import view_of
from magshell.output.results.state import states_of, timed
from magshell.output.results.units import length_unit

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
ANGLES = np.linspace(0, 2 * np.pi, MESH.n_faces)
TURNING = 4e4 * np.stack([np.cos(ANGLES), 0 * ANGLES, np.sin(ANGLES)], axis=1)
FIELD = {"applied_flux_density": (0, 0, 5e-3)}
DIPOLE = {"field": ms.Dipoles([[0.05, 0.01, -0.05]], [[0, 0, 1.0]])}
LONG = "a quantity with a rather long name, averaged over the faces around a vertex and over time [10$^{-3}$ N/m$^2$]"
SENTENCE = (
    "a title that says at length what one sees in the picture below, and why one should look at it at all"
)


def bent(angle: float) -> np.ndarray:
    x, y, _ = MESH.rest_positions.T
    radius = 0.1 / angle
    return np.stack([radius * np.sin(x / radius), y, radius * (1 - np.cos(x / radius))], axis=1)


@pytest.fixture(scope="module")
def fallen() -> ms.Trajectory:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    magnet = ms.CuboidMagnet((0.02, 0.02, 0.02), (0, 0, 1e5), center=(0.05, 0.01, -0.03))
    scene = ms.Scene(
        sheet,
        contacts=[ms.Contact(ms.obstacles.Plane(center=(0, 0, -1e-3)))],
        field=[ms.UniformField(), magnet],
        gravity=(0, 0, -9.81),
        allow_rigid_motions=True,
    )
    return ms.simulate(
        scene, steps=10, time_step=4e-3, remanent_magnetization=(1e3, 0, 0), applied_flux_density=(0, 0, 1e-3)
    )


def states(count: int, low: float, high: float) -> np.ndarray:
    return np.stack([bent(angle) for angle in np.linspace(low, high, count)])


SCENES = {
    "a sheet in a field": lambda _: (
        MESH,
        {"positions": bent(1.5), "remanent_magnetization": TURNING, **FIELD},
    ),
    "two kinds of fields": lambda _: (
        MESH,
        {"positions": bent(1.5), "remanent_magnetization": TURNING, **FIELD, **DIPOLE},
    ),
    "three kinds of arrows": lambda fallen: (
        fallen,
        {"states": [-1], "color": "contact_pressure", "style": ms.Style(contacts=True, backend="matplotlib")},
    ),
    "nine panels": lambda _: (
        MESH,
        {
            "positions": states(9, 0.1, 3.0),
            "titles": [f"{k} mT, found by following the path" for k in range(9)],
        },
    ),
    "nine states over each other": lambda _: (
        MESH,
        {
            "positions": states(9, 1.4, 1.6),
            "titles": [f"state {k}" for k in range(9)],
            "overlay": True,
            **FIELD,
        },
    ),
    "the same four times": lambda _: (
        MESH,
        {
            "positions": states(4, 1.0, 1.0),
            "titles": [f"state number {k}" for k in range(4)],
            "overlay": True,
        },
    ),
    "a motion that fades": lambda fallen: (fallen, {"fade": True}),
    "long texts": lambda _: (
        MESH,
        {
            "positions": bent(1.5),
            "color": ms.Color(np.linspace(-1.2345e-5, 1.2345e-5, MESH.n_faces), label=LONG),
            "titles": [SENTENCE],
        },
    ),
    "texts without a space": lambda _: (
        MESH,
        {"color": ms.Color(ANGLES, label="n" * 120), "titles": ["m" * 500]},
    ),
    "numbers alike": lambda _: (MESH, {"color": np.linspace(1e6 + 0.125, 1e6 + 0.25, MESH.n_faces)}),
    "axes over each other": lambda _: (MESH, {"view": (0, -45)}),
    "a tall sheet": lambda _: (
        MESH,
        {
            "positions": MESH.rest_positions[:, [2, 1, 0]],
            "view": (0, 0),
            "color": "displacement",
            "remanent_magnetization": (3e5, 0, 0),
            **FIELD,
        },
    ),
    "several meshes": lambda _: (
        [MESH, MESH.transformed(translation=(0, 0, 0.01))],
        {"titles": ["flat", "high"], "overlay": True, **FIELD, **DIPOLE},
    ),
}


@pytest.mark.parametrize("width", [400, 900, 1600])
@pytest.mark.parametrize("name", SCENES)
def test_no_texts_cross(fallen, name, width):
    what, options = SCENES[name](fallen)
    picture = ms.plot(what, **{"style": ms.Style(backend="matplotlib"), **options}, width=width)
    assert wrong_texts(picture.figure) == []
    assert len(texts(picture.figure)) >= 4  # of the axes and the scale bar at least


def test_overlap_check_finds_crossing_texts():
    picture = ms.plot(MESH, width=800, style=ms.Style(backend="matplotlib"))
    picture.figure.text(0.5, 0.5, "one")
    picture.figure.text(0.5, 0.5, "another")
    picture.figure.text(0.99, 0.5, "outside")
    found = wrong_texts(picture.figure)
    assert any("'one' crosses 'another'" in each for each in found)
    assert any("'outside' leaves the figure" in each for each in found)


def test_every_state_that_has_room_is_named():
    what, options = SCENES["nine states over each other"](None)
    picture = ms.plot(what, **options, width=1600, style=ms.Style(backend="matplotlib"))
    said = [text for text, _ in texts(picture.figure)]
    assert {f"state {k}" for k in range(9)} <= set(said)


def test_line_breaks_keep_titles_and_units_complete():
    what, options = SCENES["long texts"](None)
    for width in (400, 900):
        said = [
            text.replace("\n", " ")
            for text, _ in texts(
                ms.plot(what, **options, width=width, style=ms.Style(backend="matplotlib")).figure
            )
        ]
        assert SENTENCE in said and LONG in said


def test_no_frame_of_a_movie_has_texts_that_cross():
    """Test a growing field, whose label grows, too, and a long title."""
    count = 6
    drawn = states_of(
        MESH, positions=states(count, 0.1, 3.0), remanent_magnetization=TURNING, field=DIPOLE["field"]
    )
    fields = np.geomspace(1e-5, 1.0, count)[:, None] * (0, 0, 1.0)
    drawn = [
        replace(state, flux_density=field)
        for state, field in zip(timed(drawn, np.linspace(0, 1, count)), fields, strict=True)
    ]
    unit = length_unit(size_of(drawn))
    scalar = scalar_of(drawn, "displacement", None, None, unit)
    scenery = frames.Scenery(drawn, scalar, view_of(drawn, None), unit, Options())
    made = [
        scenery.drawing(state, values, f"{SENTENCE} {state.title}")
        for state, values in zip(drawn, scalar.values, strict=True)
    ]
    with frames.Reel(made[-1], 400, "matplotlib") as reel:
        for each in made:
            reel.image(each)
            assert wrong_texts(reel._figure) == []


def test_a_floor_and_a_field_leave_the_sheet_large():
    """Check that the field's arrow stands next to the sheet, not next to a large floor."""
    floor = ms.obstacles.Box((5.0, 5.0, 0.02), center=(0, 0, -0.03))
    bare, floored = (
        ms.plot(MESH, obstacles=each, **FIELD, width=800, style=ms.Style(backend="matplotlib"))
        .figure.axes[0]
        .get_xlim()
        for each in ((), floor)
    )
    assert np.ptp(floored) < 1.5 * np.ptp(bare)


# Its parts


def test_a_place_is_free_and_clear_where_there_is_one():
    room = Room(Box(np.zeros(2), np.array([1.0, 1.0])), drawn=np.array([[0.5, 0.6]]))
    point = np.array([0.5, 0.5])
    size = (0.2, 0.1)
    first = room.take(size, candidate_centers(point, size, (0, 1)))
    assert not first.covers(room.drawn)  # though it was to be above
    others = [room.take(size, candidate_centers(point, size, (0, 1))) for _ in range(60)]
    kept = [each for each in others if each is not None]
    assert 5 < len(kept) < 50  # a text that has no room is left out
    for k, one in enumerate([first, *kept]):
        assert room.area.contains(one) and not any(one.crosses(other) for other in [first, *kept][:k])


def test_lines_break_between_words_and_not_within_formulas():
    ruler = Ruler(200)
    broken = ruler.broken("a force [10$^{-3} N / m$] of the whole sheet", 8.0, 0.7)
    lines = broken.split("\n")
    assert len(lines) > 2 and any("$^{-3} N / m$" in line for line in lines)
    assert all(ruler.size(line, 8.0)[0] <= 0.7 or " " not in line for line in lines)
    text, size = ruler.fitted("n" * 300, 8.0, 1.0, 0.2)
    assert text.endswith("…") and size == 4.0 and ruler.size(text, size)[0] <= 1.0


@pytest.mark.parametrize(
    "limits, wanted",
    [((0.0, 8.0), "0"), ((1e-14, 2e-14), "1e-14"), ((1e6 + 0.125, 1e6 + 0.25), None), ((-3e-20, 3e-20), "0")],
)
@pytest.mark.parametrize("width", [0.8, 2.4])
def test_ticks_say_where_they_are(limits, wanted, width):
    """Test small numbers, and numbers that differ little."""
    found = ticks_of(Scalar("", [], limits), width, Ruler(200))
    extent = limits[1] - limits[0]
    assert len({text for _, text in found}) == len(found) >= 1
    for value, text in found:
        assert abs(float(text) - value) <= 1e-3 * extent
    if wanted is not None:
        assert wanted in [text for _, text in found]


def test_labels_far_outside_stay_in_the_panel():
    [state] = states_of(MESH)
    unit = length_unit(0.1)
    view = view_of([state], None)
    drawing = Drawing([Panel("")], view, unit, None, [], np.stack([[0, 0, 0], [0.1, 0.02, 0.0]]))
    drawing.panels[0].labels = [
        Label(np.array([9.0, 9.0, 9.0]), "far", "#000000"),
        Label(np.zeros(3), "n" * 99, "#000000"),
    ]
    drawing.panels[0].solids = [sheet(state.positions, state.mesh.faces, np.ones(3))]
    figure = paint(drawing, 600, None, "matplotlib").figure
    assert wrong_texts(figure) == []
