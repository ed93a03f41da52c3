"""The core's shell energies against the same formulas written a second time in torch and differentiated by it.

The two share no code: here strains come from deformation gradients and second fundamental forms in space, angles from
face normals, and the magnetic energy from a matrix inverse, as in the paper.
"""

import numpy as np
import pytest
from model_access import LoadParameters, Problem

import magshell as ms

torch = pytest.importorskip("torch")

# Dominant energy term -> thickness [m] and modulus [Pa] that make it dominate.
CARRIERS = {"membrane": (1e-3, 1e8), "bending": (30.0, 1e6), "magnetic": (1e-2, 1e-3)}
MAGNETIZATION = (3e4, -2e4, 5e4)  # A/m
FLUX_DENSITY = (0.03, -0.05, 0.08)  # T


def make_mesh():
    """Return an irregular, curved mesh with a boundary."""
    mesh = ms.meshes.rectangle(1.0, 0.7, cells=(3, 3), irregular=0.2, seed=11)
    x, y, _ = mesh.rest_positions.T
    return ms.TriangleMesh(np.stack([x, y, 0.25 * x**2 - 0.2 * y * x + 0.1 * y**2], axis=1), mesh.faces)


def make_problem(bending, dominant_term):
    mesh = make_mesh()
    thickness, modulus = CARRIERS[dominant_term]
    draw = np.random.default_rng(8).uniform
    sheet = ms.Shell(
        mesh,
        thickness=thickness * draw(0.5, 1.5, mesh.n_faces),
        young_modulus=modulus * draw(0.3, 3.0, mesh.n_faces),
        poisson_ratio=draw(-0.5, 0.5, mesh.n_faces),
        curvature_scale=draw(0.5, 2.0, mesh.n_edges),
        bending=bending,
    )
    clamped = np.concatenate([mesh.edges_at(x=0.0), mesh.edges_at(x=1.0)[:1]])
    scene = ms.Scene(sheet, supports=[ms.Clamp(clamped)], field=ms.UniformField())
    return Problem(
        scene, LoadParameters(applied_flux_density=np.array(FLUX_DENSITY)), np.array(MAGNETIZATION)
    ), clamped


class Formulas:
    """Energies of a sheet as functions of z = (positions, edge rotations), in the caller's order."""

    def __init__(self, scene, clamped):
        mesh, self.shell = scene.mesh, scene.shell
        self.hinge = scene.shell.bending == "hinge"
        self.clamped = set(clamped.tolist())
        self.n_vertices, self.faces = mesh.n_vertices, torch.tensor(mesh.faces.astype(np.int64))
        self.mesh = mesh
        self.rest = torch.tensor(mesh.rest_positions)
        a1, a2, normal = self.frame(self.rest)
        self.area = 0.5 * torch.linalg.norm(torch.linalg.cross(a1, a2), dim=1)
        self.inverse = torch.linalg.inv(torch.stack([a1, a2, normal], dim=2))
        self.rest_normal = normal
        self.edge_shapes = self.rest_edge_shapes()
        self.directions = {e: self.continuation(e) for e in self.clamped}
        self.rest_angles = self.angles(self.rest)

    def frame(self, x):
        """Compute the columns (a_1, a_2, n) of every face's frame, [Chen22] (20)."""
        corners = x[self.faces]
        a1, a2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        normal = torch.linalg.cross(a1, a2)
        return a1, a2, normal / torch.linalg.norm(normal, dim=1, keepdim=True)

    def rest_edge_shapes(self):
        """Compute t~ (x) t~ / (A~ |a~|) for the three edges of every face, (n_f, 3, 3, 3)."""
        corners = self.rest[self.faces]
        edges = torch.roll(corners, -2, dims=1) - torch.roll(corners, -1, dims=1)
        turned = torch.linalg.cross(edges, self.rest_normal[:, None].expand_as(edges))
        scale = self.area[:, None] * torch.linalg.norm(edges, dim=2)
        return torch.einsum("fij,fik->fijk", turned, turned) / scale[..., None, None]

    def deformation_gradient(self, x):
        return torch.stack(self.frame(x), dim=2) @ self.inverse

    def plane_stress(self, strain):
        """Compute ((1 - nu) tr G^2 + nu (tr G)^2) / (1 - nu^2), the density of plane stress over E/2."""
        nu = torch.tensor(self.shell.poisson_ratio)
        trace = torch.einsum("fii->f", strain)
        return ((1 - nu) * torch.einsum("fij,fji->f", strain, strain) + nu * trace**2) / (1 - nu**2)

    def membrane(self, z):
        """Compute the membrane energy, [Chen22] (22), in J.

        The strain is the Green strain of F_0 in the rest plane, to which (18) reduces.
        """
        f = self.deformation_gradient(z[: 3 * self.n_vertices].reshape(-1, 3))
        stretch = f.transpose(1, 2) @ f - torch.eye(3, dtype=torch.float64)
        in_plane = torch.eye(3, dtype=torch.float64) - torch.einsum(
            "fi,fj->fij", self.rest_normal, self.rest_normal
        )
        green = 0.5 * in_plane @ stretch @ in_plane
        modulus = torch.tensor(self.shell.young_modulus * self.shell.thickness)
        return 0.5 * torch.sum(modulus * self.area * self.plane_stress(green))

    def bending(self, z):
        """Compute the bending energy, [Chen22] (23) with (19), in J.

        delta is that of the table of the two discretisations.
        """
        x, rotations = z[: 3 * self.n_vertices].reshape(-1, 3), z[3 * self.n_vertices :]
        angles = self.angles(x)
        deltas = [
            self.delta(f, e, angles, rotations) * self.shell.curvature_scale[e]
            for f, edges in enumerate(self.mesh.face_edges.tolist())
            for e in edges
        ]
        shapes = torch.einsum("fi,fijk->fjk", torch.stack(deltas).reshape(-1, 3), self.edge_shapes)
        modulus = torch.tensor(self.shell.young_modulus * self.shell.thickness**3 / 12.0)
        return 0.5 * torch.sum(modulus * self.area * self.plane_stress(shapes))

    def magnetic(self, z):
        """Compute the magnetic energy, [Chen22] (24), in J."""
        f = self.deformation_gradient(z[: 3 * self.n_vertices].reshape(-1, 3))
        magnetization = torch.tensor(MAGNETIZATION, dtype=torch.float64)
        flux_density = torch.tensor(FLUX_DENSITY, dtype=torch.float64)
        volume = self.area * torch.tensor(self.shell.thickness)
        return -torch.sum(volume * (f @ magnetization @ flux_density))

    def delta(self, f, e, angles, rotations):
        if e in self.clamped:
            return angles[f, e] - self.rest_angles[f, e]
        inside = bool((self.mesh.edge_faces[e] >= 0).all())
        turn = 0.5 * (angles[f, e] - self.rest_angles[f, e]) if inside else torch.zeros_like(rotations[e])
        sign = 1.0 if self.mesh.edge_faces[e, 0] == f else -1.0
        return turn + (0.0 if self.hinge else sign * rotations[e])

    def angles(self, x):
        """Compute the angle between each face's normal and the normal beyond each of its edges, about that edge."""
        _, _, normal = self.frame(x)
        found = {}
        for e, pair in enumerate(self.mesh.edge_faces.tolist()):
            for f, beyond in (pair, pair[::-1]):
                if f < 0 or (beyond < 0 and e not in self.clamped):
                    continue
                start, end = self.mesh.edges[e] if f == pair[0] else self.mesh.edges[e][::-1]
                along = (x[end] - x[start]) / torch.linalg.norm(x[end] - x[start])
                other = normal[beyond]
                if e in self.clamped:
                    other = torch.linalg.cross(self.directions[e], along)
                    other = other / torch.linalg.norm(other)
                # Positive where the normals lean together: the sheet is folded up, towards its normal.
                sine = torch.linalg.cross(other, normal[f]) @ along
                found[f, e] = torch.atan2(sine, normal[f] @ other)
        return found

    def continuation(self, e):
        """Return the vector out of the edge's face within its plane, to which a clamp holds the face."""
        f = int(self.mesh.edge_faces[e].max())
        start, end = self.mesh.edges[e] if f == self.mesh.edge_faces[e, 0] else self.mesh.edges[e][::-1]
        _, _, normal = self.frame(self.rest)
        return torch.linalg.cross(self.rest[end] - self.rest[start], normal[f])


