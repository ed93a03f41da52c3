"""For tests: the core's model of solids alone, from plain arrays, and the same energies by torch."""

from __future__ import annotations

import numpy as np
import torch
from solid_materials import SAMPLES, Deformation

from magshell import _core
from magshell.model.scene.parameter_layout import Layout

EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]

# By the core's names. Those of the second list have an energy where elements are inverted.
REFUSING = [name for name, each in SAMPLES.items() if each.refuses_inversion]
STABLE = [name for name, each in SAMPLES.items() if not each.refuses_inversion]
MATERIALS = REFUSING + STABLE
ELEMENTS = ["linear", "quadratic", "mean"]
MADE = [
    (m, e) for m in MATERIALS for e in ELEMENTS if (m, e) != ("Projective", "mean")
]  # that one is refused


def values_of(material: str) -> dict:
    return SAMPLES[material].constants


def second_order(nodes, tetrahedra):
    """Return straight ten-node tetrahedra: (nodes, (n_t, 10))."""
    middle: dict[tuple[int, int], int] = {}
    points, rows = list(np.asarray(nodes, dtype=float)), []
    for tet in np.asarray(tetrahedra):
        row = list(tet)
        for i, j in EDGES:
            key = tuple(sorted((int(tet[i]), int(tet[j]))))
            if key not in middle:
                middle[key] = len(points)
                points.append(0.5 * (points[key[0]] + points[key[1]]))
            row.append(middle[key])
        rows.append(row)
    return np.array(points), np.array(rows)


class SolidModel:
    """nodes (n, 3) m, tetrahedra (n_t, 4 or 10); values by the core's names, a number or one an element.

    held: nodes that are held entirely. muscles: as the core takes them; their numbers go into `others`, {(owner, name):
    array}, before `set`.
    """

    def __init__(self, nodes, tetrahedra, material, mean=False, values=None, held=(), muscles=()):
        self.nodes, self.tetrahedra = np.asarray(nodes, dtype=float), np.asarray(tetrahedra)
        held = np.asarray(held, dtype=np.int32)
        self.core = _core.Model(
            n_vertices=len(self.nodes),
            original=[],
            sheets=[],
            six_node_sheets=[],
            skins=[],
            rigid=[],
            skeletons=[],
            closures=[],
            muscles=list(muscles),
            face_energies=[],
            pressures=[],
            volumes=[],
            tendons=[],
            springs=[],
            attached_to=[],
            creases=[],
            group_energies=[],
            solids=[
                {
                    "owner": "body 0",
                    "rest_positions": self.nodes,
                    "elements": self.tetrahedra.astype(np.int32),
                    "vertices": np.arange(len(self.nodes)),
                    "surface": None,
                    "surface_vertices": [],
                    "material": material,
                    "mean_volume": mean,
                    "magnetic": False,
                    "magnetization_rotates": False,
                    "surface_acts": False,
                }
            ],
            directions=np.zeros((0, 3)),
            held_nodes=np.stack([held, np.full_like(held, 3), *[np.full_like(held, -1)] * 3], axis=1),
            tied=[],
            held_frames=np.broadcast_to(np.eye(3), (len(held), 3, 3)),
            moves=0,
            couples=np.zeros((0, 3), dtype=np.int32),
            gravity=False,
            loads=False,
            field_sources=[],
            contacts=[],
            contact_surfaces=[],
            body_contacts=[],
            obstacles=[],
            water=None,
            own_field_shells=[],
            own_field_six_node_shells=[],
            own_field_solids=[],
            own_field_skins=[],
            own_field_rigid=[],
            own_field_max_points=0,
            own_field_accuracy=0.0,
        )
        self.layout = Layout(self.core.parameters)
        self.others = {key: np.zeros(1) for key in self.layout if key[0] != "body 0"}
        self.load_parameters = np.zeros(sum(entry[4] * entry[5] for entry in self.core.load_parameters))
        self.set(values_of(material) if values is None else values)
        marks = np.arange(3.0 * len(self.nodes)).reshape(-1, 3)
        self.order = np.asarray(self.core.state(marks, np.zeros(0))).astype(int)  # of the core's unknowns

    def set(self, values: dict) -> None:
        self.values = {
            name: np.broadcast_to(value, (len(self.tetrahedra), *np.shape(value)))
            if np.ndim(value) == 0 or (name == "fibres" and np.ndim(value) == 1)
            else np.asarray(value)
            for name, value in values.items()
        }
        own = {("body 0", name): each for name, each in self.values.items()}
        self.core.set_values(self.layout.packed({**own, **self.others}))

    def state(self, x):
        return self.core.state(np.asarray(x, dtype=float), np.zeros(0))

    def energy(self, x) -> float:
        return self.core.energy(self.state(x), self.load_parameters)

    def gradient(self, x) -> np.ndarray:
        """Return the gradient in the caller's order, (3 n,)."""
        out = np.empty(self.nodes.size)
        out[self.order] = self.core.gradient(self.state(x), self.load_parameters)
        return out

    def hessian(self, x) -> np.ndarray:
        size, starts, rows, numbers = self.core.hessian(self.state(x), self.load_parameters, reduced=False)
        lower = np.zeros((size, size))
        lower[rows, np.repeat(np.arange(size), np.diff(starts))] = numbers
        whole = np.empty_like(lower)
        whole[np.ix_(self.order, self.order)] = lower + np.tril(lower, -1).T
        return whole

    def vjp(self, x, adjoint) -> dict[str, np.ndarray]:
        """Return adjoint . dg/dk of every value k, by name; adjoint (n, 3)."""
        found = self._vjp(x, adjoint)
        return {name: self.layout.of(found, "body 0", name) for name in self.values}

    def other_vjp(self, x, adjoint) -> dict[tuple[str, str], np.ndarray]:
        """Return adjoint . dg/dk of the numbers k in `others`."""
        found = self._vjp(x, adjoint)
        return {key: self.layout.of(found, *key) for key in self.others}

    def _vjp(self, x, adjoint) -> np.ndarray:
        return np.asarray(_core.vjp(self.core, self.state(x), self.load_parameters, self.state(adjoint))[0])


