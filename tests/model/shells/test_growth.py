"""Sheets with growth and rest curvature: exact shapes, and the strains and stresses measured from them."""

import numpy as np
import pytest

import magshell as ms

BENDINGS = ("midedge", "hinge", "midedge2")
EXACT = ms.MixedNewton(tolerance=1e-12)
LENGTH, WIDTH = 0.1, 0.03


def order(bending):
    return 2 if bending == "midedge2" else 1


def rectangle(bending, cells=(8, 2), **more):
    return ms.meshes.rectangle(LENGTH, WIDTH, cells=cells, order=order(bending), **more)


def shell(mesh, bending, **more):
    options = {"thickness": 1e-3, "young_modulus": 1e6, "poisson_ratio": 0.3, **more}
    return ms.Shell(mesh, bending=bending, **options)


def held(sheet, **more):
    """Return a scene held against rigid motions alone: a corner, an end of its first edge along x, another corner."""
    mesh = sheet.mesh
    at = mesh.rest_positions
    corner = [int(np.argmin(np.abs(at[:, :2]).sum(axis=1)))]
    end = [int(np.argmin(np.abs(at[:, 0] - LENGTH) + np.abs(at[:, 1])))]
    side = [int(np.argmin(np.abs(at[:, 0]) + np.abs(at[:, 1] - WIDTH)))]
    return ms.Scene(sheet, supports=[ms.Pin(corner), ms.Pin(end, "yz"), ms.Pin(side, "z")], **more)


def clamped(sheet, **more):
    return ms.Scene(sheet, supports=[ms.Clamp(sheet.mesh.edges_at(x=0.0))], **more)


@pytest.mark.parametrize("bending", BENDINGS)
def test_a_free_sheet_that_grows_evenly_is_scaled_without_energy(bending):
    sheet = shell(rectangle(bending), bending, growth=1.3)
    found = ms.equilibrium(held(sheet), solver=EXACT)
    np.testing.assert_allclose(found.positions, 1.3 * sheet.mesh.rest_positions, atol=1e-11)
    assert abs(sum(found.energies.values())) < 1e-18
    assert found.largest_membrane_strain < 1e-9


@pytest.mark.parametrize("bending", BENDINGS)
def test_a_curved_sheet_that_grows_evenly_keeps_its_angles(bending):
    """Check that a curved sheet is scaled, its angles to symmetry planes included."""
    flat = rectangle(bending)
    bent = flat.rest_positions + (flat.rest_positions**2 @ (3.0, 2.0, 0.0))[:, None] * (0, 0, 1)
    mesh = type(flat)(bent, flat.elements)
    corner = [int(np.argmin(np.abs(bent).sum(axis=1)))]
    supports = [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0)), ms.Pin(corner, "z")]
    scene = ms.Scene(shell(mesh, bending, growth=1.2), supports=supports)
    found = ms.equilibrium(scene, solver=EXACT)
    np.testing.assert_allclose(found.positions, 1.2 * bent, atol=1e-10)
    assert abs(sum(found.energies.values())) < 1e-18


@pytest.mark.parametrize("bending", BENDINGS)
def test_growth_along_one_direction(bending):
    mesh = rectangle(bending, irregular=0.2, seed=1)
    sheet = shell(mesh, bending, growth=np.diag([1.25, 0.9, 7.0]))  # growth along the normal has no effect
    found = ms.equilibrium(held(sheet), solver=EXACT)
    np.testing.assert_allclose(found.positions, mesh.rest_positions * (1.25, 0.9, 1.0), atol=1e-11)
    assert abs(sum(found.energies.values())) < 1e-18


def rolled(found, sheet):
    """Return the angles of a strip's faces from one end to the other."""
    at = found.positions[sheet.mesh.elements[:, :3]]
    rest = sheet.mesh.rest_positions[sheet.mesh.elements[:, :3]].mean(axis=1)
    normals = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    turns = np.unwrap(np.arctan2(-normals[:, 0], normals[:, 2])[np.argsort(rest[:, 0], kind="stable")])
    return turns


@pytest.mark.parametrize("bending", ("midedge", "hinge"))
@pytest.mark.parametrize("growth", (1.0, 1.1))
def test_a_strip_that_is_bent_at_rest_closes_to_a_ring(bending, growth):
    """Compare with a polygon of the mesh's strips, whose angles are exactly those of the curvature."""
    cells = 16
    mesh = rectangle(bending, cells=(cells, 2), diagonals="aligned")
    curvature = 2.0 * np.pi / (growth * LENGTH)
    along = np.diag([growth, 1.0, 1.0])
    sheet = shell(mesh, bending, growth=along, rest_curvature=np.diag([curvature, 0.0, 0.0]))
    found = ms.equilibrium(clamped(sheet), solver=EXACT)
    turns = rolled(found, sheet)
    step = curvature * growth * LENGTH / cells
    of_columns = np.sort(turns).reshape(cells, -1)
    np.testing.assert_allclose(
        of_columns.T - turns.min(), np.tile(step * np.arange(cells), (of_columns.shape[1], 1)), atol=1e-8
    )
    first, last = mesh.vertices_at(x=0.0), mesh.vertices_at(x=LENGTH)
    assert abs(sum(found.energies.values())) < 1e-16
    # The first strip leaves the clamp at half of the angle between strips, so both ends coincide.
    np.testing.assert_allclose(found.positions[first], found.positions[last], atol=1e-9)


