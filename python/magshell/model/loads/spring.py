"""Springs between points of bodies, and between them and the ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.given_values import rest_tensor_of
from ..._input.quantity import quantity, real_numbers
from ..._input.tensors import as_operand, stacked
from ..._runtime.frozen import variant
from ..bodies.bodies import BODIES, Bodies
from ..bodies.embedded_points import embed_points, embedded_in, moved_with
from ..rigid.rigid import RigidBody
from ..shells.shell import Shell
from ..solids.solid import Solid
from .springs import Springs, SpringsResult, axes, numbers_of_springs, unit_vector

if TYPE_CHECKING:
    from typing import TypeAlias

    from ..._input.kinds import Computed, Numbers, SolveResult
    from ..rigid.equimomental_points import RigidBodyPoints
    from ..scene.values import Gradient, Values

    OnBody: TypeAlias = tuple[Shell | Solid | RigidBody, Numbers]

_KINDS = (*BODIES, RigidBody)
_CLOSEST = 1e-9  # [-] least length of a spring at rest, over the size of its ends' coordinates


class Spring(Springs):
    """One or several linear springs with dampers, between points of bodies or from them to the ground.

    a: (body, points): a Shell, a Solid or a RigidBody, and points on it at rest, (3,) or (n, 3) m. They may lie anywhere in
        its elements; those of a RigidBody anywhere.
    b: the other end: (body, points) likewise, or points of the ground, (3,) or (n, 3) m. The spring acts along the line
        between its ends. None: the ground where `a` is at rest; the spring then acts along all three axes alike, or along
        `direction` only.
    stiffness: N/m, a number or one for each spring, (n,).
    rest_length: m, the lengths without force, a number or (n,); by default those at rest. Not with b=None.
    damping: N s/m, a number or (n,), against the rate of the length or of the displacement, in motions only. None: no
        damper.
    direction: (3,), along which springs with b=None act.

    Springs are listed in Scene(loads=[...]). They belong to the structure: the load factor does not scale them, and their
    forces act from the first load step on. The Scene needs `allow_rigid_motions=True` if only springs hold a body.

    A solve can replace `stiffness`, `rest_length`, `damping` and `ground` (the points of the ground) by `values=`, with
    gradients; in ms.simulate they may change in time. With a damper the ground cannot move, and has no gradient.
    `result[spring]` has `.length` and `.tension` (N, positive if it pulls), and `.force` (3,) N on the end a.

    Raises ValueError if an end lies outside its body, if both ends are one point, or for negative numbers.

    A spring of 2 N/m pulls the tip of a strip upwards:

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> spring = ms.Spring((sheet, (0.1, 0.01, 0)), (0.1, 0.01, 0.05), stiffness=2.0, rest_length=0.02)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[spring])
    >>> rest = ms.equilibrium(scene)
    >>> pull = rest[spring]
    >>> bool(0.02 < pull.length < 0.05), bool(abs(pull.tension - 2.0 * (pull.length - 0.02)) < 1e-12)
    (True, True)
    """

    def __init__(
        self,
        a: OnBody,
        b: OnBody | Numbers | None = None,
        *,
        stiffness: Numbers,
        rest_length: Numbers | None = None,
        damping: Numbers | None = None,
        direction: Numbers | None = None,
    ):
        if not _is_on_body(a):
            raise ValueError(
                f"a must be (body, points), a Shell, Solid or RigidBody and points (3,) or (n, 3) m on it, got {a!r:.60}"
            )
        first = _points("a", a[1])
        on_ground = not _is_on_body(b)
        second = first if b is None else _points("b", b if on_ground else b[1])
        count = max(len(np.atleast_2d(first)), len(np.atleast_2d(second)))
        self._one = first.ndim == second.ndim == 1
        self._ends: tuple[np.ndarray, np.ndarray] = (
            _for_all("a", first, count),
            _for_all("b", second, count),
        )
        self._of: tuple[Any, Any] = (a[0], None if on_ground else b[0])
        self._is_axial = b is not None
        self.bodies: tuple[Any, ...] = tuple(
            {id(each): each for each in self._of if each is not None}.values()
        )
        self.stiffness: np.ndarray = numbers_of_springs("stiffness", "N/m", stiffness, count, "spring")
        self.damping: np.ndarray | None = (
            None if damping is None else numbers_of_springs("damping", "N s/m", damping, count, "spring")
        )
        self.direction: np.ndarray | None = unit_vector("direction", direction)
        self._check_kind(rest_length)
        self.rest_length: np.ndarray | None = self._length(rest_length) if self._is_axial else None
        self.ground: np.ndarray | None = np.array(second) if on_ground else None
        self._follows = ("rest_length",) * (self._is_axial and rest_length is None) + ("ground",) * (
            b is None
        )
        movable = on_ground and damping is None
        self._replaceable = self._in_time = (
            "stiffness",
            *(("rest_length",) if self._is_axial else ()),
            *(("damping",) if damping is not None else ()),
            *(("ground",) if movable else ()),
        )

    def __len__(self) -> int:
        """Return the number of springs."""
        return len(self._ends[0])

    @property
    def points(self) -> np.ndarray:
        """The two ends of each spring at rest, (n, 2, 3) m."""
        return np.stack(self._ends, axis=1)

    @property
    def body(self) -> Shell | Solid | None:
        """The shell or solid that the springs act on, if there is only one, else None."""
        found = [each for each in self.bodies if isinstance(each, BODIES)]
        return found[0] if len(found) == 1 else None

    def _check_kind(self, rest_length: Numbers | None) -> None:
        """Raise ValueError for arguments that do not fit each other."""
        if not self._is_axial and rest_length is not None:
            raise ValueError(
                "rest_length [m] belongs to a spring between two points: give b, or leave rest_length out"
            )
        if self._is_axial and self.direction is not None:
            raise ValueError("direction belongs to springs with b=None: with b they act along their line")
        if not self._is_axial:
            return
        lengths = np.linalg.norm(self._ends[1] - self._ends[0], axis=1)
        least = _CLOSEST * max(
            float(np.abs(self.points).max()), float(np.ptp(self.points, axis=(0, 1)).max())
        )
        if not lengths.min() > least:
            raise ValueError(
                f"spring {int(np.argmin(lengths))} has both ends at one point, so it has no direction: leave b out for a "
                "spring that acts along all axes or one direction"
            )

    def _length(self, rest_length: Numbers | None) -> np.ndarray:
        if rest_length is not None:
            return numbers_of_springs("rest_length", "m", rest_length, len(self), "spring")
        lengths = np.linalg.norm(self._ends[1] - self._ends[0], axis=1)
        return quantity("rest_length", "m", lengths[0] if self._one else lengths, ("n",)[: not self._one])

    def _made(self, values: dict[str, Any]) -> Spring:
        ends = [
            (body, points[0] if self._one else points)
            for body, points in zip(self._of, self._ends, strict=True)
        ]
        given = dict(values)
        ground = given.pop("ground", None)
        second = ends[1] if self._of[1] is not None else ends[1][1] if self._is_axial else None
        found = Spring(ends[0], second, direction=self.direction, **given)
        if self.ground is not None:
            kept = self.ground if ground is None else ground
            found = variant(found, ground=quantity("ground", "m", kept, self.ground.shape))
        return self._check_shapes(found)

    def _on_reshaped(self, now: dict[int, Any]) -> Spring:
        """Return the springs at the same places of the matter of bodies with other rest positions.

        now: these bodies, by the ids of those they stand for. Given points of the ground stay.
        """
        first, second = (
            np.array([moved_with(body, now[id(body)], point) for point in points])
            if id(body) in now
            else points
            for body, points in zip(self._of, self._ends, strict=True)
        )
        if not self._is_axial:
            second = first
        found = variant(
            self,
            _ends=(first, second),
            _of=tuple(now.get(id(body), body) for body in self._of),
            bodies=tuple(now.get(id(body), body) for body in self.bodies),
        )
        own = {}
        if "rest_length" in self._follows:
            own["rest_length"] = found._length(None)
        if "ground" in self._follows:
            own["ground"] = np.array(second[0] if self._one else second)
        return variant(found, **own)

    def _add_numbers(self, label: str, values: Values, numbers: dict[Any, Any]) -> None:
        super()._add_numbers(label, values, numbers)
        if self.ground is not None:
            numbers[label, "ground"] = self.ground

    def _by_rest_positions(self, body: Shell | Solid, label: str, gradient: Gradient) -> np.ndarray:
        """Return the gradient by the rest positions of a body, (n_v, 3), through the values that follow from the ends."""
        by_ends = np.zeros((2, len(self), 3))
        if "rest_length" in self._follows:
            along = self._ends[1] - self._ends[0]
            along = along / np.linalg.norm(along, axis=1, keepdims=True)
            by_ends[1] += gradient.value(label, "rest_length").reshape(-1, 1) * along
            by_ends[0] -= by_ends[1]
        if "ground" in self._follows:
            by_ends[0] += gradient.value(label, "ground").reshape(-1, 3)
        found = np.zeros((body.mesh.n_vertices, 3))
        for owner, points, by_points in zip(self._of, self._ends, by_ends, strict=True):
            for point, by in zip(points, by_points, strict=True) if owner is body else ():
                vertices, weights = embedded_in(body, point)
                np.add.at(found, vertices, weights[:, None] * by)
        return found

    def _unit(self, name: str) -> str:
        return {"stiffness": "N/m", "rest_length": "m", "damping": "N s/m", "ground": "m"}[name]

    def _embedded(
        self, bodies: Bodies, rigid_points: Sequence[RigidBodyPoints]
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return for each spring the core's nodes and weights of the vector from its end b to its end a; a point of the
        ground has no nodes.
        """
        found = [self._embedded_end(end, bodies, rigid_points) for end in range(2)]
        if not found[1]:
            return found[0]
        return [
            (np.concatenate([i, j]), np.concatenate([of_a, -of_b]))
            for (i, of_a), (j, of_b) in zip(*found, strict=True)
        ]

    def _embedded_end(
        self, end: int, bodies: Bodies, rigid_points: Sequence[RigidBodyPoints]
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the core's nodes and weights of the ends 0 or 1 of all springs; an empty list for the ground."""
        body, points = self._of[end], self._ends[end]
        pairs = [] if body is None else [(body, point) for point in points]
        return embed_points(pairs, bodies, rigid_points, "Spring")

    def _core_input(
        self, label: str, bodies: Bodies, rigid_points: Sequence[RigidBodyPoints], follows: bool
    ) -> dict[str, Any]:
        """Return the input of the core. follows: whether values that follow from rest positions are parameters there."""
        embedded = self._embedded(bodies, rigid_points)
        grounds = np.broadcast_to(np.zeros(3) if self.ground is None else self.ground, (len(self), 3))
        along = [np.zeros(3)] if self._is_axial else axes(self.direction)
        return {
            "owner": label,
            "points": [
                {"vertices": vertices.tolist(), "weights": weights.tolist()}
                for vertices, weights in embedded
                for _ in along
            ],
            "directions": np.tile(along, (len(self), 1)),
            "grounds": np.repeat(grounds, len(along), axis=0),
            "shares": np.ones(len(self) * len(along)).tolist(),
            "numbers": np.repeat(np.arange(len(self)), len(along)).tolist(),
            "stiffness_unit": "N/m",
            "damping_unit": "N s/m",
            "has_places": False,
            **{
                f"{name}_rows": self._rows(name, follows)
                for name in ("stiffness", "rest_length", "damping", "ground")
            },
        }

    def _result_in(self, result: SolveResult) -> SpringResult:
        return SpringResult(result, self)

    def __repr__(self) -> str:
        many = f"{len(self)} springs" if len(self) > 1 else "1 spring"
        to = "bodies" if self._of[1] is not None else "the ground"
        return f"Spring({many} to {to}, stiffness={float(self.stiffness.mean()):g} N/m)"


class SpringResult(SpringsResult):
    """The lengths and forces of a Spring in a result. The axis n is absent if both of its ends were given as (3,)."""

    _springs: Spring

    @property
    def ends(self) -> Computed:
        """The positions of the ends a and b, (..., n, 2, 3) m; b of a spring with b=None is where a is at rest."""
        return self._shaped(self._in_each_state(_both_ends, *map(self._points, range(2))), 2)

    @property
    def length(self) -> Computed:
        """The lengths of the springs, (..., n) m. Raises ValueError for springs with b=None."""
        self._require_axial("length")
        return self._shaped(self._in_each_state(_lengths, self._vectors(self._result.positions)), 0)

    @property
    def tension(self) -> Computed:
        """The forces along the springs, positive if they pull, with those of their dampers in motions, (..., n) N.

        Raises ValueError for springs with b=None.
        """
        self._require_axial("tension")
        return self._shaped(self._in_each_state(_tensions, *self._motion()), 0)

    @property
    def force(self) -> Computed:
        """The forces on the ends a, with those of their dampers in motions, (..., n, 3) N."""
        return self._shaped(self._in_each_state(_forces, *self._motion()), 1)

    def _at(self, k: int) -> Any:
        """Return the springs as they were in a state; what follows from their ends at rest follows the rest positions."""
        now, rest = super()._at(k), rest_tensor_of(self._result)
        if rest is None or not now._follows:
            return now
        ends = [self._ends_at_rest(end, rest) for end in range(2)]
        lengths = ((ends[1] - ends[0]) ** 2).sum(-1) ** 0.5
        of_all = {"rest_length": lengths, "ground": ends[0]}
        return variant(now, **{name: of_all[name][0] if now._one else of_all[name] for name in now._follows})

    def _ends_at_rest(self, end: int, rest: Any) -> Any:
        """Return the ends 0 or 1 at rest positions that are a tensor, (n, 3) m; those on rigid bodies do not move."""
        scene, springs = self._result.scene, self._springs
        if not isinstance(springs._of[end], BODIES):
            return as_operand(springs._ends[end], rest)
        embedded = springs._embedded_end(end, scene._bodies, scene._rigid)
        return stacked([(rest[at] * as_operand(weights[:, None], rest)).sum(0) for at, weights in embedded])

    def _require_axial(self, name: str) -> None:
        if not self._springs._is_axial:
            raise ValueError(f"{self._springs!r} acts along axes, so it has no {name}: use .force")

    def _motion(self) -> tuple[Any, Any]:
        """Return the vectors from b to a, without the ground, and their rates, zero in equilibria, (..., n, 3) each."""
        vectors = self._vectors(self._result.positions)
        velocities = self._velocities()
        return vectors, 0.0 * vectors if velocities is None else self._vectors(velocities, "_own_velocities")

    def _vectors(self, of_vertices: Any, own: str = "_own_points") -> Any:
        """Return the weighted sums of vectors of the vertices (..., n_v, 3) at the ends of each spring, (..., n, 3)."""
        scene = self._result.scene
        return self._sums(self._springs._embedded(scene._bodies, scene._rigid), of_vertices, own)

    def _points(self, end: int) -> Any:
        """Return the positions of the ends 0 or 1, (..., n, 3) m; zero for the ground."""
        scene, positions = self._result.scene, self._result.positions
        embedded = self._springs._embedded_end(end, scene._bodies, scene._rigid)
        return self._sums(embedded, positions, "_own_points") if embedded else 0.0 * self._vectors(positions)

    def _sums(self, embedded: list[tuple[np.ndarray, np.ndarray]], of_vertices: Any, own: str) -> Any:
        scene = self._result.scene
        width, n_v = max(len(vertices) for vertices, _ in embedded), len(scene._bodies.original)
        nodes, weights = np.zeros((len(embedded), width), dtype=np.int64), np.zeros((len(embedded), width, 1))
        for k, (at, of) in enumerate(embedded):
            nodes[k, : len(at)], weights[k, : len(at), 0] = at, of
        on_rigid = nodes >= n_v
        total = 0.0
        if not on_rigid.all():
            rows = of_vertices[..., np.where(on_rigid, 0, nodes), :]
            total = (rows * as_operand(weights * ~on_rigid[..., None], of_vertices)).sum(-2)
        if not on_rigid.any():
            return total
        points = getattr(self._result, own)
        rows = points[..., np.where(on_rigid, nodes - n_v, 0), :]
        return total + (rows * as_operand(weights * on_rigid[..., None], points)).sum(-2)

    def _shaped(self, found: Any, axes: int) -> Computed:
        """Return numbers of all springs, or those of the only one without their axis."""
        if not self._springs._one:
            return found
        return found[(..., 0, *[slice(None)] * axes)]


def _both_ends(spring: Spring, a: Any, b: Any) -> Any:
    if spring.ground is not None:
        b = b + as_operand(spring.ground, b).reshape(-1, 3)
    return stacked([a, b], -2)


def _spans(spring: Spring, vectors: Any) -> Any:
    return vectors if spring.ground is None else vectors - as_operand(spring.ground, vectors).reshape(-1, 3)


def _lengths(spring: Spring, vectors: Any) -> Any:
    return (_spans(spring, vectors) ** 2).sum(-1) ** 0.5


def _tensions(spring: Spring, vectors: Any, rates: Any) -> Any:
    spans, lengths = _spans(spring, vectors), _lengths(spring, vectors)
    found = as_operand(spring.stiffness, vectors) * (lengths - as_operand(spring.rest_length, vectors))
    if spring.damping is None:
        return found
    return found + as_operand(spring.damping, vectors) * (spans * rates).sum(-1) / lengths


def _forces(spring: Spring, vectors: Any, rates: Any) -> Any:
    spans = _spans(spring, vectors)
    if spring._is_axial:
        return -(_tensions(spring, vectors, rates) / _lengths(spring, vectors))[..., None] * spans
    found = -as_operand(spring.stiffness, vectors).reshape(-1, 1) * spans
    if spring.damping is not None:
        found = found - as_operand(spring.damping, vectors).reshape(-1, 1) * rates
    if spring.direction is None:
        return found
    along = as_operand(spring.direction, vectors)
    return (found * along).sum(-1)[..., None] * along


def _is_on_body(end: Any) -> bool:
    return isinstance(end, tuple | list) and len(end) == 2 and isinstance(end[0], _KINDS)


def _points(name: str, value: Any) -> np.ndarray:
    array = real_numbers(f"{name} [m]", value)
    if array.shape != (3,) and (array.ndim != 2 or array.shape[1] != 3 or not len(array)):
        raise ValueError(f"{name} [m] must have points of shape (3,) or (n, 3), got {array.shape}")
    return quantity(name, "m", array, array.shape)


def _for_all(name: str, points: np.ndarray, count: int) -> np.ndarray:
    """Return points (count, 3) from as many or from one. Raises ValueError for another number of them."""
    rows = np.atleast_2d(points)
    if len(rows) not in (1, count):
        raise ValueError(
            f"a and b must have as many points, or one of them a single point, but {name} has {len(rows)} and the other "
            f"{count}"
        )
    return np.broadcast_to(rows, (count, 3)).copy()
