"""Result arrays as tensors of torch's graph. The only module that uses torch.autograd; it holds no physics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from ..._input.tensor_kinds import why_not
from ...errors import NoGradient

if TYPE_CHECKING:
    from .dynamic import MotionAdjoint
    from .energy import EnergyAdjoint
    from .static import Adjoint


class Solved(torch.autograd.Function):
    """Result arrays that were computed from the leaves (tensors), with the adjoint that computes their gradients."""

    @staticmethod
    def forward(
        ctx: Any,
        adjoint: Adjoint | MotionAdjoint,
        arrays: tuple[np.ndarray, ...],
        dtype: torch.dtype,
        *leaves: torch.Tensor,
    ) -> tuple[torch.Tensor, ...]:
        ctx.adjoint = adjoint
        # Not by save_for_backward: that raises an error for a leaf changed in place since, whose numbers are not used here.
        ctx.leaves = leaves
        return tuple(torch.from_numpy(array).to(dtype=dtype) for array in arrays)

    @staticmethod
    def backward(ctx: Any, *by_outputs: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        arrays = [_numbers(each) for each in by_outputs]
        gradients = ctx.adjoint.gradients(arrays, ctx.needs_input_grad[3:])
        by_leaves = [
            None if values is None else torch.from_numpy(np.array(values)).to(leaf)
            for values, leaf in zip(gradients, ctx.leaves, strict=True)
        ]
        if torch.is_grad_enabled():  # create_graph=True
            given = [each for each in by_leaves if each is not None]
            marked = iter(Once.apply(len(given), *given, *ctx.leaves, *by_outputs))
            by_leaves = [None if each is None else next(marked) for each in by_leaves]
        return None, None, None, *by_leaves


class Once(torch.autograd.Function):
    """Gradients connected to the tensors that they depend on, so that second derivatives raise NoGradient.

    They are connected to the leaves as well as to the derivatives by the results: those of a loss linear in the positions
    are constant, and torch would take gradients without a graph for constants, with zero derivatives.
    """

    @staticmethod
    def forward(ctx: Any, count: int, *given: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return given[:count]

    @staticmethod
    def backward(ctx: Any, *_: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        raise NoGradient(
            "no second derivatives: a solve's gradient is exact, but it has none itself (create_graph=True, "
            "torch.autograd.functional.hessian). Take differences of gradients: H v = (g(x + h v) - g(x - h v)) / 2h."
        )


class _Energies(torch.autograd.Function):
    """The energies of a scene at given positions, (n,) J, of the leaves: positions, edge rotations and values."""

    @staticmethod
    def forward(
        ctx: Any, adjoint: EnergyAdjoint, energies: np.ndarray, dtype: torch.dtype, *leaves: torch.Tensor
    ) -> torch.Tensor:
        ctx.adjoint, ctx.leaves, ctx.dtype = adjoint, leaves, dtype
        return torch.from_numpy(energies).to(dtype=dtype)

    @staticmethod
    def backward(ctx: Any, by_energies: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        found = ctx.adjoint.gradients(_numbers(by_energies), ctx.needs_input_grad[3:])
        by_leaves = _like_leaves(found, ctx.leaves)
        if torch.is_grad_enabled():  # create_graph=True
            slopes = _Slopes.apply(ctx.adjoint, ctx.dtype, by_energies[0], *ctx.leaves)
            by_unknowns = dict(zip(("positions", "edge_rotations"), slopes, strict=True))
            given = [each for each in by_leaves if each is not None]
            marked = iter(_NoFurther.apply(_BY_VALUES, len(given), *given, *ctx.leaves, by_energies))
            by_leaves = [None if each is None else next(marked) for each in by_leaves]
            for k, leaf in enumerate(ctx.adjoint.inputs.leaves):
                if by_leaves[k] is not None and leaf.owner is None and leaf.name in by_unknowns:
                    by_leaves[k] = by_unknowns[leaf.name].to(ctx.leaves[k])
        return None, None, None, *by_leaves


class _Slopes(torch.autograd.Function):
    """A weight times the gradient of the sum of all energies by positions and by edge rotations, of the leaves."""

    @staticmethod
    def forward(
        ctx: Any, adjoint: EnergyAdjoint, dtype: torch.dtype, weight: torch.Tensor, *leaves: torch.Tensor
    ) -> tuple[torch.Tensor, ...]:
        ctx.adjoint, ctx.weight, ctx.leaves = adjoint, weight, leaves
        return tuple(torch.from_numpy(float(weight) * each).to(dtype=dtype) for each in adjoint.by_unknowns)

    @staticmethod
    def backward(ctx: Any, *motion: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        arrays = [_numbers(each) for each in motion]
        by_weight, found = ctx.adjoint.mixed(float(ctx.weight), *arrays, ctx.needs_input_grad[3:])
        by_inputs = [torch.tensor(by_weight).to(ctx.weight), *_like_leaves(found, ctx.leaves)]
        if torch.is_grad_enabled():
            given = [each for each in by_inputs if each is not None]
            others = (ctx.weight, *ctx.leaves, *motion)
            marked = iter(_NoFurther.apply(_THIRD, len(given), *given, *others))
            by_inputs = [None if each is None else next(marked) for each in by_inputs]
        return None, None, *by_inputs


_THIRD = (
    "no third derivatives of energies: there are gradients and Hessians. Take differences of the second ones."
)
_BY_VALUES = (
    "no second derivatives of energies that begin with a gradient by values: there is none by a value twice. Those of "
    "a position and a value: differentiate by the positions first (ms.forces), then by the value."
)


class _NoFurther(torch.autograd.Function):
    """Gradients connected to the tensors that they depend on, so that their derivatives raise NoGradient, with a reason."""

    @staticmethod
    def forward(ctx: Any, reason: str, count: int, *given: torch.Tensor) -> tuple[torch.Tensor, ...]:
        ctx.reason = reason
        return tuple(each.clone() for each in given[:count])

    @staticmethod
    def backward(ctx: Any, *_: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        raise NoGradient(ctx.reason)


def _like_leaves(found, leaves) -> list[torch.Tensor | None]:
    return [
        None if values is None else torch.from_numpy(np.array(values)).to(leaf)
        for values, leaf in zip(found, leaves, strict=True)
    ]


def energies_of(
    adjoint: EnergyAdjoint, energies: np.ndarray, dtype: torch.dtype, leaves: list[Any]
) -> torch.Tensor:
    """Return energies (n,) as a tensor that is connected to the leaves by their derivatives."""
    return _Energies.apply(adjoint, energies, dtype, *leaves)


def slopes_of(
    adjoint: EnergyAdjoint, dtype: torch.dtype, leaves: list[Any]
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the gradient of the sum by positions and by edge rotations, as tensors connected to the leaves."""
    return _Slopes.apply(adjoint, dtype, torch.ones((), dtype=torch.float64), *leaves)


