"""Creases of shells: folds by closed form, folds by their angle, and errors."""

import warnings

import numpy as np
import pytest

import magshell as ms

STIFFNESS = 1e-5  # N


def strip(cells=(16, 4), bending="midedge", **crease) -> tuple[ms.Shell, ms.Crease, ms.Scene]:
    """Return a stiff strip of 40 mm, clamped at one end, with a crease across its middle."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=cells)
    fold = ms.Crease(mesh.edges_at(x=0.02), **{"stiffness": STIFFNESS, **crease})
    sheet = ms.Shell(
        mesh, thickness=1e-3, young_modulus=1e9, poisson_ratio=0.3, creases=[fold], bending=bending
    )
    couple = ms.EdgeCouple(mesh.edges_at(x=0.04), 0.0)
    return sheet, fold, ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[couple])


def tip_rotation(rest: ms.Equilibrium) -> float:
    """Return the rotation of the outer half about y, rad."""
    mesh = rest.scene.mesh
    tip, middle = (rest.positions[mesh.vertices_at(x=x)].mean(axis=0) for x in (0.04, 0.02))
    return float(np.arctan2(tip[2] - middle[2], tip[0] - middle[0]))


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
@pytest.mark.parametrize("bending", ["midedge", "hinge"])
@pytest.mark.parametrize("cells", [(8, 4), (16, 8), (32, 4)])
def test_tip_rotation_a_crease_does_not_depend_on_the_mesh(bending, cells):
    """Compare with theta = C/k: a hundredth of a radian, and more than a right angle."""
    _, _, scene = strip(cells, bending)
    (couple,) = scene.loads
    for angle in (0.01, 1.8):
        rest = ms.equilibrium(scene, values={couple: {"couple_per_length": angle * STIFFNESS}})
        assert abs(tip_rotation(rest)) == pytest.approx(angle, rel=2e-3)
        assert rest.energies["creases"] == pytest.approx(0.5 * STIFFNESS * 0.01 * angle**2, rel=2e-3)


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_crease_folds_to_its_angle_and_beyond_a_half_turn():
    _, fold, scene = strip(angle=0.0)
    flat = ms.equilibrium(scene)
    assert abs(tip_rotation(flat)) < 1e-9
    for angle in (0.5 * np.pi, -2.5):
        rest = ms.equilibrium(scene, values={fold: {"angle": angle}})
        assert tip_rotation(rest) == pytest.approx(angle, rel=3e-4)
        assert rest.energies["creases"] < 1e-7 * 0.01 * STIFFNESS * angle**2


def test_crease_of_a_folded_mesh_rests_as_it_is():
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    line = mesh.edges_at(x=0.02)
    x = np.array(mesh.rest_positions)
    beyond = x[:, 0] > 0.02
    x[beyond, 2] = x[beyond, 0] - 0.02
    x[beyond, 0] = 0.02
    folded = ms.TriangleMesh(x, mesh.faces)
    clamp = ms.Clamp(folded.edges_at(x=0.0))
    for angle in (None, 0.5 * np.pi):
        crease = ms.Crease(line, stiffness=1e-4, angle=angle)
        sheet = ms.Shell(folded, thickness=1e-3, young_modulus=1e9, creases=[crease])
        scene = ms.Scene(sheet, supports=[clamp])
        assert np.abs(ms.equilibrium(scene).displacements).max() < 1e-10
        ms.linear_response(scene)  # the rest shape is an equilibrium


def test_crease_opens_in_time():
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    fold = ms.Crease(mesh.edges_at(x=0.02), stiffness=1e-3, angle=0.0)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e7, mass_density=1e3, creases=[fold])
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    move = ms.simulate(
        scene, steps=500, time_step=2e-3, damping=4e-4, progress=False,
        values={fold: {"angle": lambda t: 5.0 * min(t, 0.2)}},
    )  # fmt: skip
    tip = move.positions[-1][mesh.vertices_at(x=0.04)].mean(axis=0)
    assert np.arctan2(tip[2], tip[0] - 0.02) == pytest.approx(1.0, abs=0.05)


def test_creases_keep_their_edges_through_values_of_the_sheet():
    sheet, fold, scene = strip()
    (couple,) = scene.loads
    rest = ms.equilibrium(
        scene, values={couple: {"couple_per_length": 0.5 * STIFFNESS}, sheet: {"young_modulus": 2e9}}
    )
    assert abs(tip_rotation(rest)) == pytest.approx(0.5, rel=2e-3)
    assert sheet.replaced(young_modulus=2e9).creases == (fold,)


BAD = [
    (lambda mesh: {"creases": [ms.Crease(mesh.boundary_edges[:1], 1e-5)]}, r"at the border"),
    (lambda mesh: {"creases": [ms.Crease([mesh.n_edges], 1e-5)]}, r"Crease edges"),
    (lambda mesh: {"creases": [ms.Crease(mesh.interior_edges[:2], 1e-5)] * 2}, r"creases must differ"),
    (
        lambda mesh: {"creases": [ms.Crease(mesh.interior_edges[k : k + 2], 1e-5) for k in (0, 1)]},
        r"two creases share edge",
    ),
    (
        lambda mesh: {"creases": [ms.Crease(mesh.interior_edges[:2], 0.0)]},
        r"stiffness \[N\] must be positive",
    ),
    (lambda mesh: {"creases": [ms.Crease([3, 4], [1e-5] * 3)]}, r"one for each edge, \(2,\)"),
    (lambda mesh: {"creases": [3]}, r"creases must hold Crease objects"),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_bad_creases_are_refused(make, message):
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 2))
    with pytest.raises(ValueError, match=message):
        ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, **make(mesh))


def test_creases_need_a_mesh_of_three_node_faces():
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 2))
    second = ms.QuadraticTriangleMesh.from_triangles(mesh)
    with pytest.raises(ValueError, match=r"there are no creases"):
        ms.Shell(second, thickness=1e-3, young_modulus=1e6, creases=[ms.Crease([3], 1e-5)])


def test_crease_that_pulls_at_rest_is_refused_by_linear_theory():
    _, fold, scene = strip(angle=0.3)
    with pytest.raises(ValueError, match=r"Crease\(.* pulls at the rest shape"):
        ms.linear_response(scene)
    assert ms.linear_response(scene, values={fold: {"angle": 0.0}}).displacements.shape == (85, 3)


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_a_fold_is_no_strain_of_the_faces_beside_it(bending):
    sheet, fold, scene = strip(bending=bending, angle=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ms.LargeStrainWarning)
        rest = None
        for angle in (1.0, 2.0, 2.9):
            rest = ms.equilibrium(scene, start=rest, values={fold: {"angle": angle}})
    assert abs(tip_rotation(rest)) == pytest.approx(2.9, rel=1e-3)
    assert "BEYOND THE MODEL" not in repr(rest)
    assert rest.largest_bending_strain == rest.strains().largest.max() < 1e-5
    stresses = rest.stresses()
    stiffness = 1e9 * 1e-3**3 / (12 * (1 - 0.3**2))
    assert np.abs(stresses.curvatures).max() < 1e-5 * 2 / 1e-3
    assert np.abs(stresses.bending_moments).max() < 1e-5 * 2 / 1e-3 * stiffness
    beside = np.unique(sheet.mesh.edge_faces[fold.edges])
    assert np.abs(stresses.von_mises_stresses[beside]).max() < 1e-5 * 1e9


def test_a_moment_through_a_crease_bends_the_faces_beside_it_like_the_others():
    """Check that a couple at the end bends the sheet to one curvature M/D, and folds the crease by M/k."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(16, 4))
    moment, stiffness = 2e-3, 1e7 * 1e-3**3 / 12  # N, N m
    fold = ms.Crease(mesh.edges_at(x=0.02), stiffness=moment / 0.7)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e7, poisson_ratio=0.0, creases=[fold])
    couple = ms.EdgeCouple(mesh.edges_at(x=0.04), moment)
    rest = ms.equilibrium(ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[couple]))
    exact = moment / stiffness
    curvatures = np.abs(np.linalg.eigvalsh(rest.stresses().curvatures)).max(axis=1)
    strains = rest.strains().largest
    moments = np.abs(np.linalg.eigvalsh(rest.stresses().bending_moments)).max(axis=1)
    beside = np.isin(np.arange(mesh.n_faces), mesh.edge_faces[fold.edges])
    for faces, tolerance in ((~beside, 0.01), (beside, 0.07)):
        np.testing.assert_allclose(curvatures[faces], exact, rtol=tolerance)
        np.testing.assert_allclose(strains[faces], 0.5e-3 * exact, rtol=tolerance)
        np.testing.assert_allclose(moments[faces], moment, rtol=tolerance)
