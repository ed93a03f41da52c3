"""Finds the result of one body, joint or actuator of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.without_gradient import without_gradient
from ..actuators.muscle import Muscle, MuscleResult
from ..rigid.joints import Joint
from ..rigid.rigid import RigidBody, RigidBodyResult
from ..shells.shell import Shell
from ..solids.solid import Solid
from .body_result import BodyResult
from .joint_result import JointResult
from .solid_result import SolidResult

if TYPE_CHECKING:
    from ..._input.kinds import SolveResult


def result_of(
    result: SolveResult, body: Shell | Solid | RigidBody | Joint | Muscle
) -> BodyResult | SolidResult | RigidBodyResult | JointResult | MuscleResult:
    """Return `result[body]`, `result[joint]`, `result[actuator]` or `result[spring]`. Raises ValueError if it is
    not in the scene."""
    body = result.scene._own(body)
    if hasattr(body, "_result_in"):  # an actuator or springs
        return body._result_in(result)
    if isinstance(body, Joint):
        return JointResult(result, body)
    if isinstance(body, Muscle):
        return MuscleResult(result, body)
    if isinstance(body, RigidBody):
        return RigidBodyResult(result, body)
    return SolidResult(result, body) if isinstance(body, Solid) else BodyResult(result, body)


def displacements_of(result: Any) -> Any:
    """Return the displacements of a result from the rest shape, m: an array, or a tensor if its positions are one."""
    rest = result.scene.mesh.rest_positions
    given = getattr(result, "_rest", None)  # a tensor: positions are a function of it, too
    if given is not None and not isinstance(result.positions, np.ndarray):
        return result.positions - given.to(result.positions)
    if isinstance(result.positions, np.ndarray):
        moved = result.positions - rest
        moved.setflags(write=False)  # as the other arrays of a result
        return moved
    return result.positions - result.positions.new_tensor(np.array(rest))


class OfOneBody:
    """A mixin for results of scenes with one body, which gives them the methods of `result[body]`."""

    scene: Any

    def stresses(self, index: int = -1) -> Any:
        """Return the stresses of the scene's only body, as result[body].stresses(). Raises ValueError if there are
        several bodies.

        index: a recorded state of a motion or a path, or one of several equilibria, by default the last.

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
        >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
        >>> ends = [ms.Pin(mesh.vertices_at(x=0.0)), ms.Pin(mesh.vertices_at(x=0.1), displacement=(0.001, 0, 0))]
        >>> shape = ms.equilibrium(ms.Scene(sheet, supports=ends))
        >>> abs(shape.stresses().principal_membrane_forces[0]).round(3)
        array([10.05,  0.  ])
        """
        return without_gradient(self._stresses(index), getattr(self, "positions", None), "result.stresses()")

    def _stresses(self, index: int = -1) -> Any:
        bodies = self.scene.bodies
        if len(bodies) != 1:
            raise ValueError(f"the scene has {len(bodies)} bodies: say which, result[body].stresses()")
        return result_of(self, bodies[0])._stresses(index)

    def _one_solid(self) -> SolidResult | None:
        """Return the result of the only solid, which `strains` needs if the scene has no sheets; else None."""
        bodies = self.scene.bodies
        return SolidResult(self, bodies[0]) if len(bodies) == 1 and isinstance(bodies[0], Solid) else None
