"""Warnings about elements of mean volume: given where they are too soft, and nowhere else."""

import warnings

import numpy as np
import pytest
from model_access import LoadParameters, Problem

import magshell as ms

MODULI = {"young_modulus": 1e5, "poisson_ratio": 0.45}
SOFT = ms.NeoHookean(**MODULI)
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0], [1, 1, 1], [-1, 0.3, 0.3]])
FEW = [[0, 1, 2, 3], [1, 2, 3, 4], [0, 2, 3, 5]]  # face to face


def box(*cells, **given):
    return ms.meshes.box(tuple(0.01 * n for n in cells), cells=cells, **given)


def fin(cells):
    """Return a mesh of a thick block with a fin ten cells long and `cells` cells thick."""
    mesh = ms.meshes.box((1.0, 0.4, 0.5), cells=(20, 8, 10))
    x, _, z = mesh.tetrahedron_barycenters.T
    kept = (x < 0.5) | ((z > 0.2) & (z < 0.2 + 0.05 * cells))
    return ms.TetMesh.repaired(mesh.rest_positions, mesh.tetrahedra[kept]).mesh


def wedge():
    mesh = ms.meshes.box((1.0, 1.0, 1.0), (10, 4, 10), "aligned")
    x = mesh.rest_positions.copy()
    x[:, 2] *= 0.02 + 0.98 * x[:, 0]
    return ms.TetMesh(x, mesh.tetrahedra)


def few(n):
    return ms.TetMesh.repaired(0.1 * CORNERS[: 3 + n], FEW[:n]).mesh


def capsule():
    shape = ms.shapes.capsule((0, 0, 0), (0.06, 0, 0), 0.01)
    return ms.meshes.from_distance(shape, 0.006)


THIN = {
    "plate": lambda: box(6, 6, 1),
    "bar": lambda: box(8, 1, 1),
    "flat bar": lambda: box(10, 2, 1),
    "tube": lambda: ms.meshes.tube(0.01, 0.012, 0.05, cells=(1, 12, 8)),
    "fin of a block": lambda: fin(1),
}
THICK = {
    "plate": lambda: box(6, 6, 2),
    "plate of cells with a vertex inside": lambda: box(6, 6, 1, diagonals="crossed"),
    "bar": lambda: box(12, 2, 2),
    "bar with all corners of some on its edges": lambda: box(12, 2, 2, diagonals="aligned"),
    "wedge": lambda: wedge(),
    "flat cells": lambda: ms.meshes.box((0.1, 0.1, 0.002), cells=(10, 10, 2)),
    "cube": lambda: box(1, 1, 1, diagonals="crossed"),
    "block": lambda: box(4, 4, 4),
    "tube": lambda: ms.meshes.tube(0.01, 0.012, 0.05, cells=(2, 12, 8)),
    "ball": lambda: ms.meshes.ball(0.01, 3),
    "rod": lambda: ms.meshes.solid_cylinder(0.01, 0.1, (2, 10)),
    "capsule": capsule,
    "fin of a block": lambda: fin(2),
}


def free(solid):
    return ms.Scene(solid, allow_rigid_motions=True)


SLICES = {
    "pins on all vertices": lambda mesh: [ms.Pin(np.arange(mesh.n_vertices), "y")],
    "symmetry planes on both sides": lambda mesh: [
        ms.SymmetryPlane((0, 1, 0), point=(0, y, 0)) for y in (0.0, 0.01)
    ],
}


@pytest.mark.parametrize("hold", SLICES.values(), ids=SLICES)
def test_a_slice_in_plane_strain_may_be_one_cell_thick_where_it_is_held_and_nowhere_else(hold):
    """Check slices held along y on both sides; cells are counted along x, y and z."""

    def warnings_of(cells, supports):
        solid = ms.Solid(ms.meshes.box((0.1, 0.01, 0.04), cells), material=SOFT)
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            ms.Scene(solid, supports=supports(solid.mesh), allow_rigid_motions=True)
        return [str(each.message) for each in found]

    assert not warnings_of((10, 1, 4), hold)
    assert not warnings_of((20, 1, 2), hold)
    (free_plate,) = warnings_of((10, 1, 4), lambda mesh: [])
    (held_at_one_end,) = warnings_of((10, 1, 4), lambda mesh: [ms.Pin(mesh.vertices_at(x=0.0))])
    (thin_bar,) = warnings_of((40, 1, 1), hold)  # one cell through its height, in which it bends
    assert all("one cell thick" in text for text in (free_plate, held_at_one_end, thin_bar))


