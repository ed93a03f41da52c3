"""Overrides by `values`: the keywords of solves that are short for them, and refusals."""

import warnings

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e8, poisson_ratio=0.3, mass_density=1e3)
UNIFORM = ms.UniformField()
CUBE = ms.CuboidMagnet((0.01, 0.01, 0.01), (0, 0, 2e5), center=(0.05, 0.005, 0.05))
CLAMP = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 1e-3))
LOAD = ms.EdgeLoad(MESH.edges_at(x=0.05), (-5.0, 0, 0.05))
SCENE = ms.Scene(SHEET, supports=[CLAMP], loads=[LOAD], field=[UNIFORM, CUBE], gravity=(0, 0, -9.81))
MAGNETIZATION, FIELD = (2e4, 0.0, 1e3), np.array((1e-3, 0, 2e-3))
FACTORS = {"load_factor": 0.7, "gravity_factor": 0.6, "field_factor": 0.9, "support_factor": 0.8}
MOTION = {"steps": 3, "time_step": 2e-3, "progress": False}
RAMP = np.linspace(0.0, 1.0, 4)
SOLVES = {
    "equilibrium": lambda **given: ms.equilibrium(SCENE, **given).positions,
    "warm start": lambda **given: ms.WarmStart(SCENE)(**given).positions,
    "follow": lambda **given: ms.follow_path(SCENE, progress=False, max_step=0.1, **given).positions,
    "linear response": lambda **given: ms.linear_response(SCENE, **given).positions,
    "buckling": lambda **given: ms.linear_buckling(SCENE, **given).modes,
    "simulate": lambda **given: ms.simulate(SCENE, **MOTION, **given).positions,
}


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("name", SOLVES)
def test_keywords_are_short_forms_to_the_last_bit(name):
    solve = SOLVES[name]
    short = solve(remanent_magnetization=MAGNETIZATION, applied_flux_density=FIELD, **FACTORS)
    own = {SHEET: {"remanent_magnetization": MAGNETIZATION}}
    for values in (
        {**own, SCENE: {"applied_flux_density": FIELD, **FACTORS}},
        {**own, SCENE: FACTORS, UNIFORM: {"applied_flux_density": FIELD}},
    ):
        assert np.array_equal(solve(values=values), short)
    mixed = solve(applied_flux_density=FIELD, values={**own, SCENE: FACTORS})
    assert np.array_equal(mixed, short)


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("name", ("equilibrium", "warm start", "simulate"))
def test_material_has_short_forms_too(name):
    given = {"young_modulus": 1.2e6, "thickness": 1.1e-3}
    rest = {"applied_flux_density": FIELD}
    short = SOLVES[name](remanent_magnetization=MAGNETIZATION, **rest, **given)
    own = {SHEET: {**given, "remanent_magnetization": MAGNETIZATION}}
    assert np.array_equal(SOLVES[name](values=own, **rest), short)


def test_load_parameters_in_time_and_damping_are_values_of_the_scene():
    rest = {"remanent_magnetization": MAGNETIZATION}
    given = {
        "applied_flux_density": lambda t: (0, 0, t),
        "load_factor": RAMP,
        "support_factor": RAMP[:-1],
        "damping": 1e-3,
        "stiffness_damping": 1e-3,
        "maxwell_modulus": 0.5,
        "maxwell_time": 1e-2,
    }
    short, spelled_out = (
        ms.simulate(SCENE, **MOTION, **rest, **each) for each in (given, {"values": {SCENE: given}})
    )
    assert np.array_equal(short.positions, spelled_out.positions)
    assert abs(short.displacements).max() > 1e-4


def test_load_cases_and_gradients_come_through_values():
    fields = torch.tensor(np.array([FIELD, -FIELD]), requires_grad=True)
    of_sheet = {SHEET: {"remanent_magnetization": MAGNETIZATION}}
    found = []
    for given in ({"applied_flux_density": fields}, {}):
        values = of_sheet if given else {**of_sheet, SCENE: {"applied_flux_density": fields}}
        cases = ms.equilibrium(SCENE, values=values, **given)
        found.append(torch.autograd.grad((cases.positions**2).sum(), fields)[0])
        assert len(cases) == 2
    assert torch.equal(*found) and found[0].abs().max() > 0