def test_six_nodes_close_to_a_ring():
    gaps = []
    for cells in (8, 16):
        mesh = rectangle("midedge2", cells=(cells, 1))
        sheet = shell(mesh, "midedge2", rest_curvature=np.diag([2.0 * np.pi / LENGTH, 0.0, 0.0]))
        found = ms.equilibrium(clamped(sheet), solver=EXACT)
        first, last = mesh.vertices_at(x=0.0), mesh.vertices_at(x=LENGTH)
        gaps.append(np.abs(found.positions[first] - found.positions[last]).max() / LENGTH)
        assert found.positions[:, 2].max() > 0  # towards the normal
        height = np.ptp(found.positions[:, 2])
    assert height == pytest.approx(LENGTH / np.pi, rel=2e-3)
    assert gaps[1] < 1e-3 and gaps[1] < 0.2 * gaps[0]


def bilayer(thicknesses, moduli, mismatch):
    """Compute the parameters of one shell equivalent to a strip of two layers, Poisson's ratio 0.

    The first layer is below and longer by `mismatch`. Stiffnesses are taken about the axis where stretching and bending
    decouple.
    """
    bounds = np.cumsum([0.0, *thicknesses])
    stiffness = [e * t for e, t in zip(moduli, thicknesses, strict=True)]
    middles = 0.5 * (bounds[1:] + bounds[:-1])
    middle = np.dot(stiffness, middles) / np.sum(stiffness)
    bending = sum(
        e * ((b - middle) ** 3 - (a - middle) ** 3) / 3
        for e, a, b in zip(moduli, bounds, bounds[1:], strict=False)
    )
    strains = np.array([mismatch, 0.0])
    growth = 1.0 + np.dot(stiffness, strains) / np.sum(stiffness)
    # The curvature is positive if the upper layer, on the normal's side, is shorter.
    curvature = -np.dot(stiffness, strains * (middles - middle)) / bending
    thickness = np.sqrt(12.0 * bending / np.sum(stiffness))
    return {
        "thickness": thickness,
        "young_modulus": np.sum(stiffness) / thickness,
        "growth": growth,
        "rest_curvature": curvature,
    }


@pytest.mark.parametrize(
    "ratio, moduli, curvature",  # validation/bodies.json, P3: Timoshenko 1925, mismatch 0.01, h = 1
    [(1.0, 1.0, 0.015), (0.5, 1.0, 0.01333333333), (1.0, 4.0, 0.01315068493), (0.2, 10.0, 0.01454545455)],
)
def test_a_bilayer_bends_as_timoshenko_says(ratio, moduli, curvature):
    height = 1e-3
    layers = bilayer((height * ratio / (1 + ratio), height / (1 + ratio)), (moduli * 1e6, 1e6), 0.01)
    mesh = rectangle("midedge", cells=(10, 1), diagonals="aligned")
    along = np.diag([1.0, 0.0, 0.0])
    growth = np.eye(3) + (layers.pop("growth") - 1.0) * along
    bent = layers.pop("rest_curvature")
    sheet = ms.Shell(mesh, poisson_ratio=0.0, growth=growth, rest_curvature=bent * along, **layers)
    found = ms.equilibrium(clamped(sheet), solver=EXACT)
    turns = rolled(found, sheet)
    length = growth[0, 0] * LENGTH * 0.9  # between the middles of the first and the last strip
    assert abs(turns[-1] - turns[0]) / length * height == pytest.approx(curvature, rel=1e-8)


@pytest.mark.parametrize("bending", BENDINGS)
def test_a_disk_with_a_swollen_rim_goes_into_waves(bending):
    mesh = ms.meshes.disk(0.05, cells=3 if bending == "midedge2" else 5, order=order(bending))
    at = mesh.rest_positions
    rim = np.linalg.norm(at[mesh.elements[:, :3]].mean(axis=1), axis=1) > 0.03
    sheet = shell(mesh, bending, growth=np.where(rim, 1.05, 1.0))
    held_at = {
        "xyz": np.argmin(np.linalg.norm(at, axis=1)),
        "yz": np.argmax(at[:, 0]),
        "z": np.argmax(at[:, 1]),
    }
    scene = ms.Scene(sheet, supports=[ms.Pin([int(vertex)], axes) for axes, vertex in held_at.items()])
    flat = ms.equilibrium(scene, require_stable=False)
    assert np.abs(flat.positions[:, 2]).max() < 1e-9 and not flat.stable
    saddle = 4e-3 * (at[:, 0] ** 2 - at[:, 1] ** 2 + at[:, 0] * at[:, 1]) / 0.05**2
    wavy = ms.equilibrium(scene, start=at + saddle[:, None] * (0, 0, 1))
    assert wavy.stable and np.ptp(wavy.positions[:, 2]) > 0.01
    assert sum(wavy.energies.values()) < 0.5 * sum(flat.energies.values())


