"""Equilibria in torch's graph. The only module that touches torch.autograd; holds no physics."""

from __future__ import annotations

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from ._adjoint import Adjoint


class AtRest(torch.autograd.Function):
    """Positions and edge rotations of an equilibrium that was found from the leaves (tensors)."""

    @staticmethod
    def forward(ctx, adjoint: Adjoint, positions: np.ndarray, edge_rotations: np.ndarray, dtype, *leaves):
        ctx.adjoint = adjoint
        ctx.leaves = [(leaf.dtype, leaf.device) for leaf in leaves]
        return torch.from_numpy(positions).to(dtype=dtype), torch.from_numpy(edge_rotations).to(dtype=dtype)

    @staticmethod
    @once_differentiable
    def backward(ctx, by_positions, by_edge_rotations):
        arrays = [each.detach().cpu().numpy() for each in (by_positions, by_edge_rotations)]
        gradients = ctx.adjoint.gradients(*arrays, ctx.needs_input_grad[4:])
        return None, None, None, None, *(
            None if values is None else torch.from_numpy(np.array(values)).to(dtype=dtype, device=device)
            for values, (dtype, device) in zip(gradients, ctx.leaves, strict=True)
        )


def at_rest(adjoint: Adjoint, positions: np.ndarray, edge_rotations: np.ndarray, dtype, leaves: list):
    """The two as tensors from which gradients go back to the leaves."""
    return AtRest.apply(adjoint, positions, edge_rotations, dtype, *leaves)
