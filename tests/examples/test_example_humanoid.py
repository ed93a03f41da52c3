"""The soft figure, from one start."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def figure() -> dict:
    return load("humanoid").main(n_starts=1, slope=False)


def test_the_body_has_the_papers_size(figure) -> None:
    body = figure["body"]
    extents = np.ptp(body.mesh.rest_positions, axis=0)
    np.testing.assert_allclose(extents, (4.1, 1.3, 2.9), rtol=0.02)
    assert body.mesh.n_tetrahedra == pytest.approx(3078, rel=0.05) and body.mesh.n_components == 1
    assert sum(map(len, body.nearest.values())) == body.mesh.n_vertices
    assert all(len(vertices) > 3 for vertices in body.link_vertices.values())


def test_bones_keep_their_length_where_there_are_any(figure) -> None:
    for kind in ("rigid", "passive", "driven"):
        [fall] = figure["falls"][kind]
        assert fall.bone_error < 1e-12, kind
        assert fall.body_error < 0.05, kind
    assert figure["falls"]["no skeleton"][0].bone_error > 0.01


def test_driven_skeleton_alone_reaches_the_y_pose(figure) -> None:
    errors = {kind: falls[0].joint_error for kind, falls in figure["falls"].items()}
    assert errors["driven"] < 0.2
    assert min(errors[kind] for kind in ("no skeleton", "rigid", "passive")) > 1.0


def test_angles_of_vertices_are_those_of_joints(figure) -> None:
    load("humanoid")
    from _humanoid.fall import Figure, angles, starts

    made = Figure(figure["body"], "driven")
    motion = made.fall(starts(1)[0], steps=20)
    told = np.array([motion[joint].angle[-1] for joint in made.joints])
    np.testing.assert_allclose(angles(figure["body"], motion.positions[-1]), told, atol=1e-12)
    assert told[0] > 0.1


def test_figure_lands_on_its_soles(figure) -> None:
    [fall] = figure["falls"]["driven"]
    soles = fall.motion.positions[:, figure["body"].soles, 2].min(axis=1)
    assert soles[0] > 0.1 and -0.05 < soles[-1] < 0.02


def test_the_slope_through_landing_and_friction(figure) -> None:
    load("humanoid")
    from _humanoid.fall import Figure, slope_error, starts

    assert slope_error(Figure(figure["body"], "driven"), starts(1)[0], steps=40) < 1e-4


def test_pictures_of_the_figure(figure, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    example = load("humanoid")
    assert len(example.plot(figure).axes) == 2
    [fall] = figure["falls"]["driven"]
    assert example.picture(fall)._repr_png_().startswith(b"\x89PNG")
    assert "joint angles" in example.summary(figure)
