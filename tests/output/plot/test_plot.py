"""Contents of pictures on either backend; bad input is refused with a reason."""

import io

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot import backend as backends
from magshell.output.plot import colors, glyphs
from magshell.output.plot.colors import rgb, scalar_of
from magshell.output.plot.outlines import outline
from magshell.output.plot.view import view_of
from magshell.output.results.state import State, states_of
from magshell.output.results.units import length_unit, prefixed, round_below, with_unit

MAGNETIZATION = (4e4, 0.0, 0.0)


@pytest.fixture(params=["magshell", "matplotlib", "pyvista"])
def backend(request) -> str:
    if request.param == "pyvista" and (reason := backends.why_not_pyvista()):
        pytest.skip(f"pyvista cannot render here: {reason}")
    return request.param


@pytest.fixture(scope="module")
def mesh() -> ms.TriangleMesh:
    return ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))


@pytest.fixture(scope="module")
def bent(mesh) -> np.ndarray:
    """Return the positions of a sheet bent to a quarter of a circle, without stretch."""
    x, y, _ = mesh.rest_positions.T
    radius = 0.2 / np.pi
    return np.stack([radius * np.sin(x / radius), y, radius * (1 - np.cos(x / radius))], axis=1)


@pytest.fixture(scope="module")
def result(mesh) -> ms.Equilibrium:
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    return ms.equilibrium(scene, remanent_magnetization=MAGNETIZATION, applied_flux_density=(0, 0, 2e-3))


def pixels(picture: ms.Picture) -> np.ndarray:
    """Return the pixels of a picture, (height, width, 3), 0 to 1."""
    from matplotlib.image import imread

    return imread(io.BytesIO(picture._repr_png_()))[:, :, :3]


def color_fraction(image: np.ndarray, code: str, tolerance: float = 0.06) -> float:
    """Return the fraction of the pixels whose hue and brightness are those of a colour, up to shading."""
    wanted = rgb(code)
    scaled = image / np.maximum(image.max(axis=2, keepdims=True), 1e-9) * wanted.max()
    near = np.abs(scaled - wanted).max(axis=2) < tolerance
    return float((near & (np.abs(image.max(axis=2) - wanted.max()) < 0.25)).mean())


def painted(image: np.ndarray) -> float:
    return float((image.min(axis=2) < 0.98).mean())


# Contents of a picture


def test_a_result_is_painted(tmp_path, result, backend) -> None:
    picture = ms.plot(result, width=800, style=ms.Style(backend=backend))
    path = picture.save(tmp_path / "sheet.png")
    assert path.read_bytes().startswith(b"\x89PNG")
    image = pixels(picture)
    assert image.shape[1] == 800
    assert 0.03 < painted(image) < 0.6
    assert len(np.unique((image.reshape(-1, 3) * 31).astype(int), axis=0)) > 50
    assert repr(picture) == f"Picture(800 x {image.shape[0]} pixels, painted by {backend})"


def test_arrows_are_there_when_magnetized(mesh, backend) -> None:
    dark = [
        color_fraction(
            pixels(
                ms.plot(
                    mesh,
                    remanent_magnetization=m,
                    color=None,
                    width=800,
                    style=ms.Style(arrows=count, backend=backend),
                )
            ),
            colors.MAGNETIZATION,
        )
        for m, count in ((None, True), (MAGNETIZATION, False), (MAGNETIZATION, True))
    ]
    assert dark[2] > 2 * max(dark[:2]) + 2e-3


