"""The own field of six-node sheets: that of the flat triangles between their nodes."""

import numpy as np
import pytest

import magshell as ms
from magshell import _core
from magshell.model.scene.solve_inputs import Inputs
from tests.support.magnet_forces import VACUUM_PERMEABILITY

SIDE, THICKNESS = 0.01, 2e-4  # [m]
QUARTERS = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]
POLARIZATION = 0.0754  # [T]


def sheet_of(mesh, **options):
    return ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e6, **options)


def six_node_mesh(cells, height=0.0):
    flat = ms.meshes.rectangle(SIDE, SIDE, cells=(cells, cells)).transformed(translation=(0, 0, height))
    return ms.QuadraticTriangleMesh.from_triangles(flat)


def differentiated(shells, positions, magnetization, direction):
    """Return the energy, its gradient, the product of its Hessian with a direction, and derivatives by the magnetization."""
    scene = ms.Scene(shells, own_field=ms.OwnField(), allow_rigid_motions=True)
    model, inputs = scene._model, Inputs(scene, magnetization, None)
    with inputs.in_core():
        rotations = np.zeros(scene._bodies.n_rotations)
        state, along = model.state(positions, rotations), model.state(direction, rotations)
        energy = model.energies(state, inputs.load_parameters)["own field"]
        gradient = model.positions(model.term_gradient("own field", state, inputs.load_parameters))
        product = model.hessian_product(state, inputs.load_parameters, along) - model.hessian_product(
            state, 0 * inputs.load_parameters, along
        )
        by_values = _core.vjp(model, state, inputs.load_parameters, along)[0]
    rows = scene._value_layout.of(by_values, "body 0", "remanent_magnetization")
    return energy, gradient, model.positions(product), rows


@pytest.mark.parametrize("law", ["stretches", "rotates"])
def test_six_node_sheet_has_the_own_field_of_its_flat_triangles(law):
    rng = np.random.default_rng(4)
    mesh = six_node_mesh(2)
    arched = mesh.rest_positions + 10.0 * mesh.rest_positions[:, :1] ** 2 * (0, 0, 1)
    mesh = ms.QuadraticTriangleMesh(arched, mesh.elements)
    flat = ms.TriangleMesh(arched, mesh.elements[:, QUARTERS].reshape(-1, 3))
    magnetization = 6e4 * rng.normal(size=(mesh.n_elements, 3))
    positions = arched + 2e-4 * rng.normal(size=arched.shape)
    direction = rng.normal(size=arched.shape)
    six = differentiated(sheet_of(mesh, magnetization_law=law), positions, magnetization, direction)
    three = differentiated(
        sheet_of(flat, magnetization_law=law), positions, np.repeat(magnetization, 4, axis=0), direction
    )
    assert six[0] == pytest.approx(three[0], rel=1e-12)
    for of_six, of_three in zip(six[1:3], three[1:3], strict=True):
        np.testing.assert_allclose(of_six, of_three, rtol=0, atol=1e-11 * np.abs(of_three).max())
    # The sheets differ in bending, so that only the derivatives by the magnetization can be compared.
    np.testing.assert_allclose(
        six[3], three[3].reshape(-1, 4, 3).sum(axis=1), rtol=0, atol=1e-11 * np.abs(six[3]).max()
    )


@pytest.mark.parametrize(("axis", "force"), [(2, 8.50607e-4), (0, 4.25303e-4)])
def test_force_between_six_node_plates_equals_the_closed_form(axis, force):
    plates = [sheet_of(six_node_mesh(8, height)) for height in (0.0, THICKNESS + 1e-3)]
    positions = np.concatenate([plate.mesh.rest_positions for plate in plates])
    magnetization = POLARIZATION / VACUUM_PERMEABILITY * np.eye(3)[axis]
    _, gradient, *_ = differentiated(plates, positions, magnetization, np.zeros_like(positions))
    total = gradient[len(positions) // 2 :].sum(axis=0)
    assert abs(total[2]) == pytest.approx(force, rel=1e-3)


def test_six_node_sheet_bends_in_the_field_of_another():
    """Check the equilibrium of two clamped six-node flaps against that of finer three-node ones."""
    sags = []
    for six in (True, False):
        shells, clamps = [], []
        for height in (0.0, 2e-3):
            mesh = ms.meshes.rectangle(0.02, 4e-3, cells=(5, 1) if six else (20, 4))
            mesh = mesh.transformed(translation=(0, 0, height))
            mesh = ms.QuadraticTriangleMesh.from_triangles(mesh) if six else mesh
            shells.append(sheet_of(mesh))
            clamps.append(ms.Clamp(mesh.edges_at(x=0.0), body=shells[-1]))
        scene = ms.Scene(shells, supports=clamps, own_field=ms.OwnField())
        rest = ms.equilibrium(scene, remanent_magnetization=(3e4, 0, 0), progress=False)
        assert rest.stable
        end = shells[1].mesh.rest_positions[:, 0] > 0.02 - 1e-9
        sags.append(rest[shells[1]].displacements[end, 2].mean())
        np.testing.assert_allclose(
            rest.magnetic_force(shells[0]), -rest.magnetic_force(shells[1]), rtol=0, atol=1e-15
        )
    assert sags[0] == pytest.approx(sags[1], rel=2e-2)
    assert sags[0] > 1e-5
