"""Cheaper ways to estimate errors than ms.error_estimate, and why it does not take them: their effectivity and its costs.

Run as `python -m benchmarks.cheap_estimates`; with "quick" one case alone. All ways evaluate the residual r on six-node
elements, and weigh it with an adjoint that costs no factorization of these:

    recovered   -z . r(u), with the coarse displacements and their coarse adjoint z, each replaced by polynomials fitted to
                the vertices around each edge (Becker and Rannacher 2001, 5.2)
    relaxed     -z . r(u), with all unknowns but those of coarse vertices in equilibrium, for the displacements and for z
    solved      ms.error_estimate
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np
import scipy

import magshell as ms
from magshell.model.scene.finer_scene import finer_scene
from magshell.solve.accuracy.enriched import load_keywords, positions_of
from magshell.solve.accuracy.error_estimate import finer_meshes
from magshell.solve.accuracy.output_value import Output
from magshell.solve.adjoint.factorized import Factorized, StiffnessParts
from magshell.solve.statics.single_solve import inputs_of

from .estimates import ESTIMATED, Asked
from .report import print_table

DEGREES = (2, 3)  # of the fitted polynomials
CASES = ("B1", "B2", "B5 supported, pressure", "B5 clamped, pressure", "B5 clamped, force")


class Stiffness:
    """The stiffness at rest of a scene, and its loads, for the free unknowns."""

    def __init__(self, scene: ms.Scene, result: Any):
        self.model, inputs = scene._model, inputs_of(scene, load_keywords(result))
        with inputs.in_core():
            rest, none = self.model.rest_state(), scene._load_parameter_layout.zeros()
            size, starts, rows, entries = self.model.hessian(rest, none)
            pulled = self.model.gradient(rest, none) - self.model.gradient(rest, inputs.load_parameters)
        self.loads: np.ndarray = self.model.reduce(pulled)
        lower = scipy.sparse.csc_array((entries, rows, starts), shape=(size, size))
        diagonal = scipy.sparse.diags_array(lower.diagonal())
        self.matrix: Any = (lower + lower.T - diagonal).tocsc()

    def vector(self, rows: np.ndarray) -> np.ndarray:
        """Return rows of all vertices, (n_v, 3), as a vector of the free unknowns."""
        return self.model.reduce(self.model.full_vector(rows))

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Return the vertices' displacements under forces, (n_v, 3)."""
        rest = self.model.rest_state()
        motion = self.model.expand(_solved(self.matrix, forces, self.model.free_points))
        return self.model.positions(rest + motion) - self.model.positions(rest)

    def relaxed(self, motion: np.ndarray, loads: np.ndarray, free: np.ndarray) -> np.ndarray:
        """Return a motion of which the unknowns `free` are in equilibrium with the loads."""
        inner, moved = self.matrix[free][:, free], np.where(free, 0.0, motion)
        pulled = loads - self.matrix @ moved
        moved[free] = _solved(inner, pulled[free], self.model.free_points[free])
        return moved


def _solved(matrix: Any, forces: np.ndarray, points: np.ndarray) -> np.ndarray:
    lower = scipy.sparse.tril(matrix).tocsc()
    lower.sort_indices()
    triangle = (len(forces), lower.indptr, lower.indices, lower.data)
    factor = Factorized(StiffnessParts(triangle), points)
    return factor.solve(forces)