def test_the_uniform_field_stands_beside_the_sheet(mesh, backend) -> None:
    field = {"applied_flux_density": (0, 0, 5e-3), "color": None, "width": 800}
    with_field, without = (
        pixels(ms.plot(mesh, **field, style=ms.Style(backend=backend, show_field=shown)))
        for shown in (True, False)
    )
    green, none = (color_fraction(image[:-150], colors.FIELD) for image in (with_field, without))
    assert green > 1e-3 and none == 0.0
    left = with_field[:-150, : with_field.shape[1] // 4]
    assert color_fraction(left, colors.FIELD) * left.size > 0.9 * green * with_field[:-150].size


def test_a_field_of_dipoles_surrounds_the_sheet(mesh) -> None:
    field = ms.Dipoles([[0.05, 0.01, -0.05]], [[0.0, 0.0, 1.0]])
    image = pixels(ms.plot(mesh, field=field, color=None, width=800, style=ms.Style(backend="matplotlib")))
    quarters = [color_fraction(part, colors.FIELD) for part in np.array_split(image[:-150], 4, axis=1)]
    assert min(quarters) > 5e-4


def test_the_rest_shape_is_an_outline(mesh, bent) -> None:
    ink = [
        painted(
            pixels(
                ms.plot(
                    mesh,
                    positions=bent,
                    color=None,
                    view=(0, -90),
                    width=800,
                    style=ms.Style(rest=rest, backend="matplotlib"),
                )
            )[:-150]
        )
        for rest in (False, True)
    ]
    assert ink[0] < ink[1] < ink[0] + 0.02


def test_the_backends_paint_the_same_picture(result) -> None:
    if reason := backends.why_not_pyvista():
        pytest.skip(f"pyvista cannot render here: {reason}")
    one, other = (
        pixels(ms.plot(result, width=800, style=ms.Style(backend=b))) for b in ("matplotlib", "pyvista")
    )
    assert one.shape == other.shape
    assert np.abs(one - other).mean() < 0.02  # a shift by 5 pixels would be 0.03
    assert (np.abs(one - other).max(axis=2) > 0.3).mean() < 0.03


def test_near_parts_hide_far_ones(backend) -> None:
    near_is_red = []
    lower = ms.meshes.rectangle(0.02, 0.02, cells=(4, 4))
    upper = lower.transformed(translation=(0, 0, 0.005))
    for sheets in ([lower, upper], [upper, lower]):
        heights = [np.full(lower.n_faces, sheet.rest_positions[0, 2]) for sheet in sheets]
        picture = ms.plot(
            sheets, overlay=True, color=heights, view=(89, -90), width=600, style=ms.Style(backend=backend)
        )
        image = pixels(picture)[:-150]
        near_is_red.append(
            color_fraction(image, colors.SCALES["sequential"][-1])
            > 10 * color_fraction(image, colors.SCALES["sequential"][0])
        )
    assert near_is_red == [True, True]


def test_several_states_side_by_side_or_overlaid(mesh, bent) -> None:
    both = {"color": None, "titles": ["flat", "bent"], "style": ms.Style(backend="matplotlib"), "width": 800}
    states = np.stack([mesh.rest_positions, bent])
    side = ms.plot(mesh, positions=states, **both)
    over = ms.plot(mesh, positions=states, overlay=True, **both)
    assert [axes.get_title() for axes in side.figure.axes] == ["flat", "bent", ""]
    assert [text.get_text() for text in over.figure.axes[0].texts] == ["flat", "bent"]
    image = pixels(over)
    assert min(color_fraction(image, code) for code in colors.SERIES[:2]) > 5e-3
    assert len(ms.plot([mesh, mesh, mesh], columns=3, style=ms.Style(backend="matplotlib")).figure.axes) == 4


def test_labels_carry_units(result) -> None:
    texts = [
        t.get_text()
        for axes in ms.plot(result, style=ms.Style(backend="matplotlib")).figure.axes
        for t in axes.texts
    ]
    assert "$B$ = 2 mT" in texts and "$M_r$, up to 40 kA/m" in texts and "displacement [mm]" in texts
    assert any(text.endswith(" mm") for text in texts) and {"x", "y", "z"} <= set(texts)


# Its parts


@pytest.mark.parametrize("width", [1050, 1200, 1600])
def test_the_colour_bar_leaves_room_for_what_arrows_mean(mesh, width) -> None:
    """Test a tall picture, where the scale bar is long."""
    across = mesh.rest_positions[:, [2, 1, 0]]
    picture = ms.plot(
        mesh,
        positions=across,
        remanent_magnetization=(3e5, 0, 0),
        color="displacement",
        view=(0, 0),
        width=width,
        style=ms.Style(backend="matplotlib"),
    )
    strip = picture.figure.axes[-1]
    (bar,) = strip.images
    (meaning,) = (text for text in strip.texts if "M_r" in text.get_text())
    left = strip.transData.transform((bar.get_extent()[0], 0.0))[0]
    assert meaning.get_window_extent().x1 < left


def test_magnetization_turns_with_the_sheet(mesh, bent) -> None:
    state = State(mesh, bent, np.broadcast_to(MAGNETIZATION, (mesh.n_faces, 3)))
    angle = mesh.face_barycenters[:, 0] * np.pi / 0.2
    expected = 4e4 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    assert np.abs(state.magnetization - expected).max() < 0.05 * 4e4
    normal = State(mesh, bent, np.broadcast_to((0.0, 0.0, 1.0), (mesh.n_faces, 3))).magnetization
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0)


def test_arrows_spread_evenly(mesh) -> None:
    spacing = glyphs.spacing_of(mesh, 40)
    faces = glyphs.sample_faces(mesh, spacing)
    assert 25 <= len(faces) <= 55
    centers = mesh.face_barycenters[faces]
    gaps = np.linalg.norm(centers[:, None] - centers, axis=2) + np.eye(len(faces))
    assert gaps.min() > 0.4 * spacing


