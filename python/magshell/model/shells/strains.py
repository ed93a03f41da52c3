"""Strains of a sheet's faces by stretching and bending, and a warning where they leave the model."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._runtime.frozen import immutable, remember
from ..._runtime.warning_stacklevel import callers_level
from ...errors import LargeStrainWarning

if TYPE_CHECKING:
    from ..._input.kinds import Numbers, SolveResult
    from ..scene.scene import Scene


SMALL = 0.2  # [-] largest strain for which St. Venant-Kirchhoff material is a useful model
_MOST_NAMED = 5  # faces in a warning


@immutable
class Strains(NamedTuple):
    """Principal strains of every face, (n_f, 2) each, dimensionless, the larger value first; one shell after another.
    Solids between them have no rows.

    membrane: of Green's strain of the middle surface, (F^T F - 1)/2: a stretch s gives (s^2 - 1)/2.
    bending: half the thickness times the change of curvature from the rest shape: the strain by bending at the outer
        fibres, positive where the normals lean together. It does not include curvature_scale.

    The outer fibres have the strains membrane + bending and membrane - bending if both have the same axes.
    """

    membrane: np.ndarray
    bending: np.ndarray

    @property
    def largest(self) -> np.ndarray:
        """The largest magnitude among the four strains of each face, (n_f,)."""
        largest = np.abs(np.concatenate(self, axis=1)).max(axis=1)
        largest.setflags(write=False)  # as the others
        return largest


class Largest(NamedTuple):
    """The largest magnitudes of membrane and bending strain of one state."""

    membrane: float
    bending: float

    def __str__(self) -> str:
        text = (
            f"largest strain {_percent(self.membrane)} of the membrane, {_percent(self.bending)} by bending"
        )
        if is_small(max(self)):
            return text
        return f"{text}: BEYOND THE MODEL, which is for small strains (below {_percent(SMALL)})"


class StrainHistory(NamedTuple):
    """The largest strains of several states: (n,) each."""

    membrane: np.ndarray
    bending: np.ndarray

    @staticmethod
    def of(rows: Sequence[Any]) -> StrainHistory:
        """Return the history from the rows that the core computes for each state."""
        numbers = np.array([(membrane, bending) for membrane, _, bending, _ in rows]).reshape(-1, 2)
        return StrainHistory(numbers[:, 0], numbers[:, 1])

    @staticmethod
    def of_each(strains: Numbers) -> StrainHistory:
        """Return the history from the Strains of each state."""
        pairs = [[np.abs(each).max(initial=0.0) for each in of_state] for of_state in strains]
        return StrainHistory(*np.reshape(pairs, (-1, 2)).T)

    @property
    def worst(self) -> int:
        """The number of the state with the largest strain of all."""
        return int(np.argmax(np.maximum(*self)))

    def at(self, state: int) -> Largest:
        return Largest(float(self.membrane[state]), float(self.bending[state]))

    def __str__(self) -> str:
        if not len(self.membrane):
            return "no states"
        return f"state {self.worst}: {self.at(self.worst)}"


def is_small(strain: float) -> bool:
    """Return whether a strain is within the model; False for NaN."""
    return strain <= SMALL


def strains_of(scene: Scene, state: np.ndarray, thickness: np.ndarray) -> Strains:
    """Return the strains in a state of the core. Raises ValueError if the scene has solids only."""
    if scene._bodies.solids and not scene._bodies.shells:
        raise ValueError("strains() has those of shells, and the scene has none: ask result[solid].strains()")
    rows = scene._model.principal_strains(state, thickness)
    return Strains(rows[:, :2], rows[:, 2:])


def largest_of(scene: Scene, state: np.ndarray, thickness: np.ndarray) -> Largest:
    """Return the largest strains in a state of the core."""
    return StrainHistory.of([scene._model.largest_strains(state, thickness)]).at(0)


def warn_if_large(result: SolveResult, largest: Largest, where: str, index: tuple[Any, ...] = ()) -> None:
    """Warn once per scene that a result leaves the model, and again whenever strains have doubled since.

    So a design loop of a thousand solves warns a few times. index: the argument of result.strains.
    """
    scene, worst = result.scene, max(largest)
    if is_small(worst) or worst < 2.0 * scene._warned_of_strain:
        return
    strains = result._strains(*index)
    unit = f"{_UNIT_ADVICE} " if worst > _MISTAKEN else ""
    warning = LargeStrainWarning(f"{unit}{where}: {largest}. {_faces(strains)}. {_ADVICE}", result)
    warnings.warn(warning, stacklevel=callers_level())
    remember(scene, _warned_of_strain=worst if np.isfinite(worst) else np.inf)


_MISTAKEN = 1.0  # [-] a strain that few elastomers reach, and a mistaken unit usually passes; fixed by test_strains.py
_UNIT_ADVICE = "mT for T, kPa for Pa or mm for m? Units are SI."
_ADVICE = (
    "What St. Venant-Kirchhoff material does there is no prediction for a real one; strains() of the result has every "
    "face"
)


def _faces(strains: Strains) -> str:
    largest = strains.largest
    beyond = np.flatnonzero(~(largest <= SMALL))
    named = beyond[np.argsort(-largest[beyond], kind="stable")][:_MOST_NAMED]
    first = "the first of them " if len(beyond) > len(named) else ""
    return (
        f"{len(beyond)} of {len(largest)} faces are beyond it: {first}{', '.join(map(str, named.tolist()))}"
    )


def _percent(strain: float) -> str:
    return f"{100 * strain:.3g} %"
