"""Several load cases in one call: the same results and gradients as one at a time, one analysis for all."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.1, 0.04, cells=(5, 2), irregular=0.2, seed=1)
FIELDS = np.array([(0, 0, 2e-3), (0, 0, -2e-3), (1e-3, 0, 0)])
EXACT = ms.MixedNewton(tolerance=1e-12)


@pytest.fixture
def scene():
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    load = ms.EdgeLoad(MESH.edges_at(x=0.1), (0, 0, 0.01))
    return ms.Scene(sheet, supports=[clamp], loads=[load], field=ms.UniformField())


def magnetization():
    return torch.tensor(np.tile((4e4, 0.0, 1e4), (MESH.n_faces, 1)), requires_grad=True)


def test_cases_are_the_equilibria_of_their_fields(scene):
    cases = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 1e4), applied_flux_density=FIELDS)
    assert cases.positions.shape == (3, MESH.n_vertices, 3)
    assert cases.edge_rotations.shape == (3, MESH.n_edges)
    assert len(cases) == 3 and cases.stable and len(cases[1:]) == 2
    for case, field in zip(cases, FIELDS, strict=True):
        alone = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 1e4), applied_flux_density=field)
        np.testing.assert_array_equal(case.positions, alone.positions)
        np.testing.assert_array_equal(case.displacements, alone.displacements)


def test_factors_make_cases_too(scene):
    cases = ms.equilibrium(
        scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=(0, 0, 1e-3), load_factor=[0.0, 1.0]
    )
    assert cases[1].positions[:, 2].max() > cases[0].positions[:, 2].max() + 1e-3


def test_gradients_of_cases(scene):
    def positions(magnetization, fields, factors):
        return ms.equilibrium(
            scene,
            remanent_magnetization=magnetization,
            applied_flux_density=fields,
            load_factor=factors,
            solver=EXACT,
        ).positions

    fields = torch.tensor(FIELDS, requires_grad=True)
    factors = torch.tensor([0.5, 1.0, 1.5], dtype=torch.float64, requires_grad=True)
    torch.manual_seed(0)
    weights = torch.randn(3, MESH.n_vertices, 3, dtype=torch.float64)

    def by_strength(strength, fields, factors):
        return (positions(strength * magnetization().detach(), fields, factors) * weights).sum()

    strength = torch.tensor(1.0, dtype=torch.float64, requires_grad=True)
    steps = {"eps": 1e-6, "atol": 1e-5, "rtol": 1e-5}
    assert torch.autograd.gradcheck(by_strength, (strength, fields, factors), **steps)


def test_cases_share_the_analysis(scene):
    """Check the number of symbolic analyses, one of which costs more than a factorization of a fine sheet."""
    ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=FIELDS)
    before = scene._model.analyses
    ms.equilibrium(scene, remanent_magnetization=(1e4, 0, 0), applied_flux_density=FIELDS)
    assert before == scene._model.analyses == 1


def test_the_progress_of_cases_runs_once_from_0_to_1(scene):
    seen = []
    ms.equilibrium(
        scene,
        remanent_magnetization=(4e4, 0, 0),
        applied_flux_density=FIELDS,
        progress=lambda share, residual: seen.append(share),
    )
    assert seen == sorted(seen) and seen[0] == 0.0 and 2 / 3 <= seen[-1] <= 1.0


def test_cases_start_from_cases(scene):
    inputs = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": FIELDS}
    first = ms.equilibrium(scene, **inputs)
    again = ms.equilibrium(scene, **inputs, start=first)
    assert all(case.factorizations == 1 for case in again)
    with pytest.raises(ValueError, match="2 equilibria, for 3 load cases"):
        ms.equilibrium(scene, **inputs, start=first[:2])


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_a_failing_case_is_named_and_the_others_kept(scene):
    fields = [(0, 0, 1e-3), (0, 0, 50.0)]
    solver = ms.MixedNewton(max_iterations=2, min_load_step=1.0, max_relaxation_steps=1)
    first = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=fields[0])
    with pytest.raises(ms.NotConverged, match="load case 1 of 2") as caught:
        ms.equilibrium(
            scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=fields, solver=solver, start=first
        )
    assert len(caught.value.last_good) == 2 and caught.value.last_good[0].load_fraction == 1.0


@pytest.mark.parametrize(
    "inputs, words",
    [
        ({"applied_flux_density": np.zeros((0, 3))}, "no load case"),
        (
            {"applied_flux_density": FIELDS, "load_factor": [1.0, 2.0]},
            "applied_flux_density of 3, load_factor of 2",
        ),
        ({"applied_flux_density": np.zeros((2, 2))}, r"\(3,\)"),
        ({"applied_flux_density": np.zeros((2, 2, 3))}, r"\(3,\)"),
    ],
)
def test_cases_that_do_not_fit(scene, inputs, words):
    with pytest.raises(ValueError, match=words):
        ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0), **inputs)


def test_bad_input_of_one_case_is_told_with_its_number() -> None:
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    fields = [(0, 0, 1e-3), (0, 0, np.nan), (0, 0, 2e-3)]
    with pytest.raises(ValueError, match=r"load case 1 of 3: applied_flux_density \[T\] must be finite"):
        ms.equilibrium(scene, remanent_magnetization=(1e4, 0, 0), applied_flux_density=fields)