def test_named_scalars_have_their_values_and_units(mesh, bent) -> None:
    mm = length_unit(0.1)
    halves = np.where(mesh.face_barycenters[:, :1] < 0.05, 1.0, -1.0) * MAGNETIZATION
    [state] = states_of(
        mesh, positions=bent, remanent_magnetization=halves, applied_flux_density=(0, 0, 0.01)
    )
    signed = scalar_of([state], "magnetization", None, None, mm)
    assert signed.label == "$M_r$ along x [kA/m]" and signed.limits == (-40.0, 40.0)
    np.testing.assert_allclose(signed.values[0], halves[:, 0] / 1e3)
    moved = scalar_of([state], "displacement", None, None, mm)
    np.testing.assert_allclose(moved.values[0], 1e3 * np.linalg.norm(bent - mesh.rest_positions, axis=1))
    energy = scalar_of([state], "magnetic_energy", None, None, mm)
    np.testing.assert_allclose(energy.values[0], -0.01 * state.magnetization[:, 2])
    turning = np.stack([np.cos(x := mesh.face_barycenters[:, 0] * 60), np.sin(x), 0 * x], axis=1)
    [state] = states_of(mesh, remanent_magnetization=turning)
    angle = scalar_of([state], "magnetization", None, None, mm)
    assert angle.scale == "cyclic"
    np.testing.assert_allclose(angle.values[0], np.degrees(x) % 360.0)
    [state] = states_of(mesh, remanent_magnetization=turning * np.linspace(0, 1, mesh.n_faces)[:, None])
    assert scalar_of([state], "magnetization", None, None, mm).label == "$|M_r|$ [A/m]"


def test_a_scale_runs_between_its_ends() -> None:
    shades = colors.scale_colors("diverging", np.array([-1.0, 0.0, 1.0, 9.0, np.nan]), (-1.0, 1.0))
    anchors = colors.SCALES["diverging"]
    expected = [anchors[0], anchors[2], anchors[4], anchors[4], colors.NO_VALUE]
    np.testing.assert_allclose(shades, [rgb(code) for code in expected])


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 1), (1, 2, -1)])
def test_flat_sheets_are_seen_obliquely(normal) -> None:
    normal = np.array(normal) / np.linalg.norm(normal)
    helper = np.cross(normal, (0.3, 0.5, 0.8))
    frame = np.stack(
        [helper / np.linalg.norm(helper), np.cross(normal, helper) / np.linalg.norm(helper), normal], axis=1
    )
    for sides in ((0.1, 0.1), (0.1, 0.004)):
        sheet = ms.meshes.rectangle(*sides, cells=(4, 4)).transformed(frame)
        axes = view_of(states_of(sheet), None).axes
        assert 0.3 < abs(axes[2] @ normal) < 0.99
        if normal[2] == 1 and sides[1] < 0.1:
            assert np.linalg.norm(axes[:2] @ frame[:, 0]) > 0.85  # a strip lies across the picture


def test_a_view_is_a_rotation_with_z_upwards() -> None:
    mesh = ms.meshes.disk(1.0, cells=2)
    axes = view_of(states_of(mesh), (30.0, -60.0)).axes
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) > 0 and axes[1, 2] > 0 and abs(axes[0, 2]) < 1e-15
    np.testing.assert_allclose(axes[2], [np.sqrt(3) / 4, -0.75, 0.5])


def test_lines_are_the_boundary_and_the_creases(mesh) -> None:
    assert len(outline(mesh)) == len(mesh.boundary_edges)
    roof = ms.TriangleMesh([[0, 0, 0], [1, 0, 1], [1, 1, 1], [2, 0, 0]], [[0, 1, 2], [1, 3, 2]])
    assert [1, 2] in outline(roof).tolist()


def test_units_have_readable_prefixes() -> None:
    assert [length_unit(size).name for size in (3e-5, 3e-3, 0.12, 4.0)] == ["µm", "mm", "mm", "m"]
    assert with_unit(0.00626, "T") == "6.26 mT" and with_unit(0.0, "T") == "0 T"
    assert prefixed(48e3, "A/m") == (1e3, "kA/m")
    assert [round_below(x) for x in (0.034, 0.05, 9.9, 1.0)] == [0.02, 0.05, 5.0, 1.0]


