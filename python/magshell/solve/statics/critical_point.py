"""The points of a path of equilibria where it gains or loses an unstable direction: ms.CriticalPoint."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import dtype_like, like
from ..._runtime.frozen import immutable
from ...model.scene.solve_inputs import Inputs
from ..adjoint.critical import CriticalAdjoint
from ..adjoint.critical_system import Line, Located
from .along_path import AlongPath

if TYPE_CHECKING:
    from .equilibrium import Equilibrium


@immutable
@dataclass(frozen=True)
class CriticalPoint:
    """A point of a path where it gains or loses an unstable direction.

    parameter: on the path. kind: "limit" (the path turns round here), "bifurcation" (another branch crosses, which
    path.switch_branch follows) or, under forces without potential, "flutter" (oscillations begin to grow). positions:
    (n_v, 3) m. mode: (n_v, 3), the displacement that costs nothing here, largest component 1. after_point: index of the
    last point of the path before it.

    Where values or load parameters of the path are tensors, `parameter` and `positions` are tensors, located by Newton's
    method to 1e-9, and differentiable at limit points and at symmetric bifurcations; `path.switch_branch` and `start=` take
    the point and its positions as before. The gradient costs one factorization, and one or two back-substitutions and
    thirty evaluations of the stiffness where positions are asked for, or at a bifurcation. The gradient
    by an input that breaks the symmetry of a bifurcation raises NoGradient; so do gradients at flutter, and of paths along
    which values change.

    >>> import torch
    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (-0.4, 0, 0))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    >>> modulus = torch.tensor(1e6, dtype=torch.float64, requires_grad=True)
    >>> buckling = ms.follow_path(scene, values={sheet: {"young_modulus": modulus}}).critical[0].parameter
    >>> (by_modulus,) = torch.autograd.grad(buckling.log(), modulus)
    >>> round(1e6 * by_modulus.item(), 3)  # the load is proportional to the modulus, nearly
    1.0
    """

    parameter: Any
    kind: str
    positions: Any = field(repr=False)
    mode: np.ndarray = field(repr=False)
    after_point: int
    _found: Any = field(repr=False)


def critical_point(
    inputs: Inputs, moving: AlongPath, start: Equilibrium | None, before: np.ndarray, found: Any
) -> CriticalPoint:
    """Return one that the core has found, located and connected to the inputs if these have tensors.

    start, before: the equilibrium at which the path starts, and the load parameters there.
    """
    model, kind = inputs.scene._model, found.kind.name
    parameter, positions = found.point.parameter, model.positions(found.point.state)
    of_start = _leaves_of_load(start)
    if inputs.given or of_start:
        parameter, positions = _connected(inputs, moving, of_start, before, found)
    return CriticalPoint(
        parameter=parameter,
        kind=kind,
        positions=positions,
        mode=model.positions(found.mode),
        after_point=found.after_point,
        _found=found,
    )


def _leaves_of_load(start: Equilibrium | None) -> list[Any]:
    """Return those leaves of an equilibrium that are load parameters."""
    if start is None or start._inputs is None:
        return []
    own = start.scene._load_parameter_layout
    return [leaf for leaf in start._inputs.leaves if leaf.owner is None and ("scene", leaf.name) in own]


def _connected(
    inputs: Inputs, moving: AlongPath, of_start: list[Any], before: np.ndarray, found: Any
) -> tuple[Any, Any]:
    """Return the parameter and the positions as tensors."""
    kind, at = found.kind.name, found.point
    parameter, state, refusal, point = at.parameter, at.state, _refusal(inputs, moving, kind), None
    if not refusal:
        point = Located(
            inputs,
            Line(before, inputs.load_parameters),
            kind,
            state,
            at.angle_branches,
            parameter,
            found.mode,
        )
        parameter, state, refusal = point.parameter, point.state, point.problem
    arrays = np.array(parameter), np.ascontiguousarray(inputs.scene._model.positions(state))
    given = [*inputs.given, *(leaf.tensor for leaf in of_start)]
    if not (inputs.leaves or of_start):
        return tuple(like(each, *given).reshape(each.shape) for each in arrays)
    from ..adjoint.autograd import solved

    adjoint = CriticalAdjoint(inputs, point, of_start, refusal)
    return solved(adjoint, arrays, dtype_like(*given), adjoint.tensors)


def _refusal(inputs: Inputs, moving: AlongPath, kind: str) -> str:
    """Return why a critical point has no gradient, or "" if it may have one."""
    if kind == "flutter":
        return "no gradient here: oscillations begin to grow at this point, and only limit points and bifurcations have one"
    if moving.entries:
        return "no gradient here: values of the scene change along the path; load parameters alone may"
    if inputs.scene.rigid_parts:
        return "no gradient here: the scene has rigid bodies or skeletons"
    return ""