def fits(mesh: ms.TriangleMesh, middles: np.ndarray, degree: int) -> Any:
    """Return what maps values at vertices to those at the middles of edges, a sparse (n_e, n_v) matrix.

    Polynomials in the plane of the faces beside an edge are fitted to the vertices around it, and go through its ends.
    """
    n, x = mesh.n_vertices, mesh.rest_positions
    ends = np.concatenate([mesh.edges, mesh.edges[:, ::-1]])
    near = scipy.sparse.csr_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n))
    areas = mesh._area_vectors_at(x)
    rows = []
    for edge, (pair, middle) in enumerate(zip(mesh.edges, middles, strict=True)):
        around = np.array(pair)
        while len(around) <= 0.65 * (degree + 1) * (degree + 2):
            around = np.unique(np.concatenate([around, near[around].indices]))
        normal = areas[mesh.edge_faces[edge][mesh.edge_faces[edge] >= 0]].sum(axis=0)
        along = x[pair[1]] - x[pair[0]]
        size = np.linalg.norm(along)
        frame = np.stack([along, np.cross(normal / np.linalg.norm(normal), along)]) / size**2
        s, t = frame @ (x[around] - middle).T
        terms = np.stack([s**i * t**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)
        weights = np.where(np.isin(around, pair), 1e4, (0.25 + s**2 + t**2) ** -1.5)
        row = np.zeros(n)
        row[around] = np.linalg.pinv(weights[:, None] * terms, rcond=1e-9)[0] * weights
        rows.append(scipy.sparse.csr_array(row[None]))
    return scipy.sparse.vstack(rows).tocsr()


def errors(asked: Asked) -> dict[str, float]:
    """Return the true error of a linear response of three-node faces, and the estimates of all ways."""
    result, scene = asked.result, asked.result.scene
    output, positions, mesh = Output(asked.output, scene), positions_of(asked.result), asked.result.scene.mesh
    slope = output.gradient(positions)
    (finer,) = finer_meshes(scene, asked.project)
    made = finer_scene(scene, result._values, {id(scene.bodies[0]): finer})
    coarse, fine = Stiffness(scene, result), Stiffness(made, result)
    moved = [positions - mesh.rest_positions, coarse.solve(coarse.vector(slope))]

    def on_finer(rows: np.ndarray, middles: Any) -> np.ndarray:
        return fine.vector(np.concatenate([rows, middles @ rows]))

    def weighted(vectors: list[np.ndarray], free: np.ndarray) -> float:
        loads = (fine.loads, np.zeros_like(fine.loads))
        u, z = (fine.relaxed(each, load, free) for each, load in zip(vectors, loads, strict=True))
        return float(z @ (fine.loads - fine.matrix @ u))

    marks = np.random.default_rng(0).uniform(1.0, 2.0, (made.mesh.n_vertices, 3))
    turns = fine.vector(marks) == 0.0  # edge rotations have no rows of vertices
    marks[mesh.n_vertices :] = 0.0
    straight = finer.interpolation[mesh.n_vertices :]
    found = {"true": asked.exact - output.value(positions)}
    for degree in DEGREES:
        middles = fits(mesh, made.mesh.rest_positions[mesh.n_vertices :], degree)
        found[f"degree {degree}"] = weighted([on_finer(each, middles) for each in moved], turns)
    found["relaxed"] = weighted([on_finer(each, straight) for each in moved], fine.vector(marks) == 0.0)
    found["solved"] = ms.error_estimate(result, asked.output, project=asked.project, by_face=False).error
    return found


def costs(cells: int) -> list[str]:
    """Return what an estimate takes of a cantilever's solve, and what its finer scene alone takes, in solves."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(cells, cells // 5))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0.0, 0.0, 0.05))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    tip = mesh.vertices_at(x=0.1)

    def seconds(function: Any) -> float:
        function()
        began = time.process_time()
        function()
        return time.process_time() - began

    bent = ms.equilibrium(scene, progress=False)
    solve = seconds(lambda: ms.equilibrium(scene, progress=False))
    made = seconds(
        lambda: finer_scene(scene, bent._values, {id(sheet): each for each in finer_meshes(scene, None)})
    )
    estimates = [
        seconds(
            lambda by_face=by_face: ms.error_estimate(
                bent, lambda rest: rest.positions[tip, 2].mean(), by_face=by_face
            )
        )
        for by_face in (False, True)
    ]
    return [str(mesh.n_faces), f"{solve:.3f}", *(f"{each / solve:.1f}" for each in (made, *estimates))]


def main(quick: bool = False) -> None:
    """Print both tables."""
    ms.set_num_threads(1)
    rows = []
    for name in CASES[1:2] if quick else CASES:
        make, arguments, meshes = ESTIMATED[name]
        for cells in meshes["midedge"][:1] if quick else meshes["midedge"]:
            asked = make(cells, "midedge", *arguments)
            found = errors(asked)
            true = found.pop("true")
            shares = [f"{each / true:.2f}" for each in found.values()]
            rows.append([name, f"{cells[0]} x {cells[1]}", f"{100 * true / asked.exact:.2f}", *shares])
    heading = ["case", "mesh", "error / %", *(f"recovered, degree {each}" for each in DEGREES)]
    print_table("Estimated over true errors of three-node faces", [*heading, "relaxed", "solved"], rows)
    print_table(
        "Processor time of an estimate, in solves",
        ["faces", "solve / s", "finer scene alone", "estimate", "with faces"],
        [costs(each) for each in ((20,) if quick else (40, 60, 120))],
    )


if __name__ == "__main__":
    main("quick" in sys.argv[1:])
