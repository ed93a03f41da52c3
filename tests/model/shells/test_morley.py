"""Small deflections of a plate against an independent code of Morley's element, to which `midedge` then reduces."""

import numpy as np
import pytest

import magshell as ms


@pytest.mark.parametrize("load", ["pressure", "force"])
@pytest.mark.parametrize("support", ["supported", "clamped"])
def test_the_plate_element_is_morleys(support: str, load: str) -> None:
    mesh = ms.meshes.rectangle(1.0, 1.0, (8, 8), irregular=0.2)
    sheet = ms.Shell(mesh, thickness=0.01, young_modulus=12e6 * (1 - 0.09), poisson_ratio=0.3)  # D = 1
    rim = mesh.boundary_edges
    held = ms.Clamp(rim) if support == "clamped" else ms.Pin(np.unique(mesh.edges[rim]))
    middle = mesh.nearest_vertex((0.5, 0.5, 0.0))
    force = ms.AreaLoad((0, 0, 1.0)) if load == "pressure" else ms.PointLoad(middle, (0, 0, 1.0))
    found = ms.linear_response(ms.Scene(sheet, supports=[held], loads=[force])).displacements[:, 2]
    forces = force.vertex_forces(mesh)[:, 2]
    np.testing.assert_allclose(found, morley_plate(mesh, support == "clamped", forces), rtol=1e-8, atol=1e-14)


def morley_plate(
    mesh: ms.TriangleMesh, clamped: bool, vertex_forces: np.ndarray, poisson_ratio: float = 0.3
) -> np.ndarray:
    """Compute the deflections (n_v,) for D = 1 with quadratics that share vertex values and mid-edge slopes."""
    points, n_v, n_e = mesh.rest_positions[:, :2], mesh.n_vertices, mesh.n_edges
    along = points[mesh.edges[:, 1]] - points[mesh.edges[:, 0]]
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    material = np.array([[1, poisson_ratio, 0], [poisson_ratio, 1, 0], [0, 0, (1 - poisson_ratio) / 2]])
    stiffness = np.zeros((n_v + n_e, n_v + n_e))
    for face, edges, area in zip(mesh.faces, mesh.face_edges, mesh.face_areas, strict=True):
        center = points[face].mean(axis=0)
        x, y = (points[face] - center).T
        mid_x, mid_y = (mesh.edge_midpoints[edges, :2] - center).T
        n_x, n_y = normals[edges].T
        zero, one = np.zeros(3), np.ones(3)
        values = np.stack([one, x, y, x * x, x * y, y * y], axis=1)
        slopes = np.stack(
            [zero, n_x, n_y, 2 * mid_x * n_x, mid_y * n_x + mid_x * n_y, 2 * mid_y * n_y], axis=1
        )
        coefficients = np.linalg.inv(np.concatenate([values, slopes]))
        curvatures = np.stack([2 * coefficients[3], 2 * coefficients[5], 2 * coefficients[4]])
        unknowns = np.concatenate([face, n_v + edges])
        stiffness[np.ix_(unknowns, unknowns)] += area * curvatures.T @ material @ curvatures
    held = np.zeros(n_v + n_e, dtype=bool)
    held[mesh.edges[mesh.boundary_edges].ravel()] = True
    held[n_v + mesh.boundary_edges] = clamped
    solution = np.zeros(n_v + n_e)
    forces = np.concatenate([vertex_forces, np.zeros(n_e)])
    solution[~held] = np.linalg.solve(stiffness[np.ix_(~held, ~held)], forces[~held])
    return solution[:n_v]