def test_a_path_knows_its_fields(mesh) -> None:
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    source = ms.Dipoles([[0.05, 0.01, -0.2]], [[0.0, 0.0, 1.0]])
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], field=[ms.UniformField(), source])
    path = ms.follow_path(
        scene,
        remanent_magnetization=MAGNETIZATION,
        applied_flux_density=(0, 0, 1e-3),
        field_factor=0.5,
        first_step=0.5,
        progress=False,
    )
    states = states_of(path, remanent_magnetization=MAGNETIZATION)
    assert len(states) == len(path) > 2
    far = np.array([[0.0, 0.0, 0.1]])
    for state, positions, parameter in zip(states, path.positions, path.parameters, strict=True):
        np.testing.assert_array_equal(state.positions, positions)
        expected = parameter * (np.array([0, 0, 1e-3]) + 0.5 * source.flux_density(far))
        np.testing.assert_allclose(state.flux_density_at(far), expected, atol=1e-15)
    picture = ms.plot(path, states=[0, -1], width=400, style=ms.Style(backend="matplotlib"))
    last = f"parameter {path.parameters[-1]:.4g}"
    assert [axes.get_title() for axes in picture.figure.axes] == ["parameter 0", last, ""]


def test_some_of_many_states_are_drawn(mesh) -> None:
    many = np.repeat(mesh.rest_positions[None], 30, axis=0)
    assert (
        len(ms.plot(mesh, positions=many, width=400, style=ms.Style(backend="matplotlib")).figure.axes)
        == 9 + 1
    )


# Bad input


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"color": "colour"},
            "color must be None, 'auto', 'magnetization', 'displacement', 'magnetic_energy', 'contact_pressure', "
            "'volume_ratio', 'von_mises_stress', 'activation', 'fibre_stretch', "
            "'fibre_tension', 'membrane_force', 'bending_moment' or an array",
        ),
        ({"color": "magnetization"}, "needs magnetized faces"),
        ({"color": "magnetic_energy"}, "needs magnetized faces in a field"),
        ({"color": 7}, "color must be None, a name or an array, got 7"),
        ({"color": np.zeros(7)}, r"a number a face, \(160,\), or a vertex, \(105,\), got \(7,\)"),
        ({"color": np.full(160, np.nan)}, "must be finite"),
        ({"color": ms.Color("displacement", range=(1, 0))}, "the range of a color must rise"),
        ({"positions": np.zeros((3, 3))}, r"positions \[m\] must have shape \(n_v, 3\) = \(105, 3\)"),
        ({"remanent_magnetization": np.zeros((5, 3))}, r"remanent_magnetization \[A/m\] must have shape"),
        ({"applied_flux_density": np.zeros((2, 3))}, r"applied_flux_density \[T\] must have shape"),
        ({"view": (1, 2, 3)}, r"view \[degrees\] must have shape"),
        ({"titles": ["a", "b"]}, "titles must be 1 strings"),
        ({"states": [0, 1]}, "states must be numbers of the 1 states"),
        ({"width": 10}, "width must be at least 400 pixels and at most 8000, got 10"),
        ({"style": "bare"}, "style must be an ms.Style, got 'bare'"),
    ],
)
def test_bad_input_is_refused(mesh, arguments, message) -> None:
    with pytest.raises(ValueError, match=message):
        ms.plot(mesh, **{"style": ms.Style(backend="matplotlib"), **arguments})


@pytest.mark.parametrize(
    ("what", "message"), [("sheet", "cannot draw a str"), ([], "the list is empty"), (3, "cannot draw a int")]
)
def test_plot_refuses_other_objects(what, message) -> None:
    with pytest.raises(ValueError, match=message):
        ms.plot(what, style=ms.Style(backend="matplotlib"))


@pytest.mark.parametrize(("ending", "beginning"), [("pdf", b"%PDF-"), ("svg", b"<?xml")])
def test_vector_files_have_texts_and_the_same_bytes_again(mesh, tmp_path, ending, beginning) -> None:
    heights = ms.Color(mesh.rest_positions[:, 0], label="length [m]")
    picture = ms.plot(mesh, color=heights, titles="flat", width=400, style=ms.Style(backend="matplotlib"))
    contents = [picture.save(tmp_path / f"{name}.{ending}").read_bytes() for name in "ab"]
    assert contents[0].startswith(beginning) and contents[0] == contents[1]
    if ending == "svg":
        assert contents[0].count(b"<path") > mesh.n_faces  # each face is a polygon, not a pixel


def test_a_picture_goes_to_a_png_in_a_folder_that_exists(mesh, tmp_path) -> None:
    picture = ms.plot(mesh, width=400, style=ms.Style(backend="matplotlib"))
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        picture.save(tmp_path / "none" / "a.png")
    with pytest.raises(ValueError, match=r"saved as \.png or \.pdf or \.svg"):
        picture.save(tmp_path / "a.jpg")
    with pytest.raises(RuntimeError, match="no display"):
        picture.show()
