"""Several equilibria of one scene: of load cases, or with the same load parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.checked_list import listed
from ..._input.tensors import stacked
from ..._input.without_gradient import without_gradient
from ..._runtime.mixins import SaveMixin
from ...model.bodies.bodies import BODIES
from ...model.results.result_lookup import OfOneBody, result_of
from .equilibrium import INSTEAD_OF_ENERGIES, Equilibrium

if TYPE_CHECKING:
    from ..._input.kinds import Computed
    from ...model.scene.scene import Scene


class EquilibriumSet(SaveMixin, OfOneBody, Sequence[Equilibrium]):
    """The equilibria of a scene in k load cases, or k equilibria of one; a sequence of Equilibrium.

    positions, displacements: (k, n_v, 3) m; edge_rotations: (k, n_e) rad. Tensors where those of the cases are.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.EquilibriumSet([ms.equilibrium(scene), ms.equilibrium(scene, gravity_factor=0.5)]).positions.shape
    (2, 33, 3)
    """

    def __init__(self, cases: Iterable[Equilibrium]):
        self._cases = tuple(listed("cases", cases, lambda given: isinstance(given, Equilibrium)))
        for case in self._cases:
            if not isinstance(case, Equilibrium):
                raise ValueError(f"cases must hold Equilibrium objects, got {type(case).__name__}")
        self.positions: Any | np.ndarray = stacked([case.positions for case in self._cases])
        self.edge_rotations: Any | np.ndarray = stacked([case.edge_rotations for case in self._cases])

    def __getstate__(self) -> dict[Any, Any]:
        return {"_cases": self._cases}

    def __setstate__(self, state: dict[Any, Any]) -> None:
        self.__init__(state["_cases"])

    @property
    def scene(self) -> Scene:
        """The scene of all cases."""
        return self._cases[0].scene

    @property
    def displacements(self) -> Computed:
        """The displacements from the rest shape, (k, n_v, 3) m."""
        return stacked([case.displacements for case in self._cases])

    @property
    def energy(self) -> Computed:
        """The potential energies, (k,) J."""
        energies = np.array([case._energy for case in self._cases])
        return without_gradient(energies, self.positions, "result.energy", INSTEAD_OF_ENERGIES)

    @property
    def stable(self) -> bool:
        """The stability of all together: True if every equilibrium is stable."""
        return all(case.stable for case in self._cases)

    @property
    def largest_membrane_strain(self) -> Computed:
        """The largest membrane strain of all cases."""
        return max(case.largest_membrane_strain for case in self._cases)

    @property
    def largest_bending_strain(self) -> Computed:
        """The largest bending strain of all cases."""
        return max(case.largest_bending_strain for case in self._cases)

    @property
    def wall_time(self) -> float:
        """The time that all cases took together, s."""
        return sum(case.wall_time for case in self._cases)

    @property
    def factorizations(self) -> int:
        """The number of factorizations of all cases."""
        return sum(case.factorizations for case in self._cases)

    def strains(self, index: int = -1) -> Any:
        """Return the strains of one of the cases, by default the last, as `Equilibrium.strains` does."""
        return self._cases[index].strains()

    def _strains(self, index: int = -1) -> Any:
        return self._cases[index]._strains()

    def _values_at(self, index: int):
        return self._cases[index]._values

    def _tensors_at(self, index: int) -> dict[tuple[Any, str], Any]:
        return self._cases[index]._tensors_at(0)

    @property
    def _rest(self) -> Any:
        return self._cases[0]._rest

    @property
    def _load_factors(self) -> np.ndarray:
        return np.array([case._load_factors for case in self._cases])

    def _state_at(self, index: int) -> np.ndarray:
        return self._cases[index]._state

    def __len__(self) -> int:
        return len(self._cases)

    def __getitem__(self, index: Any) -> Any:
        """Return one case, a slice of them, or the results of one body of the scene in all cases."""
        if isinstance(index, BODIES) or hasattr(index, "_result_in"):
            return result_of(self, index)
        chosen = self._cases[index]
        return EquilibriumSet(chosen) if isinstance(index, slice) else chosen

    def __repr__(self) -> str:
        return "\n".join([f"Equilibria: {len(self)}", *(repr(case) for case in self._cases)])