@pytest.mark.parametrize("name", THIN)
def test_slender_region_one_cell_thick_is_warned_of(name):
    mesh = THIN[name]()
    with pytest.warns(
        ms.MeshQualityWarning, match=r"a slender region about \[[^\]]*\] m is one cell thick \("
    ) as warned:
        free(ms.Solid(mesh, material=SOFT))
    assert warned[0].filename == __file__ and len(warned) == 1
    with warnings.catch_warnings():  # not where each point has its own volume
        warnings.simplefilter("error")
        free(ms.Solid(mesh, material=SOFT, element="linear"))
        free(ms.Solid(mesh, material=SOFT, mean_volume=False))
        free(ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)))


@pytest.mark.parametrize("name", THICK)
def test_no_warning_without_reason(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        free(ms.Solid(THICK[name](), material=SOFT))


def test_warning_locates_a_fin_and_is_not_repeated_by_a_solve():
    with pytest.warns(ms.MeshQualityWarning) as warned:
        solid = ms.Solid(fin(1), material=SOFT)
        free(solid)
    place = np.fromstring(str(warned[0].message).split("[")[1].split("]")[0], sep=",")
    assert place == pytest.approx((0.75, 0.2, 0.225), abs=0.01)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        other = solid.replaced(young_modulus=2e5, mass_density=900.0)
    assert other.young_modulus[0] == 2e5 and other.mass_density[0] == 900.0 and solid.young_modulus[0] == 1e5
    assert solid.mass_density is None and other.mesh is solid.mesh
    with pytest.raises(ValueError, match=r"young_modulus.*must be a number or have shape"):
        solid.replaced(young_modulus=np.ones(3))


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_bent_bar_of_one_cell_is_too_soft_and_of_two_is_not():
    """Compare the end deflection of a bent bar with that of a finer mesh.

    One cell through the thickness is too soft; two are not, and neither is one with a vertex inside.
    """

    def deflection(cells, diagonals="alternating"):
        solid = ms.Solid(ms.meshes.box((0.1, 0.01, 0.01), cells, diagonals), material=SOFT)
        end = solid.mesh.vertices_at(x=0.1)
        load = ms.PointLoad(end, np.tile([0, 0, 1e-6 / len(end)], (len(end), 1)))
        rest = ms.equilibrium(ms.Scene(solid, supports=[ms.Pin(solid.mesh.vertices_at(x=0.0))], loads=[load]))
        return rest.displacements[end, 2].mean()

    fine = deflection((20, 4, 4))
    assert 1.12 < deflection((20, 1, 1)) / fine < 1.20
    assert 1.0 < deflection((20, 2, 2)) / fine < 1.03
    assert 1.0 < deflection((20, 1, 1), "crossed") / fine < 1.05


@pytest.mark.parametrize(
    ("mesh", "free"), [(few(1), 3), (few(2), 2), (few(3), 1), (box(1, 1, 1), 1), (box(2, 1, 1), 0)]
)
def test_zero_energy_modes_of_isochoric_material_are_counted(mesh, free):
    """Count the zero eigenvalues of the Hessian at rest beyond the six of rigid motions."""
    material = ms.NeoHookean("isochoric", **MODULI)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        solid = ms.Solid(mesh, material=material)
        ms.Solid(mesh, material=SOFT)  # no region of so few elements is slender
    assert len(warned) <= 1
    said = [str(each.message) for each in warned if "cost no energy" in str(each.message)]
    assert len(said) == (free > 0) and all(f"has {free} shape" in text for text in said)
    for each, count in ((solid, 6 + free), (ms.Solid(mesh, material=SOFT), 6)):
        scene = ms.Scene(each, allow_rigid_motions=True)
        hessian = Problem(scene, LoadParameters()).hessian(scene._model.rest_state())
        values = np.linalg.eigvalsh(hessian.toarray() if hasattr(hessian, "toarray") else hessian)
        assert (np.abs(values) < 1e-9 * values.max()).sum() == count
