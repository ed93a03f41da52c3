"""Rigid bodies, their mass properties, and their motion in results."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._input.scalars import positive
from ..._input.selections import count_of, selection
from ..._runtime.frozen import Frozen, variant
from ..._runtime.solver_entry_point import grouped
from ...mesh.generate.stuffed import from_distance
from ...mesh.shapes import Shape
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers, SolveResult
    from ..scene.values import Gradient, Values


def mass_properties(shape: TriangleMesh, mass_density: Numbers) -> dict[Any, Any]:
    """Return the mass [kg], inertia [kg m2] and center [m] of a rigid body that fills a closed surface.

    Raises ValueError if the surface is open, or its faces look inwards.
    """
    density = positive("mass_density", "kg/m3", mass_density)
    volume, center, second = moments_of(shape)
    inertia = density * (np.trace(second) * np.eye(3) - second)
    return {"mass": density * volume, "inertia": inertia, "center": center}


def moments_of(shape: TriangleMesh) -> tuple[float, np.ndarray, np.ndarray]:
    """Return the volume, the center and the second moments about it of the interior of a closed surface.

    They are sums over tetrahedra from each face to the mean of the vertices. Raises ValueError if the surface is open,
    or its faces look inwards.
    """
    faces, points = shape.faces, shape.rest_positions
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    if (counts != 2).any():
        raise ValueError(
            f"a shape must be closed to have a mass density, but {np.sum(counts != 2)} of its edges are open"
        )
    middle = points.mean(axis=0)
    a, b, c = (points[faces[:, k]] - middle for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = float(volumes.sum())
    if not volume > 0:
        raise ValueError("a shape holds no volume: its faces must look outwards")
    center = (volumes[:, None] * (a + b + c)).sum(axis=0) / (4.0 * volume)
    total = a + b + c
    second = sum(np.einsum("i,ij,ik->jk", volumes, x, x) for x in (a, b, c, total)) / 20.0
    return volume, middle + center, second - volume * np.outer(center, center)


_ROUNDING = 1e-9  # [-] of the largest entry: tolerance of the checks of an inertia


class RigidBody(Owner):
    """A rigid body: vertices of a body that move together, such as a payload, a stiff frame or a magnet glued on, or a
    free body without a mesh. It is one of the bodies of a scene.

    vertices: (k,), three at least and not all on a line; or None for a free body.
    mass: kg, its own, in addition to that of the sheet it is part of; None for a frame without mass.
    inertia: kg m2, about `center`, in the world's axes at rest: (3, 3), or (3,) if these are its principal axes, or one
        number for all three. By default zero, as for a point mass.
    center: (3,) m, of its own mass and of its magnetic moment, at rest; by default the mean of the vertices, or the
        origin.
    magnetic_moment: (3,) A m2 at rest, in a scene with a field; it turns with the body.
    force, torque: (3,) N at the center, and (3,) N m, in the world's axes: they keep their direction as the body turns, so
        that a torque has no potential. They may change in ms.simulate, values={body: {"force": ...}}, one value a step or
        at the ends of steps.
    velocity, angular_velocity: (3,) m/s of the center, (3,) rad/s in the world's axes: initial values of a free body in a
        motion that starts at rest positions. Vertices take theirs from the `velocities` of ms.simulate.
    body: the Shell or Solid whose vertices they are, in a scene of several.
    shape: the surface for an ms.Contact with other bodies and for pictures: a TriangleMesh in its rest pose, or one of
        ms.shapes, which is meshed with about 2000 tetrahedra. `RigidBody.of` computes mass, inertia and center
        from a shape.

    Supports cannot hold its vertices. `result[body]` has its center, rotation and velocities. ms.simulate integrates it
    by TRBDF2, with the first step in seven parts, or by ImplicitEuler; without vertices and joints also by SDIRK2 and
    SDIRK3. Without a torque it keeps its angular momentum and energy by each of them, to round-off. Viscous damping acts
    on vertices only. Faces with only some corners in the rigid body still bend at its border: if that half of a face
    matters, give them a larger modulus too.

    >>> import numpy as np
    >>> import magshell as ms
    >>> top = ms.RigidBody(mass=1.0, inertia=(1.0, 2.0, 3.0), angular_velocity=(0, 0, 2.0))
    >>> scene = ms.Scene(top, allow_rigid_motions=True)
    >>> move = ms.simulate(scene, steps=50, time_step=np.pi / 100)
    >>> bool(np.abs(move[top].rotation[-1] - np.diag([-1.0, -1.0, 1.0])).max() < 1e-2)  # half a turn
    True
    """

    _for_all = False
    _center_follows = False  # whether its center is the mean of vertices that other rest positions have moved
    _in_time = ("force", "torque")
    _replaceable = ("mass", "inertia", "center", "magnetic_moment", *_in_time, "velocity", "angular_velocity")

    @grouped()
    def __init__(
        self,
        vertices: Numbers | None = None,
        *,
        mass: Numbers | None = None,
        inertia: Numbers | None = None,
        center: Numbers | None = None,
        magnetic_moment: Numbers | None = None,
        force: Numbers | None = None,
        torque: Numbers | None = None,
        velocity: Numbers | None = None,
        angular_velocity: Numbers | None = None,
        body: Shell | Solid | None = None,
        shape: TriangleMesh | Shape | None = None,
    ):
        if body is not None and not isinstance(body, Shell | Solid):
            raise ValueError(f"body must be a Shell or a Solid of the scene, got {body!r:.60}")
        if vertices is None and body is not None:
            raise ValueError("a RigidBody of a body needs its vertices: RigidBody(vertices=..., body=...)")
        self.shape: TriangleMesh | None = _checked_shape(shape)
        self.vertices: np.ndarray | None = (
            None if vertices is None else selection("RigidBody vertices", vertices)
        )
        self.body = body
        self.mass: float | None = None if mass is None else float(quantity("mass", "kg", mass, ()))
        if self.mass is not None and not self.mass > 0:
            raise ValueError(f"mass [kg] must be positive, got {self.mass:g}")
        self.inertia: np.ndarray | None = None if inertia is None else _checked_inertia(inertia)
        if self.mass is None and self.inertia is not None:
            raise ValueError("inertia [kg m2] was given without a mass [kg]")
        self.center: np.ndarray | None = _vector("center", "m", center)
        self.magnetic_moment: np.ndarray | None = _vector("magnetic_moment", "A m2", magnetic_moment)
        self.force: np.ndarray | None = _vector("force", "N", force)
        self.torque: np.ndarray | None = _vector("torque", "N m", torque)
        self._in_time = tuple(name for name in type(self)._in_time if getattr(self, name) is not None)
        self.velocity: np.ndarray | None = _vector("velocity", "m/s", velocity)
        self.angular_velocity: np.ndarray | None = _vector("angular_velocity", "rad/s", angular_velocity)
        if vertices is None:
            self._check_free()
        elif velocity is not None or angular_velocity is not None:
            raise ValueError(
                "velocity and angular_velocity are those of a free body: vertices have theirs from ms.simulate's velocities"
            )

    def _check_free(self) -> None:
        if self.mass is None:
            raise ValueError(
                "a free RigidBody needs a mass [kg], and an inertia [kg m2]: RigidBody(mass=..., inertia=...)"
            )
        least = 0.0 if self.inertia is None else np.linalg.eigvalsh(self.inertia_tensor)[0]
        if not least > 0:
            raise ValueError(
                f"a free RigidBody needs an inertia [kg m2] about every axis, but the smallest is {least:g}: it could spin "
                "without a force"
            )

    @property
    def inertia_tensor(self) -> np.ndarray:
        """The inertia about the center, (3, 3) kg m2; zero if none was given."""
        given = np.zeros(()) if self.inertia is None else self.inertia
        return given if given.ndim == 2 else given * np.eye(3)

    def replaced(self, **values: Any) -> RigidBody:
        """Return the same rigid body with other values.

        Raises ValueError for a value that the body was made without.
        """
        own = {name: getattr(self, name) for name in self._replaceable}
        for name in values:
            if own[name] is None and not (name in ("velocity", "angular_velocity") and self.vertices is None):
                raise ValueError(
                    f"the RigidBody was made without {name}: give it one in the scene, zero will do"
                )
        return self._again({**own, **values})

    @classmethod
    def of(cls, shape: TriangleMesh | Shape, mass_density: float, **others: Any) -> RigidBody:
        """Make the rigid body that fills a closed surface whose faces look outwards.

        mass_density: kg/m3; mass [kg], inertia and center follow from it. others: further arguments of RigidBody.
        Raises ValueError if the surface is open, or its faces look inwards.

        >>> import magshell as ms
        >>> ms.RigidBody.of(ms.meshes.box((0.02, 0.02, 0.02), cells=(1, 1, 1)).surface, 1e3)
        RigidBody(free, mass 0.008 kg)
        """
        surface = _checked_shape(shape)
        if surface is None:
            raise ValueError("shape must be a TriangleMesh or one of ms.shapes, got None")
        return cls(shape=surface, **mass_properties(surface, mass_density), **others)

    @property
    def _resting(self) -> RigidBody:
        """Return the rigid body without the force and torque that act on it."""
        acting = {name: np.zeros(3) for name in self._in_time if getattr(self, name).any()}
        return self.replaced(**acting) if acting else self

    def _on_reshaped(self, now: dict[int, Any], of: Shell | Solid | None) -> RigidBody:
        """Return the rigid body whose center, if it is the mean of its vertices, moves with them.

        now: bodies with other rest positions, by the ids of those they stand for. of: the body whose vertices it has.
        """
        found = self if self.body is None else variant(self, body=now.get(id(self.body), self.body))
        if self.vertices is None or id(of) not in now or not (self.center is None or self._center_follows):
            return found
        center = now[id(of)].mesh.rest_positions[self.vertices].mean(axis=0)
        return variant(found, center=center, _center_follows=True)

    def _again(self, values: dict[Any, Any]) -> RigidBody:
        return type(self)(self.vertices, body=self.body, shape=self.shape, **values)

    def _add_numbers(self, label: str, values: Values, numbers: dict[Any, Any]) -> None:
        acting = {name: getattr(self, name) for name in ("magnetic_moment", "force", "torque")}
        for name, value in acting.items():
            if value is not None:
                numbers[label, name] = value
        if self.magnetic_moment is not None or self.force is not None:
            numbers[label, "center"] = values.rigid_points(self).center_of(self)

    def _gradients(self, label: str, values: Values, gradient: Gradient) -> dict[str, np.ndarray]:
        own_points, found = values.rigid_points(self), {}
        by_center = np.zeros(3)
        for name in ("magnetic_moment", "force", "torque"):
            if gradient.has(label, name):
                found[name] = gradient.value(label, name)[0]
            elif getattr(self, name) is not None:
                found[name] = np.zeros(3)
        if gradient.has(label, "center"):
            by_center += gradient.value(label, "center")[0]
        by_masses = values.by_masses(gradient)
        if self.mass is not None and by_masses is not None:
            by_own_masses = by_masses[own_points.points]
            found["mass"], found["inertia"], by_mass_center = own_points.masses_vjp(self, by_own_masses)
            by_center += by_mass_center
        by_velocities = gradient.others.get("own_velocities")
        if by_velocities is not None:
            started = values.started_by(self)
            rows = np.concatenate([by_velocities[each.points] for each in started])
            at = np.concatenate([each.rest for each in started]) - own_points.center_of(self)
            found["velocity"], found["angular_velocity"] = rows.sum(axis=0), np.cross(at, rows).sum(axis=0)
            if self.vertices is None:  # points start at velocity + angular_velocity x (point - center)
                by_center -= np.cross(rows.sum(axis=0), or_zero(self.angular_velocity))
        found["center"] = by_center
        none = {"mass": np.zeros(()), "inertia": np.zeros(np.shape(self.inertia)), "velocity": np.zeros(3)}
        return {**none, "angular_velocity": np.zeros(3), **found}

    def __repr__(self) -> str:
        what = "free" if self.vertices is None else f"{count_of(self.vertices)} vertices"
        mass = "" if self.mass is None else f", mass {self.mass:g} kg"
        magnet = (
            ""
            if self.magnetic_moment is None
            else f", magnetic_moment {tuple(self.magnetic_moment.tolist())} A m2"
        )
        return f"RigidBody({what}{mass}{magnet})"


_SHAPE_TETRAHEDRA = 2000  # tetrahedra of the mesh whose surface stands for one of ms.shapes


def _checked_shape(shape) -> TriangleMesh | None:
    if isinstance(shape, Shape):
        return from_distance(shape, n_tetrahedra=_SHAPE_TETRAHEDRA).surface
    if shape is not None and not isinstance(shape, TriangleMesh):
        raise ValueError(f"shape must be a TriangleMesh or one of ms.shapes, got {shape!r:.60}")
    return shape


def _checked_inertia(given) -> np.ndarray:
    given = real_numbers("inertia [kg m2]", given)
    if given.shape not in ((), (3,), (3, 3)):
        raise ValueError(f"inertia [kg m2] must be a number or have shape (3,) or (3, 3), got {given.shape}")
    given = np.array(quantity("inertia", "kg m2", given, given.shape))
    tensor = given if given.ndim == 2 else given * np.eye(3)
    size = np.abs(tensor).max()
    if np.abs(tensor - tensor.T).max() > _ROUNDING * size:
        raise ValueError("inertia [kg m2] must be symmetric")
    low, middle, high = np.linalg.eigvalsh(tensor)
    if low < -_ROUNDING * size:
        raise ValueError(f"inertia [kg m2] must not be negative about any axis, but the smallest is {low:g}")
    if high > low + middle + _ROUNDING * size:
        raise ValueError(
            f"no body has the inertia [kg m2]: its largest principal moment {high:g} is more than the sum of the other "
            f"two, {low:g} and {middle:g}"
        )
    return 0.5 * (tensor + tensor.T) if given.ndim == 2 else given


def _vector(name: str, unit: str, given) -> np.ndarray | None:
    return None if given is None else np.array(quantity(name, unit, given, (3,)))


def or_zero(vector: np.ndarray | None) -> np.ndarray:
    """Return a vector, or zeros for None."""
    return np.zeros(3) if vector is None else vector


class RigidBodyResult(Frozen):
    """The motion of a rigid body in a result. If the result has tensors, these are tensors in the same graph.

    rotation: (..., 3, 3), from the orientation at rest. center: (..., 3) m, of its own mass as the scene has it: this
        stays the same material point in a solve with another center.
    """

    body: RigidBody

    def __init__(self, result: SolveResult, part: RigidBody):
        scene = result.scene
        k = scene._bodies.rigid_number(part)
        self._result, self.body = result, part
        self._points, self._rows = scene._rigid[k], slice(10 * k, 10 * k + 4)
        self._offsets = self._points.rest[:4] - self._points.center

    @property
    def positions(self) -> Computed:
        """The positions of its vertices in their order, (..., k, 3) m.

        Raises ValueError for a free body, which has none.
        """
        if not len(self._points.vertices):
            raise ValueError("a free RigidBody has no vertices: ask for its center and rotation")
        return self._result.positions[..., self._points.vertices, :]

    @property
    def rotation(self) -> Computed:
        """The rotation matrix from the orientation at rest, (3, 3), or (n, 3, 3) of a motion."""
        return self._turned(self._result._own_points[..., self._rows, :])

    @property
    def center(self) -> Computed:
        """The position of the center, (3,) m, or (n, 3) of a motion."""
        return self._result._own_points[..., self._rows, :].mean(-2)

    @property
    def velocity(self) -> Computed:
        """The velocity of the center in a motion, (n, 3) m/s."""
        return self._result._own_velocities[..., self._rows, :].mean(-2)

    @property
    def angular_velocity(self) -> Computed:
        """The angular velocity in a motion, in the world's axes, (n, 3) rad/s."""
        velocities = self._result._own_velocities[..., self._rows, :]
        corners = self._result._own_points[..., self._rows, :]
        around = corners - corners.mean(-2)[..., None, :]
        moments = _cross(around, velocities).sum(-2)
        return moments / (8.0 * self._points.length**2)

    def _turned(self, corners):
        """Return the rotation matrices R of corners c + R rho: the sums of (x - c) rho^T over 4 length^2."""
        around = corners - corners.mean(-2)[..., None, :]
        offsets = _like(self._offsets / (4.0 * self._points.length**2), corners)
        return (around[..., :, :, None] * offsets[:, None, :]).sum(-3)

    def __repr__(self) -> str:
        return f"{type(self._result).__name__} of {self.body!r}"


def _like(array: np.ndarray, other):
    return array if isinstance(other, np.ndarray) else other.new_tensor(array)


def _cross(a, b):
    return np.cross(a, b) if isinstance(a, np.ndarray) else a.cross(b, dim=-1)
