"""Results of one joint of a skeleton."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.tensors import as_operand, detached
from ..._runtime.frozen import Frozen
from ..rigid.joint_table import JOINTS
from ..rigid.joints import Joint
from ..rigid.rigid import RigidBodyResult, _cross
from ..rigid.skeleton import motor_rows

if TYPE_CHECKING:
    from ..._input.kinds import Computed, SolveResult


class JointResult(Frozen):
    """The coordinate, the rate and the motor of a joint in a result. If the result has tensors, these are tensors in
    the same graph.
    """

    joint: Joint

    def __init__(self, result: SolveResult, joint: Joint):
        if not any(joint is each for each in result.scene.joints):
            raise ValueError(f"a joint of the scene is one of scene.joints, got {joint!r} that is not in it")
        self._result, self.joint = result, joint
        self._child = RigidBodyResult(result, joint.child)
        self._parent = None if joint.parent is None else RigidBodyResult(result, joint.parent)

    @property
    def angle(self) -> Computed:
        """The angle of a Revolute, with full turns over a motion, or that of the rotation of a Ball, (...) rad.

        That of a Screw has its full turns in every state.
        """
        spec = self.joint._spec
        if not spec.freedoms or spec.slides:
            raise ValueError(f"a {type(self.joint).__name__} has no angle")
        rotation = self._relative
        xp = np if isinstance(rotation, np.ndarray) else __import__("torch")
        if spec.freedoms == 3:
            trace = rotation[..., 0, 0] + rotation[..., 1, 1] + rotation[..., 2, 2]
            return 2.0 * xp.arcsin(xp.sqrt(xp.clip(0.25 * (3.0 - trace), 0.0, 1.0)))
        axis = as_operand(self._axis, rotation)
        # R = cos I + sin [a] + (1 - cos) a a^T
        twice_sine = sum(
            axis[..., k] * (rotation[..., (k + 2) % 3, (k + 1) % 3] - rotation[..., (k + 1) % 3, (k + 2) % 3])
            for k in range(3)
        )
        trace = rotation[..., 0, 0] + rotation[..., 1, 1] + rotation[..., 2, 2]
        angle = xp.arctan2(twice_sine, trace - 1.0)
        if not self.joint._pitch:
            return _unwrapped(angle)
        numbers = detached(self._displacement) / self._at_states("pitch")
        return angle + as_operand(
            2.0 * np.pi * np.round((numbers - detached(angle)) / (2.0 * np.pi)), rotation
        )

    @property
    def displacement(self) -> Computed:
        """The displacement of a Prismatic or a Screw, (...) m."""
        if not self.joint._spec.slides and not self.joint._pitch:
            raise ValueError(f"a {type(self.joint).__name__} has no displacement")
        return self._displacement

    @property
    def _displacement(self) -> Computed:
        along = as_operand(self._axis, self._child.center)
        if self._parent is not None:
            along = _rotated(self._parent.rotation, along)
        return (along * (self.place - self._position_on(self._parent))).sum(-1)

    @property
    def rate(self) -> Computed:
        """The rate of its coordinate in a motion: (n,) rad/s of a Revolute or a Screw, m/s of a Prismatic.

        Of a Ball it is the angular velocity of the child relative to the parent, in the world's axes, (n, 3) rad/s.
        """
        spec = self.joint._spec
        if not spec.freedoms:
            raise ValueError(f"a {type(self.joint).__name__} has no rate")
        if spec.freedoms == 3:
            turning = self._child.angular_velocity
            return turning if self._parent is None else turning - self._parent.angular_velocity
        axis, spin = as_operand(self._axis, self._child.center), 0.0
        velocity = self._velocity_of(self._child) - self._velocity_of(self._parent)
        if self._parent is not None:
            axis, spin = _rotated(self._parent.rotation, axis), self._parent.angular_velocity
        if not spec.slides:
            return (axis * (self._child.angular_velocity - spin)).sum(-1)
        slid = self.place - self._position_on(self._parent)
        turned = 0.0 if self._parent is None else (_cross(spin, axis) * slid).sum(-1)
        return (axis * velocity).sum(-1) + turned

    @property
    def motor_torque(self) -> Computed:
        """The motor torque of a Revolute on its child about the axis, (...) N m; of a Ball (..., 3), in the world's
        axes. That of a Screw is the work per angle: a force along its axis is included by the pitch.

        The parent has the opposite torque. It is NaN in the state that a motion starts from.
        """
        return self._motor("torque")

    @property
    def motor_force(self) -> Computed:
        """The motor force of a Prismatic on its child along the axis, (...) N, like `motor_torque`."""
        return self._motor("force")

    def _motor(self, unknown: str):
        of_length = unknown == "force"
        if self.joint._spec.slides != of_length or not self.joint._driven:
            names = {spec.motor: "" for spec in JOINTS.values() if spec.motor and spec.slides == of_length}
            raise ValueError(f"only a joint with a {' or a '.join(names)} has a motor {unknown}")
        return self._result._driving[..., motor_rows(self._result.scene._bodies.skeletons, self.joint)]

    @property
    def place(self) -> Computed:  # plain-words: ok
        """The position of the joint's origin on its child, (..., 3) m.

        It is the origin in the scene; in a solve with another origin it is still this material point.
        """
        return self._position_on(self._child)

    @property
    def gap(self) -> Computed:
        """The distance of the joint's origin on the child from that on the parent, (...) m.

        It is the remaining gap of a LoopClosure, the displacement of a Prismatic or a Screw, and round-off of others. The
        origin is that in the scene, also in a solve with another origin.
        """
        return ((self.place - self._position_on(self._parent)) ** 2).sum(-1) ** 0.5

    @property
    def _axis(self) -> Computed:
        """The axis of the joint at rest, (3,), or (n, 3) if the states of the result have different ones.

        A tensor if the solve was given one. Positions obey the joint to round-off, so that angles depend on the axis through
        them only. Velocities obey it to the order of the integrator, so that rates depend on it directly as well.
        """
        given = self._result._tensors_at(0).get((self.joint, "axis"))
        return self._at_states("axis") if given is None else given / (given**2).sum() ** 0.5

    def _at_states(self, name: str) -> np.ndarray:
        """Return a number of the joint; with a row for each state of the result if they have different ones."""
        result = self._result
        if np.ndim(result.positions) == 2 or hasattr(result, "_values"):
            return getattr(result._values_at(0).current(self.joint), name)
        states = range(len(result.positions))
        return np.stack([getattr(result._values_at(k).current(self.joint), name) for k in states])

    @property
    def _relative(self):
        child = self._child.rotation
        return child if self._parent is None else self._parent.rotation.swapaxes(-1, -2) @ child

    def _velocity_of(self, link: RigidBodyResult | None):
        if link is None:
            return 0.0
        return link.velocity + _cross(link.angular_velocity, self._position_on(link) - link.center)

    def _position_on(self, link: RigidBodyResult | None):
        if link is None:
            return as_operand(self.joint.origin, self._child.center)
        middle = link._points.center
        return link.center + link.rotation @ as_operand(self.joint.origin - middle, link.center)

    def __repr__(self) -> str:
        return f"{type(self._result).__name__} of {self.joint!r}"


def _rotated(rotations, vectors):
    """Return vectors (..., 3) rotated by matrices (..., 3, 3)."""
    return (rotations * vectors[..., None, :]).sum(-1)


def _unwrapped(angle):
    """Return angles unwrapped over the first axis, if there is one."""
    if angle.ndim == 0:
        return angle
    numbers = detached(angle)
    return angle + as_operand(np.unwrap(numbers, axis=0) - numbers, angle)
