"""Parameters in groups: built once and passed to many calls; the message for a moved keyword names its group."""

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot.view import view_of

pytest.importorskip("matplotlib")

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
PLAIN = ms.Style(backend="matplotlib")
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
SCENE = ms.Scene(SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], gravity=(0, 0, -1.0))
LIFTED = np.stack([MESH.rest_positions, MESH.rest_positions + np.array([0, 0, 0.02])])


def limits(picture) -> np.ndarray:
    axes = picture.figure.axes[0]
    return np.array([*axes.get_xlim(), *axes.get_ylim()])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: ms.plot(MESH, mesh_lines=True),
            r"plot\(\) has no keyword 'mesh_lines'; use style=ms.Style\(mesh_lines=...\)",
        ),
        (lambda: ms.plot(MESH, color_label="u"), r"color=ms.Color\(label=...\)"),
        (lambda: ms.plot(MESH, frame=None), r"view=ms.View\(frame=...\)"),
        (lambda: ms.animate(MESH, "a.gif", backend="matplotlib"), r"style=ms.Style\(backend=...\)"),
        (lambda: ms.write_page(MESH, "a.html", arrows=3), r"style=ms.Style\(arrows=...\)"),
        (lambda: ms.equilibrium(SCENE, tolerance=1e-8), r"solver=ms.MixedNewton\(tolerance=...\)"),
        (lambda: ms.follow_path(SCENE, max_iterations=9), r"solver=ms.MixedNewton\(max_iterations=...\)"),
        (lambda: ms.find_equilibria(SCENE, tolerance=1e-8), r"solver=ms.MixedNewton\(tolerance=...\)"),
        (
            lambda: ms.simulate(SCENE, steps=1, time_step=1e-3, memory_budget=1e6),
            r"adjoint_storage=ms.AdjointStorage\(memory_budget=...\)",
        ),
        (
            lambda: ms.simulate(SCENE, steps=1, timestep=1e-3),
            "no keyword 'timestep'; use time_step; it has: time_step,",
        ),
        (lambda: ms.plot(MESH, colour=None), "no keyword 'colour'; it has, most like it first: color,"),
    ],
)
def test_a_keyword_that_is_elsewhere_is_told_where(call, words):
    with pytest.raises(TypeError, match=words):
        call()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ms.Style(arrows=-1), "arrows must be"),
        (lambda: ms.Style(arrows=10**9), "a count of at most 20000"),
        (lambda: ms.Style(rest="yes"), "rest must be True or False, got 'yes'"),
        (
            lambda: ms.Style(backend="opengl"),
            "backend must be one of 'magshell', 'pyvista', 'matplotlib', got 'opengl'",
        ),
        (lambda: ms.Color("displacement", label=3), "the label of a color must be a string, got 3"),
        (
            lambda: ms.Color("displacement", scale="hot"),
            "scale of a color must be sequential, diverging, cyclic or None",
        ),
        (lambda: ms.View(1, np.nan), r"azimuth \[degrees\] must be finite"),
        (
            lambda: ms.View(1, 2, frame=np.zeros((2, 3))),
            "two opposite corners of a box, got the same point twice",
        ),
        (lambda: ms.View(1, 2, frame=(0, 1)), r"frame \[m\] must have shape"),
        (
            lambda: ms.AdjointStorage("all"),
            'adjoint_storage must be "stages", "checkpoints", "factors" or None',
        ),
        (lambda: ms.AdjointStorage(memory_budget=-1), r"memory_budget \[bytes\] must not be negative"),
    ],
)
def test_bad_groups_are_refused_as_they_are_made(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_pictures_with_one_frame_have_one_window():
    view = ms.View(20, -60, frame=[(0, 0, -0.01), (0.1, 0.02, 0.05)])
    low, high = (ms.plot(MESH, positions=each, view=view, width=500, style=PLAIN) for each in LIFTED)
    np.testing.assert_array_equal(limits(low), limits(high))
    own = [limits(ms.plot(MESH, positions=each, view=(20, -60), width=500, style=PLAIN)) for each in LIFTED]
    assert np.abs(own[1] - own[0]).max() > 0.01


@pytest.mark.parametrize("name, right, up", [("top", 0, 1), ("front", 0, 2), ("side", 1, 2)])
def test_usual_views_have_names(name, right, up):
    """Check the axes of the world that point to the right and upwards."""
    axes = view_of([], name).axes
    np.testing.assert_allclose(axes[:2], np.eye(3)[[right, up]], atol=1e-12)
    with pytest.raises(ValueError, match="'top', 'front', 'side', got 'above'"):
        ms.plot(MESH, view="above", style=PLAIN)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: ms.Shell(MESH, thickness=1e-3, modulus=1e6),
            r"Shell\(\) has no keyword 'modulus'; use young_modulus; it has: ",
        ),
        (
            lambda: ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, density=1e3),
            "use mass_density; it has: mass_density",
        ),
        (lambda: ms.Scene(SHEET, support=[]), r"Scene\(\) has no keyword 'support'; .*first: supports"),
        (
            lambda: ms.meshes.rectangle(0.1, 0.1, cell=(2, 2)),
            "rectangle.* has no keyword 'cell'; .*first: cells",
        ),
    ],
)
def test_a_keyword_that_is_misspelt_is_told_the_nearest(call, words):
    with pytest.raises(TypeError, match=words):
        call()