def test_growth_along_a_path_buckles_where_the_theory_says():
    """Compare a strip between clamps with a column, which buckles at the strain (pi^2 / 3) (h / L)^2."""
    mesh = ms.meshes.rectangle(LENGTH, 0.004, cells=(40, 1), diagonals="aligned")
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0, growth=np.eye(3))
    ends = [ms.Clamp(mesh.edges_at(x=place)) for place in (0.0, LENGTH)]
    scene = ms.Scene(sheet, supports=ends)
    along = np.diag([1.0, 0.0, 0.0])
    path = ms.follow_path(
        scene,
        start=ms.equilibrium(scene),
        values={sheet: {"growth": np.eye(3) + 1e-3 * along}},
        until=lambda parameter, positions: parameter > 0.5,
        first_step=0.1,
        solver=EXACT,
    )
    critical = path.critical[0]
    assert critical.kind == "bifurcation"
    strain = np.pi**2 / 3.0 * (1e-3 / LENGTH) ** 2
    assert critical.parameter * 1e-3 == pytest.approx(strain, rel=0.01)
    # Strains are measured with the growth of each point of the path.
    at = path.parameters[-1] * 1e-3
    squeezed = 0.5 * (1.0 - (1.0 + at) ** 2) / (1.0 + at) ** 2
    assert path.strains(-1).membrane.min() == pytest.approx(squeezed, rel=1e-6)
    assert path.largest_membrane_strain[-1] == pytest.approx(-squeezed, rel=1e-6)


def test_stresses_of_a_sheet_that_cannot_grow():
    mesh = rectangle("midedge", irregular=0.2, seed=2)
    growth = 1.02
    sheet = shell(mesh, "midedge", growth=growth)
    scene = ms.Scene(sheet, supports=[ms.Pin(np.arange(mesh.n_vertices))])
    found = ms.equilibrium(scene, require_stable=False)
    strain = 0.5 * (1.0 / growth**2 - 1.0)
    stresses = found[sheet].stresses()
    force = 1e6 * 1e-3 / (1.0 - 0.3) * strain
    np.testing.assert_allclose(
        stresses.membrane_strains, np.broadcast_to(strain * np.eye(2), (mesh.n_faces, 2, 2)), atol=1e-12
    )
    np.testing.assert_allclose(stresses.principal_membrane_forces, force, rtol=1e-9)
    np.testing.assert_allclose(stresses.areas, growth**2 * mesh.face_areas)
    np.testing.assert_allclose(found.strains().membrane, strain, rtol=1e-9)
    work = 0.5 * (stresses.areas[:, None, None] * stresses.membrane_forces * stresses.membrane_strains).sum()
    assert found.energies["membrane"] == pytest.approx(work, rel=1e-9)


@pytest.mark.parametrize("bending", BENDINGS)
def test_moments_of_a_sheet_that_is_kept_flat(bending):
    """Compare with M = - Y h^3 / 12 (1 - nu^2) ((1 - nu) K + nu tr K) of a rest curvature alone."""
    mesh = rectangle(bending, cells=(6, 3), diagonals="aligned")
    bent = np.diag([3.0, 1.0, 0.0])
    sheet = shell(mesh, bending, rest_curvature=bent)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.boundary_edges), ms.Pin(np.arange(mesh.n_vertices))])
    stresses = ms.equilibrium(scene, require_stable=False)[sheet].stresses()
    modulus = 1e6 * 1e-9 / 12.0 / (1.0 - 0.3**2)
    moments = np.einsum("fai,fab,fbj->fij", stresses.rest_axes, stresses.bending_moments, stresses.rest_axes)
    wanted = -modulus * (0.7 * bent + 0.3 * np.trace(bent) * np.diag([1.0, 1.0, 0.0]))
    # Hinges have no angle at the border, where nothing holds it: compared inside only.
    inside = (
        ~np.isin(np.arange(len(mesh.faces)), mesh.edge_faces[mesh.boundary_edges].ravel())
        if bending == "hinge"
        else slice(None)
    )
    np.testing.assert_allclose(
        moments[inside], np.broadcast_to(wanted, moments.shape)[inside], atol=1e-9 * modulus
    )
