"""What a result says of one body, whatever it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .body_result import BodyResult
from .joint import Joint
from .joint_result import JointResult
from .muscle import Muscle
from .muscle_result import MuscleResult
from .rigid import Rigid
from .rigid_result import RigidResult
from .shell import Shell
from .solid import Solid
from .solid_result import SolidResult

if TYPE_CHECKING:
    from .._checks.kinds import SolveResult


def result_of(
    result: SolveResult, body: Shell | Solid | Rigid | Joint | Muscle
) -> BodyResult | SolidResult | RigidResult | JointResult | MuscleResult:
    """`result[body]`, `result[joint]` or `result[actuator]`. Raises ValueError where the scene has no such one."""
    if hasattr(body, "_result_in"):  # an actuator
        return body._result_in(result)
    if isinstance(body, Joint):
        return JointResult(result, body)
    if isinstance(body, Muscle):
        return MuscleResult(result, body)
    if isinstance(body, Rigid):
        return RigidResult(result, body)
    return SolidResult(result, body) if isinstance(body, Solid) else BodyResult(result, body)
