"""Numbers by decades beyond any body are warned of, once; those of robots of 1 mm and 1 m, and of theory, are not."""

import warnings

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.04, 0.02, cells=(4, 2))
USUAL = {"thickness": 1e-3, "young_modulus": 1e5, "mass_density": 1e3}


def scene(mesh=MESH, **values):
    sheet = ms.Shell(mesh, **{**USUAL, **values})
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def warned(call) -> list[str]:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        call()
    found = [each for each in told if issubclass(each.category, ms.UnitWarning)]
    assert all(each.filename == __file__ for each in found)
    return [str(each.message) for each in found]


BAD = {
    "thickness over extent": (
        {"thickness": 1.0},
        r"thickness [m] is 1, 22.4 times the extent of the sheet, 0.0447 m: mm?",
    ),
    "thickness far too small": ({"thickness": 1e-12}, "thickness [m] is 1e-12, 2.24e-11 times the extent"),
    "modulus in MPa": ({"young_modulus": 0.02}, "young_modulus [Pa] is 0.02, outside of 0.1 to 1e+13"),
    "modulus too large": ({"young_modulus": 1e15}, "young_modulus [Pa] is 1e+15, outside of 0.1 to 1e+13"),
    "density in t/mm3": (
        {"mass_density": 1.1e-9},
        "mass_density [kg/m3] is 1.1e-09, outside of 1e-07 to 1e+06",
    ),
    "magnetization in kA/m": (
        {"remanent_magnetization": (62, 0, 0)},
        "remanent_magnetization [A/m] has entries up to 62, and composites at least 1000: kA/m?",
    ),
    "remanence in T": ({"remanent_magnetization": (0, 0, 0.1)}, "ms.magnetization_from_remanence"),
    "modulus of a composite in MPa": (
        {"remanent_magnetization": (62e3, 0, 0), "young_modulus": 1.2},
        "young_modulus [Pa] is 1.2, too little for a body with a magnetization of 62000 A/m: kPa? MPa?",
    ),
    "density of a composite in g/cm3": (
        {"remanent_magnetization": (62e3, 0, 0), "mass_density": 1.86},
        "mass_density [kg/m3] is 1.86, too little for a body with a magnetization of 62000 A/m: g/cm3?",
    ),
    "magnetization": (
        {"remanent_magnetization": (0, 0, 4e10)},
        "remanent_magnetization [A/m] has entries up to 4e+10",
    ),
}


@pytest.mark.parametrize("values, words", BAD.values(), ids=BAD)
def test_an_absurd_number_of_a_sheet_is_warned_of_where_its_scene_is_made(values, words):
    (text,) = warned(lambda: scene(**values))
    assert words in text and text.endswith(" Units are SI")


@pytest.mark.parametrize("unit, key", [("mm?", "thickness"), ("kPa?", "young_modulus"), ("mT?", "field")])
def test_a_warning_of_units_names_the_unit_that_may_have_been_meant(unit, key):
    if key == "field":
        there = scene(remanent_magnetization=(1e4, 0, 0))
        (text,) = warned(lambda: ms.equilibrium(there, applied_flux_density=(0, 0, 60.0)))
    else:
        (text,) = warned(lambda: scene(**{key: {"thickness": 1.0, "young_modulus": 0.02}[key]}))
    assert unit in text


def test_a_magnetized_mesh_in_mm_and_gravity_in_mm_are_warned_of():
    mesh = MESH.scaled(1e3)
    (text,) = warned(lambda: scene(mesh, thickness=0.5, remanent_magnetization=(62e3, 0, 0)))
    assert text.startswith("the mesh has a size of 44.7 m, too large for a magnetized soft body: mm?")
    sheet = ms.Shell(MESH, **USUAL)
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    (text,) = warned(lambda: ms.Scene(sheet, supports=[clamp], gravity=(0, 0, -9810)))
    assert text == "gravity [m/s2] has a magnitude of 9810, 1e+03 times ours: mm/s2? Units are SI"


def test_thickness_beside_the_edges_of_a_fine_mesh_is_warned_of():
    mesh = ms.meshes.rectangle(0.04, 0.02, cells=(160, 80))
    (text,) = warned(lambda: scene(mesh, thickness=0.1))
    assert "times the usual edge of the mesh" in text


def test_a_solid_of_absurd_modulus_and_density_is_warned_of_by_its_number():
    box = ms.meshes.box((0.02, 0.02, 0.02), cells=(2, 2, 2))
    soft = ms.NeoHookean(young_modulus=1e-3, poisson_ratio=0.3)
    solid = ms.Solid(box, material=soft, mass_density=1e-9)
    told = warned(lambda: ms.Scene([ms.Shell(MESH, **USUAL), solid], allow_rigid_motions=True))
    assert [text.split(" is ")[0] for text in told] == [
        "young_modulus [Pa] of body 1",
        "mass_density [kg/m3] of body 1",
    ]


