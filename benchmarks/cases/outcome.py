"""Result of a case: computed numbers with their references, and their cost."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import magshell as ms

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Comparison:
    """Computed numbers with their references.

    quantity: their name. computed, reference: (k,). at: (k,) names of the entries, such as loads.
    scale: the denominators of relative errors, a number or (k,); by default the references themselves.
    allowed: the largest relative error allowed; None if the comparison is for information only.
    """

    def __init__(
        self,
        quantity: str,
        computed: ArrayLike,
        reference: ArrayLike,
        *,
        at: Iterable[str] | None = None,
        scale: ArrayLike | None = None,
        allowed: float | None = None,
    ):
        self.quantity = quantity
        self.computed: np.ndarray = np.atleast_1d(np.asarray(computed, dtype=np.float64))
        self.reference: np.ndarray = np.atleast_1d(np.asarray(reference, dtype=np.float64))
        self.at: tuple[str, ...] = tuple("" for _ in self.reference) if at is None else tuple(at)
        self.scale: np.ndarray = np.broadcast_to(
            np.abs(self.reference) if scale is None else scale, self.reference.shape
        )
        self.allowed = allowed
        if not self.computed.shape == self.reference.shape == (len(self.at),):
            raise ValueError(
                f"{quantity}: {self.computed.shape} numbers, {self.reference.shape} references, "
                f"{len(self.at)} names"
            )

    @property
    def errors(self) -> np.ndarray:
        """The relative errors, (k,)."""
        return np.abs(self.computed - self.reference) / self.scale

    @property
    def worst(self) -> int:
        """The index of the largest error; NaN counts as the largest."""
        return int(np.argmax(np.where(np.isnan(self.errors), np.inf, self.errors)))

    @property
    def error(self) -> float:
        """The largest relative error."""
        return float(self.errors[self.worst])

    @property
    def passes(self) -> bool:
        return self.allowed is None or self.error <= self.allowed


@dataclass(frozen=True)
class Outcome:
    """One run of a case: mesh, comparisons, and the cost of all its solves together. times: (solves,) s, of each."""

    mesh: str
    comparisons: tuple[Comparison, ...]
    n_faces: int
    solves: int
    times: tuple[float, ...]
    factorizations: int
    failed_factorizations: int

    @property
    def time(self) -> float:
        """The time of all solves, s."""
        return sum(self.times)

    @property
    def passes(self) -> bool:
        return all(comparison.passes for comparison in self.comparisons)


def outcome(
    mesh_name: str, mesh: ms.TriangleMesh, comparisons: Iterable[Comparison], results: Iterable[Any]
) -> Outcome:
    """Return the Outcome of solves that returned Equilibrium, LinearResponse, Buckling or EquilibriumPath objects."""
    results = list(results)
    return Outcome(
        mesh=mesh_name,
        comparisons=tuple(comparisons),
        n_faces=mesh.n_elements,
        solves=len(results),
        times=tuple(result.wall_time for result in results),
        factorizations=sum(result.factorizations for result in results),
        failed_factorizations=sum(getattr(result, "failed_factorizations", 0) for result in results),
    )


def sweep(scene: ms.Scene, load_parameters: Iterable[dict[str, Any]], **common: Any) -> list[ms.Equilibrium]:
    """Solve for equilibria with one set of load parameters after the other, each from the one before and the first from
    rest."""
    found: list[ms.Equilibrium] = []
    for each in load_parameters:
        found.append(ms.equilibrium(scene, start=found[-1] if found else None, **common, **each))
    return found


def mesh_name(cells: tuple[int, int], irregular: float | None = None) -> str:
    return f"{'irregular ' if irregular else ''}{cells[0]}x{cells[1]}"


def order_of(bending: str) -> int:
    """Return the order of the meshes that a kind of bending element needs."""
    return 2 if bending == "midedge2" else 1


def tip(mesh: ms.TriangleMesh, displacements: np.ndarray, **at: float) -> np.ndarray:
    """Return the mean displacement (3,) m of the vertices at the given coordinates."""
    return displacements[mesh.vertices_at(**at)].mean(axis=0)
