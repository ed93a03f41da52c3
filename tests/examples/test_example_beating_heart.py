"""The beating heart after few iterations, one of the two designs."""

import numpy as np
import pytest
import torch
from example_modules import load


@pytest.fixture(scope="module")
def heart() -> dict:
    return load("beating_heart").main(
        areas=("lower_half",), fine=1963, with_faces=1963, iterations=4, beats=1
    )


@pytest.fixture(scope="module")
def parts():
    load("beating_heart")
    from _heart import design, shape, task

    return {"design": design, "shape": shape, "task": task}


def test_the_mesh_of_the_papers_size(parts) -> None:
    shape = parts["shape"]
    heart = shape.Heart.of()
    assert heart.mesh.n_tetrahedra == pytest.approx(1963, rel=0.02)
    assert heart.handles == 0 and heart.mesh.n_components == 1
    assert set(np.unique(heart.sides)) == {0, 1, 2}
    assert len(heart.ribbon) < len(heart.lower_half) < heart.mesh.n_faces / 2


def test_the_chamber_holds_what_its_shape_leaves_out(parts) -> None:
    """Compare the chamber's volume with that of its shape, from random points in a box."""
    shape = parts["shape"]
    heart = shape.Heart.of(6000)
    points = shape.UNIT * np.random.default_rng(0).uniform((-40, -40, -50), (40, 40, shape.TOP), (200_000, 3))
    expected = (shape.chamber()(points) < 0).mean() * 80 * 80 * (50 + shape.TOP) * shape.UNIT**3
    found = float(shape.Chamber(heart.mesh).volume(heart.mesh.rest_positions.copy()))
    assert found == pytest.approx(expected, rel=0.05)


def test_the_field_contracts_the_heart(heart) -> None:
    found = heart["hearts"]["lower_half"]
    for name in ("linear", "quadratic"):
        design = found[name]
        assert design.rms_error < 0.85 * design.task.target_distance
        assert design.errors[0] == pytest.approx(design.task.target_distance)
        assert np.linalg.norm(design.remanent_magnetization, axis=1).max() < 4e5
        assert design.rest.stable
    assert max(found["volumes"]) < 0.99


def test_linear_elements_promise_too_little(heart) -> None:
    """Check that the chamber shrinks further on a better mesh than on the one where the design was found."""
    where_found, converged = heart["hearts"]["lower_half"]["volumes"][:2]
    assert converged < where_found - 0.01


def test_a_design_is_what_the_heart_does_when_the_field_is_turned_on(heart) -> None:
    design = heart["hearts"]["lower_half"]["quadratic"]
    again = design.task.at_rest(design.remanent_magnetization)
    np.testing.assert_allclose(again.positions, design.rest.positions.detach().numpy(), atol=1e-8)


def test_heart_contracts_and_expands_with_the_field(heart) -> None:
    """Check that the heart contracts and expands with the field, slowly enough to be near its equilibria at the
    ends.
    """
    found = heart["hearts"]["lower_half"]
    beats, contracted = found["beating"], found["volumes"][4]
    assert beats.volumes[0] == pytest.approx(beats.at_rest)
    assert beats.volumes.max() > 1.005 * beats.at_rest
    assert beats.stroke > 0.02
    assert beats.volumes.min() / beats.at_rest == pytest.approx(contracted, abs=0.01)


def test_gradient_against_differences(parts) -> None:
    what = parts["task"].Task(parts["shape"].Heart.of(1963), "ribbon", "linear")
    search = parts["design"].Search(what)
    generator = torch.Generator().manual_seed(0)
    numbers = 0.3 * torch.randn(what.n_designed, 3, dtype=torch.float64, generator=generator)
    numbers.requires_grad_()
    (gradient,) = torch.autograd.grad(search.objective(numbers)[0], numbers)
    across = torch.randn(numbers.shape, dtype=torch.float64, generator=generator)
    for direction in (gradient / gradient.norm(), across / across.norm()):
        values = [float(search.objective(numbers.detach() + sign * 1e-4 * direction)[0]) for sign in (1, -1)]
        slope = float((gradient * direction).sum())
        assert (values[0] - values[1]) / 2e-4 == pytest.approx(slope, rel=1e-4)


def test_pictures_of_the_heart(heart, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    example = load("beating_heart")
    assert len(example.plot(heart).axes) == 3
    found = heart["hearts"]["lower_half"]
    assert example.picture(found, "lower_half")._repr_png_().startswith(b"\x89PNG")
    assert example.movie(found, "lower_half", tmp_path / "a.gif", fps=3.0, width=400).stat().st_size > 10_000
    told = example.summary(heart)
    assert "on a finer mesh" in told and "a stroke of" in told
