"""Linear theory measures edge rotations of six-node shells from rest, for a sparser Hessian: answers stay the same."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.scene.solve_inputs import plain_inputs
from magshell.solve.linear.rest import RestStiffness

FLAT = ms.meshes.rectangle(1.0, 1.0, cells=(4, 4), irregular=0.2)


def arched(x: np.ndarray) -> np.ndarray:
    return np.column_stack([x[:, :2], 0.2 * (x[:, 0] - x[:, 0] ** 2) + 0.1 * x[:, 1] ** 2])


def folded(x: np.ndarray) -> np.ndarray:
    """Map points to a fold by a right angle at the line of vertices nearest x = 1/2, with some twist added."""
    return np.column_stack([x[:, :2], np.abs(x[:, 0] - 0.5) + 0.3 * x[:, 0] * x[:, 1]])


def sheet(map_positions=lambda x: x, **values) -> tuple[ms.QuadraticTriangleMesh, ms.Shell]:
    mesh = ms.QuadraticTriangleMesh.from_triangles(
        ms.TriangleMesh(map_positions(FLAT.rest_positions), FLAT.faces)
    )
    values = {"thickness": 0.02, "young_modulus": 1e6, "poisson_ratio": 0.3, **values}
    return mesh, ms.Shell(mesh, bending="midedge2", **values)


def left_edges(mesh: ms.QuadraticTriangleMesh) -> np.ndarray:
    return mesh.edges_where(lambda middles: middles[:, 0] < 1e-9)


def right_edges(mesh: ms.QuadraticTriangleMesh) -> np.ndarray:
    return mesh.edges_where(lambda middles: middles[:, 0] > 1.0 - 1e-9)


def loaded_scene(map_positions) -> ms.Scene:
    mesh, shell = sheet(map_positions)
    return ms.Scene(shell, supports=[ms.Clamp(left_edges(mesh))], loads=[ms.AreaLoad((0.3, -0.2, 1.0))])


def turned_at_its_end() -> ms.Scene:
    """Return a scene whose clamp moves nodes and directions across edges, which causes forces on rotations."""
    mesh, shell = sheet(arched)
    turned = ms.Clamp(right_edges(mesh), rotation=(0.0, 0.1, 0.02), displacement=(0, 0, 0.1))
    return ms.Scene(shell, supports=[ms.Clamp(left_edges(mesh)), turned])


def held_inside() -> ms.Scene:
    """Return a scene clamped along inner edges, which have no rotation, and on oblique symmetry planes."""
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    mesh, shell = sheet(lambda x: x @ turn.T)
    inner = np.setdiff1d(np.arange(mesh.n_edges), mesh.boundary_edges)[3:6]
    planes = [ms.SymmetryPlane(turn[:, 0]), ms.SymmetryPlane(turn[:, 1])]
    return ms.Scene(shell, supports=[ms.Clamp(inner), *planes], loads=[ms.AreaLoad((0, 0, 1.0))])


def varied() -> ms.Scene:
    """Return a scene pinned along its rim, whose thickness and modulus jump from face to face."""
    random = np.random.default_rng(0)
    thickness, modulus = random.uniform(0.01, 0.05, FLAT.n_faces), random.uniform(1e6, 1e7, FLAT.n_faces)
    mesh, shell = sheet(folded, thickness=thickness, young_modulus=modulus)
    rim = np.unique(mesh.nodes_of_edges[mesh.boundary_edges])
    return ms.Scene(shell, supports=[ms.Pin(rim)], loads=[ms.AreaLoad((0, 1.0, 1.0))])


def with_a_rigid_part() -> ms.Scene:
    mesh, shell = sheet(arched)
    part = ms.RigidBody(np.flatnonzero(mesh.rest_positions[:, 0] > 0.7))
    return ms.Scene(
        [shell, part], supports=[ms.Clamp(left_edges(mesh))], loads=[ms.AreaLoad((0.1, 0.2, 1.0))]
    )


def with_an_edge_moment() -> ms.Scene:
    mesh, shell = sheet(arched)
    couple = ms.EdgeCouple(right_edges(mesh), 1e-2)
    return ms.Scene(shell, supports=[ms.Clamp(left_edges(mesh))], loads=[couple])


SCENES = {
    "flat": lambda: loaded_scene(lambda x: x),
    "arched": lambda: loaded_scene(arched),
    "folded": lambda: loaded_scene(folded),
    "turned at its end": turned_at_its_end,
    "held inside": held_inside,
    "jumps": varied,
    "rigid part": with_a_rigid_part,
    "couple": with_an_edge_moment,
}


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("name", SCENES)
def test_linear_response_equals_that_of_the_full_hessian(name) -> None:
    scene = SCENES[name]()
    found = ms.linear_response(scene)
    inputs = plain_inputs(scene, None, None, None, load_factor=1.0, support_factor=1.0)
    with inputs.in_core():
        stiffness = RestStiffness(inputs)
        stiffness.factorize()
        whole = stiffness.response(inputs)
    moves = scene._model.positions(whole)
    assert np.abs(moves).max() > 1e-6
    assert found.displacements == pytest.approx(moves, abs=1e-10 * np.abs(moves).max())
    rotations = scene._model.edge_rotations(whole)
    assert np.abs(rotations).max() > 1e-8
    assert found.edge_rotations == pytest.approx(
        rotations, abs=1e-10 * np.abs(found.displacements).max() / 0.1
    )


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_later_solves_measure_rotations_as_before() -> None:
    scene, untouched = loaded_scene(arched), loaded_scene(arched)
    ms.linear_response(scene)
    found, expected = (ms.equilibrium(each, load_factor=10.0) for each in (scene, untouched))
    assert found.displacements == pytest.approx(expected.displacements, rel=0, abs=1e-13)
    assert found.factorizations == expected.factorizations
