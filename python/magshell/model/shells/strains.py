"""How far a sheet is stretched and bent, and when that leaves the model."""

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


SMALL = 0.2  # the largest strain for which St. Venant-Kirchhoff material is of use
_MOST_NAMED = 5  # faces in a warning


@immutable
class Strains(NamedTuple):
    """Principal strains of every face, (n_f, 2) each, dimensionless, the larger value first; of one shell after another,
    solids between them have no rows.

    membrane: of Green's strain of the middle surface, (F^T F - 1)/2: a stretch s gives (s^2 - 1)/2.
    bending: half the thickness times the change of curvature since rest: the strain that bending makes at the
        outer fibres, positive where the normals lean together. curvature_scale is not in it.

    The outer fibres have membrane + bending and membrane - bending, where the two have the same axes.
    """

    membrane: np.ndarray
    bending: np.ndarray

    @property
    def largest(self) -> np.ndarray:
        """(n_f,), the largest magnitude among the four of each face."""
        return np.abs(np.concatenate(self, axis=1)).max(axis=1)


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
        """From what the core says of each state."""
        numbers = np.array([(membrane, bending) for membrane, _, bending, _ in rows]).reshape(-1, 2)
        return StrainHistory(numbers[:, 0], numbers[:, 1])

    @staticmethod
    def of_each(strains: Numbers) -> StrainHistory:
        """From the Strains of each state."""
        pairs = [[np.abs(each).max(initial=0.0) for each in of_state] for of_state in strains]
        return StrainHistory(*np.reshape(pairs, (-1, 2)).T)

    @property
    def worst(self) -> int:
        """The state with the largest of all."""
        return int(np.argmax(np.maximum(*self)))

    def at(self, state: int) -> Largest:
        return Largest(float(self.membrane[state]), float(self.bending[state]))

    def __str__(self) -> str:
        if not len(self.membrane):
            return "no states"
        return f"state {self.worst}: {self.at(self.worst)}"


def is_small(strain: float) -> bool:
    """False where it is no number."""
    return strain <= SMALL


def strains_of(scene: Scene, state: np.ndarray, thickness: np.ndarray) -> Strains:
    """Of a state of the core. Raises ValueError where the scene has solids only."""
    if scene._bodies.solids and not scene._bodies.sheets:
        raise ValueError("strains() has those of shells, and the scene has none: ask result[solid].strains()")
    rows = scene._model.principal_strains(state, thickness)
    return Strains(rows[:, :2], rows[:, 2:])


def largest_of(scene: Scene, state: np.ndarray, thickness: np.ndarray) -> Largest:
    return StrainHistory.of([scene._model.largest_strains(state, thickness)]).at(0)


def warn_if_large(result: SolveResult, largest: Largest, where: str, index: tuple[Any, ...] = ()) -> None:
    """Says once a scene that a result leaves the model, and again where strains have doubled since: a design that is
    solved a thousand times says it a few times, wherever it goes. index: what result.strains takes."""
    scene, worst = result.scene, max(largest)
    if is_small(worst) or worst < 2.0 * scene._warned_of_strain:
        return
    strains = result.strains(*index)
    warning = LargeStrainWarning(f"{where}: {largest}. {_faces(strains)}. {_ADVICE}", result)
    warnings.warn(warning, stacklevel=callers_level())
    remember(scene, _warned_of_strain=worst if np.isfinite(worst) else np.inf)


_ADVICE = (
    "What St. Venant-Kirchhoff material does there is no prediction for a real one; strains() of the result has every "
    "face"
)


def _faces(strains: Strains) -> str:
    largest = strains.largest
    beyond = np.flatnonzero(~(largest <= SMALL))
    named = beyond[np.argsort(-largest[beyond], kind="stable")][:_MOST_NAMED]
    first = "the first of them " if len(beyond) > len(named) else ""
    return f"{len(beyond)} of {len(largest)} faces are, {first}{', '.join(map(str, named.tolist()))}"


def _percent(strain: float) -> str:
    return f"{100 * strain:.3g} %"
