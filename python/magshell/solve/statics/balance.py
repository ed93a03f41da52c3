"""The balance of energy along a sequence of states: what is stored, what is put in, what is lost, and the rest."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.frozen import immutable
from ..._runtime.mixins import call_registered

if TYPE_CHECKING:
    import pandas

    from ...model.scene.scene import Scene
    from .path import EquilibriumPath

_OF_FLIGHT = 0.01  # [-] of a kinetic energy that counts as moved though it stays the same
LARGEST_REST = 0.05  # [-] of the largest energy that moved; see test_rest_of_a_coarse_motion_is_warned_of

_ROUND_OFF = 1e-9  # [-] of the largest row; see test_fixed_supports_have_impulses_and_no_work

# Kinds of terms whose forces count as work done on the scene; the others count as energies that the scene stores.
_WORK = {
    "loads": "loads",
    "pressure": "pressures",
    "couple": "edge moments",
    "wrenches": "forces and torques on rigid bodies",
}
# The row for the work of parameters that change, by the kind of term; that of other kinds has the name of the term.
_AGENTS = {
    "magnetic": "moving fields",
    "contact": "moving obstacles",
    "gravity": "changing gravity",
    "springs": "moving springs",
    "growth": "growth",
}
_ENERGIES = {
    "magnetic": "magnetic",
    "induced": "magnetic",
    "moments": "magnetic",
    "body contact": "contact",
}
_ELASTIC = ("membrane", "bending", "solid")


class TermKind(NamedTuple):
    """The row of a balance to which a term of the energy belongs.

    name: of the row. is_work: whether its forces count as work, otherwise as an energy. agent: the row of the work by
    parameters of the term that change.
    """

    name: str
    is_work: bool
    agent: str


def term_kinds(scene: Scene) -> list[TermKind]:
    """Return the row of each term of the energy, in the core's order."""
    bodies, kinds = scene._bodies, []
    places = {id(body): k for k, body in enumerate(scene.bodies)}
    deformable = {
        bodies.core_number(span, len(bodies.skins)): f"elastic, body {places[id(body)]}"
        for span, body in zip(bodies.spans, bodies.deformable, strict=True)
    }
    for name, body, has_no_potential in _core.kinds_of_terms(scene._model):
        if name in _ELASTIC:
            label = "elastic" if len(deformable) == 1 else deformable[body]
            kinds.append(TermKind(label, False, "growth"))
        elif name in _WORK:
            kinds.append(TermKind(_WORK[name], True, _WORK[name]))
        elif has_no_potential:
            kinds.append(TermKind(f"torques of {name}", True, f"torques of {name}"))
        else:
            row = _ENERGIES.get(name, name)
            kinds.append(TermKind(row, False, _AGENTS.get(row, f"changing {row}")))
    return kinds


def above_round_off(rows: dict[str, np.ndarray], size: float) -> dict[str, np.ndarray]:
    """Return the rows that exceed the round-off of numbers of a size."""
    return {name: row for name, row in rows.items() if np.abs(row).max() > _ROUND_OFF * size}


def sums_by_name(names: Iterable[str], columns: np.ndarray) -> dict[str, np.ndarray]:
    """Return the sums of columns (n, m, ...) that have the same name, {name: (n, ...)}; those that are zero are left out."""
    found: dict[str, np.ndarray] = {}
    for name, column in zip(names, np.moveaxis(columns, 1, 0), strict=True):
        if column.any():
            found[name] = found[name] + column if name in found else column
    return found


