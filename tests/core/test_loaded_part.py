"""Linear theory solves for the unknowns that a load is coupled with, and leaves the rest of a scene at rest."""

import numpy as np
import pytest

import magshell as ms
from magshell import _core
from magshell.model.scene.solve_inputs import plain_inputs
from magshell.solve.linear.rest import RestStiffness

# Unknowns 0, 2, 4 are coupled, and 1, 3; a stored zero lies between the two groups.
STARTS, ROWS = [0, 4, 6, 8, 9, 10], [0, 1, 2, 4, 1, 3, 2, 4, 3, 4]
VALUES = [4.0, 0.0, 1.0, 0.0, 5.0, 2.0, 6.0, 3.0, 7.0, 8.0]


def test_loaded_part_is_the_coupled_block_of_a_matrix() -> None:
    def part(*forces):
        return _core.loaded_part(5, STARTS, ROWS, VALUES, forces)

    unknowns, starts, rows, values = part(0, 0, 0, 0, 1)
    assert (unknowns.tolist(), starts.tolist(), rows.tolist()) == (
        [0, 2, 4],
        [0, 2, 4, 5],
        [0, 1, 1, 2, 2],
    )
    assert values.tolist() == [4.0, 1.0, 6.0, 3.0, 8.0]
    unknowns, starts, rows, values = part(0, -1, 0, 0, 0)
    assert (unknowns.tolist(), starts.tolist(), rows.tolist()) == ([1, 3], [0, 2, 3], [0, 1, 1])
    assert values.tolist() == [5.0, 2.0, 7.0]
    for forces in ((1, 1, 0, 0, 0), (0, 0, 0, 0, 0)):
        unknowns, starts, rows, values = part(*forces)
        assert (unknowns.tolist(), starts.tolist()) == ([0, 1, 2, 3, 4], [0, 2, 4, 6, 7, 8])
        assert (rows.tolist(), values.tolist()) == (
            [0, 2, 1, 3, 2, 4, 3, 4],
            [4.0, 1.0, 5.0, 2.0, 6.0, 3.0, 7.0, 8.0],
        )
    _, _, rows, values = _core.loaded_part(2, [0, 2, 3], [0, 1, 1], [0.0, 1.0, 0.0], [1, 0])
    assert (rows.tolist(), values.tolist()) == ([0, 1, 1], [0.0, 1.0, 0.0])  # a diagonal stays


def test_single_zeros_between_nodes_stay() -> None:
    """Check that unknowns 0, 1 and 2, 3 keep their common rows, so that each pair is ordered as one; 4 is alone."""
    starts, rows = [0, 5, 9, 11, 12, 13], [0, 1, 2, 3, 4, 1, 2, 3, 4, 2, 3, 3, 4]
    values = [9.0, 0, 1, 0, 0, 9, 0, 0, 0, 9, 0, 9, 9]
    unknowns, starts, rows, kept = _core.loaded_part(5, starts, rows, values, [1, 1, 1, 1, 1])
    assert unknowns.tolist() == [0, 1, 2, 3, 4]
    assert starts.tolist() == [0, 4, 7, 9, 10, 11]
    assert rows.tolist() == [0, 1, 2, 3, 1, 2, 3, 2, 3, 3, 4]
    assert kept.tolist() == [9, 0, 1, 0, 9, 0, 0, 9, 0, 9, 9]


def test_malformed_matrices_are_refused() -> None:
    with pytest.raises(ValueError, match=r"values\[9\] is nan"):
        _core.loaded_part(5, STARTS, ROWS, [*VALUES[:9], np.nan], [0, 1, 0, 0, 0])
    with pytest.raises(ValueError, match="forces 5, one per row of the matrix"):
        _core.loaded_part(5, STARTS, ROWS, VALUES, [0, 1, 0])
    with pytest.raises(ValueError, match="outside the matrix"):
        _core.loaded_part(5, STARTS, [*ROWS[:9], 7], VALUES, [0, 1, 0, 0, 0])


def plate(bending: str, map_positions=lambda x: x, loads=None, supports=None, **options) -> ms.Scene:
    flat = ms.meshes.rectangle(1.0, 1.0, cells=(4, 4), irregular=0.2)
    flat = ms.TriangleMesh(map_positions(flat.rest_positions), flat.faces)
    mesh = ms.QuadraticTriangleMesh.from_triangles(flat) if bending == "midedge2" else flat
    sheet = ms.Shell(mesh, thickness=0.01, young_modulus=1e6, poisson_ratio=0.3, bending=bending)
    held = [ms.Clamp(mesh.boundary_edges)] if supports is None else supports(mesh)
    loads = [ms.AreaLoad((0, 0, 1.0))] if loads is None else loads
    return ms.Scene(sheet, supports=held, loads=loads, **options)