@pytest.mark.filterwarnings("ignore::magshell.LinearTheoryWarning")
def test_linear_theory_and_vibrations_take_values_of_objects():
    """Compare with a scene that was built with these values."""
    thick = ms.Shell(MESH, thickness=2e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    load = ms.EdgeLoad(MESH.edges_at(x=0.05), (-0.01, 0, 0.002))
    made = ms.Scene(thick, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=[load])
    other = ms.EdgeLoad(MESH.edges_at(x=0.05), (0, 0, 1.0))
    thin = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    scene = ms.Scene(thin, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=[other])
    values = {thin: {"thickness": 2e-3}, other: {"force_per_length": (-0.01, 0, 0.002)}}
    for solve in (
        lambda scene, **given: ms.linear_response(scene, **given).displacements,
        lambda scene, **given: ms.linear_buckling(scene, **given).factors,
        lambda scene, **given: ms.follow_path(scene, progress=False, **given).positions[-1],
    ):
        assert np.array_equal(solve(scene, values=values), solve(made))
    of_thick = ms.vibration_modes(made, count=3).squares
    assert np.array_equal(
        ms.vibration_modes(scene, values={thin: {"thickness": 2e-3}}, count=3).squares, of_thick
    )
    with pytest.raises(ValueError, match="values are those of the equilibrium"):
        ms.vibration_modes(scene, ms.equilibrium(scene), values=values)


OTHER = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
BALL = ms.obstacles.Sphere(0.01, center=(0.025, 0.005, -0.02))
SWAYING = ms.obstacles.Sphere(0.01, center=(0.025, 0.005, -0.04), motion=lambda t: (t, 0, 0))
STILL = ms.Pin(MESH.vertices_at(x=0.05), "y")
HELD = ms.Scene(SHEET, supports=[CLAMP, STILL], contacts=[ms.Contact([BALL, SWAYING])])
ENDS = np.tile((0.025, 0.005, -0.02), (4, 1))
FACTOR = {"load_factor": 0.5}


def simulate(values, scene=HELD, **given):
    return ms.simulate(scene, **MOTION, values=values, **given)


def at_rest(values, **given):
    magnetic = {"remanent_magnetization": MAGNETIZATION, "applied_flux_density": FIELD}
    return ms.equilibrium(SCENE, values=values, **{**magnetic, **given})


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: at_rest({OTHER: {"thickness": 1e-3}}), "not the scene, nor an object of it"),
        (lambda: simulate({CUBE: {"center": (0, 0, 1)}}), "not the scene, nor an object of it"),
        (lambda: simulate({ms.UniformField(): {"applied_flux_density": FIELD}}), "nor an object of it"),
        (
            lambda: at_rest({CUBE: {"centers": (0, 0, 1)}}),
            "CuboidMagnet has no value 'centers' .* it has center, ",
        ),
        (
            lambda: at_rest({SCENE: {"gravity_factors": 1}}),
            "Scene has no value .* it has gravity_factor, gravity, ",
        ),
        (lambda: at_rest({SCENE: {"damping": 1.0}}), "damping of the scene has no part in this solve"),
        (
            lambda: at_rest({SCENE: FACTOR}, load_factor=1.0),
            "load_factor was given twice: as an argument and in",
        ),
        (lambda: at_rest({UNIFORM: {"applied_flux_density": FIELD}}), "applied_flux_density was given twice"),
        (
            lambda: ms.equilibrium(
                SCENE,
                values={UNIFORM: {"applied_flux_density": FIELD}, SCENE: {"applied_flux_density": FIELD}},
            ),
            "twice in values: of the scene and of its UniformField",
        ),
        (lambda: at_rest({SHEET: {"thickness": 1e-3}}, thickness=1e-3), "thickness was given twice"),
        (lambda: at_rest([SHEET]), "values must be a dict"),
        (lambda: at_rest({CUBE: 3.0}), "values of CuboidMagnet.* must be a dict"),
        (lambda: at_rest({CUBE: {"center": lambda t: (0, 0, t)}}), "only ms.simulate takes functions"),
        (lambda: at_rest({CUBE: {"center": ENDS}}), r"center \[m\] must have shape \(3,\), got \(4, 3\)"),
        (lambda: at_rest({SCENE: {"load_factor": np.ones((2, 2))}}), r"load_factor \[1\] must be a number"),
        (
            lambda: simulate({SHEET: {"thickness": lambda t: 1e-3}}),
            "thickness of Shell cannot change during a motion",
        ),
        (
            lambda: simulate({BALL: {"rotation": lambda t: 0.0}}),
            r"rotation at 0 s \[rad\] must have shape \(3,\)",
        ),
        (
            lambda: simulate({BALL: {"center": ENDS[:-1]}}),
            r"center \[m\] of Sphere must have shape \(3,\), or \(steps \+ 1, ...\) = \(4, 3\) .* would have it jump",
        ),
        (
            lambda: simulate({CLAMP: {"displacement": ENDS[:2]}}),
            r"displacement \[m\] of Clamp must .* got \(2, 3\)",
        ),
        (
            lambda: simulate({BALL: {"center": ENDS * np.nan}}),
            r"center \[m\] must be finite, but center\[0, 0\]",
        ),
        (lambda: simulate({SWAYING: {"center": ENDS}}), "moves by its motion: give .* not both"),
        (
            lambda: simulate({STILL: {"displacement": ENDS}}),
            "a support that stays cannot be moved by a solve",
        ),
        (
            lambda: simulate(
                {CUBE: {"center": ENDS[:2]}},
                SCENE,
                remanent_magnetization=MAGNETIZATION,
                applied_flux_density=FIELD,
            ),
            r"center \[m\] of CuboidMagnet .*\(steps \+ 1, ...\) = \(4, 3\) or \(steps, ...\) = \(3, 3\) .* got \(2, 3\)",
        ),
        (
            lambda: simulate({BALL: {"center": ENDS + np.array([0, 0, 0.02])}}),
            "the sheet starts inside Sphere",
        ),
        (
            lambda: ms.PlacedField(CUBE),
            "field must be a SampledField, CustomField, MagpylibField or Dipoles, got CuboidMagnet",
        ),
    ],
)
def test_values_without_an_owner_are_refused(call, message):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError, match=message):
            call()


def test_a_support_does_not_move_against_another_at_any_time():
    corner = MESH.nearest_vertex((0.05, 0.0, 0.0))
    moving = ms.Pin([corner], "xz", displacement=(0, 0, 0))
    still = ms.SymmetryPlane((0, 1, 0))
    scene = ms.Scene(SHEET, supports=[moving, still, ms.Pin(MESH.vertices_at(x=0.0), "xz")])
    rows = 1e-3 * RAMP[:, None] * np.array((0.0, 0.0, 1.0))
    assert abs(simulate({moving: {"displacement": rows}}, scene).displacements).max() > 5e-4
    turns = RAMP[:, None] * np.array((0.0, 0.0, 0.3))  # away from the plane, but for its own center
    about = {"displacement": rows, "center": (0.04, 0.001, 0.0), "rotation": turns}
    with pytest.raises(
        ValueError, match=f"one support holds vertex {corner} along a direction in which another moves"
    ):
        simulate({moving: about}, scene)