@immutable
@dataclass(frozen=True, repr=False)
class EnergyBalance:
    """The balance of energy along a path of equilibria or a motion, in n states.

    energies: {name: (n,) J}, what the scene stores. work: {name: (n,) J}, done on the scene since the first state.
    dissipation: {name: (n,) J}, lost since then to damping, viscosity, friction and water. Rows that are zero are left out.

    `rest` is what is left: energies - energies of the first state - work + dissipation. It is the error of the steps:
    positive where they made energy, negative where they lost it.

    parameters: (n,) of a path, or the times (n,) s of a motion.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> pull = ms.EdgeLoad(mesh.edges_at(x=0.05), (0, 0, 0.01))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[pull])
    >>> balance = ms.follow_path(scene, progress=False).balance()
    >>> sorted(balance.energies), "loads" in balance.work, balance.rest_fraction < 0.05
    (['elastic'], True, True)
    """

    parameters: np.ndarray
    energies: Mapping[str, np.ndarray]
    work: Mapping[str, np.ndarray]
    dissipation: Mapping[str, np.ndarray]
    _coordinate: str = field(repr=False, default="parameter", kw_only=True)

    @property
    def energy(self) -> np.ndarray:
        """The sum of all energies, (n,) J."""
        return self._sum(self.energies)

    @property
    def rest(self) -> np.ndarray:
        """The energy that the steps made (positive) or lost (negative) since the first state, (n,) J."""
        energy = self.energy
        return energy - energy[0] - self._sum(self.work) + self._sum(self.dissipation)

    @property
    def moved(self) -> float:
        """The largest energy that moved, in J: the largest range of one of the energies, works and losses over the
        states, and at least a hundredth of the largest kinetic energy, as a body that only flies exchanges none.
        """
        rows = [*self.energies.values(), *self.work.values(), *self.dissipation.values()]
        kinetic = self.energies.get("kinetic", np.zeros(1))
        return max(_OF_FLIGHT * float(np.abs(kinetic).max()), *(float(np.ptp(row)) for row in rows), 0.0)

    @property
    def rest_fraction(self) -> float:
        """The largest magnitude of the rest over `moved`, 1; zero where nothing moved."""
        moved = self.moved
        return float(np.abs(self.rest).max()) / moved if moved > 0.0 else 0.0

    def to_pandas(self) -> pandas.DataFrame:
        """Return the balance as a pandas.DataFrame, a row for each state, with units in the names of its columns.

        Raises ImportError without pandas.
        """
        try:
            pandas = importlib.import_module("pandas")
        except ImportError as error:
            raise ImportError('this needs pandas: pip install "magshell[tables]"') from error
        return pandas.DataFrame(self._columns(), index=pandas.Index(self.parameters, name=self._coordinate))

    def plot(self) -> Any:
        """Draw energies, work, losses and the rest over the states (needs the package matplotlib); returns a Picture."""
        return call_registered("plot_balance", self)

    def _sum(self, rows: Mapping[str, np.ndarray]) -> np.ndarray:
        return sum(rows.values(), np.zeros(len(self.parameters)))

    def _columns(self) -> dict[str, np.ndarray]:
        columns = {f"{name} energy [J]": row for name, row in self.energies.items()}
        columns |= {f"work of {name} [J]": row for name, row in self.work.items()}
        columns |= {f"lost to {name} [J]": row for name, row in self.dissipation.items()}
        return {**columns, "rest [J]": self.rest}

    def _lines(self) -> list[str]:
        """Return the table of energies: the change over all states of each row, and its range."""
        lines, rest = [], self.rest
        for head, rows in (
            ("energy", self.energies),
            ("work done on the scene by", self.work),
            ("lost to", self.dissipation),
        ):
            lines += [f"  {head}"] * bool(rows)
            lines += [
                f"    {name:<36}{row[-1] - row[0]:+12.4g}{np.ptp(row):12.4g}" for name, row in rows.items()
            ]
        lines.append(f"  {'rest':<38}{rest[-1]:+12.4g}{np.ptp(rest):12.4g}")
        lines.append(f"  {describe_rest(self)}")
        return lines

    def __repr__(self) -> str:
        head = f"{type(self).__name__}: {len(self.parameters)} states, {self._coordinate} {self.parameters[0]:.4g} to "
        head += f"{self.parameters[-1]:.4g}"
        return "\n".join([head, f"  {'[J]':<38}{'change':>12}{'range':>12}", *self._lines()])


def percent(fraction: float, digits: int) -> str:
    """Return a fraction in percent with so many digits, without an exponent where it is 100 or more."""
    return f"{float(f'{100.0 * fraction:.{digits}g}'):.6g}"


def describe_rest(balance: EnergyBalance) -> str:
    """Return one sentence on the rest of a balance."""
    rest = balance.rest
    worst = float(rest[np.argmax(np.abs(rest))])
    verb = "made" if worst > 0.0 else "lost"
    return (
        f"the steps {verb} {abs(worst):.3g} J at most, {percent(balance.rest_fraction, 2)} % of the {balance.moved:.3g} J "
        "that moved"
    )


def balance_of_path(path: EquilibriumPath) -> EnergyBalance:
    """Return the balance of a path, with the work between two points by the trapezoidal rule.

    Supports and motors work on the scene along the prescribed displacements, loads along those of their vertices, and
    parameters that change (fields, obstacles, activations) through the energies of their terms.
    """
    scene, model, kinds = path.scene, path.scene._model, term_kinds(path.scene)
    load_parameters, points = path._load_parameters, path._points
    n, is_work = len(points), np.array([kind.is_work for kind in kinds], dtype=bool)
    energies, driven, work = (np.zeros((n, len(kinds))) for _ in range(3))
    constraints = np.zeros((n, 2))  # work of supports, and of motors
    on_rigid = _is_rigid(scene)
    before: Any = None

    def energies_of(state: int, parameters: int) -> np.ndarray:
        point = points[state]
        with path._values_at(parameters).in_core():
            found = model.term_energies(point.state, point.angle_branches, load_parameters[parameters])
        return np.array([energy for _, energy in found])

    for k, point in enumerate(points):
        energies[k] = energies_of(k, k)
        with path._values_at(k).in_core():
            gradients = _core.term_gradients(model, point.state, point.angle_branches, load_parameters[k])
        if before is not None:
            step = point.state - before[0]
            mean = 0.5 * (gradients + before[1])
            work[k] = work[k - 1] - mean @ step
            reactions = mean.sum(axis=0) * step
            constraints[k] = constraints[k - 1] + [reactions[~on_rigid].sum(), reactions[on_rigid].sum()]
            change = energies_of(k - 1, k) - energies[k - 1] + energies[k] - energies_of(k, k - 1)
            driven[k] = driven[k - 1] + 0.5 * change
        before = point.state, gradients
    stored = sums_by_name([kind.name for kind in kinds], np.where(is_work, 0.0, energies))
    done = sums_by_name([kind.name for kind in kinds], np.where(is_work, work, 0.0))
    done |= sums_by_name([kind.agent for kind in kinds], np.where(is_work, 0.0, driven))
    done |= {"supports": constraints[:, 0], "motors": constraints[:, 1]}
    moved = max((float(np.ptp(row)) for row in [*stored.values(), *done.values()]), default=0.0)
    return EnergyBalance(path.parameters, stored, above_round_off(done, moved), {})


def _is_rigid(scene: Scene) -> np.ndarray:
    """Return whether each unknown belongs to a rigid body or a link."""
    own = np.zeros((scene._bodies.n_points, 3))
    own[scene.mesh.n_vertices :] = 1.0
    for points in scene._rigid:
        own[points.vertices] = 1.0
    return np.asarray(scene._model.full_vector(own)) != 0.0
