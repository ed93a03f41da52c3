"""Contact of bodies with each other and with themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.owner import Owner
from ..._input.scalars import flag, not_negative, positive
from ...mesh.mesh_base import width_of
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..bodies.bodies import BODIES
from ..rigid.rigid import RigidBody
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_REACH_OF_SHEETS = 0.1  # [-] default activation distance over the thickness
_REACH_OF_SOLIDS = 0.05  # [-] default activation distance over the mean edge on the surface
_STICKING = 1e-2  # [1/s] default sticking speed over the larger body's width
_SMOOTHING = 0.1  # [-] default smoothing over the activation distance
LAWS = ("barrier", "penalty")


class BodyContact(Owner):
    """Contact of two bodies, which cannot pass through each other; ms.Contact(a, b, ...) makes it.

    a, b: a Shell, a Solid, or a RigidBody. The contact surface of a RigidBody is its shape, or, of one made of vertices of
        a body, the faces between these.
    min_distance: the distance that always remains between the surfaces, m. By default half the largest thickness of each
        sheet, since sheets are represented by their middle surfaces; zero for solids.
    activation_distance: the distance, m, beyond the minimal one, at which contact forces begin. By default a tenth of the
        thickness of a sheet, or a twentieth of the mean edge on the surface of a solid, and the smaller one of the two
        bodies. A lightly pressed body rests at nearly this distance. Bodies that start within it push each other before they
        touch, which MeshQualityWarning tells where the distance is the default: give a smaller one than their gap.
    contact_stiffness: Pa, the contact pressure at about half the activation distance; by default the smaller Young's
        modulus of the two bodies. Forces do not depend on the time step.
    law: "barrier", whose force grows without bound, so that the minimal distance is kept under any load; or "penalty",
        softer and cheaper, whose force `contact_stiffness` limits: a larger load enters the minimal distance, but no step
        of a solve passes through the other surface.
    smoothing: m, of the penalty, as for contacts with obstacles; by default a tenth of the activation distance.
    friction_coefficient: of Coulomb's law, or None for contact without friction. Friction acts in ms.simulate only.
    static_friction_coefficient: the coefficient while bodies stick, if it is larger; by default the same.
    sticking_speed: the speed below which contacts stick, m/s, as for contacts with obstacles.
    lagged_friction: as for contacts with obstacles.

    Pairs are a vertex and a face, or two edges; they act on either side of a surface. At a given gap, a flat contact bears
    1.0 to 3.5 times the pressure of the law, depending on how the edges of the two meshes cross, most where the meshes
    coincide; where single edges cross, the force is proportional to the area of their faces. The mesh thus changes the
    gap at which a load rests, within the activation distance, but not the load. Friction acts at the middle surfaces of
    sheets. No step of a solve passes through a pair; a start in which faces intersect, or are nearer than the minimal
    distance, is refused with their numbers. Defaults come from the bodies at construction: a solve with another
    thickness or modulus does not change them.

    Gradients through impacts are exact for the computed motion. But the stiffer the contact and the longer the step, the
    smaller is the range of parameters in which they predict the loss: a barrier reverses a body within a fraction of the
    activation distance, and if a small change shifts an impact by a whole step, the loss is rough. For a smooth loss use
    steps that resolve the impact, a longer activation distance, or the penalty.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.02, 0.02, cells=(4, 4))
    >>> above = mesh.transformed(translation=(1e-3, 5e-4, 2e-3))
    >>> lower = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> upper = ms.Shell(above, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> held = ms.Clamp(mesh.boundary_edges, body=lower)
    >>> scene = ms.Scene(
    ...     [lower, upper],
    ...     supports=[held],
    ...     contacts=[ms.Contact(lower, upper)],
    ...     gravity=(0, 0, -9.81),
    ...     allow_rigid_motions=True,
    ... )
    >>> fall = ms.simulate(scene, steps=40, time_step=1e-3)
    >>> gap = fall[upper].positions[-1, :, 2].min() - fall[lower].positions[-1, :, 2].max()
    >>> bool(1e-3 < gap < 1.2e-3)
    True
    """

    a: Shell | Solid | RigidBody
    b: Shell | Solid | RigidBody
    lagged_friction: bool

    body = None
    _for_all = True
    _replaceable = (
        "contact_stiffness",
        "activation_distance",
        "min_distance",
        "smoothing",
        "friction_coefficient",
        "static_friction_coefficient",
        "sticking_speed",
    )

    def __init__(
        self,
        a: Shell | Solid | RigidBody,
        b: Shell | Solid | RigidBody,
        *,
        min_distance: Numbers | None = None,
        activation_distance: Numbers | None = None,
        contact_stiffness: Numbers | None = None,
        law: str = "barrier",
        smoothing: Numbers | None = None,
        friction_coefficient: Numbers | None = None,
        static_friction_coefficient: Numbers | None = None,
        sticking_speed: Numbers | None = None,
        lagged_friction: bool = False,
    ):
        self.a, self.b = checked_side("a", a), checked_side("b", b)
        if self.a is self.b:
            raise ValueError("a and b are one body: SelfContact(body) is contact of a body with itself")
        self._take(
            min_distance=min_distance,
            activation_distance=activation_distance,
            contact_stiffness=contact_stiffness,
            law=law,
            smoothing=smoothing,
            friction_coefficient=friction_coefficient,
            static_friction_coefficient=static_friction_coefficient,
            sticking_speed=sticking_speed,
            lagged_friction=lagged_friction,
        )

    def _take(self, *, law, lagged_friction, **given) -> None:
        if law not in LAWS:
            raise ValueError(f'law must be "barrier" or "penalty", got {law!r:.60}')
        self.law, self.lagged_friction = law, flag("lagged_friction", lagged_friction)
        bodies = [side_of(side) for side in self._sides]

        def number(name, unit, default, check=positive):
            return default if given[name] is None else check(name, unit, given[name])

        self._distance_given: bool = given["min_distance"] is not None
        self.min_distance: float = number("min_distance", "m", self._distance(bodies), not_negative)
        self._reach_given: bool = given["activation_distance"] is not None
        self.activation_distance: float = number("activation_distance", "m", self._reach(bodies))
        stiffness = min(map(_modulus, bodies))
        if stiffness == np.inf and given["contact_stiffness"] is None:
            raise ValueError("contact_stiffness [Pa] is needed between rigid shapes, which have no modulus")
        self.contact_stiffness: float = number("contact_stiffness", "Pa", stiffness)
        self.smoothing: float = number("smoothing", "m", _SMOOTHING * self.activation_distance)
        self.friction_coefficient: float | None = number("friction_coefficient", "1", None, not_negative)
        self.static_friction_coefficient: float | None = number(
            "static_friction_coefficient", "1", None, not_negative
        )
        if self.static_friction_coefficient is not None:
            if self.friction_coefficient is None:
                raise ValueError(
                    "static_friction_coefficient [1] was given without a friction_coefficient [1]"
                )
            if self.static_friction_coefficient < self.friction_coefficient:
                raise ValueError(
                    "static_friction_coefficient [1] must not be smaller than friction_coefficient, "
                    f"{self.friction_coefficient:g}, got {self.static_friction_coefficient:g}"
                )
        extent = max(width_of(body.mesh) for body in bodies)
        self.sticking_speed: float = number("sticking_speed", "m/s", _STICKING * extent)

    def _distance(self, bodies) -> float:
        return sum(0.5 * _thickness(body) for body in bodies)

    def _reach(self, bodies) -> float:
        return min(map(_reach, bodies))

    @property
    def _sides(self) -> tuple[Any, ...]:
        return self.a, self.b

    @property
    def _numbers(self) -> dict[Any, Any]:
        """The arguments that `replaced` starts from."""
        own = {name: getattr(self, name) for name in self._replaceable}
        return {**own, "law": self.law, "lagged_friction": self.lagged_friction}

    def _checked_names(self, values: dict[Any, Any]) -> dict[Any, Any]:
        """Return the arguments of `replaced`. Raises ValueError for friction if the contact was made without."""
        for name in ("friction_coefficient", "static_friction_coefficient"):
            if getattr(self, name) is None and name in values:
                raise ValueError(
                    f"a Contact without {name} cannot get one in a solve: give it one, and zero will do for friction"
                )
        return values

    def replaced(self, **values: Any) -> BodyContact:
        """Return the same contact with other parameters of its law."""
        return BodyContact(self.a, self.b, **{**self._numbers, **self._checked_names(values)})

    @property
    def _one_coefficient(self) -> bool:
        return self.static_friction_coefficient is None

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        for name in self._replaceable:
            numbers[label, name] = getattr(self, name) or 0.0
        if self._one_coefficient:
            numbers[label, "static_friction_coefficient"] = numbers[label, "friction_coefficient"]

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        found = super()._gradients(label, values, gradient)
        if self._one_coefficient:
            found["friction_coefficient"] = (
                found["friction_coefficient"] + found["static_friction_coefficient"]
            )
        return found

    def __repr__(self) -> str:
        friction = "" if self.friction_coefficient is None else f", friction {self.friction_coefficient:g}"
        return (
            f"{type(self).__name__}({' and '.join(type(side).__name__ for side in self._sides)}; {self.law}, "
            f"{self.contact_stiffness:g} Pa within {self.activation_distance:g} m beyond {self.min_distance:g} m{friction})"
        )


class SelfContact(BodyContact):
    """Contact of a body with itself.

    a: a Shell or a Solid. The other arguments are as in BodyContact, which ms.Contact(a, b, ...) makes, except that the
    default min_distance of a sheet is its whole thickness. Faces that are neighbours along the surface may be nearer at
    rest than twice the minimal and the activation distance; they keep half of their rest distance, divided in the
    proportion of the two. If that is less than the minimal distance itself, a scene refuses a min_distance that was
    given, naming faces and the largest possible one, and warns (ms.MeshQualityWarning) if it comes from the thickness.
    A mesh that passes through itself at rest is refused.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> strip = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> ms.SelfContact(strip)
    SelfContact(Shell; barrier, 1e+06 Pa within 0.0001 m beyond 0.001 m)
    """

    b: Shell | Solid

    def __init__(
        self,
        a: Shell | Solid | RigidBody,
        *,
        min_distance: Numbers | None = None,
        activation_distance: Numbers | None = None,
        contact_stiffness: Numbers | None = None,
        law: str = "barrier",
        smoothing: Numbers | None = None,
        friction_coefficient: Numbers | None = None,
        static_friction_coefficient: Numbers | None = None,
        sticking_speed: Numbers | None = None,
        lagged_friction: bool = False,
    ):
        if not isinstance(a, BODIES):
            raise ValueError(f"a must be a Shell or Solid of the scene, got {a!r:.60}")
        self.a: Shell | Solid | RigidBody = a
        self.b: Shell | Solid | RigidBody = a
        self._check_rest_shape()
        self._take(
            min_distance=min_distance,
            activation_distance=activation_distance,
            contact_stiffness=contact_stiffness,
            law=law,
            smoothing=smoothing,
            friction_coefficient=friction_coefficient,
            static_friction_coefficient=static_friction_coefficient,
            sticking_speed=sticking_speed,
            lagged_friction=lagged_friction,
        )

    def _check_rest_shape(self) -> None:
        """Raise ValueError if the mesh passes through itself at rest."""
        pairs = self.a.mesh.self_intersections(self.a.mesh.rest_positions)
        if len(pairs):
            raise ValueError(
                f"the mesh of a passes through itself at rest, and cannot be kept from it: {len(pairs)} pairs of faces do, "
                f"{pairs[0, 0]} and {pairs[0, 1]} the first"
            )

    def _distance(self, bodies) -> float:
        return _thickness(self.a)

    @property
    def _sides(self) -> tuple[Any, ...]:
        return (self.a,)

    def replaced(self, **values: Any) -> SelfContact:
        """Return the same contact with other parameters of its law."""
        return SelfContact(self.a, **{**self._numbers, **self._checked_names(values)})


class RigidShape(NamedTuple):
    """The contact surface of a RigidBody that has a shape."""

    mesh: TriangleMesh


def has_contact_shape(side: Shell | Solid | RigidBody) -> bool:
    """Return whether the contact surface of a body is the shape of a RigidBody."""
    return isinstance(side, RigidBody) and side.shape is not None


def checked_side(name: str, side: Shell | Solid | RigidBody) -> Shell | Solid | RigidBody:
    """Return a body of a contact as it was given. Raises ValueError if it has no contact surface."""
    if isinstance(side, BODIES) or has_contact_shape(side):
        return side
    if not isinstance(side, RigidBody):
        raise ValueError(f"{name} must be a Shell, a Solid or a RigidBody of the scene, got {side!r:.60}")
    if side.vertices is None:
        raise ValueError(
            f"{name} is a free RigidBody without faces to touch with: give it a shape, or make it of the vertices of a body"
        )
    if side.body is None:
        raise ValueError(
            f"{name} is a RigidBody that does not say of which body it is: RigidBody(..., body=...)"
        )
    return side


def side_of(side: Shell | Solid | RigidBody) -> Shell | Solid | RigidShape:
    """Return the body or shape that has the contact surface."""
    if has_contact_shape(side):
        return RigidShape(side.shape)
    return side.body if isinstance(side, RigidBody) else side


def _thickness(body) -> float:
    return float(np.max(body.thickness)) if isinstance(body, Shell) else 0.0


def _modulus(body) -> float:
    if isinstance(body, RigidShape):
        return np.inf
    if isinstance(body, Solid):
        return float(np.min(body.material._wave_modulus(body.mesh.n_tetrahedra)))
    return float(np.min(body.young_modulus))


def _reach(body) -> float:
    if isinstance(body, Shell):
        return _REACH_OF_SHEETS * float(np.min(body.thickness))
    return _REACH_OF_SOLIDS * _mean_edge(body.mesh)


def _mean_edge(mesh) -> float:
    corners = mesh.rest_positions[mesh.faces]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
