"""What a solve found, in torch's graph. The only module that touches torch.autograd; holds no physics."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from ..._input.tensor_kinds import why_not
from ...errors import NoGradient

if TYPE_CHECKING:
    from .dynamic import MotionAdjoint
    from .static import Adjoint


class Solved(torch.autograd.Function):
    """Arrays that were computed from the leaves (tensors); the adjoint knows the way back, once."""

    @staticmethod
    def forward(
        ctx: Any,
        adjoint: Adjoint | MotionAdjoint,
        arrays: tuple[np.ndarray, ...],
        dtype: torch.dtype,
        *leaves: torch.Tensor,
    ) -> tuple[torch.Tensor, ...]:
        ctx.adjoint = adjoint
        # Not by save_for_backward: a design that was changed in place since is no error, its numbers are not used.
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
    """Gradients as they are, with what they depend on; theirs in turn raise NoGradient.

    Connected to the leaves, not only to what came back to the solve: a loss linear in the positions sends a constant,
    and torch would take gradients without a graph for constants, whose derivatives are zero.
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


def depends_on(tensor: torch.Tensor, other: torch.Tensor) -> bool:
    """Whether torch knows a way from one to the other."""
    if not tensor.requires_grad:
        return False
    return torch.autograd.grad(tensor.sum(), other, retain_graph=True, allow_unused=True)[0] is not None


def _numbers(by_output) -> np.ndarray:
    if why := why_not(by_output):
        raise NoGradient(f"no gradient here: the one by a result {why}")
    return by_output.detach().cpu().double().numpy()


def solved(
    adjoint: Adjoint | MotionAdjoint, arrays: tuple[np.ndarray, ...], dtype: torch.dtype, leaves: list[Any]
) -> tuple[torch.Tensor, ...]:
    """The arrays as tensors from which gradients go back to the leaves."""
    return Solved.apply(adjoint, arrays, dtype, *leaves)


def is_transformed(tensor: torch.Tensor) -> bool:
    """Whether torch.func has wrapped it, or it carries a tangent of forward-mode differentiation."""
    try:
        functorch = torch._C._functorch
        wrapped = functorch.is_functorch_wrapped_tensor(tensor) or functorch.is_legacy_batchedtensor(tensor)
    except AttributeError:  # another torch: its own error says it
        wrapped = False
    return wrapped or torch.autograd.forward_ad.unpack_dual(tensor).tangent is not None
