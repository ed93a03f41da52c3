"""The example of the hexagram, on a mesh of 486 faces: its numbers, their assumptions, and its pictures."""

import numpy as np
import pytest
from example_modules import load

import magshell as ms

example = load("hexagram")
design, sheet = load("_hexagram.design"), load("_hexagram.sheet")


@pytest.fixture(scope="module")
def result() -> dict:
    return example.main(edges_per_side=6, n_vertices=280, iterations=40)


def test_mesh_has_the_papers_faces_and_vertices() -> None:
    mesh = sheet.hexagram(12, 1097)
    assert (mesh.n_faces, mesh.n_vertices, len(mesh.boundary_edges)) == (2048, 1097, 144)
    assert mesh.face_areas.sum() == pytest.approx(3 * np.sqrt(3) * sheet.SIDE**2, rel=1e-12)
    assert mesh.face_areas.min() > 0.3 * mesh.face_areas.mean()
    radii = np.linalg.norm(mesh.rest_positions, axis=1)
    np.testing.assert_allclose(radii[sheet.tips(mesh)], np.sqrt(3) * sheet.SIDE, rtol=1e-12)
    np.testing.assert_allclose(radii[sheet.feet(mesh)], sheet.SIDE, rtol=1e-12)
    assert radii[sheet.center(mesh)] == 0.0


def test_no_edge_crosses_a_root() -> None:
    mesh = sheet.hexagram(12, 1097)
    _, s = sheet.arm_coordinates(mesh.rest_positions)
    side = np.where(np.abs(s) < 1e-9 * sheet.SIDE, 0, np.sign(s))[mesh.faces]
    assert (side.min(axis=1) * side.max(axis=1) >= 0).all()


def test_mesh_that_cannot_be_had_is_refused() -> None:
    with pytest.raises(ValueError, match="no mesh of 60 vertices"):
        sheet.hexagram(4, 60)


@pytest.mark.parametrize("degrees", [-90.0, 0.0, 90.0, 200.0])
def test_rolling_is_an_isometry(degrees) -> None:
    """Compare the metric of the rolled sheet, from differences of the formula off the roots, with the flat one."""
    mesh, step = sheet.hexagram(6, 280), 1e-7
    centers = mesh.face_barycenters
    columns = [
        (
            sheet.rolled(centers + shift, np.radians(degrees))
            - sheet.rolled(centers - shift, np.radians(degrees))
        )
        / (2 * step)
        for shift in step * np.eye(3)[:2]
    ]
    tangents = np.stack(columns, axis=2)
    np.testing.assert_allclose(
        tangents.transpose(0, 2, 1) @ tangents, np.broadcast_to(np.eye(2), (486, 2, 2)), atol=1e-8
    )


def test_rolled_arms_are_arcs() -> None:
    mesh = sheet.hexagram(6, 280)
    rest, rolled = mesh.rest_positions, sheet.rolled(mesh.rest_positions, np.radians(90.0))
    _, s = sheet.arm_coordinates(rest)
    np.testing.assert_array_equal(rolled[s <= 0], rest[s <= 0])
    radius = sheet.ARM_LENGTH / np.radians(90.0)
    tips = rolled[sheet.tips(mesh)]
    np.testing.assert_allclose(tips[:, 2], -radius, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(tips[:, 0], tips[:, 1]), sheet.ROOT_DISTANCE + radius, rtol=1e-12)


def test_objective_falls_from_both_starts(result) -> None:
    beam, none = result["runs"]["from beam theory"], result["runs"]["from none"]
    assert beam["history"][0].objective == pytest.approx(2.22e-2, rel=0.05)
    assert beam["objective"] < 5e-4
    assert none["history"][0].objective == pytest.approx(4.07e-2, rel=0.01)
    assert none["objective"] < 6e-3
    assert result["rms"] < 0.3e-3
    assert result["plain_sum"] < 8e-5


def test_objective_is_the_mean_square_distance(result) -> None:
    star, positions = result["design"], result["positions"]
    squares = ((positions - star.targets.numpy()) ** 2).sum(axis=2)
    assert result["plain_sum"] == pytest.approx(squares.sum(), rel=1e-9)
    shares = star.scene.shell.vertex_masses / star.scene.shell.vertex_masses.sum()
    mean = (squares @ shares).sum() / sheet.ARM_LENGTH**2
    assert result["runs"]["from beam theory"]["objective"] == pytest.approx(mean, rel=1e-6)


def test_arms_reach_their_angles(result) -> None:
    chords, faces = result["chord_angles"], result["tip_angles"]
    np.testing.assert_allclose(np.degrees(chords["reached"]), 40.4, atol=1.5)
    assert np.degrees(chords["wanted"]) == pytest.approx(45.0)
    np.testing.assert_allclose(np.degrees(faces["reached"]), 64.0, atol=2.5)
    np.testing.assert_allclose(np.degrees(faces["wanted"]), 82.5, atol=0.1)
    assert result["hexagon_height"] < 0.04 * sheet.ARM_LENGTH


def test_reversed_field_mirrors_the_shape(result) -> None:
    assert result["mirror"] < 1e-9
    assert result["normal_magnetization"] < 1e-9 * design.CAP


def test_a_normal_component_breaks_the_mirror(result) -> None:
    """Check that the mirrored shapes are due to the in-plane magnetization."""
    tilted = result["magnetization"] + np.array([0.0, 0.0, 0.05 * design.CAP])
    rest = ms.equilibrium(
        result["design"].scene, remanent_magnetization=tilted, applied_flux_density=design.FIELDS
    )
    down, up = rest.positions
    assert np.abs(down * (1, 1, -1) - up).max() > 1e-3 * sheet.ARM_LENGTH


def test_magnetization_stays_below_its_cap(result) -> None:
    assert 0.8 * design.CAP < result["largest_magnetization"] < design.CAP


def test_magnetization_points_inwards_in_the_arms_and_outwards_in_the_hexagon(result) -> None:
    star = result["design"]
    along = np.einsum("fi,fi->f", result["magnetization"], star.frames[:, 0].numpy())
    _, s = sheet.arm_coordinates(star.mesh.face_barycenters)
    assert (along[s > 0.4 * sheet.ARM_LENGTH] < 0).all()
    assert along[s < -0.2 * sheet.ARM_LENGTH].mean() > 0.05 * design.CAP


def test_arms_shake_as_the_field_goes_round(result) -> None:
    shaking = result["shaking"]
    assert shaking["not_closed"] < 1e-9
    np.testing.assert_allclose(np.linalg.norm(shaking["fields"], axis=1), design.FLUX_DENSITY)
    heights = shaking["heights"][:-1]
    assert np.ptp(heights, axis=0).min() > 0.7 * sheet.ARM_LENGTH
    # the feet have threefold symmetry: 120 degrees are four steps of the field and two arms
    np.testing.assert_allclose(np.roll(heights, (4, 2), axis=(0, 1)), heights, atol=0.06 * sheet.ARM_LENGTH)
    assert np.abs(np.roll(heights, (4, 0), axis=(0, 1)) - heights).max() > 0.5 * sheet.ARM_LENGTH


def test_pictures_and_summary_are_written(result, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")  # what runs everywhere, and the quicker
    example.plot(result).savefig(tmp_path / "plot.png")
    for name, picture in example.pictures(result).items():
        picture.save(tmp_path / f"{name}.png")
    assert {path.stem for path in tmp_path.glob("*.png")} == {"plot", "magnetization", "states", "shaking"}
    assert all(path.stat().st_size > 20_000 for path in tmp_path.glob("*.png"))
    assert "486 faces" in example.summary(result)