def depends_on(tensor: torch.Tensor, other: torch.Tensor) -> bool:
    """Return whether torch can differentiate one tensor by another."""
    if not tensor.requires_grad:
        return False
    return torch.autograd.grad(tensor.sum(), other, retain_graph=True, allow_unused=True)[0] is not None


def products(
    outputs: Sequence[torch.Tensor],
    inputs: Sequence[torch.Tensor],
    weights: Sequence[torch.Tensor],
    differentiable: bool = False,
) -> tuple[torch.Tensor | None, ...]:
    """Return the products of weights of the outputs with their Jacobian, one for each input; None where there is none.

    differentiable: whether the products are connected to the weights.
    """
    return torch.autograd.grad(
        outputs, inputs, weights, retain_graph=True, create_graph=differentiable, allow_unused=True
    )


def _numbers(by_output) -> np.ndarray:
    if why := why_not(by_output):
        raise NoGradient(f"no gradient here: the one by a result {why}")
    return by_output.detach().cpu().double().numpy()


def solved(
    adjoint: Adjoint | MotionAdjoint, arrays: tuple[np.ndarray, ...], dtype: torch.dtype, leaves: list[Any]
) -> tuple[torch.Tensor, ...]:
    """Return the arrays as tensors that are connected to the leaves by the adjoint."""
    return Solved.apply(adjoint, arrays, dtype, *leaves)


def is_transformed(tensor: torch.Tensor) -> bool:
    """Return whether a tensor is wrapped by torch.func or has a tangent of forward-mode differentiation."""
    try:
        functorch = torch._C._functorch
        wrapped = functorch.is_functorch_wrapped_tensor(tensor) or functorch.is_legacy_batchedtensor(tensor)
    except AttributeError:  # a torch without these functions raises its own error later
        wrapped = False
    return wrapped or torch.autograd.forward_ad.unpack_dual(tensor).tangent is not None
