"""The jumping starfish: a short search on a coarse mesh, the gradient of its whole horizon, and its pictures."""

import numpy as np
import pytest
import torch
from example_modules import load

STEPS = 80  # 40 ms: it has left the ground
SPACING = 2e-3  # m


@pytest.fixture(scope="module")
def example():
    return load("jumping_starfish")


@pytest.fixture(scope="module")
def parts(example):
    from _starfish import body, jump

    return body, jump


@pytest.fixture(scope="module")
def result(example, parts) -> dict:
    """Run two iterations of a search for a jump 6 mm ahead and 10 mm high after 40 ms, and its field on quadratic
    elements.
    """
    _, jump = parts
    places = {"OVER_TIME": 0.03, "OVER": (4e-3, 0.0, 8e-3), "DOWN_TIME": 0.04, "DOWN": (6e-3, 0.0, 10e-3)}
    with pytest.MonkeyPatch.context() as patched:
        for name, value in places.items():
            patched.setattr(jump, name, value)
        return example.main(("heavy",), iterations=2, again=1, steps=STEPS, spacings=(SPACING,) * 3)["heavy"]


def test_the_mesh_has_the_papers_number_of_tetrahedra(parts) -> None:
    body, _ = parts
    mesh = body_mesh(body)
    assert mesh.n_tetrahedra == pytest.approx(1870, rel=0.02)
    assert mesh.n_components == 1
    low, high = mesh.rest_positions.min(axis=0), mesh.rest_positions.max(axis=0)
    assert low[2] == pytest.approx(0.0, abs=1e-12)
    assert high[0] == pytest.approx(body.REACH, abs=0.5e-3)
    underside = np.isclose(mesh.rest_positions[:, 2], 0.0, atol=1e-9)
    assert underside.sum() > 100  # it stands on more than a few points


def body_mesh(body):
    import magshell as ms

    return ms.meshes.from_distance(body.shape(), n_tetrahedra=body.TETRAHEDRA)


def test_arms_are_magnets_along_themselves(parts) -> None:
    body, _ = parts
    fifth = 2 * np.pi / 5
    around = fifth * np.arange(5) + 0.2
    points = 0.01 * np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    vectors = body.magnetization(np.vstack([points, [1e-3, 0, 0]]))
    arms = np.stack([np.cos(around - 0.2), np.sin(around - 0.2), 0 * around], axis=1)
    np.testing.assert_allclose(vectors[:5], body.MAGNETIZATION * arms, atol=1e-9)
    assert not vectors[5].any()


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_starfish_takes_off_by_the_stroke_of_its_arms(result) -> None:
    """Check that the starfish takes off: its arms' stroke lifts it, and friction pushes it ahead."""
    found = result["found"]
    assert found["lowest"][0] < 1e-5 and found["lowest"][-1] > 1e-3
    assert found["center"][-1, 0] > found["center"][0, 0] + 0.3e-3
    assert found["lowest"].min() > -0.2e-3
    assert abs(found["center"][:, 1]).max() < 1e-3


def test_the_search_lowers_the_objective_within_the_field_s_limit(result, parts) -> None:
    for which in ("found", "again"):
        first, *_, last = result[which]["history"]
        assert last.objective < 0.95 * first.objective
        assert result[which]["strongest"] <= parts[1].FIELD_LIMIT
    assert result["found"]["rms_distance"] < result["guess"]["rms_distance"]


def test_linear_elements_are_too_stiff(result) -> None:
    """Check that the field found with linear elements lifts the starfish higher with quadratic ones."""
    assert result["converged"]["center"][-1, 2] > result["found"]["center"][-1, 2] + 0.5e-3
    assert result["again"]["rms_distance"] < result["converged"]["rms_distance"]


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_the_gradient_of_the_whole_motion_is_that_of_differences(parts, element) -> None:
    """Compare along one direction of the unknowns, through contact, friction and take-off."""
    body, jump = parts
    import magshell as ms

    mesh = ms.meshes.from_distance(body.shape(), 2.2e-3)
    task = jump.Jump(jump.DESIGNS["heavy"], mesh, element, steps=60, tolerance=1e-11)
    place = torch.tensor([5e-3, 0.0, 8e-3])

    def objective(unknowns):
        field = jump.blurred(unknowns)
        return ((task.center(task.move(field, adjoint_storage="stages").positions)[-1] - place) ** 2).sum()

    start = torch.tensor(task.design.guess(60), requires_grad=True)
    objective(start).backward()
    direction = torch.tensor(np.random.default_rng(3).standard_normal((60, 3)))
    direction /= direction.norm()
    step = 1e-6
    with torch.no_grad():
        up, down = (float(objective(start + sign * step * direction)) for sign in (1, -1))
    slope = float((start.grad * direction).sum())
    assert slope == pytest.approx((up - down) / (2 * step), rel=1e-4)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_pictures_and_summary(example, result, tmp_path) -> None:
    example.plot({"heavy": result}).savefig(tmp_path / "starfish.png")
    assert (tmp_path / "starfish.png").stat().st_size > 50_000
    from _starfish import report

    report.movie(result, "heavy", tmp_path / "starfish.gif", fps=4)
    assert (tmp_path / "starfish.gif").stat().st_size > 10_000
    told = example.summary({"heavy": result})
    assert "converged mesh" in told and "[Chen22] Table 1: 42 iterations" in told
