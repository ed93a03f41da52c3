"""What a solve found, in torch's graph. The only module that touches torch.autograd; holds no physics."""

from __future__ import annotations

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from ._tensor_kinds import why_not
from .errors import NoGradient


class Solved(torch.autograd.Function):
    """Arrays that were computed from the leaves (tensors); the adjoint knows the way back."""

    @staticmethod
    def forward(ctx, adjoint, arrays, dtype, *leaves):
        ctx.adjoint = adjoint
        ctx.leaves = [(leaf.dtype, leaf.device) for leaf in leaves]
        return tuple(torch.from_numpy(array).to(dtype=dtype) for array in arrays)

    @staticmethod
    @once_differentiable
    def backward(ctx, *by_outputs):
        arrays = [_numbers(each) for each in by_outputs]
        gradients = ctx.adjoint.gradients(arrays, ctx.needs_input_grad[3:])
        by_leaves = (
            None if values is None else torch.from_numpy(np.array(values)).to(dtype=dtype, device=device)
            for values, (dtype, device) in zip(gradients, ctx.leaves, strict=True)
        )
        return None, None, None, *by_leaves


def _numbers(by_output) -> np.ndarray:
    if why := why_not(by_output):
        raise NoGradient(f"no gradient here: the one by a result {why}")
    return by_output.detach().cpu().double().numpy()


def solved(adjoint, arrays: tuple[np.ndarray, ...], dtype, leaves: list) -> tuple[torch.Tensor, ...]:
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