def test_values_of_a_solve_are_warned_of_once_a_scene():
    there = scene()
    solve = {"remanent_magnetization": (1e9, 0, 0), "applied_flux_density": (0, 0, 1e-9), "thickness": 0.2}
    first = warned(lambda: ms.equilibrium(there, **solve))
    assert [text.split(" [")[0] for text in first] == ["thickness", "remanent_magnetization"]
    assert not warned(lambda: ms.equilibrium(there, **solve))


def test_a_field_of_a_motion_is_warned_of():
    (text,) = warned(
        lambda: ms.simulate(
            scene(remanent_magnetization=(1e3, 0, 0)),
            steps=2,
            time_step=1e-3,
            applied_flux_density=lambda t: (0, 0, 1e5 * t),
        )
    )
    assert (
        text
        == "applied_flux_density [T] has entries up to 200, beyond 30, the most there is: mT? Units are SI"
    )


def test_a_filter_silences_the_warning():
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", category=ms.UnitWarning)
        scene(thickness=1.0)
    assert not told


SCENES = {
    "a robot of 1 mm": (1e-3, {"thickness": 2e-5, "young_modulus": 1e4}),
    "a robot of 1 m": (1.0, {"thickness": 0.05, "young_modulus": 1e6}),
    "a film of 100 nm": (1e-2, {"thickness": 1e-7}),
    "a steel sheet": (1.0, {"thickness": 1e-3, "young_modulus": 2.1e11, "mass_density": 7.8e3}),
    "a gel": (1e-2, {"young_modulus": 10.0}),
    "a foam": (1e-2, {"mass_density": 5.0}),
    "as good as no mass": (1e-2, {"mass_density": 1e-6}),
    "a model without units": (1.0, {"thickness": 1.0, "young_modulus": 1.0, "mass_density": 1.0}),
    "a magnetized model without units": (1.0, {"young_modulus": 1.0, "remanent_magnetization": (1, 0, 0)}),
    "a weak composite": (1e-2, {"remanent_magnetization": (2e3, 0, 0)}),
    "a magnet": (1e-2, {"remanent_magnetization": (0, 0, 1.2e6)}),
}


@pytest.mark.parametrize("size, values", SCENES.values(), ids=SCENES)
def test_usual_sizes_and_materials_are_not_warned_of(size, values):
    mesh = ms.meshes.rectangle(size, 0.5 * size, cells=(8, 4))
    assert not warned(lambda: scene(mesh, **values))


def test_numbers_of_every_kind_of_a_zero_field_pass():
    there = scene(remanent_magnetization=np.zeros(3))
    assert not warned(lambda: ms.equilibrium(there, applied_flux_density=(0, 0, 12.0)))


def varied(usual: float, some: float) -> np.ndarray:
    rows = np.full(MESH.n_faces, usual)
    rows[:2] = some
    return rows


@pytest.mark.parametrize(
    "name, usual, some",
    [
        ("young_modulus", 1e5, 2.5e13),
        ("young_modulus", 1e5, 1e-3),
        ("mass_density", 1e3, 1e-9),
        ("thickness", 1e-3, 1e-12),
    ],
)
def test_some_faces_beyond_the_limits_are_not_warned_of_and_all_of_them_are(name, usual, some):
    """Compare one extreme face, as a fit face by face passes through, with all faces, as a mistaken unit gives."""
    assert not warned(lambda: scene(**{name: varied(usual, some)}))
    assert len(warned(lambda: scene(**{name: varied(1.5 * some, some)}))) == 1
    if name != "mass_density":  # which has no part in a solve without gravity
        there = scene(remanent_magnetization=np.zeros(3))
        solve = {"applied_flux_density": np.zeros(3), name: varied(usual, some)}
        assert not warned(lambda: ms.equilibrium(there, **solve))


def test_a_design_that_an_optimizer_tries_is_no_mistaken_unit():
    torch = pytest.importorskip("torch")
    made, loaded = scene(), {"remanent_magnetization": (0, 0, 4e4), "applied_flux_density": (0, 0, 0)}
    modulus = torch.tensor(1e5, dtype=torch.float64, requires_grad=True)

    def objective(young_modulus):
        values = {made.bodies[0]: {"young_modulus": young_modulus}}
        positions = ms.equilibrium(made, values=values, **loaded).positions
        return positions[:, 2].sum() + young_modulus / 1e5

    optimizer = ms.optim.GaussNewton([modulus], lower=1e-3, scale=1e5, first_step=2.0)
    assert not warned(
        lambda: ms.minimize(
            lambda young_modulus: objective(young_modulus).reshape(1),
            [modulus],
            optimizer,
            max_iterations=3,
            progress=False,
        )
    )
    assert modulus.item() < 0.1  # it did try one
    assert warned(lambda: ms.equilibrium(made, young_modulus=1e-2, **loaded))