def in_callers_order(problem, vector):
    """Return a core vector in the caller's order, (3 n_v + n_e,), or a matrix with its rows so ordered.

    Rotations of edges that the core has no unknown for are zero.
    """
    order = problem.order
    known = order >= 0
    mesh = problem.scene.mesh
    out = np.zeros((3 * mesh.n_vertices + mesh.n_edges, *vector.shape[1:]))
    out[order[known]] = vector[known]
    return out


def deformed(problem, rng):
    """Return positions and rotations in the caller's order, and the core's state; clamps are moved as well."""
    mesh = problem.scene.mesh
    strain = np.diag([1.3, 0.75, 1.1]) + 0.1 * rng.normal(size=(3, 3))
    positions = mesh.rest_positions @ strain.T + 0.03 * rng.normal(size=(mesh.n_vertices, 3))
    rotations = 0.3 * rng.normal(size=mesh.n_edges)
    return np.concatenate([positions.ravel(), rotations]), problem.model.state(positions, rotations)


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
@pytest.mark.parametrize("bending", ["midedge", "hinge"])
@pytest.mark.parametrize("dominant_term", CARRIERS)
def test_energies_gradients_and_hessians_agree_with_torch(dominant_term, bending, rng):
    problem, clamped = make_problem(bending, dominant_term)
    formulas = Formulas(problem.scene, clamped)
    z, q = deformed(problem, rng)
    z = torch.tensor(z, requires_grad=True)

    energies = problem.model.energies(q, problem.load_parameters)
    for name in CARRIERS:
        assert energies[name] == pytest.approx(getattr(formulas, name)(z).item(), rel=1e-12)
        assert name == dominant_term or abs(energies[name]) < 1e-2 * abs(energies[dominant_term])

    def total(unknowns):
        return sum(getattr(formulas, name)(unknowns) for name in CARRIERS)

    expected = torch.autograd.functional.jacobian(total, z).numpy()
    assert_close(in_callers_order(problem, problem.gradient(q)), expected)
    order = problem.order
    hessian = np.zeros((len(z), len(z)))
    hessian[:, order[order >= 0]] = in_callers_order(problem, problem.hessian(q)[:, order >= 0])
    assert_close(hessian, torch.autograd.functional.hessian(total, z, vectorize=True).numpy())


def assert_close(actual, expected):
    assert np.abs(actual - expected).max() < 1e-9 * np.abs(expected).max()
