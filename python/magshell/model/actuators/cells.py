"""Pneumatic cells: groups of tetrahedra of a solid with a target volume."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..._input.selections import indices, selection
from ..._input.tensors import as_operand
from ..bodies.bodies import Bodies, on_body
from ..solids.solid import Solid
from .actuator import Actuator, numbers
from .actuator_results import CellsResult
from .closed_surface import of_tetrahedra

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers
    from ..scene.scene import Scene


# Largest number of nodes of a cell whose coupling is stored in the matrix; that of larger cells is a low-rank term.
_FEW_NODES = 40


class PneumaticCells(Actuator):
    """Pneumatic cells of a solid with the energy V K/2 (J - a)^2 each, J = volume / rest volume V, and a the target of J
    ([Qiao21]: "the pneumatic activation can control the volume of a tetrahedron"). It adds to the solid's own energy: a
    cell whose target is larger than its volume is under pressure.

    body: the Solid.
    groups: the cell of each tetrahedron, (n_t,) integers from 0 up, -1 for none; or a list of arrays of tetrahedra, one
        per cell. By default each tetrahedron is a cell. The energy depends on the total volume of a cell only.
    stiffness: K, Pa, of all cells, or one per cell, (k,).
    volume_ratio: a, 1 by default; of all cells, or one per cell, (k,). The load factor interpolates from 1 to it. Both may
        change in time, (steps + 1, k), and have gradients.

    Results: `result[cells].volume_ratios` (..., k) and `.pressures` (..., k) Pa, K (a - J).

    A free cube reaches a volume that is larger by an eighth:

    >>> import magshell as ms
    >>> mesh = ms.meshes.box((1, 1, 1), cells=(2, 2, 2))
    >>> cube = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1.0, poisson_ratio=0.0), element="linear")
    >>> planes = [ms.SymmetryPlane(normal) for normal in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    >>> blown = ms.PneumaticCells(cube, stiffness=1e6, volume_ratio=1.125)
    >>> found = ms.equilibrium(ms.Scene(cube, supports=planes, actuators=[blown]))
    >>> round(float(found.positions[:, 0].max()), 3)  # 1.125^(1/3)
    1.04
    """

    _replaceable = _in_time = ("volume_ratio", "stiffness")
    _units: ClassVar[dict[str, str]] = {"volume_ratio": "1", "stiffness": "Pa"}

    def __init__(
        self, body: Solid, groups: Numbers | None = None, *, stiffness: Numbers, volume_ratio: Numbers = 1.0
    ):
        if not isinstance(body, Solid):
            raise ValueError(f"body of PneumaticCells must be a Solid, got {body!r:.60}")
        self.bodies: tuple[Any, ...] = (body,)
        self._groups = tuple(_groups(groups, body.mesh.n_tetrahedra))
        self.stiffness: np.ndarray = numbers(
            "stiffness", "Pa", stiffness, self.count, "cell", 0.0, above=True
        )
        self.volume_ratio: np.ndarray = numbers(
            "volume_ratio", "1", volume_ratio, self.count, "cell", 0.0, above=True
        )

    @property
    def groups(self) -> tuple[np.ndarray, ...]:
        """The tetrahedra of each cell."""
        return self._groups

    @property
    def count(self) -> int:
        """The number of cells."""
        return len(self._groups)

    def replaced(self, **values: Any) -> PneumaticCells:
        """Returns the same cells with other numbers."""
        now = {name: getattr(self, name) for name in self._replaceable} | values
        return self._check_shapes(PneumaticCells(self.body, self._groups, **now))

    def _filling(self, scene: Scene) -> float:
        return float(np.abs(np.asarray(self.volume_ratio) - 1.0).max(initial=0.0))

    def _pressure_at(self, ratios: Computed, load_factor: Computed) -> Computed:
        """Return the pressures at volume ratios (k,), (k,) Pa. The values of the cells may be tensors."""
        target = 1.0 + load_factor * (as_operand(self.volume_ratio, ratios) - 1.0)
        return as_operand(self.stiffness, ratios) * (target - ratios)

    def _core_input(self, label: str, bodies: Bodies) -> dict[Any, Any]:
        of_scene = bodies.original[bodies.of(self).vertices]
        tetrahedra = self.body.mesh.tetrahedra
        surfaces = [of_tetrahedra(of_scene[tetrahedra[group]]) for group in self._groups]
        few = max(len(surface.vertices) for surface in surfaces) <= _FEW_NODES
        return {
            "owner": label,
            "law": "cell",
            "stays_open": False,
            "coupled": few,
            "surfaces": [surface.core_input for surface in surfaces],
        }

    def _result_in(self, result) -> CellsResult:
        return CellsResult(result, self)

    def __repr__(self) -> str:
        return f"PneumaticCells({self.count}{on_body(self.body)})"


def _groups(groups, n_tetrahedra: int) -> list[np.ndarray]:
    if groups is None:
        return [np.array([k]) for k in range(n_tetrahedra)]
    name = "PneumaticCells groups"
    if isinstance(groups, list | tuple) and groups and all(np.ndim(each) == 1 for each in groups):
        cells = [indices(name, selection(name, each, "tetrahedra"), n_tetrahedra) for each in groups]
    else:
        array = np.asarray(groups)
        if array.shape != (n_tetrahedra,) or not np.issubdtype(array.dtype, np.integer):
            raise ValueError(
                f"groups must be {n_tetrahedra} integers, one a tetrahedron, or a list of arrays of tetrahedra, "
                f"got shape {array.shape} of {array.dtype}"
            )
        found = sorted({int(each) for each in array if each >= 0})
        missing = next((k for k, each in enumerate(found) if each != k), None)
        if missing is not None:
            raise ValueError(f"cell {missing} has no tetrahedron")
        cells = [np.flatnonzero(array == array.dtype.type(k)) for k in found]
    for k, cell in enumerate(cells):
        if not len(cell):
            raise ValueError(f"cell {k} has no tetrahedron")
    if not cells:
        raise ValueError("groups holds no cell")
    every, counts = np.unique(np.concatenate(cells), return_counts=True)
    if (counts > 1).any():
        twice = every[np.argmax(counts > 1)]
        which = [k for k, cell in enumerate(cells) if twice in cell]
        raise ValueError(f"cells must not overlap, but tetrahedron {twice} is in cells {which}")
    return cells