def raised(by: float):
    return lambda x: x + np.array([0.0, 0.0, by])


def arched(x: np.ndarray) -> np.ndarray:
    return np.column_stack([x[:, :2], 0.1 * (x[:, 0] - x[:, 0] ** 2)])


def solved_sizes(monkeypatch) -> list[int]:
    """Return a list that receives the size of every matrix that a load is solved with from now on."""
    sizes, solve = [], _core.Model.small_deflection

    def counted(*args):
        found = solve(*args)
        sizes.append(found.unknowns)
        return found

    monkeypatch.setattr(_core.Model, "small_deflection", counted)
    return sizes


BENDINGS = ["hinge", "midedge", "midedge2"]


@pytest.mark.parametrize("bending", BENDINGS)
@pytest.mark.parametrize("load", [(0, 0, 1.0), (1.0, 0.5, 0), (1.0, 0, 1.0)])
@pytest.mark.parametrize("map_positions", [raised(0.0), raised(0.37), arched])
def test_loaded_part_gives_the_solution_of_the_full_matrix(bending, load, map_positions, monkeypatch) -> None:
    scene = plate(bending, map_positions, [ms.AreaLoad(load)])
    sizes = solved_sizes(monkeypatch)
    found = ms.linear_response(scene)
    falls_apart = map_positions is not arched and 0 in (load[0], load[2])
    assert (sizes[0] < scene.n_dofs) == falls_apart

    inputs = plain_inputs(scene, None, None, None, load_factor=1.0)
    with inputs.in_core():
        stiffness = RestStiffness(inputs)
        stiffness.factorize()
        whole = stiffness.response(inputs)
    assert len(sizes) == 1
    expected = scene._model.positions(whole)
    assert found.displacements == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())
    turned = scene._model.edge_rotations(whole)
    assert found.edge_rotations == pytest.approx(
        turned, abs=1e-11 * max(np.abs(turned).max(initial=0), 1e-300)
    )


@pytest.mark.parametrize("bending", BENDINGS)
def test_plate_held_across_its_plane_only_needs_no_load_in_it(bending) -> None:
    """Check a plate held across its plane only: it is free to slide in the plane, where nothing pushes it."""

    def across(mesh) -> list:
        rim = np.unique(mesh.nodes_of_edges[mesh.boundary_edges])
        return [ms.Pin(rim, components="z")]

    free = ms.linear_response(plate(bending, supports=across, allow_rigid_motions=True)).displacements
    held = ms.linear_response(
        plate(bending, supports=lambda m: [ms.Pin(np.unique(m.nodes_of_edges[m.boundary_edges]))])
    ).displacements
    assert not free[:, :2].any()
    assert free[:, 2] == pytest.approx(held[:, 2], rel=1e-11, abs=1e-13 * held[:, 2].max())
    pushed = plate(bending, loads=[ms.AreaLoad((1.0, 0, 1.0))], supports=across, allow_rigid_motions=True)
    with pytest.raises(ValueError, match="not positive definite"):
        ms.linear_response(pushed)


@pytest.mark.parametrize(("along", "still"), [((1.0, 0, 0), [2]), ((0, 0, 1.0), [0, 1])])
def test_moving_supports_load_only_the_coupled_part(along, still) -> None:
    """Check that an end pulled in its plane only stretches the sheet, and one that is lifted only bends it."""

    def supports(mesh) -> list:
        return [ms.Clamp(mesh.edges_at(x=0.0)), ms.Clamp(mesh.edges_at(x=1.0), displacement=along)]

    moved = ms.linear_response(plate("midedge", loads=[], supports=supports)).displacements
    assert not moved[:, still].any()
    assert np.abs(moved).max() == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("height", [0.37, 1000.0])
def test_six_node_sheets_far_from_the_origin(height) -> None:
    here = ms.linear_response(plate("midedge2")).displacements
    there = ms.linear_response(plate("midedge2", raised(height))).displacements
    assert there == pytest.approx(here, abs=1e-14 * here.max())
