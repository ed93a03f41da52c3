"""Tendons: strings through points that are embedded in bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensors import as_operand
from ..._runtime.frozen import variant
from ..bodies.bodies import BODIES, Bodies, on_body
from ..bodies.embedded_points import embed_points, embedded_in, moved_with
from ..rigid.rigid import RigidBody
from ..shells.shell import Shell
from ..solids.solid import Solid
from .actuator import Actuator, number
from .actuator_results import TendonResult

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers
    from ..rigid.equimomental_points import RigidBodyPoints
    from ..scene.values import Gradient


_SMOOTHING = 1e-3  # [-] default smoothing over the length at rest
_OF_LENGTH = {"rest_length": 1.0, "smoothing": _SMOOTHING}  # [-] defaults over the length at rest
_KINDS = (*BODIES, RigidBody)


class Tendon(Actuator):
    """A string through points of bodies, which pulls, and is slack if it is shorter than its rest length.

    points: (k, 3) m, k >= 2, its points at rest in `body`, each embedded in the element or face that it lies in. Or
        [(body, (3,)), ...] for several bodies, links of a skeleton and rigid bodies among them.
    body: a Shell, a Solid, or a RigidBody such as a Link.
    tension: N, at any length.
    stiffness: N/m, of the whole tendon as a spring beyond rest_length.
    rest_length: m, by default its length at rest.
    sliding: whether it slides through its inner points without friction, so that one tension acts along all of it; else
        each segment is a spring of its own, with its fraction of the rest length.
    smoothing: m, the length beyond the rest length over which the stiffness sets in; by default 0.1 % of its length at
        rest.

    All values may change in time, and have gradients. Results: `result[tendon].length` (m), `.tension` (N; of a tendon
    that does not slide, one per segment) and `.positions` (..., k, 3).

    A bar of E A = 1 N under a tendon of 0.01 N along its axis:

    >>> import magshell as ms
    >>> mesh = ms.meshes.box((1, 0.1, 0.1), cells=(4, 2, 2))
    >>> bar = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=100.0, poisson_ratio=0.0))
    >>> pull = ms.Tendon([(0, 0.05, 0.05), (1, 0.05, 0.05)], bar, tension=0.01)
    >>> found = ms.equilibrium(ms.Scene(bar, supports=[ms.Pin(bar.mesh.vertices_at(x=0.0))], actuators=[pull]))
    >>> float(found[pull].length) < 0.99
    True
    """

    _replaceable = _in_time = ("tension", "stiffness", "rest_length", "smoothing")
    _units: ClassVar[dict[str, str]] = {
        "tension": "N",
        "stiffness": "N/m",
        "rest_length": "m",
        "smoothing": "m",
    }

    def __init__(
        self,
        points: Numbers | Sequence[tuple[Shell | Solid | RigidBody, Numbers]],
        body: Shell | Solid | RigidBody | None = None,
        *,
        tension: Numbers = 0.0,
        stiffness: Numbers = 0.0,
        rest_length: Numbers | None = None,
        sliding: bool = True,
        smoothing: Numbers | None = None,
    ):
        self._points = _points(points, body)
        if not isinstance(sliding, bool):
            raise ValueError(f"sliding must be True or False, got {sliding!r:.60}")
        self.sliding = sliding
        self.bodies: tuple[Any, ...] = tuple({id(each): each for each, _ in self._points}.values())
        lengths = self._lengths
        length = float(lengths.sum())
        if not lengths.min() > 1e-9 * length:
            raise ValueError(
                f"points {np.argmin(lengths)} and {np.argmin(lengths) + 1} of the Tendon are one"
            )
        self._fractions = lengths / length  # of the rest length, one per segment
        self.tension: np.ndarray = number("tension", "N", tension, 0.0)
        self.stiffness: np.ndarray = number("stiffness", "N/m", stiffness, 0.0)
        rest = length if rest_length is None else rest_length
        self.rest_length: np.ndarray = number("rest_length", "m", rest, 0.0, above=True)
        smooth = _SMOOTHING * length if smoothing is None else smoothing
        self.smoothing: np.ndarray = number("smoothing", "m", smooth, 0.0, above=True)
        given = {"rest_length": rest_length, "smoothing": smoothing}
        # the values that follow from its length at rest
        self._follows: tuple[str, ...] = tuple(name for name, value in given.items() if value is None)

    @property
    def _lengths(self) -> np.ndarray:
        """The lengths of its segments at rest, m."""
        return np.linalg.norm(np.diff(self.points, axis=0), axis=1)

    @property
    def _is_spring(self) -> bool:
        """Return whether it has a stiffness; else its tension is a given force."""
        return bool(self.stiffness > 0.0)

    @property
    def points(self) -> np.ndarray:
        """The points at rest, (k, 3) m."""
        return np.array([point for _, point in self._points])

    @property
    def body(self) -> Shell | Solid | None:
        """The first shell or solid that it goes through, or None."""
        return next((each for each in self.bodies if isinstance(each, BODIES)), None)

    def replaced(self, **values: Any) -> Tendon:
        """Returns the same tendon with other numbers."""
        now = {name: getattr(self, name) for name in self._replaceable} | values
        found = self._check_shapes(Tendon(self._points, sliding=self.sliding, **now))
        return variant(found, _follows=tuple(name for name in self._follows if name not in values))

    def _on_reshaped(self, now: dict[int, Any]) -> Tendon:
        """Return the tendon through the same places of the matter of bodies with other rest positions.

        now: these bodies, by the ids of those they stand for.
        """
        points = [
            (now[id(body)], moved_with(body, now[id(body)], point)) if id(body) in now else (body, point)
            for body, point in self._points
        ]
        bodies = tuple(now.get(id(body), body) for body in self.bodies)
        found = variant(self, _points=points, bodies=bodies)
        return found._of_lengths(found._lengths)

    def _of_lengths(self, lengths: Computed) -> Tendon:
        """Return the tendon with the values that follow from the lengths of its segments at rest, (segments,) m."""
        length = lengths.sum()
        own = {name: _OF_LENGTH[name] * length for name in self._follows}
        if isinstance(lengths, np.ndarray):
            own = {name: number(name, "m", value, 0.0, above=True) for name, value in own.items()}
        return variant(self, _fractions=lengths / length, **own)

    def _by_rest_positions(self, body: Shell | Solid, label: str, gradient: Gradient) -> np.ndarray:
        """Return the gradient by the rest positions of a body, (n_v, 3), through the values that follow from the length."""
        by_length = sum(_OF_LENGTH[name] * float(gradient.value(label, name).sum()) for name in self._follows)
        along = np.diff(self.points, axis=0) / self._lengths[:, None]
        by_points = np.zeros_like(self.points)
        by_points[1:] += by_length * along
        by_points[:-1] -= by_length * along
        found = np.zeros((body.mesh.n_vertices, 3))
        for (owner, point), by in zip(self._points, by_points, strict=True):
            if owner is body:
                vertices, weights = embedded_in(body, point)
                np.add.at(found, vertices, weights[:, None] * by)
        return found

    def _tension_at(self, length: Computed) -> Computed:
        """Return the tension at a length [m], N; of a tendon that does not slide, for all segments, (..., segments).

        Its values may be tensors.
        """
        fractions = 1.0 if self.sliding else as_operand(self._fractions, length)
        tension, stiffness, rest_length, smooth = (
            as_operand(getattr(self, name), length)
            for name in ("tension", "stiffness", "rest_length", "smoothing")
        )
        beyond = length - fractions * rest_length
        smoothing = fractions * smooth
        below = 0.5 * beyond**2 / smoothing
        pull = (beyond - 0.5 * smoothing) * (beyond >= smoothing) + below * (
            (beyond > 0.0) & (beyond < smoothing)
        )
        return tension + stiffness / fractions * pull

    def _embedded(
        self, scene_bodies: Bodies, rigid_points: Sequence[RigidBodyPoints]
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return for each point the core's vertices that it is embedded in, and their weights."""
        return embed_points(self._points, scene_bodies, rigid_points)

    def _core_input(
        self, label: str, bodies: Bodies, rigid_points: Sequence[RigidBodyPoints]
    ) -> dict[Any, Any]:
        return {
            "owner": label,
            "slides": self.sliding,
            "shares": self._fractions.tolist(),
            "points": [
                {"vertices": vertices.tolist(), "weights": weights.tolist()}
                for vertices, weights in self._embedded(bodies, rigid_points)
            ],
        }

    def _result_in(self, result) -> TendonResult:
        return TendonResult(result, self)

    def __repr__(self) -> str:
        return f"Tendon({len(self._points)} points, tension={float(self.tension):g}{on_body(self.body)})"


def _points(points, body) -> list[tuple[Shell | Solid | RigidBody, np.ndarray]]:
    if isinstance(points, list | tuple) and points and all(_is_pair(each) for each in points):
        if body is not None:
            raise ValueError("points name their bodies, so body= must not")
        pairs = [(each, quantity("points", "m", point, (3,))) for each, point in points]
    else:
        if not isinstance(body, _KINDS):
            raise ValueError(
                f"a Tendon runs through a Shell, a Solid or a RigidBody: Tendon(points, body), got {body!r:.60}"
            )
        pairs = [(body, point) for point in quantity("points", "m", points, ("k", 3))]
    if len(pairs) < 2:
        raise ValueError(f"a Tendon needs two points or more, got {len(pairs)}")
    return pairs


def _is_pair(each) -> bool:
    return isinstance(each, list | tuple) and len(each) == 2 and isinstance(each[0], _KINDS)
