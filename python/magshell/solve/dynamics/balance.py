"""The balance of a motion: where its energy, momentum and angular momentum come from and go."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ..._runtime.frozen import immutable
from ..._runtime.warning_stacklevel import callers_level
from ...errors import StepErrorWarning
from ..options import ProjectiveDynamics
from ..statics.balance import (
    LARGEST_REST,
    EnergyBalance,
    above_round_off,
    describe_rest,
    percent,
    sums_by_name,
    term_kinds,
)
from .step_errors import has_large_errors

if TYPE_CHECKING:
    from .trajectory import Trajectory

_SAME = 1e-6  # [-] of the largest coordinate; see test_substeps_and_chosen_steps_are_balanced

# Forces that are no terms, in the order of the core's MotionBalance; by their names in a balance.
_FURTHER = (
    "damping",
    "stiffness damping",
    "Maxwell branches",
    "dampers",
    "supports",
    "joints",
    "motors",
    "contact",
)
_LOST = {"friction": "friction", "body friction": "friction", "water": "water", "muscle": "muscle"}
# Forces between parts of a scene, whose impulses must cancel: if they do not, the rest has what is left.
_INTERNAL = (
    *("membrane", "bending", "solid", "creases", "muscle"),
    *("own field", "body contact", "body friction", "stiffness damping", "Maxwell branches", "motors"),
)


@immutable
@dataclass(frozen=True, repr=False)
class MotionBalance(EnergyBalance):
    """The balance of energy, momentum and angular momentum of a motion, in its n recorded states.

    parameters: (n,) s, the times. energies, work, dissipation: as in EnergyBalance.
    momentum: (n, 3) N s; angular_momentum: (n, 3) N m s, about the origin. impulses, angular_impulses: {name: (n, 3)}, of
    supports, loads, fields, contact with obstacles and other forces from outside since the first state. Forces between the
    parts of a scene have none, so that `momentum_rest` and `angular_momentum_rest` show it if they do not cancel.

    The sums are those that the integrator itself would give for the work and the impulses as further unknowns, so each has
    its order. The momentum is balanced up to the tolerance of the solver.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> fall = ms.simulate(scene, steps=50, time_step=1e-3).balance()
    >>> sorted(fall.energies), bool(abs(fall.momentum_rest).max() < 1e-9), fall.rest_fraction < 0.05
    (['elastic', 'gravity', 'kinetic'], True, True)
    """

    momentum: np.ndarray
    angular_momentum: np.ndarray
    impulses: Mapping[str, np.ndarray]
    angular_impulses: Mapping[str, np.ndarray]
    _coordinate: str = field(repr=False, default="time [s]", kw_only=True)

    @property
    def times(self) -> np.ndarray:
        """The times of the states, (n,) s."""
        return self.parameters

    @property
    def momentum_rest(self) -> np.ndarray:
        """The change of the momentum without an impulse, (n, 3) N s."""
        return self.momentum - self.momentum[0] - sum(self.impulses.values(), np.zeros(3))

    @property
    def angular_momentum_rest(self) -> np.ndarray:
        """The change of the angular momentum without an angular impulse, (n, 3) N m s: the error of the steps, or of forces
        between parts of the scene."""
        return (
            self.angular_momentum
            - self.angular_momentum[0]
            - sum(self.angular_impulses.values(), np.zeros(3))
        )

    def _columns(self) -> dict[str, np.ndarray]:
        columns = super()._columns()
        for unit, what, total, impulses, rest in self._vectors():
            rows = {what: total, **{f"{what} by {name}": row for name, row in impulses.items()}}
            rows[f"rest of {what}"] = rest
            for name, row in rows.items():
                columns |= {f"{name} {axis} [{unit}]": row[:, k] for k, axis in enumerate("xyz")}
        return columns

    def _vectors(self):
        """Return (unit, name, total, impulses, rest) of the momentum and the angular momentum."""
        return (
            ("N s", "momentum", self.momentum, self.impulses, self.momentum_rest),
            (
                "N m s",
                "angular momentum",
                self.angular_momentum,
                self.angular_impulses,
                self.angular_momentum_rest,
            ),
        )

    def _lines(self) -> list[str]:
        lines = super()._lines()
        for unit, what, total, impulses, rest in self._vectors():
            lines.append(f"  change of the {what} [{unit}]")
            rows = {
                "all": total - total[0],
                **{f"by {name}": row for name, row in impulses.items()},
                "rest": rest,
            }
            for name, row in rows.items():
                lines.append(f"    {name:<36}" + "".join(f"{each:+12.4g}" for each in row[-1]))
        return lines


def balance_of_motion(move: Trajectory) -> MotionBalance:
    """Return the balance of a motion, whose steps are repeated for it; raise ValueError for a copy or a loaded motion."""
    given = move._conditions
    if given is None:
        raise ValueError(
            "the balance repeats the steps of a motion, whose inputs copies and files do not have: ask the motion itself, "
            "and keep its balance"
        )
    scene, model = move.scene, move.scene._model
    with given.inputs.in_core():
        forces, energies, driven, momenta, last, without_energy = _core.motion_balance(
            model, given.core, given.substeps, len(move.time_steps)
        )
        kinds = term_kinds(scene)
        names = [name for name, _, _ in _core.kinds_of_terms(model)]
    _check_repeated(move, last)
    n_terms = len(kinds)
    is_work = np.array([kind.is_work for kind in kinds], dtype=bool)
    work, further = forces[:, :n_terms, 0], n_terms + len(without_energy)
    rows = dict(zip(_FURTHER, range(further, forces.shape[1]), strict=True))
    stored = {"kinetic": momenta[:, 0]}
    stored |= sums_by_name([kind.name for kind in kinds], np.where(is_work, 0.0, energies[:, :n_terms]))
    branches = energies.shape[1] - n_terms
    stored |= sums_by_name(["Maxwell branches"] * branches, energies[:, n_terms:])
    done = sums_by_name([kind.name for kind in kinds], np.where(is_work, work, 0.0))
    done |= sums_by_name([kind.agent for kind in kinds], np.where(is_work, 0.0, driven))
    done |= sums_by_name(["supports", "motors"], forces[:, [rows["supports"], rows["motors"]], 0])
    lost = sums_by_name([_LOST.get(name, name) for name in without_energy], -forces[:, n_terms:further, 0])
    lost |= sums_by_name(_FURTHER[:4], -forces[:, further : further + 4, 0])
    hard_contact = isinstance(move.integrator, ProjectiveDynamics) and move.integrator.contact == "coulomb"
    if hard_contact and (of_contact := forces[:, rows["contact"], 0]).any():
        lost["contact"] = -of_contact
    outside = [
        (row, label)
        for row, (name, label) in enumerate(
            [
                *zip(names, [kind.name for kind in kinds], strict=True),
                *((name, _LOST.get(name, name)) for name in without_energy),
                *zip(_FURTHER, _FURTHER, strict=True),
            ]
        )
        if name not in _INTERNAL and (row != rows["contact"] or hard_contact)
    ]
    moved = max(float(np.ptp(row)) for row in [*stored.values(), *done.values(), *lost.values()])
    impulses, labels = forces[:, [row for row, _ in outside]], [label for _, label in outside]
    momentum, angular_momentum = momenta[:, 1:4], momenta[:, 4:]
    balance = MotionBalance(
        move.times,
        stored,
        above_round_off(done, moved),
        above_round_off(lost, moved),
        momentum,
        angular_momentum,
        _from_outside(labels, impulses[:, :, 1:4], momentum),
        _from_outside(labels, impulses[:, :, 4:], angular_momentum),
    )
    _warn_of_rest(move, balance)
    return balance


def _from_outside(labels: list[str], impulses: np.ndarray, momentum: np.ndarray) -> dict[str, np.ndarray]:
    """Return the impulses by name that exceed the round-off of them all and of the momentum."""
    size = max(float(np.abs(each).max(initial=0.0)) for each in (impulses, momentum))
    return above_round_off(sums_by_name(labels, impulses), size)


def _check_repeated(move: Trajectory, last: np.ndarray) -> None:
    """Raise RuntimeError if the repeated motion ends elsewhere: then the balance is that of another motion."""
    difference = np.abs(last - move.end.state).max(initial=0.0)
    size = np.abs(move.end.state).max(initial=0.0)
    if difference > _SAME * size:
        raise RuntimeError(
            f"the steps of the motion could not be repeated exactly: the end differs by {difference:.3g} m. The motion is so"
            " sensitive to round-off that this would be the balance of another motion: take shorter steps, or balance a part"
        )


def rest_of_energy(move: Trajectory) -> EnergyBalance | None:
    """Return the balance of energy of a motion in which no force puts energy in or takes it out.

    It has the energies of the recorded states. Returns None for another motion, of which only its balance knows the rest.
    """
    if not move._keeps_energy:
        return None
    return EnergyBalance(
        move.times, {"kinetic": move._kinetic_energy, **move._energies}, {}, {}, _coordinate="time [s]"
    )


def describe_energy(move: Trajectory) -> str:
    """Return one sentence on the energy that the steps made or lost, if it is known, and else on the energy."""
    known = vars(move).get("_balance") or rest_of_energy(move)
    if known is not None and np.isfinite(known.rest).all():
        return f"energy: {describe_rest(known)}"
    energy = move._kinetic_energy + sum(move._energies.values())
    return f"energy: {energy[0]:.4g} J at first, {energy[-1]:.4g} J at last; balance() says where it came from and went"


def _warn_of_rest(move: Trajectory, balance: EnergyBalance) -> None:
    """Warn of a rest that is large, unless the errors of the steps have been warned of."""
    if not balance.rest_fraction > LARGEST_REST or has_large_errors(move) or move.scene._warned_of_gains:
        return
    # One digit: Python shows a warning once for each place and text, so that a loop over motions does not repeat it.
    worst = balance.rest[np.argmax(np.abs(balance.rest))]
    what = f"{'made' if worst > 0.0 else 'lost'} {percent(balance.rest_fraction, 1)} %"
    warning = StepErrorWarning(
        f"the steps of the motion {what} of the largest energy that moved. Take shorter steps; print(motion.balance()) says "
        "where the energy went",
        move,
    )
    warnings.warn(warning, stacklevel=callers_level())