def test_a_frame_shows_a_part(tmp_path):
    """Check the requested size, whatever else is in the scene; labels of places outside the frame are omitted."""
    view = ms.View(90, -90, frame=[(0.08, 0, 0), (0.1, 0.02, 0.0)])
    field = {"applied_flux_density": (0, 1e-3, 0)}
    picture = ms.plot(MESH, view=view, width=500, style=PLAIN, **field)
    left, right, bottom, top = limits(picture)
    assert right - left < 0.025 and top - bottom < 0.025
    assert not picture.figure.axes[0].texts  # the field's arrow is left of the sheet
    assert ms.plot(MESH, view=(90, -90), width=500, style=PLAIN, **field).figure.axes[0].texts
    movie = ms.animate(
        MESH, tmp_path / "a.gif", positions=LIFTED, view=view, width=400, style=PLAIN, progress=False
    )
    assert movie.stat().st_size > 500
    with pytest.raises(ValueError, match="a page shows all of it"):
        ms.write_page(MESH, tmp_path / "a.html", view=view)


def test_a_color_brings_its_text_its_ends_and_its_scale():
    values = np.linspace(-1.0, 3.0, MESH.n_faces)
    wanted = {"sequential": (-1.0, 3.0), "diverging": (-3.0, 3.0)}
    for scale, (low, high) in wanted.items():
        color = ms.Color(values, label="u [m]", scale=scale)
        [bar] = ms.plot(MESH, color=color, width=600, style=PLAIN).figure.axes[-1].images
        said = [
            t.get_text() for t in ms.plot(MESH, color=color, width=600, style=PLAIN).figure.axes[-1].texts
        ]
        assert "u [m]" in said
        numbers = [float(text) for text in said if text.lstrip("-").replace(".", "").isdigit()]
        assert low <= min(numbers) < max(numbers) <= high
        assert bar is not None
    one = ms.Color("displacement", range=(0, 100))
    said = [
        {
            t.get_text()
            for t in ms.plot(MESH, positions=each, color=one, width=600, style=PLAIN).figure.axes[-1].texts
        }
        for each in LIFTED
    ]
    assert said[0] == said[1] and "100" in said[0]  # one scale for both


def test_a_page_takes_what_a_style_says(tmp_path):
    style = ms.Style(arrows=False, rest=True, show_field=False)
    field = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": (0, 0, 1e-3)}
    text = ms.write_page(MESH, tmp_path / "a.html", style=style, **field).read_text()
    assert '"shown":{"rest":true,"edges":false}' in text
    assert 'fluxDensity"' not in text and 'magnetizationLabel"' not in text
    text = ms.write_page(MESH, tmp_path / "a.html", **field).read_text()
    assert '"fluxDensity"' in text and '"magnetizationLabel"' in text
    with pytest.raises(ValueError, match="a page does not show contacts"):
        ms.write_page(MESH, tmp_path / "b.html", style=ms.Style(contacts=True))


def test_adjoint_storage_may_be_a_word_or_a_group():
    torch = pytest.importorskip("torch")
    young = torch.tensor(1e6, dtype=torch.float64, requires_grad=True)
    for keep, word in (
        ("factors", "factors"),
        (ms.AdjointStorage("factors"), "factors"),
        (ms.AdjointStorage(memory_budget=1.0), "checkpoints"),
    ):
        move = ms.simulate(SCENE, steps=8, time_step=1e-3, young_modulus=young, adjoint_storage=keep)
        assert move.adjoint_storage == word
