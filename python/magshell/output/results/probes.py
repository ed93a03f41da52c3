"""Named quantities of results, recorded in every state for tables and curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from ..._input.nearest_names import nearest_names
from ..._input.quantity import quantity, real_numbers
from ..._input.selections import indices, selection
from ..._input.tensors import detached
from ..._runtime.frozen import immutable
from ...model.bodies.embedded_points import embed_points
from ...model.contact.contact import Contact
from ...model.shells.shell import Shell
from ...model.solids.solid import Solid
from ...model.supports.displacement_ties import Periodic
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
    "stress": ("Pa", None),
    "von_mises_stress": ("Pa", None),
    "reaction": ("N", 0),
    "contact_force": ("N", 0),
    "energy": ("J", 0),
}


@immutable
@dataclass(frozen=True)
class Probe:
    """A quantity that is recorded under a name in every state of a result, such as the displacement of a tip.

    name: of its columns in ms.to_pandas: "tip.x [m]" and alike for vectors, "tip [J]" for scalars.
    of: vertices (k,), a support, a contact or the name of an energy, as `what` needs. Instead of vertices:
    points: (3,) or (k, 3) m, anywhere on the shell or in the solid at rest; the values are interpolated in its elements.
    what: "position", "displacement" or "velocity" (motions only): the mean over the vertices [m, m/s]; "distance" between
        two vertices [m]; "angle" at the second of three vertices, from 0 to pi [rad]; "reaction" of a Pin, Clamp,
        SymmetryPlane or Periodic of the scene [N]; "contact_force" of a Contact with an obstacle on the bodies, friction
        included [N]; "energy" of a name in `result.energies` [J]; "stress", the six components of the Cauchy stress, of a
        shell at its middle surface, and "von_mises_stress", of a shell the larger one at its surfaces [Pa]: averages over
        the elements around a vertex, weighted by volume, then over the vertices. They are too low at a peak: by 5 to 21 %
        at the edge of a hole in ten-node tetrahedra, by less in smaller elements.
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
    of: Any = None
    what: str = "displacement"
    body: Shell | Solid | None = None
    points: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise ValueError(f"name must be the name of the probe's columns, got {self.name!r:.60}")
        if not isinstance(self.what, str) or self.what not in _QUANTITIES:
            raise ValueError(f"what must be one of {', '.join(_QUANTITIES)}, got {self.what!r:.60}")
        if self.body is not None and not isinstance(self.body, Shell | Solid):
            raise ValueError(f"body must be a Shell or a Solid, got {type(self.body).__name__}")
        _, count = _QUANTITIES[self.what]
        if (self.of is None) == (self.points is None):
            raise ValueError("a Probe needs `of` or `points`, one of them")
        if self.points is not None:
            if count == 0:
                raise ValueError(f"points are for quantities of vertices; {self.what} needs `of`")
            points = np.atleast_2d(real_numbers("points [m]", self.points))
            points = quantity("points", "m", points, ("k", 3))
            if count is not None and len(points) != count:
                raise ValueError(f"{self.what} needs {count} points, got {len(points)}")
            object.__setattr__(self, "points", points)
            return
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
        if self.what in ("distance", "angle", "energy", "von_mises_stress"):
            return {self.name: (unit, values)}
        if self.what == "stress":
            return {f"{self.name}.{name}": (unit, values[..., k]) for k, name in enumerate(_COMPONENTS)}
        return {f"{self.name}.{axis}": (unit, values[..., k]) for k, axis in enumerate("xyz")}

    def _of_vertices(self, result: Any) -> np.ndarray:
        if "stress" in self.what:
            return self._stress(result)
        held = {"velocity": "velocities", "displacement": "displacements"}.get(self.what, "positions")
        whole = result if self.body is None else result[self.body]
        if self.what == "velocity" and not isinstance(result, Trajectory):
            raise ValueError(f"probe {self.name!r}: only motions have velocities, not an {_kind(result)}")
        rows = np.asarray(detached(getattr(whole, held)))
        if self.points is None:
            x = rows[..., indices(f"of of probe {self.name!r}", self.of, rows.shape[-2]), :]
        else:
            x = self._weights(result, rows.shape[-2]).toarray() @ rows
        if self.what == "distance":
            return np.linalg.norm(x[..., 1, :] - x[..., 0, :], axis=-1)
        if self.what == "angle":
            a, b = x[..., 0, :] - x[..., 1, :], x[..., 2, :] - x[..., 1, :]
            return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))
        return x.mean(axis=-2)

    def _weights(self, result: Any, n: int) -> Any:
        """Return the weights of the vertices of the scene, or of `body`, at each vertex or point, sparse (k, n)."""
        if self.points is None:
            chosen = np.arange(n)[indices(f"of of probe {self.name!r}", self.of, n)]
            return scipy.sparse.eye_array(n, format="csr")[chosen]
        body = self._body(result)
        bodies = result.scene._bodies
        found = embed_points([(body, point) for point in self.points], bodies, (), f"probe {self.name!r}")
        weights = scipy.sparse.lil_array((len(found), bodies.n_vertices))
        for k, (vertices, of) in enumerate(found):
            weights[[k], vertices] = of
        weights = weights.tocsr()
        return weights if self.body is None else weights[:, bodies.original[bodies.of(self).vertices]]

    def _body(self, result: Any) -> Shell | Solid:
        bodies = result.scene.bodies
        if self.body is None and len(bodies) != 1:
            raise ValueError(
                f"probe {self.name!r}: the scene has {len(bodies)} bodies: say which, Probe(body=...)"
            )
        return bodies[0] if self.body is None else self.body

    def _stress(self, result: Any) -> np.ndarray:
        body = self._body(result)
        weights = self._weights(result, body.mesh.n_vertices)
        if isinstance(result, EquilibriumSet):
            return np.stack([self._stress_in(case[body]._stresses(), body, weights) for case in result])
        of = result[body]
        if isinstance(result, Equilibrium):
            return self._stress_in(of._stresses(), body, weights)
        return np.stack([self._stress_in(of._stresses(k), body, weights) for k in range(len(result))])

    def _stress_in(self, stresses: Any, body: Shell | Solid, weights: Any) -> np.ndarray:
        """Return the mean over the probe's vertices or points of the stress averaged at the nodes, (6,) or ()."""
        shell = isinstance(body, Shell)
        elements = body.mesh.faces if shell else body.mesh.tetrahedra
        if self.what == "stress":
            i, j = _PAIRS
            values = stresses.mean(stresses.cauchy_stresses)[:, i, j]
        else:
            both = stresses.von_mises_stresses
            values = (both.max(axis=1) if shell else stresses.mean(both))[:, None]
        share = np.repeat(stresses.volumes.sum(axis=1), elements.shape[1])
        around = scipy.sparse.coo_array(
            (share, (elements.ravel(), np.repeat(np.arange(len(elements)), elements.shape[1]))),
            shape=(body.mesh.n_vertices, len(elements)),
        )
        at_nodes = (around @ values) / around.sum(axis=1)[:, None]
        found = (weights @ at_nodes).mean(axis=0)
        return found if self.what == "stress" else found[0]

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
            return result._reaction(self.of, *index).force
        return result._contact_state(self.of, *index).forces.sum(axis=0)

    def _energy(self, result: Any) -> np.ndarray:
        if isinstance(result, EquilibriumSet):
            return np.array([float(self._energy(case)) for case in result])
        energies = getattr(result, "_energies", None)
        if energies is None:
            raise ValueError(f"probe {self.name!r}: an {_kind(result)} holds no energies")
        if self.of not in energies:
            raise ValueError(
                f"probe {self.name!r}: the result has no energy {self.of!r:.60}{nearest_names(self.of, energies)}"
            )
        return np.asarray(energies[self.of])


_COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")
_PAIRS = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]).T
_OBJECTS = {
    "reaction": ((Pin, Clamp, SymmetryPlane, Periodic), "a Pin, Clamp, SymmetryPlane or Periodic"),
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
