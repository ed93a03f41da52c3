"""Letters and the banner, small."""

import numpy as np
import pytest
import torch
from example_modules import load

CELLS, ITERATIONS = 24, 15


@pytest.fixture(scope="module")
def letter() -> dict:
    return load("letters").main(letters="A", cells=CELLS, iterations=ITERATIONS)["A"]


@pytest.fixture(scope="module")
def designs():
    load("letters")
    from _letters import designs

    return designs


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_every_variant_lowers_the_objective(letter) -> None:
    for design in letter["designs"].values():
        values = [record.objective for record in design.history]
        assert len(values) == ITERATIONS + 1
        assert min(values) < 0.35 * values[0]
        assert all(np.diff(values[4:]) < 0.1 * values[4])  # no equilibrium has jumped


def test_elasticity_beats_magnetization_alone(letter) -> None:
    alone, modulus, joint = letter["designs"].values()
    assert modulus.squares < alone.squares / 3
    assert joint.squares < alone.squares / 3


def test_designs_stay_within_bounds(letter, designs) -> None:
    rounding = 1e-12
    for design in letter["designs"].values():
        assert np.linalg.norm(design.remanent_magnetization, axis=1).max() < 1e5
        for values, (low, high) in (
            (design.young_modulus, designs.MODULI),
            (design.curvature_scale, designs.SCALES),
        ):
            assert values.min() >= low * (1 - rounding) and values.max() <= high * (1 + rounding)
    alone, modulus, joint = letter["designs"].values()
    assert np.ptp(alone.young_modulus) == 0 and np.ptp(modulus.curvature_scale) == 0
    assert joint.young_modulus.max() > 1e7 and joint.young_modulus.min() < 1.1e4
    assert joint.curvature_scale.max() > 2 and joint.curvature_scale.min() < 0.5


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_a_design_is_what_a_sheet_does_when_its_field_is_turned_on(letter) -> None:
    joint = letter["designs"]["M, Y, c"]
    assert letter["checks"]["raised"] == pytest.approx(joint.error, rel=1e-4)
    assert letter["checks"]["other bending"] == pytest.approx(joint.error, rel=0.1)
    error = letter["task"].error(joint.positions)
    assert error == pytest.approx(joint.error, rel=1e-6)
    assert joint.squares == pytest.approx(
        np.sum((joint.positions - letter["task"].target.numpy()) ** 2), rel=1e-6
    )


def test_gradient_against_differences(designs) -> None:
    """Compare along the gradient itself and along a random direction, for all variables at once."""
    from _letters.task import Task

    search = designs.Search(Task("S", 8), "M, Y, c")
    generator = torch.Generator().manual_seed(0)
    with torch.no_grad():
        for variable in search.variables:
            variable += 0.05 * torch.randn(variable.shape, generator=generator, dtype=torch.float64)
    start = [variable.detach().clone() for variable in search.variables]
    gradient = torch.autograd.grad(search.objective()[0], search.variables)
    norm = sum(float((g**2).sum()) for g in gradient) ** 0.5
    along = [g / norm for g in gradient]
    across = [torch.randn(g.shape, generator=generator, dtype=torch.float64) for g in gradient]
    for directions in (along, across):
        step = 1e-4 / sum(float((d**2).sum()) for d in directions) ** 0.5
        values = []
        for sign in (1, -1):
            with torch.no_grad():
                for variable, at, direction in zip(search.variables, start, directions, strict=True):
                    variable.copy_(at + sign * step * direction)
            values.append(float(search.objective()[0].detach()))
        slope = sum(float((g * d).sum()) for g, d in zip(gradient, directions, strict=True))
        assert (values[0] - values[1]) / (2 * step) == pytest.approx(slope, rel=1e-5)


def test_the_sheet_is_held_at_eight_points(designs) -> None:
    from _letters.task import supported_points

    assert len(supported_points()) == 8
    assert len(supported_points(3)) == 7 * 2 + 4  # squares side by side share three


def test_pictures_of_letters(letter, monkeypatch) -> None:
    example = load("letters")
    result = {"A": letter}
    assert len(example.sheets(result).axes) == 6
    assert len(example.plot(result).axes[0].lines) == 3
    assert "sum of squares is" in example.summary(result)
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    assert example.picture(result)._repr_png_().startswith(b"\x89PNG")


@pytest.fixture(scope="module")
def banner() -> dict:
    return load("banner").main(word="SA", cells=16, iterations=10)


def test_letters_of_the_banner_are_as_good_as_alone(banner) -> None:
    assert banner["rest"].stable
    assert banner["rest"].scene.mesh.n_faces == 2 * 2 * 16 * 16
    for row in banner["letters"]:
        assert row["in the banner"] == pytest.approx(row["alone"], rel=0.1)
        assert row["moved"] < 0.3e-3


def test_pictures_of_the_banner(banner, monkeypatch) -> None:
    example = load("banner")
    assert len(example.plot(banner).axes) == 1
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    assert example.picture(banner)._repr_png_().startswith(b"\x89PNG")
    assert example.summary(banner).count("%") == 2 * 2
