"""Named quantities of results, recorded in every state for tables and curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._input.nearest_names import nearest_names
from ..._input.selections import indices, selection
from ..._input.tensors import detached
from ..._runtime.frozen import immutable
from ...model.contact.contact import Contact
from ...model.shells.shell import Shell
from ...model.solids.solid import Solid
from ...model.supports.supports import Clamp, Pin, SymmetryPlane
from ...solve.dynamics.trajectory import Trajectory
from ...solve.statics.equilibria import EquilibriumSet
from ...solve.statics.equilibrium import Equilibrium
from ...solve.statics.path import EquilibriumPath

# Unit of each quantity, and how many vertices it takes: None for one or more, 0 for none.
_QUANTITIES = {
    "position": ("m", None),
    "displacement": ("m", None),
    "velocity": ("m/s", None),
    "distance": ("m", 2),
    "angle": ("rad", 3),
    "reaction": ("N", 0),
    "contact_force": ("N", 0),
    "energy": ("J", 0),
}


@immutable
@dataclass(frozen=True)
class Probe:
    """A quantity that is recorded under a name in every state of a result, such as the displacement of a tip.

    name: of its columns in ms.to_pandas: "tip.x [m]" and alike for vectors, "tip [J]" for scalars.
    of: vertices (k,), a support, a contact or the name of an energy, as `what` needs.
    what: "position", "displacement" or "velocity" (motions only): the mean over the vertices [m, m/s]; "distance" between
        two vertices [m]; "angle" at the second of three vertices, from 0 to pi [rad]; "reaction" of a Pin, Clamp or
        SymmetryPlane of the scene [N]; "contact_force" of a Contact with an obstacle on the bodies, friction included [N];
        "energy" of a name in `result.energies` [J].
    body: the Shell or Solid whose vertices `of` counts; by default they are those of the scene.

    Raises ValueError if `of` does not suit `what`; ms.to_pandas does if the result has no such vertices, support or energy.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> clamp = ms.Clamp(mesh.edges_at(x=0.0))
    >>> rest = ms.equilibrium(ms.Scene(sheet, supports=[clamp], gravity=(0, 0, -9.81)))
    >>> probes = [ms.Probe("tip", mesh.vertices_at(x=0.05)), ms.Probe("hold", clamp, "reaction")]
    >>> table = ms.to_pandas(rest, probes=probes)
    >>> bool(table["tip.z [m]"][0] < 0), round(float(table["hold.z [N]"][0]), 4)  # carries 0.5 g
    (True, 0.0049)
    """

    name: str
    of: Any
    what: str = "displacement"
    body: Shell | Solid | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise ValueError(f"name must be the name of the probe's columns, got {self.name!r:.60}")
        if not isinstance(self.what, str) or self.what not in _QUANTITIES:
            raise ValueError(f"what must be one of {', '.join(_QUANTITIES)}, got {self.what!r:.60}")
        if self.body is not None and not isinstance(self.body, Shell | Solid):
            raise ValueError(f"body must be a Shell or a Solid, got {type(self.body).__name__}")
        _, count = _QUANTITIES[self.what]
        if count != 0:
            vertices = selection("of", self.of, "vertices")
            if count is not None and (vertices.dtype == bool or len(vertices) != count):
                raise ValueError(f"{self.what} needs of = {count} vertices, got {len(vertices)}")
            object.__setattr__(self, "of", vertices)
            return
        if self.body is not None:
            raise ValueError(f"body is for vertices; {self.what} takes none")
        kinds, words = _OBJECTS[self.what]
        if not isinstance(self.of, kinds):
            raise ValueError(f"{self.what} needs of = {words}, got {type(self.of).__name__}")

    def columns(self, result: Any) -> dict[str, tuple[str, np.ndarray]]:
        """Return its numbers in all states of a result, {name of the column: (unit, (n,) or () for one state)}."""
        unit, count = _QUANTITIES[self.what]
        values = self._of_object(result) if count == 0 else self._of_vertices(result)
        if self.what in ("distance", "angle", "energy"):
            return {self.name: (unit, values)}
        return {f"{self.name}.{axis}": (unit, values[..., k]) for k, axis in enumerate("xyz")}

    def _of_vertices(self, result: Any) -> np.ndarray:
        held = {"velocity": "velocities", "displacement": "displacements"}.get(self.what, "positions")
        whole = result if self.body is None else result[self.body]
        if self.what == "velocity" and not isinstance(result, Trajectory):
            raise ValueError(f"probe {self.name!r}: only motions have velocities, not an {_kind(result)}")
        rows = np.asarray(detached(getattr(whole, held)))
        chosen = indices(f"of of probe {self.name!r}", self.of, rows.shape[-2])
        x = rows[..., chosen, :]
        if self.what == "distance":
            return np.linalg.norm(x[..., 1, :] - x[..., 0, :], axis=-1)
        if self.what == "angle":
            a, b = x[..., 0, :] - x[..., 1, :], x[..., 2, :] - x[..., 1, :]
            return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))
        return x.mean(axis=-2)

    def _of_object(self, result: Any) -> np.ndarray:
        if self.what == "energy":
            return self._energy(result)
        if isinstance(result, Equilibrium):
            return self._force(result)
        if isinstance(result, EquilibriumSet):
            return np.array([self._force(case) for case in result]).reshape(-1, 3)
        if isinstance(result, EquilibriumPath):
            points = (result.equilibrium(k) for k in range(len(result)))
            return np.array([self._force(point) for point in points]).reshape(-1, 3)
        return np.array([self._force(result, k) for k in range(len(result))]).reshape(-1, 3)

    def _force(self, result: Any, *index: int) -> np.ndarray:
        if self.what == "reaction":
            return result.reaction(self.of, *index).force
        return result.contact_state(self.of, *index).forces.sum(axis=0)

    def _energy(self, result: Any) -> np.ndarray:
        if isinstance(result, EquilibriumSet):
            return np.array([float(self._energy(case)) for case in result])
        energies = getattr(result, "energies", None)
        if energies is None:
            raise ValueError(f"probe {self.name!r}: an {_kind(result)} holds no energies")
        if self.of not in energies:
            raise ValueError(
                f"probe {self.name!r}: the result has no energy {self.of!r:.60}{nearest_names(self.of, energies)}"
            )
        return np.asarray(energies[self.of])


_OBJECTS = {
    "reaction": ((Pin, Clamp, SymmetryPlane), "a Pin, Clamp or SymmetryPlane"),
    "contact_force": ((Contact,), "a Contact with an obstacle"),
    "energy": ((str,), "the name of an energy"),
}


def checked_probes(probes: Probe | Sequence[Probe]) -> tuple[Probe, ...]:
    """Return one or several probes as a tuple. Raises ValueError if one is no Probe, or if two have the same name."""
    given = (probes,) if isinstance(probes, Probe) else probes
    if not isinstance(given, list | tuple) or not all(isinstance(each, Probe) for each in given):
        raise ValueError(f"probes must be an ms.Probe or a list of them, got {probes!r:.80}")
    names = [each.name for each in given]
    if twice := {name for name in names if names.count(name) > 1}:
        raise ValueError(f"probes must have different names, but two are called {min(twice)!r}")
    return tuple(given)


def _kind(result: Any) -> str:
    return type(result).__name__
