"""The ball thrown at a sheet: nothing passes, it gets lower and wider, and it comes back."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("ball_on_sheet")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main(cases=((8, 2),), throws=example.THROWS[:3], steps=60)


def test_meshes_are_the_papers(example, result) -> None:
    assert result["rows"][0]["sheet_nodes"] == 81 and result["rows"][0]["ball"] == (43, 80)
    sizes = [example.scenery(example.THROWS[0], cells).sheet.mesh for cells in (16, 32)]
    assert [(mesh.n_vertices, mesh.n_faces) for mesh in sizes] == [(289, 512), (1089, 2048)]


def test_no_face_passes_through_another_body(result) -> None:
    for row in [*result["rows"], result["soft"]]:
        assert row["penetrations"] == 0
        assert row["gaps"].min() > row["least_gap"]
        assert (
            row["forces"].max() > 98
        )  # it carried more than the ball's weight, or there was nothing to pass


def test_ball_gets_lower_and_wider(result) -> None:
    for row in result["rows"]:
        assert 0.1 < row["compression"] < 0.3
        assert 0.02 < row["stretching"] < 0.15


def test_ball_flies_off_again_and_gains_nothing(result) -> None:
    row = result["rows"][0]
    height = row["center"][:, 2]
    lowest = np.argmin(height)
    assert 0 < lowest < len(height) - 10 and row["forces"][-1] == 0
    motion = row["motion"]
    ball = slice(0, row["ball"][0])
    speeds = motion.velocities[:, ball, 2].mean(axis=1)
    energies = 0.5 * speeds**2 + 9.8 * height  # of the ball's center, J/kg
    assert speeds[-1] > 0.5
    assert energies.max() < energies[0] * (1 + 1e-2)


def test_picture_movie_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "ball.png")
    assert (tmp_path / "ball.png").stat().st_size > 50_000
    example.movie(result["shown"], tmp_path / "ball.gif", speed=1.0, fps=8, width=400, progress=False)
    assert (tmp_path / "ball.gif").stat().st_size > 5_000
    assert "81   43 / 80" in example.summary(result)
