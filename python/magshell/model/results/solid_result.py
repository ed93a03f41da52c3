"""Results of one solid of a scene, with strains and stresses of its tetrahedra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.tensors import detached
from ..._input.without_gradient import without_gradient
from ..actuators.muscle import muscles_of
from ..solids.solid_stresses import SolidStates, states_at
from .body_result import BodyResult

if TYPE_CHECKING:
    from ..._input.kinds import SolveResult

# Largest number of tetrahedra whose stresses are computed when a result is printed; that takes about 30 ms.
AFFORDABLE_TETRAHEDRA = 20_000


class SolidResult(BodyResult):
    """The part of a result that belongs to one solid, with strains and stresses of its tetrahedra."""

    def strains(self, index: int = -1) -> SolidStates:
        """Return the deformation, Green strain, J, Cauchy and von Mises stress of every tetrahedron, for the values of
        the solve.

        index: a recorded state of a motion or a path, by default the last.

        >>> import magshell as ms
        >>> mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(5, 1, 1))
        >>> bar = ms.Solid(mesh, material=ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.0))
        >>> ends = [bar.mesh.vertices_at(x=0.0), bar.mesh.vertices_at(x=0.1)]
        >>> pulled = [ms.Pin(ends[0]), ms.Pin(ends[1], displacement=(0.01, 0, 0))]
        >>> strains = ms.equilibrium(ms.Scene(bar, supports=pulled))[bar].strains()
        >>> strains.mean(strains.volume_ratios)[0].round(6), strains.mean(strains.green_strains)[0, 0, 0].round(6)
        (np.float64(1.1), np.float64(0.105))
        """
        return without_gradient(self._states(index), self._result.positions, "strains()")

    def _states(self, index: int = -1) -> SolidStates:
        positions = np.asarray(detached(self._result.positions), dtype=np.float64)
        at = positions if positions.ndim == 2 else positions[index]
        found = states_at(self._result._values_at(index), self.body, at)
        return SolidStates(*found[:3], muscles=muscles_of(self._result, self.body, index))

    def stresses(self, index: int = -1) -> SolidStates:
        """Return the same as `strains`, which has both.

        `green_strains`, `cauchy_stresses`, `von_mises_stresses` and `mean` have the same names in a shell's `stresses`.
        """
        return self.strains(index)

    def _stresses(self, index: int = -1) -> SolidStates:
        return self._states(index)


def describe_strains(result: SolveResult, of_sheets: str) -> str:
    """Return lines of a repr on the last state: one for all sheets and one per solid. of_sheets: the line for the sheets."""
    bodies = result.scene._bodies
    lines = [str(of_sheets)] if bodies.shells or not bodies.solids else []
    last = "" if np.ndim(result.positions) == 2 else ", in the last state"
    for solid in bodies.solids:
        name = f"body {bodies.number(solid)}" if len(bodies) > 1 else "solid"
        if (
            solid.mesh.n_tetrahedra > AFFORDABLE_TETRAHEDRA
            or result.scene._solving
            or not len(result.positions)
        ):
            lines.append(f"{name}: strain and stress: ask result[solid].strains()")
            continue
        strains = SolidResult(result, solid)._states()
        ratios, stress = strains.volume_ratios, strains.von_mises_stresses
        of_means = ""
        if solid.mean_volume:  # the energy is one of the means: at single points J has no meaning
            ratios, of_means = strains.mean(ratios), " (means of elements)"
        lines.append(
            f"{name}: J {ratios.min():.4g} to {ratios.max():.4g}{of_means}, largest principal Green strain "
            f"{100 * strains.largest_green_strain:.3g} %, von Mises stress at most {stress.max():.4g} Pa{last}"
        )
    return "\n  ".join(lines)


def largest_green_strains(result: SolveResult) -> np.ndarray:
    """Return the largest magnitude of a principal Green strain in all solids, in every state (n,), or () in a single one."""
    solids = result.scene._bodies.solids
    single = np.ndim(result.positions) == 2
    states = [-1] if single else range(len(result.positions))
    largest = [
        max(SolidResult(result, solid).strains(k).largest_green_strain for solid in solids) for k in states
    ]
    return np.array(largest[0] if single else largest)
