"""The crawler's first steps, in longer time steps than the example's."""

import numpy as np
import pytest
from example_modules import load

TIME_STEP = 1e-3  # s


@pytest.fixture(scope="module")
def example():
    return load("reptile")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main(cycles={"flat": 1, "slope": 1}, time_step=TIME_STEP)


@pytest.fixture(scope="module")
def parts(example):
    from _reptile import model, study

    return model, study


def advance(parts, walk) -> np.ndarray:
    return parts[1].advances(*walk)[0]


def test_the_paper_s_mesh_and_a_magnetization_that_adds_up_to_nothing(parts) -> None:
    model, _ = parts
    mesh = model.lizard()
    assert (mesh.n_faces, mesh.n_vertices) == (496, 326)
    assert mesh.n_components == 1
    magnetization = model.magnetization(mesh)
    total = (mesh.face_areas[:, None] * magnetization).sum(axis=0)
    assert np.abs(total).max() < 1e-12 * (mesh.face_areas[:, None] * np.abs(magnetization)).sum()


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_crawler_walks_ahead_and_uphill(parts, result) -> None:
    flat, slope = (advance(parts, result["walks"][name])[0] for name in ("flat", "slope"))
    assert flat == pytest.approx(3.2e-3, rel=0.05)
    assert 0.3 * flat < slope < flat


def test_crawler_keeps_to_its_line(parts, result) -> None:
    for walk in result["walks"].values():
        assert abs(advance(parts, walk)[1]) < 0.01e-3


def test_a_field_that_turns_the_other_way_drives_it_back(parts, result) -> None:
    """Use the symmetry: mirrored back to front, the pairs' magnets and the field's rotation change sign."""
    ahead, back = (advance(parts, walk)[0] for walk in (result["walks"]["flat"], result["back"]))
    assert back == pytest.approx(-ahead, rel=1e-3)


def test_penetration_into_the_ground_stays_below_0_1_mm(result) -> None:
    for who, motion in result["walks"].values():
        depth = who.ground.obstacle.signed_distance(motion.positions).min()
        assert -0.1e-3 < depth < 0


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_without_friction_it_stays_where_it_is(parts, result) -> None:
    model, study = parts
    slippery = model.crawler(model.flat(), friction_coefficient=0.0)
    motion = slippery.crawl(1, time_step=TIME_STEP)
    ahead = advance(parts, result["walks"]["flat"])[0]
    assert abs(study.advances(slippery, motion)[0, 0]) < 0.03 * ahead


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_pictures_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "reptile.png")
    example.animation(result, "slope", tmp_path / "slope.gif", fps=2, speed=0.1)
    assert (tmp_path / "reptile.png").stat().st_size > 30_000
    assert (tmp_path / "slope.gif").stat().st_size > 20_000
    assert "the other way" in example.summary(result)
