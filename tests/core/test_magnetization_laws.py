"""The energy of a magnetization that stretches or rotates, against formulas written and differentiated in torch.

The polar decomposition is that of the whole 3 x 3 deformation gradient here, by Newton's iteration (Higham 1986), for faces
as for tetrahedra.
"""

import numpy as np
import pytest
from magnet_forces import VACUUM_PERMEABILITY
from model_access import LoadParameters, Problem

import magshell as ms

torch = pytest.importorskip("torch")

MAGNETIZATION = np.array([3e4, -2e4, 5e4])  # A/m
FLUX_DENSITY = np.array([0.03, -0.05, 0.08])  # T
AT = np.array([[0.3, 0.2, -1.2], [1.5, -0.9, 1.0]])  # of two dipoles [m]
MOMENTS = np.array([[3e5, 1e5, 5e5], [0.0, 4e5, 1e5]])  # A m2
SOFT = 1e-9  # Pa


def rotation_of(f):
    for _ in range(12):
        f = 0.5 * (f + torch.linalg.inv(f).transpose(-1, -2))
    return f


def flux_density(x):
    total = torch.tensor(FLUX_DENSITY).expand(x.shape)
    for at, moment in zip(torch.tensor(AT), torch.tensor(MOMENTS), strict=True):
        r = x - at
        distance = torch.linalg.norm(r, dim=-1, keepdim=True)
        along = (r @ moment)[..., None]
        total = total + VACUUM_PERMEABILITY / (4 * np.pi) * (
            3.0 * along * r / distance**5 - moment / distance**3
        )
    return total


def zeeman_energy(law, f, positions, volumes):
    carried = f if law == "stretches" else rotation_of(f)
    magnetization = carried @ torch.tensor(MAGNETIZATION)
    return -(volumes[..., None] * magnetization * flux_density(positions)).sum()


def frames(first, second):
    normal = torch.linalg.cross(first, second)
    return torch.stack([first, second, normal / torch.linalg.norm(normal, dim=-1, keepdim=True)], dim=-1)


class Faces:
    """Shells of three-node or six-node faces: integration points with values and derivatives of the shape functions."""

    def __init__(self, mesh, thickness):
        self.nodes = torch.tensor(mesh.elements.astype(np.int64))
        if mesh.order == 1:
            points, weights = np.full((1, 3), 1 / 3), np.ones(1)
        else:
            a, b = 0.44594849091596488632, 0.09157621350977074346
            rings = [np.where(np.eye(3, dtype=bool), 1 - 2 * c, c) for c in (a, b)]
            points, weights = (
                np.concatenate(rings),
                np.repeat([0.22338158967801146570, 0.10995174365532186764], 3),
            )
        self.shapes, self.slopes = (torch.tensor(each) for each in self.functions(points, mesh.order))
        self.rest_first, self.rest_second = self.tangents(torch.tensor(np.array(mesh.rest_positions)))
        areas = 0.5 * torch.linalg.norm(torch.linalg.cross(self.rest_first, self.rest_second), dim=-1)
        self.volumes = areas * torch.tensor(weights) * thickness

    @staticmethod
    def functions(points, order):
        """Return the shape functions (p, n) and their derivatives by the last two barycentric coordinates (p, 2, n)."""
        if order == 1:
            return points, np.tile(np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]]), (len(points), 1, 1))
        l0, l1, l2 = points.T
        zero = 0.0 * l0
        shapes = [
            l0 * (2 * l0 - 1),
            l1 * (2 * l1 - 1),
            l2 * (2 * l2 - 1),
            4 * l0 * l1,
            4 * l1 * l2,
            4 * l2 * l0,
        ]
        first = [1 - 4 * l0, 4 * l1 - 1, zero, 4 * (l0 - l1), 4 * l2, -4 * l2]
        second = [1 - 4 * l0, zero, 4 * l2 - 1, -4 * l1, 4 * l1, 4 * (l0 - l2)]
        return np.stack(shapes, axis=1), np.stack([np.stack(first, 1), np.stack(second, 1)], axis=1)

    def tangents(self, x):
        found = torch.einsum("psn,fnd->sfpd", self.slopes, x[self.nodes])
        return found[0], found[1]

    def energy(self, law, x):
        f = frames(*self.tangents(x)) @ torch.linalg.inv(frames(self.rest_first, self.rest_second))
        positions = torch.einsum("pn,fnd->fpd", self.shapes, x[self.nodes])
        return zeeman_energy(law, f, positions, self.volumes)


