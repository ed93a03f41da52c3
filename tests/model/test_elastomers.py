"""Tests of measured elastomers: their numbers, the estimate for filled ones, and errors."""

import copy

import numpy as np
import pytest

import magshell as ms
from magshell.model.elastomers import _MEASURED

INK = {
    "name": "ink",
    "young_modulus": 1e5,
    "young_modulus_range": (9e4, 2e5),
    "source": "own",
    "note": "tension",
}


@pytest.mark.parametrize("name", _MEASURED)
def test_every_elastomer_has_a_source_and_a_modulus_within_its_range(name):
    rubber = ms.elastomer(name)
    low, high = rubber.young_modulus_range
    assert 1e4 < low <= rubber.young_modulus <= high < 1e7
    assert "doi" in rubber.source or "20" in rubber.source
    assert len(rubber.note) > 40
    assert ms.elastomer(name.upper()) == rubber == copy.deepcopy(rubber)
    assert rubber.mass_density is None
    assert rubber.remanent_magnetization == 0.0


def test_softer_grades_of_a_product_are_softer():
    for grades in (("Ecoflex 00-10", "Ecoflex 00-30", "Ecoflex 00-50"), ("Dragon Skin 20", "Dragon Skin 30")):
        moduli = [ms.elastomer(each).young_modulus for each in grades]
        assert moduli == sorted(moduli)


def test_shell_takes_the_elasticity_of_an_elastomer():
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, **ms.elastomer("Ecoflex 00-30").elasticity)
    assert (sheet.young_modulus == 50e3).all()
    assert (sheet.poisson_ratio == 0.5).all()


def test_filled_elastomer_follows_einstein_for_few_particles_and_mixes_the_rest():
    rubber = ms.Elastomer(**INK)
    few = rubber.filled(1e-4)
    assert few.young_modulus / rubber.young_modulus - 1.0 == pytest.approx(2.5e-4, rel=1e-3)
    ink = rubber.filled(0.2, particle_magnetization=5e5, mass_density=1000.0, particle_density=7500.0)
    assert ink.young_modulus == pytest.approx(1e5 * np.exp(2.5 * 0.2 / (1 - 1.35 * 0.2)))
    assert ink.remanent_magnetization == pytest.approx(1e5)
    assert ink.mass_density == pytest.approx(0.8 * 1000 + 0.2 * 7500)
    low, high = ink.young_modulus_range
    assert low < ink.young_modulus < high
    assert "estimate" in ink.note
    assert rubber.filled(0.0).young_modulus == rubber.young_modulus
    assert rubber.filled(0.3).young_modulus > ink.young_modulus


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"volume_fraction": 0.31}, "volume_fraction must be from 0 to 0.3"),
        ({"volume_fraction": -0.1}, "volume_fraction must be from 0"),
        ({"volume_fraction": 0.1, "particle_magnetization": -1.0}, "is a magnitude"),
        ({"volume_fraction": 0.1, "mass_density": 1e3}, "are both needed"),
        ({"volume_fraction": 0.1, "mass_density": 1e3, "particle_density": 0.0}, "particle_density"),
    ],
)
def test_bad_filling_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        ms.elastomer("RTV615").filled(**arguments)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": 3}, "name must be a text"),
        ({"young_modulus": 0.0}, "young_modulus"),
        ({"young_modulus": 3e5}, "young_modulus_range .* must hold 300000"),
        ({"poisson_ratio": 0.6}, "poisson_ratio must be in"),
        ({"mass_density": -1.0}, "mass_density"),
        ({"remanent_magnetization": -1.0}, "is a magnitude"),
    ],
)
def test_bad_elastomer_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        ms.Elastomer(**{**INK, **change})


def test_unknown_elastomer_names_the_nearest():
    with pytest.raises(ValueError, match="nearest names are 'Ecoflex 00-30'"):
        ms.elastomer("Ecoflex 30")
    with pytest.raises(ValueError, match="name must be a text"):
        ms.elastomer(30)
