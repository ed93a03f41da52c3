"""Frictional contact of bodies with obstacles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from ..._input.checked_list import checked_list
from ..._input.owner import Owner
from ..._input.scalars import not_negative, positive
from ..._input.selections import indices, selection
from ..._runtime.solver_entry_point import grouped
from ...mesh.mesh_base import width_of
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..bodies.bodies import BODIES, checked_body, joined, on_body
from ..rigid.rigid import RigidBody
from ..shells.shell import Shell
from ..solids.solid import Solid
from .body_contact import BodyContact
from .obstacles import Attached, Obstacle
from .round_shapes import RoundPair, checked_shapes, round_pairs

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ..scene.values import Gradient, Values

_FACE_POINTS = {  # barycentric coordinates of the points on a face
    0: np.zeros((0, 3)),
    1: np.full((1, 3), 1.0 / 3.0),
    3: np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]) / 6.0,
}
_SMOOTHING = 1e-2  # [-] default smoothing over the mean thickness of sheets
_SMOOTHING_OF_SOLIDS = 1e-4  # [-] default smoothing over the width, for solids alone
_SMOOTHING_OF_SHAPES = 1e-3  # [-] default smoothing over half the smallest width of shapes
_STICKING = 1e-2  # [1/s] default sticking speed over the largest body's width, or that of shapes


class Contact(Owner):
    """Keeps points of a sheet out of obstacles, with friction if wanted [Chen22, 6.1; Geilinger et al. 2020].

    For two bodies, ms.Contact(a, b, ...) makes a BodyContact, which keeps them out of each other. With `shapes`, rigid
    balls, capsules and ellipsoids touch obstacles and each other.

    obstacles: one of ms.obstacles, or several.
    contact_stiffness: N/m, of every point: the force grows linearly with the depth, after a short parabola.
    friction_coefficient: Coulomb's, or None for contact without friction. It acts in ms.simulate only.
    sticking_speed: m/s, the speed bound of static friction (eps_v of IPC). Below it a point sticks: with a fraction r of
        its largest friction force it creeps at sticking_speed (1 - sqrt(1 - r)). By default a hundredth of the sheet's
        width per second (of the largest sheet's).
    smoothing: m, the length of the parabola; by default a hundredth of the thickness, for solids alone 1e-4 of the width,
        for shapes a thousandth of the smallest radius or semi-axis.
    offset: m, the distance from the obstacle at which the force begins; with half the thickness the face of the sheet is
        in contact, not its middle surface.
    lagged_friction: take normal forces and normals of friction from the beginning of each step. The matrix stays
        symmetric; the friction is late by a step.
    vertices: those in contact; by default all, for a solid those on its surface.
    body: the Shell or Solid in contact; by default all, if no vertices are given.
    face_samples: further contact points on every face, 0, 1 or 3, for meshes that are coarse compared to the obstacle.
    shapes: smooth spheres, capsules, ellipsoids and boxes that rigid bodies carry, ms.obstacles.Attached objects, which
        touch the obstacles in place of vertices. Those that are among the obstacles as well touch each other; those of one
        rigid body do not. Each pair touches at one place, but where it touches a Plane or a hollow, a capsule does so at
        both ends of its axis, and a box at its corners. Where a capsule touches a Capsule or a Box its ends are thinner by
        5e-4 of its radius. Pairs that do not touch at one place are refused.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.02, 0.02, cells=(2, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, -1e-3)), friction_coefficient=0.6)
    >>> scene = ms.Scene(sheet, contacts=[floor], gravity=(0, 0, -9.81), allow_rigid_motions=True)
    >>> move = ms.simulate(scene, steps=50, time_step=1e-3, integrator=ms.ImplicitEuler())
    >>> bool(abs(move.positions[-1, :, 2] + 1e-3).max() < 1e-4)
    True

    >>> body = ms.Link(mass=1e-3, inertia=1e-8, center=(0, 0, 4.9e-3))
    >>> ball = ms.obstacles.Attached(ms.obstacles.Sphere(5e-3, center=(0, 0, 4.9e-3)), to=body)
    >>> touch = ms.Contact(ms.obstacles.Plane(), shapes=ball, contact_stiffness=100)
    >>> rail = ms.Prismatic(body, origin=(0, 0, 0), axis=(0, 0, 1))
    >>> scene = ms.Scene(ms.Skeleton([body], [rail]), contacts=[touch], gravity=(0, 0, -9.81))
    >>> round(ms.equilibrium(scene).contact_state(touch).normal_force, 6)
    0.00981
    """

    _replaceable = ("contact_stiffness", "smoothing", "offset", "friction_coefficient", "sticking_speed")

    @overload
    def __new__(cls, obstacles: Obstacle | Iterable[Obstacle], **options: Any) -> Contact: ...
    @overload
    def __new__(
        cls, a: Shell | Solid | RigidBody, b: Shell | Solid | RigidBody, **options: Any
    ) -> BodyContact: ...
    def __new__(cls, *given: Any, **options: Any) -> Contact | BodyContact:
        if given and isinstance(given[0], (*BODIES, RigidBody)):
            return BodyContact(*given, **options)
        if {"a", "b"} & set(options):
            return BodyContact(*given, **options)
        return super().__new__(cls)

    @grouped()
    def __init__(
        self,
        obstacles: Obstacle | Sequence[Obstacle],
        *,
        contact_stiffness: Numbers = 1e4,
        friction_coefficient: Numbers | None = None,
        sticking_speed: Numbers | None = None,
        smoothing: Numbers | None = None,
        offset: Numbers = 0.0,
        lagged_friction: bool = False,
        vertices: Numbers | None = None,
        face_samples: int = 0,
        body: Shell | Solid | None = None,
        shapes: Attached | Sequence[Attached] = (),
    ):
        self.body: Shell | Solid | None = checked_body(body)
        listed = checked_list("obstacles", obstacles, (Obstacle,), "objects of ms.obstacles")
        if not listed:
            raise ValueError("obstacles must hold at least one obstacle")
        self.obstacles = listed
        self.contact_stiffness: float = positive("contact_stiffness", "N/m", contact_stiffness)
        self.friction_coefficient: float | None = (
            None
            if friction_coefficient is None
            else not_negative("friction_coefficient", "1", friction_coefficient)
        )
        self.sticking_speed: float | None = (
            None if sticking_speed is None else positive("sticking_speed", "m/s", sticking_speed)
        )
        self.smoothing: float | None = None if smoothing is None else positive("smoothing", "m", smoothing)
        self.offset: float = not_negative("offset", "m", offset)
        if not isinstance(lagged_friction, bool):
            raise ValueError(f"lagged_friction must be True or False, got {lagged_friction!r}")
        self.lagged_friction = lagged_friction
        self.vertices: np.ndarray | None = (
            None if vertices is None else selection("Contact vertices", vertices)
        )
        if isinstance(face_samples, bool) or face_samples not in _FACE_POINTS:
            raise ValueError(f"face_samples must be 0, 1 or 3, got {face_samples!r}")
        self.face_samples: int = int(face_samples)
        self.shapes: tuple[Attached, ...] = checked_shapes(
            checked_list("shapes", shapes, (Obstacle,), "objects of ms.obstacles")
        )
        self._rounds: tuple[RoundPair, ...] = round_pairs(self.shapes, self.obstacles)
        if self.shapes:
            self._check_shapes()

    def _check_shapes(self) -> None:
        """Raise ValueError if a contact of shapes is also about vertices, or about no pair."""
        about = {"vertices": self.vertices, "body": self.body, "face_samples": self.face_samples or None}
        for name, given in about.items():
            if given is not None:
                raise ValueError(f"a Contact of shapes is not about vertices: give {name} to another Contact")
        if not self._rounds:
            raise ValueError("shapes and obstacles must hold two that different bodies carry")

    def replaced(self, **values: Any) -> Contact:
        """Return the same contact with other parameters of its law."""
        if "friction_coefficient" in values and self.friction_coefficient is None:
            raise ValueError(
                "a Contact without friction cannot get some in a solve: give it some, zero will do"
            )
        return Contact(
            self.obstacles,
            **{
                "contact_stiffness": self.contact_stiffness,
                "friction_coefficient": self.friction_coefficient,
                "sticking_speed": self.sticking_speed,
                "smoothing": self.smoothing,
                "offset": self.offset,
                "lagged_friction": self.lagged_friction,
                "vertices": self.vertices,
                "face_samples": self.face_samples,
                "body": self.body,
                "shapes": self.shapes,
                **values,
            },
        )

    @property
    def _for_all(self) -> bool:
        """Return whether a contact without a `body` acts on all bodies."""
        return self.vertices is None

    def points(self, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """Return the contact points on a mesh: their vertices (k, 3), padded with -1, and weights (k, 3); points on
        faces last.
        """
        if self.shapes:
            return np.zeros((0, 3), dtype=np.int32), np.zeros((0, 3))
        if self.vertices is not None:
            chosen = indices("Contact vertices", self.vertices, mesh.n_vertices)
        else:
            sheet = isinstance(mesh, TriangleMesh)
            chosen = np.arange(mesh.n_vertices) if sheet else np.unique(mesh.faces)
        alone = np.full((len(chosen), 3), -1)
        alone[:, 0] = chosen
        faces = mesh.faces[np.isin(mesh.faces, chosen).all(axis=1)]
        weights = _FACE_POINTS[self.face_samples]
        on_faces = np.repeat(faces, len(weights), axis=0)
        return (
            np.concatenate([alone, on_faces]).astype(np.int32),
            np.concatenate([np.tile([1.0, 0.0, 0.0], (len(alone), 1)), np.tile(weights, (len(faces), 1))]),
        )

    def _law(self, *sheets: Shell) -> tuple[float, ...]:
        """Return the values of `_replaceable` for these bodies, or for the shapes: N/m, m, m, 1, m/s."""
        if self.shapes:
            extent = 2.0 * max(each.most for each in self._rounds)
            smoothing = _SMOOTHING_OF_SHAPES * min(each.least for each in self._rounds)
        else:
            extent = max(width_of(sheet.mesh) for sheet in sheets)
            thick = [sheet.thickness for sheet in sheets if isinstance(sheet, Shell)]
            smoothing = _SMOOTHING * float(np.mean(joined(thick))) if thick else _SMOOTHING_OF_SOLIDS * extent
        return (
            self.contact_stiffness,
            smoothing if self.smoothing is None else self.smoothing,
            self.offset,
            self.friction_coefficient or 0.0,
            _STICKING * extent if self.sticking_speed is None else self.sticking_speed,
        )

    def _add_numbers(self, label: str, values: Values, numbers: dict[Any, Any]) -> None:
        for name, number in zip(self._replaceable, self._law(*values.contact_bodies(self)), strict=True):
            numbers[label, name] = number

    def _by_thickness(self, label: str, sheets: Sequence[Shell | Solid], gradient: Gradient) -> float:
        """Return the gradient with respect to the thickness of each face of the sheets, on which the default smoothing in
        `_law` depends.
        """
        if self.shapes or self.smoothing is not None:
            return 0.0
        by_smoothing = gradient.value(label, "smoothing")[0]
        return (
            _SMOOTHING
            * by_smoothing
            / sum(sheet.thickness.size for sheet in sheets if isinstance(sheet, Shell))
        )

    def _by_width(self, label: str, sheets: Sequence[Shell | Solid], gradient: Gradient) -> float:
        """Return the gradient with respect to the largest width of the bodies, on which the defaults in `_law` depend."""
        if self.shapes:
            return 0.0
        of_sheets = any(isinstance(sheet, Shell) for sheet in sheets)
        found = 0.0
        if self.sticking_speed is None:
            found += _STICKING * gradient.value(label, "sticking_speed")[0]
        if self.smoothing is None and not of_sheets:
            found += _SMOOTHING_OF_SOLIDS * gradient.value(label, "smoothing")[0]
        return found

    def __repr__(self) -> str:
        friction = "" if self.friction_coefficient is None else f", friction {self.friction_coefficient:g}"
        with_what = ", ".join(repr(each) for each in self.obstacles)
        shapes = f", shapes {', '.join(map(repr, self.shapes))}" if self.shapes else ""
        return f"Contact({with_what}; {self.contact_stiffness:g} N/m{friction}{on_body(self.body)}{shapes})"
