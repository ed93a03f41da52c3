"""Energies at given positions as tensors of torch's graph, with their derivatives. It holds no physics."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from ...errors import NoGradient
from .autograd import looped, numbers_of
from .curvature import moved_inputs, rows_of
from .differences import directional_derivative
from .energy import POSITIONAL, EnergyAdjoint
from .tangent import steps_along

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Leaf


_THIRD = (
    "no third derivatives of energies: there are gradients and Hessians. Take differences of the second ones."
)
_FORWARD = (
    "no tangents of energies and forces: torch.func.grad, vjp and jacrev have their derivatives, and jacrev of jacrev or "
    "ms.hessian the second ones"
)
# Fractions (1) of the first step that are tried. Tested by test_second_derivatives_by_values_agree_with_differences.
_SHORTER = (1.0, 0.1, 1e-2)
# The error (1) of derivatives with respect to values, over their largest entry: they are differences themselves. Tested
# by the same.
_OF_DIFFERENCES = 1e-11


class _Energies(torch.autograd.Function):
    """The energies of a scene at given positions, (n,) J, of the leaves: positions, edge rotations and values."""

    @staticmethod
    def forward(
        adjoint: EnergyAdjoint, energies: np.ndarray, dtype: torch.dtype, *leaves: torch.Tensor
    ) -> torch.Tensor:
        return torch.from_numpy(energies).to(dtype=dtype)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
        ctx.adjoint, _, ctx.dtype, *leaves = inputs
        ctx.leaves = leaves

    @staticmethod
    def backward(ctx: Any, by_energies: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        wanted = ctx.needs_input_grad[3:]
        by_leaves = _on_arrays(
            lambda weights: _like_leaves(ctx.adjoint.gradients(weights, wanted), ctx.leaves),
            wanted,
            by_energies,
        )
        if torch.is_grad_enabled():  # create_graph=True
            positional = [is_positional(leaf) for leaf in ctx.adjoint.inputs.leaves]
            asked = [each is not None for each in by_leaves]
            if any(is_asked and at for is_asked, at in zip(asked, positional, strict=True)):
                gradients = _WeightedGradient.apply(ctx.adjoint, ctx.dtype, by_energies, *ctx.leaves)
                for k, leaf in enumerate(ctx.adjoint.inputs.leaves):
                    if asked[k] and positional[k]:
                        by_leaves[k] = gradients[POSITIONAL.index(leaf.name)].to(ctx.leaves[k])
            chosen = [k for k, at in enumerate(positional) if asked[k] and not at]
            if chosen:
                given = [by_leaves[k] for k in chosen]
                connected = _GradientByValues.apply(ctx.adjoint, chosen, by_energies, *given, *ctx.leaves)
                for k, each in zip(chosen, connected, strict=True):
                    by_leaves[k] = each
        return None, None, None, *by_leaves

    @staticmethod
    def jvp(ctx: Any, *_: torch.Tensor | None) -> torch.Tensor:
        raise NoGradient(_FORWARD)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[torch.Tensor, Any]:
        raise NoGradient(_FORWARD)  # positions inside a map are refused, so this is torch.func.jacfwd


class _OnArrays(torch.autograd.Function):
    """A function of tensors that is computed on arrays and not differentiated further, also inside torch.func."""

    @staticmethod
    def forward(
        compute: Callable[..., list[torch.Tensor]], *tensors: torch.Tensor
    ) -> tuple[torch.Tensor, ...]:
        return tuple(compute(*map(numbers_of, tensors)))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        pass

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[tuple[torch.Tensor, ...], Any]:
        return looped(_OnArrays, info.batch_size, in_dims, inputs)


def _on_arrays(
    compute: Callable[..., list[torch.Tensor | None]], asked: Sequence[bool], *tensors: torch.Tensor
) -> list[torch.Tensor | None]:
    """Return what `compute` makes of the numbers of tensors; asked: where it is not None."""
    found = iter(
        _OnArrays.apply(
            lambda *arrays: [each for each in compute(*arrays) if each is not None],
            *(each.detach() for each in tensors),
        )
    )
    return [next(found) if is_asked else None for is_asked in asked]


class _GradientByValues(torch.autograd.Function):
    """Computed gradients of weighted energies with respect to some leaves that are values, connected to all leaves."""

    @staticmethod
    def forward(
        adjoint: EnergyAdjoint, chosen: list[int], weights: torch.Tensor, *tensors: torch.Tensor
    ) -> tuple[torch.Tensor, ...]:
        return tuple(each.clone() for each in tensors[: len(chosen)])

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        ctx.adjoint, ctx.chosen, ctx.weights, *tensors = inputs
        ctx.leaves = tensors[len(ctx.chosen) :]

    @staticmethod
    def backward(ctx: Any, *motion: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        wanted = ctx.needs_input_grad[3 + len(ctx.chosen) :]

        def rates(weights: np.ndarray, *changes: np.ndarray) -> list[torch.Tensor | None]:
            along: list[np.ndarray | None] = [None] * len(ctx.leaves)
            for k, each in zip(ctx.chosen, changes, strict=True):
                along[k] = each
            by_weights, found = rates_along_values(ctx.adjoint, weights, along, wanted)
            return _like_leaves([by_weights, *found], [ctx.weights, *ctx.leaves])

        by_inputs = _on_arrays(rates, [True, *wanted], ctx.weights, *motion)
        if torch.is_grad_enabled():
            given = [each for each in by_inputs if each is not None]
            marked = iter(_NoFurther.apply(_THIRD, len(given), *given, ctx.weights, *ctx.leaves, *motion))
            by_inputs = [None if each is None else next(marked) for each in by_inputs]
        by_weights, *by_leaves = by_inputs
        return None, None, by_weights, *(None for _ in ctx.chosen), *by_leaves

    @staticmethod
    def jvp(ctx: Any, *_: torch.Tensor | None) -> tuple[torch.Tensor, ...]:
        raise NoGradient(_FORWARD)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[tuple[torch.Tensor, ...], Any]:
        return looped(_GradientByValues, info.batch_size, in_dims, inputs)


class _WeightedGradient(torch.autograd.Function):
    """The gradient of the weighted sum of all energies with respect to positions and edge rotations, as a function of
    weights and leaves.
    """

    @staticmethod
    def forward(
        adjoint: EnergyAdjoint, dtype: torch.dtype, weights: torch.Tensor, *leaves: torch.Tensor
    ) -> tuple[torch.Tensor, ...]:
        return tuple(
            torch.from_numpy(each).to(dtype=dtype) for each in adjoint.weighted_gradient(numbers_of(weights))
        )

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        ctx.adjoint, _, ctx.weights, *leaves = inputs
        ctx.leaves = leaves

    @staticmethod
    def backward(ctx: Any, *motion: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        is_asked, *wanted = ctx.needs_input_grad[2:]

        def mixed(weights: np.ndarray, *arrays: np.ndarray) -> list[torch.Tensor | None]:
            by_weights, found = ctx.adjoint.mixed(weights, *arrays, is_asked, wanted)
            return _like_leaves([by_weights, *found], [ctx.weights, *ctx.leaves])

        by_inputs = _on_arrays(mixed, [is_asked, *wanted], ctx.weights, *motion)
        if torch.is_grad_enabled():
            given = [each for each in by_inputs if each is not None]
            others = (ctx.weights, *ctx.leaves, *motion)
            marked = iter(_NoFurther.apply(_THIRD, len(given), *given, *others))
            by_inputs = [None if each is None else next(marked) for each in by_inputs]
        return None, None, *by_inputs

    @staticmethod
    def jvp(ctx: Any, *_: torch.Tensor | None) -> tuple[torch.Tensor, ...]:
        raise NoGradient(_FORWARD)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[tuple[torch.Tensor, ...], Any]:
        return looped(_WeightedGradient, info.batch_size, in_dims, inputs)


class _NoFurther(torch.autograd.Function):
    """Gradients connected to the tensors that they depend on, so that their derivatives raise NoGradient, with a reason."""

    @staticmethod
    def forward(reason: str, count: int, *given: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return tuple(each.clone() for each in given[:count])

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        ctx.reason = inputs[0]

    @staticmethod
    def backward(ctx: Any, *_: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        raise NoGradient(ctx.reason)

    @staticmethod
    def jvp(ctx: Any, *_: torch.Tensor | None) -> tuple[torch.Tensor, ...]:
        raise NoGradient(ctx.reason)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[tuple[torch.Tensor, ...], Any]:
        return looped(_NoFurther, info.batch_size, in_dims, inputs)


def _like_leaves(found, leaves) -> list[torch.Tensor | None]:
    return [
        None if values is None else torch.from_numpy(np.array(values)).to(leaf.device, leaf.dtype)
        for values, leaf in zip(found, leaves, strict=True)
    ]


def energies_of(
    adjoint: EnergyAdjoint, energies: np.ndarray, dtype: torch.dtype, leaves: list[Any]
) -> torch.Tensor:
    """Return energies (n,) as a tensor that is connected to the leaves by their derivatives."""
    return _Energies.apply(adjoint, energies, dtype, *leaves)


def gradient_of(
    adjoint: EnergyAdjoint, dtype: torch.dtype, leaves: list[Any]
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the gradient of the sum with respect to positions and edge rotations, as tensors connected to the leaves."""
    weights = torch.ones(adjoint.count, dtype=torch.float64)
    return _WeightedGradient.apply(adjoint, dtype, weights, *leaves)


