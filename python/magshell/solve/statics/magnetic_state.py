"""Magnetic forces, torques, energies and flux density of an equilibrium."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensors import detached
from ..._runtime.frozen import Frozen
from ...model.fields.field import UniformField
from ...model.results.result_lookup import OfOneBody

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ...model.shells.shell import Shell
    from ...model.solids.solid import Solid
    from .equilibrium import Equilibrium

_TERMS = ("magnetic", "moments", "own field")


def field_of(equilibrium: Equilibrium) -> MagneticState:
    """Return the magnetic state of an equilibrium: flux density at points, forces and torques on bodies, energies.

    Raises ValueError unless it is an Equilibrium of a scene in which magnetization acts.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.01, 0.01, cells=(4, 4))
    >>> sheet = ms.Shell(mesh, thickness=2e-4, young_modulus=1e6)
    >>> scene = ms.Scene(sheet, supports=ms.Clamp(mesh.edges_at(x=0.0)), own_field=ms.OwnField())
    >>> state = ms.field_of(ms.equilibrium(scene, remanent_magnetization=(0, 0, 6e4)))
    >>> above = state.flux_density([(0.005, 0.005, 0.03)])  # nearly that of a dipole of 1.2e-3 A m2
    >>> bool(abs(above[0, 2] / (2e-7 * 1.2e-3 / 0.03**3) - 1) < 0.1)
    True
    """
    return MagneticState(equilibrium)


class MagneticState(Frozen):
    """The magnetic state of an equilibrium, from ms.field_of.

    equilibrium: whose state it is.
    """

    def __init__(self, equilibrium: Equilibrium):
        # Equilibrium itself cannot be imported: it uses this class.
        if not isinstance(equilibrium, OfOneBody) or not hasattr(equilibrium, "n_negative_eigenvalues"):
            raise ValueError(f"equilibrium must be an Equilibrium, got {type(equilibrium).__name__}")
        if not equilibrium.scene.is_magnetic:
            raise ValueError(
                "equilibrium: its scene has no magnetic field: Scene(..., field=...) or Scene(..., own_field=...)"
            )
        self.equilibrium = equilibrium

    def flux_density(self, points: Numbers) -> np.ndarray:
        """Return the flux density of the applied and the own field at points outside of the bodies, (n, 3) T.

        points: (n, 3) m. Only shells of the scene's OwnField contribute to the own field. Within a few edge lengths of a
        shell the points of its sources show.
        """
        return self.applied_flux_density(points) + self.own_flux_density(points)

    def own_flux_density(self, points: Numbers) -> np.ndarray:
        """Return the flux density of the magnetized shells at points (n, 3) m outside of them, (n, 3) T; zero without an
        OwnField.
        """
        at, result = _points(points), self.equilibrium
        with result._values.in_core():
            return result.scene._model.own_flux_density(result._state, at)

    def applied_flux_density(self, points: Numbers) -> np.ndarray:
        """Return the flux density of the applied fields at points (n, 3) m, (n, 3) T; NaN where a field has no value."""
        at, result = _points(points), self.equilibrium
        layout = result.scene._control_layout
        factor = float(layout.of(result._controls, "scene", "field_factor")[0])
        total = np.tile(layout.of(result._controls, "scene", "applied_flux_density")[0], (len(at), 1))
        for source in result.scene.fields:
            if not isinstance(source, UniformField):
                total = total + factor * result._values.current(source).flux_density(at)
        return total

    def magnetic_force(self, body: Shell | Solid) -> np.ndarray:
        """Return the magnetic force of the applied field and of the other bodies on a body, (3,) N.

        Raises ValueError for a body that is not among the scene's shells and solids.

        >>> import magshell as ms
        >>> meshes = [
        ...     ms.meshes.rectangle(0.01, 0.01, cells=(4, 4)).transformed(translation=(0, 0, z)) for z in (0, 0.01)
        ... ]
        >>> plates = [ms.Shell(mesh, thickness=2e-4, young_modulus=1e9) for mesh in meshes]
        >>> held = [ms.Pin(range(25), body=plate) for plate in plates]
        >>> scene = ms.Scene(plates, supports=held, own_field=ms.OwnField())
        >>> state = ms.field_of(ms.equilibrium(scene, remanent_magnetization=(0, 0, 6e4)))
        >>> lower, upper = (state.magnetic_force(plate) for plate in plates)
        >>> bool(upper[2] < 0), bool(abs(upper + lower).max() < 1e-12 * abs(upper[2]))
        (True, True)
        """
        return self._forces(body)[0].sum(axis=0)

    def magnetic_torque(self, body: Shell | Solid, center: Numbers | None = None) -> np.ndarray:
        """Return the torque of these forces about a point, (3,) N m.

        center: (3,) m; None: the mean of the current positions of the body's vertices.
        """
        forces, positions = self._forces(body)
        about = positions.mean(axis=0) if center is None else quantity("center", "m", center, (3,))
        return np.cross(positions - about, forces).sum(axis=0)

    @property
    def energies(self) -> dict[str, float]:
        """The magnetic energies, J: "applied" in the applied fields, "own" of each shell in its own field, "mutual" of the
        shells in the fields of each other.
        """
        result = self.equilibrium
        with result._values.in_core():
            own = float(sum(result.scene._model.own_energies(result._state)))
        applied = sum(result.energies.get(name, 0.0) for name in _TERMS[:2])
        return {"applied": applied, "own": own, "mutual": result.energies.get("own field", 0.0) - own}

    def _forces(self, body) -> tuple[np.ndarray, np.ndarray]:
        """Return the magnetic forces on the vertices of a body and their positions, (n_v, 3) each."""
        result = self.equilibrium
        model, bodies = result.scene._model, result.scene._bodies
        if not any(body is each for each in result.scene.bodies):
            raise ValueError("body must be one of the shells and solids of the scene")
        rows = bodies.spans[bodies.number(body)].vertices
        with result._values.in_core():
            gradient = sum(model.term_gradient(name, result._state, result._controls) for name in _TERMS)
            of_vertices = model.positions(gradient)
        return -of_vertices[rows], np.asarray(detached(result.positions))[rows]

    def __repr__(self) -> str:
        energies = ", ".join(f"{name} {value:.4g}" for name, value in self.energies.items())
        return f"MagneticState: energies {energies} J"


def _points(points: Numbers) -> np.ndarray:
    return quantity("points", "m", points, ("n", 3))