def shape_gradients(nodes, tetrahedra):
    """Return gradients (n_t, p, N, 3) at the integration points and volumes (n_t, p), from textbook formulas."""
    nodes, tetrahedra = torch.tensor(np.array(nodes)), torch.tensor(np.array(tetrahedra))
    if tetrahedra.shape[1] == 4:
        points, weights = (
            torch.full((1, 4), 0.25, dtype=torch.float64),
            torch.tensor([1.0 / 6.0], dtype=torch.float64),
        )
    else:
        a, b = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
        points = torch.full((4, 4), a, dtype=torch.float64).fill_diagonal_(b)
        weights = torch.full((4,), 1.0 / 24.0, dtype=torch.float64)

    def shapes(xi):  # (3,) natural coordinates
        bary = torch.cat([1 - xi.sum()[None], xi])
        if tetrahedra.shape[1] == 4:
            return bary
        middle = [4 * bary[i] * bary[j] for i, j in EDGES]
        return torch.cat([bary * (2 * bary - 1), torch.stack(middle)])

    by_xi = torch.stack(
        [torch.autograd.functional.jacobian(shapes, each[1:]) for each in points]
    )  # (p, N, 3)
    jacobian = torch.einsum("tni,pnj->tpij", nodes[tetrahedra], by_xi)
    gradients = torch.einsum("pnj,tpji->tpni", by_xi, torch.linalg.inv(jacobian))
    return gradients, weights * torch.linalg.det(jacobian)


def torch_energy(model: SolidModel, material: str, mean: bool, values: dict | None = None):
    """Return the energy as a function of positions (n, 3), a tensor; values: {name: tensor} in place of the model's."""
    gradients, volumes = shape_gradients(model.nodes, model.tetrahedra)
    tetrahedra = torch.tensor(np.array(model.tetrahedra))
    given = {name: torch.tensor(np.array(each)) for name, each in model.values.items()}
    given |= values or {}

    def averaged(measure):
        if not mean:
            return measure
        return ((volumes * measure).sum(1) / volumes.sum(1))[:, None].expand_as(measure)

    def energy(x):
        f = torch.einsum("tni,tpnj->tpij", x[tetrahedra], gradients)
        constants = {name: each[:, None] if each.ndim == 1 else each for name, each in given.items()}
        return (volumes * SAMPLES[material].density(constants, Deformation(f, averaged))).sum()

    return energy


def sample_element(element: str, curved: bool = True):
    """Build one tetrahedron in general position: (nodes, tetrahedra)."""
    nodes = np.array([[0.1, 0.0, 0.05], [1.2, 0.1, -0.1], [0.2, 0.9, 0.1], [0.15, 0.2, 1.1]])
    tetrahedra = np.array([[0, 1, 2, 3]])
    if element == "linear":
        return nodes, tetrahedra
    nodes, tetrahedra = second_order(nodes, tetrahedra)
    if curved:
        nodes[4:] += 0.03 * np.random.default_rng(3).standard_normal((6, 3))
    return nodes, tetrahedra


def deformed(nodes, principal, noise=0.0, seed=1):
    """Return x = R diag(principal) Q X, with noise of this size on each node."""
    rng = np.random.default_rng(seed)
    r, q = (np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(2))
    r, q = r * np.sign(np.linalg.det(r)), q * np.sign(np.linalg.det(q))
    return nodes @ (r @ np.diag(principal) @ q).T + noise * rng.standard_normal(nodes.shape)
