"""Magnetic forces, torques, energies and flux density of an equilibrium."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._input.quantity import quantity
from ..._input.tensors import detached
from ..._input.without_gradient import without_gradient
from ..._runtime.frozen import Frozen
from ...model.fields.field import UniformField
from ...model.fields.magnet_forces import Action, action_between, magnetic_moment_of
from ...model.results.result_lookup import OfOneBody
from ...model.scene.own_field import own_field_inputs
from ...model.scene.own_field_overlap import are_in_solids

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers
    from ...model.fields.field import AppliedField
    from ...model.rigid.rigid import RigidBody
    from ...model.shells.shell import Shell
    from ...model.solids.solid import Solid
    from .equilibrium import Equilibrium

_APPLIED = ("magnetic", "induced magnetization", "moments")
_TERMS = (*_APPLIED, "own field")


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
        """Return the flux density of the applied and the own field at points outside of the bodies, (n, 3) T; NaN inside of
        a magnetized Solid with an own field.

        points: (n, 3) m. Only bodies of the scene's OwnField contribute to the own field. Within a few edge lengths of a
        shell the points of its sources show.
        """
        return self.applied_flux_density(points) + self.own_flux_density(points)

    def own_flux_density(self, points: Numbers) -> np.ndarray:
        """Return the flux density of the magnetized bodies at points (n, 3) m outside of them, (n, 3) T; NaN inside of a
        magnetized Solid, zero without an OwnField. The magnetization that a field induces in susceptible shells makes none
        here.
        """
        at, result = _points(points), self.equilibrium
        with result._values.in_core():
            flux = result.scene._model.own_flux_density(result._state, at)
        flux[are_in_solids(result.scene, np.asarray(detached(result.positions)), at)] = np.nan
        return flux

    def applied_flux_density(self, points: Numbers) -> np.ndarray:
        """Return the flux density of the applied fields at points (n, 3) m, (n, 3) T; NaN where a field has no value."""
        at, result = _points(points), self.equilibrium
        total = np.tile(self._uniform, (len(at), 1))
        for source in result.scene.fields:
            if not isinstance(source, UniformField):
                total = total + self._field_factor * result._values.current(source).flux_density(at)
        return total

    @property
    def _uniform(self) -> np.ndarray:
        """The uniform applied flux density, (3,) T."""
        result = self.equilibrium
        return result.scene._load_parameter_layout.of(
            result._load_parameters, "scene", "applied_flux_density"
        )[0]

    @property
    def _field_factor(self) -> float:
        result = self.equilibrium
        return float(
            result.scene._load_parameter_layout.of(result._load_parameters, "scene", "field_factor")[0]
        )

    def magnetic_force(self, body: Shell | Solid | RigidBody | AppliedField) -> Computed:
        """Return the magnetic force on a body or on a magnet of the scene, (3,) N.

        body: a Shell or Solid, on which the applied field and the other bodies of an OwnField act; a RigidBody or Link with
            a magnetic_moment, on which they act likewise; or a field of the scene that has sources, such as a
            CuboidMagnet, a PlacedField or Dipoles: the force of all bodies on these, opposite to theirs on the bodies, and
            that of the other fields. Of two fields one must be a magnet or Dipoles.

        Raises ValueError for what is not in the scene, for a RigidBody without a moment, for a UniformField, and for magnets
        that overlap.

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
        return self._given_out(self._actions(body).forces.sum(axis=0), "magnetic_force(body)")

    def magnetic_torque(
        self, body: Shell | Solid | RigidBody | AppliedField, center: Numbers | None = None
    ) -> Computed:
        """Return the torque of these forces about a point, (3,) N m.

        center: (3,) m; None: the mean of the current positions of the body's vertices, the center of a RigidBody's moment,
            or the `center` of a field that has one.
        """
        on = self._actions(body)
        about = on.center if center is None else quantity("center", "m", center, (3,))
        if about is None:
            raise ValueError(f"center is needed: {body!r:.60} has none of its own")
        torque = (np.cross(on.points - about, on.forces) + on.couples).sum(axis=0)
        return self._given_out(torque, "magnetic_torque(body)")

    @property
    def energies(self) -> Computed:
        """The magnetic energies, J: "applied" in the applied fields, that of susceptible shells too, "own" of each shell
        and solid in its own field, "mutual" of the bodies in the fields of each other.
        """
        return self._given_out(self._energies, "energies[name]")

    @property
    def _energies(self) -> dict[str, float]:
        result = self.equilibrium
        with result._values.in_core():
            own = float(sum(result.scene._model.own_energies(result._state)))
        applied = sum(result._energies.get(name, 0.0) for name in _APPLIED)
        return {"applied": applied, "own": own, "mutual": result._energies.get("own field", 0.0) - own}

    def _given_out(self, value: Any, name: str) -> Any:
        return without_gradient(value, self.equilibrium.positions, name)

    def _actions(self, body: Any) -> _Actions:
        scene = self.equilibrium.scene
        if any(body is each for each in scene.bodies):
            return self._on_body(body)
        for k, part in enumerate(part for part in scene.rigid_parts if part.magnetic_moment is not None):
            if part is body:
                return self._on_moment(k, body)
        if any(body is each for each in scene.fields) and not isinstance(body, UniformField):
            return self._on_source(body)
        raise ValueError(
            "body must be a Shell or Solid of the scene, a RigidBody of it with a magnetic_moment, or one of its "
            f"fields with sources, got {body!r:.60}"
        )

    def _on_body(self, body: Shell | Solid) -> _Actions:
        result = self.equilibrium
        model, bodies = result.scene._model, result.scene._bodies
        rows = bodies.spans[bodies.number(body)].vertices
        with result._values.in_core():
            gradient = sum(
                model.term_gradient(name, result._state, result._load_parameters) for name in _TERMS
            )
            of_vertices = model.positions(gradient)
        positions = np.asarray(detached(result.positions))[rows]
        return _Actions(positions, -of_vertices[rows], np.zeros(3), positions.mean(axis=0))

    def _on_moment(self, number: int, part: RigidBody) -> _Actions:
        """Return the force and couple on the moment of a rigid part, by its number among those with a moment."""
        result = self.equilibrium
        points, moments = (rows[number : number + 1] for rows in self._moments("moments"))
        fields = [field for field in result.scene.fields if not isinstance(field, UniformField)]
        forces, couples = self._on_moments(fields, points, moments)
        couples = couples + np.cross(moments, self._uniform)
        of_own_field = own_field_inputs(result.scene)["own_field_rigid"]
        place = result.scene.rigid_parts.index(part)
        if place in of_own_field:
            with result._values.in_core():
                _, own_forces, own_couples = result.scene._model.own_field_on_moments(result._state)
            row = of_own_field.index(place)
            forces, couples = forces + own_forces[row], couples + own_couples[row]
        return _Actions(points, forces, couples, points[0])

    def _on_source(self, field: AppliedField) -> _Actions:
        """Return the forces and couples on the sources of a field: of all bodies, minus those of the field on them, and of
        the other fields.
        """
        points, moments = self._moments("")
        forces, couples = self._on_moments([field], points, moments)
        others = self._of_other_fields(field)
        return _Actions(
            np.concatenate([points, np.zeros((1, 3))]),
            np.concatenate([-forces, [others.force]]),
            np.concatenate([-couples, [others.torque]]),
            getattr(self.equilibrium._values.current(field), "center", None),
        )

    def _of_other_fields(self, field: AppliedField) -> Action:
        """Return the force and the torque about the origin of the other fields on the sources of one."""
        result = self.equilibrium
        fields = [each for each in result.scene.fields if not isinstance(each, UniformField)]
        number = next(k for k, each in enumerate(fields) if each is field)
        now = [result._values.current(each) for each in fields]
        moment = magnetic_moment_of(now[number])
        force, torque = np.zeros(3), np.zeros(3)
        if moment is not None:
            torque = torque + self._field_factor * np.cross(moment, self._uniform)
        for k, other in enumerate(now):
            if k == number:
                continue
            # The charges of the earlier field are those that are summed, so that both forces are opposite to round-off.
            first, second = (now[number], other) if number < k else (other, now[number])
            action, sign = action_between(first, second), 1.0 if number < k else -1.0
            if action is None:
                action, sign = action_between(second, first), -sign
            if action is None:
                raise ValueError(
                    f"the force between {first!r:.80} and {second!r:.80} cannot be computed, because one of them must be a "
                    "magnet or Dipoles"
                )
            force = force + sign * self._field_factor**2 * action.force
            torque = torque + sign * self._field_factor**2 * action.torque
        return Action(force, torque)

    def _on_moments(
        self, fields: Iterable[AppliedField], points: np.ndarray, moments: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the forces (n, 3) N and couples (n, 3) N m of fields on magnetic moments at points."""
        current = [self.equilibrium._values.current(field)._core for field in fields]
        factors = [self._field_factor] * len(current)
        flux, gradient, _ = _core.sample_fields(current, factors, points, np.zeros_like(points), 1)
        return np.einsum("nij,ni->nj", gradient, moments), np.cross(moments, flux)

    def _moments(self, term: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the points (n, 3) m and magnetic moments (n, 3) A m2 that the applied field acts on; term: of the core, ""
        for all.
        """
        result = self.equilibrium
        with result._values.in_core():
            return result.scene._model.magnetic_moments(term, result._state, result._load_parameters)

    def __repr__(self) -> str:
        energies = ", ".join(f"{name} {value:.4g}" for name, value in self._energies.items())
        return f"MagneticState: energies {energies} J"


class _Actions(NamedTuple):
    """Forces (n, 3) N and couples (n, 3) N m, the latter one each or (3,), at points (n, 3) m, and the point (3,) m that
    torques are about by default, or None.
    """

    points: np.ndarray
    forces: np.ndarray
    couples: np.ndarray
    center: np.ndarray | None


def _points(points: Numbers) -> np.ndarray:
    return quantity("points", "m", points, ("n", 3))