class Tetrahedra:
    """Solids of four-node or ten-node tetrahedra."""

    def __init__(self, mesh):
        self.nodes = torch.tensor(mesh.tetrahedra.astype(np.int64))
        linear = self.nodes.shape[1] == 4
        c, d = 0.58541019662496845446, 0.13819660112501051518
        points = np.full((1, 4), 0.25) if linear else np.where(np.eye(4, dtype=bool), c, d)
        shapes, slopes = [], []  # by each of the four coordinates, the others fixed
        for at in points:
            by = np.zeros((10, 4))
            values = [at[i] * (2 * at[i] - 1) for i in range(4)]
            by[range(4), range(4)] = 4 * at - 1
            for k, (i, j) in enumerate([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]):
                values.append(4 * at[i] * at[j])
                by[4 + k, i], by[4 + k, j] = 4 * at[j], 4 * at[i]
            shapes.append(at if linear else values)
            slopes.append(np.eye(4) if linear else by)
        self.shapes = torch.tensor(np.array(shapes))
        self.slopes = torch.tensor(np.array(slopes)[:, :, 1:] - np.array(slopes)[:, :, :1])
        rest = self.jacobians(torch.tensor(np.array(mesh.rest_positions)))
        self.inverse = torch.linalg.inv(rest)
        self.volumes = torch.linalg.det(rest) / 6.0 / len(points)

    def jacobians(self, x):
        return torch.einsum("pns,fnd->fpds", self.slopes, x[self.nodes])

    def energy(self, law, x):
        positions = torch.einsum("pn,fnd->fpd", self.shapes, x[self.nodes])
        return zeeman_energy(law, self.jacobians(x) @ self.inverse, positions, self.volumes)


def shell_scene(order, law):
    mesh = ms.meshes.rectangle(1.0, 0.7, cells=(2, 2), irregular=0.2, seed=11)
    x, y, _ = mesh.rest_positions.T
    curved = ms.TriangleMesh(np.stack([x, y, 0.25 * x**2 - 0.2 * y * x], axis=1), mesh.faces)
    if order == 2:
        curved = ms.QuadraticTriangleMesh.from_triangles(
            curved, project=lambda p: p + 0.1 * np.sin(3.0 * p[:, :1]) * np.array([0.0, 0.0, 1.0])
        )
    sheet = ms.Shell(
        curved,
        thickness=0.05,
        young_modulus=SOFT,
        remanent_magnetization=MAGNETIZATION,
        magnetization_law=law,
    )
    return sheet, Faces(curved, 0.05)


def solid_scene(element, law):
    mesh = ms.meshes.box((1.0, 0.6, 0.5), cells=(1, 1, 1))
    body = ms.Solid(
        mesh,
        material=ms.StVenantKirchhoff(young_modulus=SOFT, poisson_ratio=0.3),
        element=element,
        remanent_magnetization=MAGNETIZATION,
        magnetization_law=law,
    )
    return body, Tetrahedra(body.mesh)


CASES = {
    "three-node shell": lambda law: shell_scene(1, law),
    "six-node shell": lambda law: shell_scene(2, law),
    "linear solid": lambda law: solid_scene("linear", law),
    "quadratic solid": lambda law: solid_scene("quadratic", law),
}


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning", "ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("law", ["stretches", "rotates"])
@pytest.mark.parametrize("case", CASES)
def test_energy_gradient_and_hessian_of_each_law_agree_with_torch(case, law, rng):
    body, formulas = CASES[case](law)
    scene = ms.Scene(body, field=[ms.UniformField(), ms.Dipoles(AT, MOMENTS)], allow_rigid_motions=True)
    load_parameters = LoadParameters(applied_flux_density=tuple(FLUX_DENSITY), field_factor=1.0)
    problem = Problem(scene, load_parameters)
    scene._model.set_values(scene._values.numbers)
    n = scene.mesh.n_vertices
    strain = np.diag([1.3, 0.75, 1.1]) + 0.15 * rng.normal(size=(3, 3))
    x = scene.mesh.rest_positions @ strain.T + 0.03 * rng.normal(size=(n, 3))
    n_rotations = scene._bodies.n_rotations
    q = scene._model.state(x, np.zeros(n_rotations))
    order = scene._model.state(np.arange(3.0 * n).reshape(-1, 3), np.full(n_rotations, -1.0)).astype(int)
    known = np.flatnonzero(order >= 0)
    at = torch.tensor(x, requires_grad=True)

    def total(positions):
        return formulas.energy(law, positions.reshape(-1, 3))

    expected = total(at).item()
    assert scene._model.energies(q, problem.load_parameters)["magnetic"] == pytest.approx(expected, rel=1e-9)
    gradient = np.zeros(3 * n)
    gradient[order[known]] = problem.gradient(q)[known]
    by = torch.autograd.functional.jacobian(total, at.reshape(-1)).numpy()
    assert np.abs(gradient - by).max() < 1e-9 * np.abs(by).max()
    hessian = np.zeros((3 * n, 3 * n))
    hessian[np.ix_(order[known], order[known])] = problem.hessian(q)[np.ix_(known, known)]
    by = torch.autograd.functional.hessian(total, at.detach().reshape(-1), vectorize=True).numpy()
    assert np.abs(hessian - by).max() < 1e-8 * np.abs(by).max()