def is_positional(leaf: Leaf) -> bool:
    """Return whether a leaf holds positions or edge rotations."""
    return leaf.owner is None and leaf.name in POSITIONAL


def rates_along_values(
    adjoint: EnergyAdjoint,
    weights: np.ndarray,
    along: Sequence[np.ndarray | None],
    wanted: Sequence[bool],
) -> tuple[np.ndarray, list[np.ndarray | None]]:
    """Compute the derivatives of u . dE/dk by the weights (n,), and by the wanted leaves.

    along: u, one change for each leaf; None for positions. Raises NoGradient where there are none.
    """
    inputs = adjoint.inputs
    values = [leaf for leaf in inputs.leaves if not is_positional(leaf)]
    changes = [
        np.zeros(leaf.shape) if change is None else change
        for leaf, change in zip(inputs.leaves, along, strict=True)
        if not is_positional(leaf)
    ]
    if not any(np.any(each) for each in changes):
        leaves = zip(inputs.leaves, wanted, strict=True)
        return np.zeros_like(weights), [np.zeros(leaf.shape) if asked else None for leaf, asked in leaves]
    base = copy.copy(inputs)
    base.leaves = values

    def at(step: float) -> list[np.ndarray]:
        there = adjoint.with_inputs(moved_inputs(base, [step * each for each in changes]), inputs.leaves)
        with there.inputs.in_core():
            energies = np.array([*there.by_name().values()])
        found = there.gradients(weights, wanted)
        return [energies, *(each.ravel() for each in found if each is not None)]

    steps = [
        steps_along(inputs, leaf, change)
        for leaf, change in zip(values, changes, strict=True)
        if np.any(change)
    ]
    first = min(each[0] for each in steps)
    parts = at(0.0)
    rates = directional_derivative(
        lambda step: rows_of(at(step)), [first * shorter for shorter in _SHORTER], _OF_DIFFERENCES
    )
    if rates is None:
        raise NoGradient("no second derivatives of energies here: they are not smooth in the values")
    found = iter(row[: part.size] for row, part in zip(rates[1:], parts[1:], strict=True))
    by_leaves = [
        next(found).reshape(leaf.shape) if asked else None
        for leaf, asked in zip(inputs.leaves, wanted, strict=True)
    ]
    return rates[0][: weights.size], by_leaves
