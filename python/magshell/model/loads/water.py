"""Water around bodies: drag, thrust, viscous drag and added mass."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.owner import Owner
from ..._input.quantity import quantity
from ..._input.scalars import not_negative, positive

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


_HEAD_ON = 0.5 * np.pi
# [-] Entries of a table below this fraction of its largest one count as zero; [rad] tolerance of its first and last angle.
_NONE = 1e-9


class Water(Owner):
    """Water, or another fluid, that flows past bodies and through which they move: [Chen22] (42)-(44), [Lamb32] 121.

    On a face of area A whose corners move at v on average, the flow u = velocity - v of direction d = u / |u| exerts

        f = 1/2 rho A |u|^2 (C_d(phi) d - C_t(phi) n) + A (b_n n (n . u) + b_t (u - n (n . u))),

    a third of it on each corner. The unit normal n is the one against the flow, n . u <= 0, so the two sides of a face
    are alike (the paper leaves that open); phi in [0, pi/2] is the attack angle, sin phi = |n . d|: 0 where the water
    runs along the face, pi/2 where it meets it head on. C_d = drag_coefficient C(phi), and C_t likewise with a C of its
    own if there is one; C(phi) = 2 sin^2(phi) unless a table says otherwise. "Thrust" is the paper's word for the part
    along the normal. The undisturbed flow acts on every face: faces do not shield each other. There is no buoyancy: if it
    matters, reduce the scene's gravity g by the factor 1 - fluid_density / mass_density.

    By default the force is the pressure on a square plate, which is normal to it: head on its coefficient is 2 * 0.59 =
    1.18 ([White11] table 7.3; a disk has 1.17, plates of aspect ratio 5, 10 and 20 have 1.2, 1.3 and 1.5, an endless one
    2.0), and in oblique flow only the velocity across the plate counts, sin^2 ([Taylor52]).

    Added mass m is the water that a face has to move when it moves along its normal. It has the kinetic energy

        T = 1/2 m A (n . (v - velocity))^2,

    from which its momentum and its force follow, so that body and water together keep energy and momentum.
    `Trajectory.kinetic_energy` contains that energy.

    A plate of areal mass s (mass_density * thickness) that falls face-on from rest has, with C_d and C_t head on,

        v(t) = v_T tanh(t / T),    v_T = sqrt(2 s g / (rho (C_d + C_t))),    T = v_T (s + m) / (s g).

    fluid_density: rho, kg/m3, not negative.
    velocity: of the water, (3,), m/s.
    drag_coefficient, thrust_coefficient: factors on the two forces, not negative.
    attack_table: (angles, values), C of drag and of thrust, instead of 2 sin^2. Angles in rad ascend from 0 to pi/2;
        between them runs a twice differentiable cubic spline, which reproduces cubics ("not a knot" at both ends). A
        third entry (a, b) gives it the slopes a at 0 and b at pi/2 [1/rad] instead.
    thrust_table: the same for the thrust alone.
    added_mass: m, kg/m2, not negative, in proportion to the current area of a face. A disk of radius a in open water
        carries 8 a / (3 pi) rho on average, a long strip of width w pi w / 4 rho.
    normal_viscous_drag, tangential_viscous_drag: b_n and b_t, N s/m3, not negative: forces that grow with the speed
        itself, of flow across a face and along it, as at small Reynolds numbers. `Water.viscous` has those of a strip.

    Tables decide how smooth the force is, and solves need its derivatives. Faces are equal on both sides, so C is
    even about 0 and pi/2 (for the thrust: odd about 0): the force is continuously differentiable if the drag's
    C has slope zero at both ends, and the thrust's C is zero at 0 and has slope zero at pi/2. Otherwise the force has a
    kink there; a thrust that is not zero at 0 jumps from one side of the face to the other where the flow is
    tangential. No table is refused for that; `is_smooth` tells whether the force is smooth.

    Raises ValueError on negative or non-finite numbers, and on tables that do not ascend from 0 to pi/2.

    >>> Water(velocity=(0.1, 0, 0), thrust_coefficient=0.5)
    Water(1000 kg/m3, velocity (0.1, 0, 0) m/s, drag_coefficient 0, thrust_coefficient 0.5)
    """

    _replaceable = (
        "fluid_density",
        "velocity",
        "drag_coefficient",
        "thrust_coefficient",
        "added_mass",
        "normal_viscous_drag",
        "tangential_viscous_drag",
    )

    def __init__(
        self,
        fluid_density: Numbers = 1000.0,
        velocity: Numbers = (0.0, 0.0, 0.0),
        drag_coefficient: Numbers = 0.0,
        thrust_coefficient: Numbers = 0.59,
        attack_table: Numbers | None = None,
        thrust_table: Numbers | None = None,
        added_mass: Numbers = 0.0,
        normal_viscous_drag: Numbers = 0.0,
        tangential_viscous_drag: Numbers = 0.0,
    ):
        self.fluid_density: float = not_negative("fluid_density", "kg/m3", fluid_density)
        self.velocity: np.ndarray = quantity("velocity", "m/s", velocity, (3,))
        self.drag_coefficient: float = not_negative("drag_coefficient", "1", drag_coefficient)
        self.thrust_coefficient: float = not_negative("thrust_coefficient", "1", thrust_coefficient)
        self.added_mass: float = not_negative("added_mass", "kg/m2", added_mass)
        self.normal_viscous_drag: float = not_negative("normal_viscous_drag", "N s/m3", normal_viscous_drag)
        self.tangential_viscous_drag: float = not_negative(
            "tangential_viscous_drag", "N s/m3", tangential_viscous_drag
        )
        self.attack_table: Any = _table("attack_table", attack_table)
        self.thrust_table: Any = _table("thrust_table", thrust_table)
        self._drag_curve = _curve(self.attack_table)
        self._thrust_curve = self._drag_curve if thrust_table is None else _curve(self.thrust_table)
        self._core = _core.Water(
            **{name: getattr(self, name) for name in self._replaceable},
            drag_curve=self._drag_curve,
            thrust_curve=self._thrust_curve,
        )

    @classmethod
    def viscous(cls, viscosity: Numbers, length: Numbers, width: Numbers, **others: Any) -> Water:
        """Return water at small Reynolds numbers around a slender strip, such as a cilium: resistive-force theory.

        [Gray55]. The forces per length of a long flat ellipsoid ([Lamb32] 339; [Happel83] 5-11) over its width are

            b_n = 4 pi viscosity / (width ln(4 length / width)),
            b_t = 2 pi viscosity / (width (ln(4 length / width) - 1/2)),

        of motion across the strip and along its length. They exceed those of the ellipsoid by 0.7 and 1.4 % at 5 widths,
        and by 0.1 % at 20. The faces of a strip cannot tell its length from its width, so b_t holds for motion along the
        width as well, which in truth has 4 pi viscosity / (width (ln(4 length / width) + 1)). The water that one part sets
        in motion does not carry others, and a wall is not felt.

        viscosity: of the fluid, Pa s, not negative; water at 20 degrees C has 1e-3. length, width: of the strip, m,
            positive, the length at least twice the width. others: arguments of `Water`; drag and thrust are 0 unless given.

        Raises ValueError on other numbers.

        >>> Water.viscous(1e-3, length=8e-3, width=1e-3).normal_viscous_drag.__round__(3)
        3.626
        """
        mu = not_negative("viscosity", "Pa s", viscosity)
        long, wide = positive("length", "m", length), positive("width", "m", width)
        if long < 2.0 * wide:
            raise ValueError(
                f"length [m] of a slender strip must be at least twice its width, got {long:g} and {wide:g}"
            )
        logarithm = math.log(4.0 * long / wide)
        return cls(
            **{
                "drag_coefficient": 0.0,
                "thrust_coefficient": 0.0,
                "normal_viscous_drag": 4.0 * math.pi * mu / (wide * logarithm),
                "tangential_viscous_drag": 2.0 * math.pi * mu / (wide * (logarithm - 0.5)),
                **others,
            }
        )

    def replaced(self, **values: Any) -> Water:
        """Return the same water with other values, of those that a solve may replace and differentiate by."""
        if unknown := sorted(set(values) - set(self._replaceable)):
            raise ValueError(
                f"Water has no value {unknown[0]!r} to be replaced: it has {', '.join(self._replaceable)}"
            )
        return Water(**{**self.__getstate__(), **values})

    def coefficients(self, attack_angle: Numbers) -> tuple[np.ndarray, np.ndarray]:
        """Return C_d and C_t, each (...), at attack angles [rad] in [0, pi/2], (...)."""
        angles = quantity("attack_angle", "rad", attack_angle, ("...",))
        if (bad := (angles < 0) | (angles > _HEAD_ON)).any():
            raise ValueError(f"attack_angle [rad] must lie in [0, pi/2], got {angles[bad].flat[0]:g}")
        drag, thrust = (
            curve.samples(angles.ravel())[:, 0].reshape(angles.shape)
            for curve in (self._drag_curve, self._thrust_curve)
        )
        return self.drag_coefficient * drag, self.thrust_coefficient * thrust

    def force(
        self, positions: Numbers, velocities: Numbers, accelerations: Numbers | None = None
    ) -> np.ndarray:
        """Return the force on each face, (n_f, 3) N.

        A third of it acts on each corner, except for added mass: its forces on the three corners differ from each other.

        positions, velocities, accelerations: of the corners of the faces, (n_f, 3, 3), a row per corner; m, m/s, m/s2.
            `mesh.rest_positions[mesh.faces]` has that shape. Accelerations are zero by default.

        >>> Water().force([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], np.broadcast_to([0, 0, -0.1], (1, 3, 3))).round(9) + 0.0
        array([[0.  , 0.  , 2.95]])
        """
        x, v = self._checked(positions, velocities)
        drag = 3.0 * _core.drag_faces(self._core, x, v)["corner_force"]
        if self.added_mass == 0.0 and accelerations is None:
            return drag
        w = np.zeros_like(x) if accelerations is None else accelerations
        w = quantity("accelerations", "m/s2", w, x.shape)
        found = _core.added_mass_faces(self._core, x, v)
        rate = np.einsum("fkij,fkj->fi", found["momentum_by_position"], v)
        rate += np.einsum("fij,fj->fi", found["momentum_by_velocity"], w.mean(axis=1))
        return drag - 3.0 * rate

    def momentum(self, positions: Numbers, velocities: Numbers) -> np.ndarray:
        """Return the momentum of the water that each face pushes, (n_f, 3) N s; arguments as in `force`.

        >>> falling = np.broadcast_to([0, 0, -0.1], (1, 3, 3))
        >>> Water(added_mass=4.0).momentum([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], falling).round(9) + 0.0
        array([[ 0. ,  0. , -0.2]])
        """
        return (
            3.0 * _core.added_mass_faces(self._core, *self._checked(positions, velocities))["corner_momentum"]
        )

    def kinetic_energy(self, positions: Numbers, velocities: Numbers) -> np.ndarray:
        """Return the kinetic energy that the water has by the motion of each face, (n_f,) J; arguments as in `force`.

        In flowing water it is that beyond the undisturbed flow, T + velocity . momentum: its changes are work of the faces.

        >>> falling = np.broadcast_to([0, 0, -0.1], (1, 3, 3))
        >>> Water(added_mass=4.0).kinetic_energy([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], falling).round(9)
        array([0.01])
        """
        return _core.added_mass_faces(self._core, *self._checked(positions, velocities))["energy"]

    def _checked(self, positions: Numbers, velocities: Numbers) -> tuple[np.ndarray, np.ndarray]:
        positions = quantity("positions", "m", positions, ("n_f", 3, 3))
        return positions, quantity("velocities", "m/s", velocities, positions.shape)

    @property
    def is_smooth(self) -> bool:
        """Return whether the force is continuously differentiable in the motion of a face, as the tables decide."""
        _, drag_slopes = _ends(self._drag_curve)
        thrust, thrust_slopes = _ends(self._thrust_curve)
        drag_is = self.drag_coefficient == 0 or not drag_slopes.any()
        thrust_is = self.thrust_coefficient == 0 or (thrust[0] == 0 and thrust_slopes[1] == 0)
        return bool(drag_is and thrust_is)

    def __getstate__(self) -> dict[Any, Any]:
        return {
            **{name: getattr(self, name) for name in self._replaceable},
            "attack_table": self.attack_table,
            "thrust_table": self.thrust_table,
        }

    def __setstate__(self, arguments: dict[Any, Any]) -> None:
        self.__init__(**arguments)

    def __repr__(self) -> str:
        parts = [f"{self.fluid_density:g} kg/m3"]
        if self.velocity.any():
            parts.append(f"velocity ({', '.join(f'{v:g}' for v in self.velocity)}) m/s")
        parts.append(f"drag_coefficient {self.drag_coefficient:g}")
        parts.append(f"thrust_coefficient {self.thrust_coefficient:g}")
        for name in ("attack_table", "thrust_table"):
            if (table := getattr(self, name)) is not None:
                parts.append(f"{name} of {len(table[0])} angles")
        units = {"added_mass": "kg/m2", "normal_viscous_drag": "N s/m3", "tangential_viscous_drag": "N s/m3"}
        parts += [
            f"{name} {getattr(self, name):g} {unit}" for name, unit in units.items() if getattr(self, name)
        ]
        return f"Water({', '.join(parts)})"


def _table(name: str, table) -> tuple[np.ndarray, ...] | None:
    """Return a checked table: angles, values and, if given, the two slopes. Raises ValueError."""
    if table is None:
        return None
    if not isinstance(table, tuple | list) or len(table) not in (2, 3):
        raise ValueError(f"{name} must be None, (angles, values) or (angles, values, slopes at both ends)")
    angles = quantity(f"{name} angles", "rad", table[0], ("n",))
    values = quantity(f"{name} values", "1", table[1], angles.shape)
    if len(angles) < 2:
        raise ValueError(f"{name} must have at least two angles, got {len(angles)}")
    if (steps := np.diff(angles)).min() <= 0:
        k = int(np.argmax(steps <= 0))
        raise ValueError(
            f"{name} angles [rad] must ascend, but angle {k} is {angles[k]:g} and angle {k + 1} is {angles[k + 1]:g}"
        )
    if abs(angles[0]) > _NONE or abs(angles[-1] - _HEAD_ON) > _NONE:
        raise ValueError(
            f"{name} angles [rad] must run from 0 to pi/2 = {_HEAD_ON:.7f}, got {angles[0]:g} to {angles[-1]:g}"
        )
    slopes = (quantity(f"{name} slopes", "1/rad", table[2], (2,)),) if len(table) == 3 else ()
    return angles, values, *slopes


def _curve(table: tuple[np.ndarray, ...] | None) -> _core.AttackCurve:
    if table is None:
        return _core.AttackCurve()
    from scipy.interpolate import CubicSpline  # when needed, as loading it takes long

    angles, values, *slopes = table
    ends = [(1, slope) for slope in slopes[0]] if slopes else "not-a-knot"
    return _core.AttackCurve(angles, CubicSpline(angles, values, bc_type=ends).c.T)


def _ends(curve: _core.AttackCurve) -> tuple[np.ndarray, np.ndarray]:
    """Return the values and slopes at 0 and pi/2, with round-off set to zero."""
    samples = curve.samples(np.linspace(0.0, _HEAD_ON, 65))
    samples[np.abs(samples) <= _NONE * np.abs(samples[:, 0]).max()] = 0.0
    return samples[[0, -1], 0], samples[[0, -1], 1]
