"""Result arrays as tensors of torch's graph. It holds no physics; energy_autograd.py is for energies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from ..._input.tensor_kinds import numbers_of as numbers_outside_transforms
from ..._input.tensor_kinds import why_not
from ...errors import NoGradient

if TYPE_CHECKING:
    from .dynamic import MotionAdjoint
    from .static import Adjoint


class Solved(torch.autograd.Function):
    """Result arrays that were computed from the leaves (tensors), with the adjoint that computes their derivatives."""

    @staticmethod
    def forward(
        adjoint: Adjoint | MotionAdjoint,
        arrays: tuple[np.ndarray, ...],
        dtype: torch.dtype,
        *leaves: torch.Tensor,
    ) -> tuple[torch.Tensor, ...]:
        return tuple(torch.from_numpy(array).to(dtype=dtype) for array in arrays)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        adjoint, arrays, dtype, *leaves = inputs
        # Not by save_for_backward: that raises an error for a leaf changed in place since, whose numbers are not used here.
        ctx.leaves = leaves
        ctx.products = _Products(
            adjoint,
            [dtype for _ in arrays],
            [(tuple(leaf.shape), leaf.dtype, leaf.device) for leaf in leaves],
        )

    @staticmethod
    def backward(ctx: Any, *by_outputs: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        wanted = tuple(ctx.needs_input_grad[3:])
        found = iter(_Transposed.apply(ctx.products.by(wanted), *by_outputs))
        by_leaves = [next(found) if is_wanted else None for is_wanted in wanted]
        if torch.is_grad_enabled():  # create_graph=True
            # Connected to the leaves alone: tangents are the derivatives of gradients by by_outputs, and need no curvature.
            products = ctx.products.by(wanted)
            products.by_outputs = by_outputs
            values = (each.detach() for each in by_outputs)
            zeros = iter(_ZeroWithCurvature.apply(products, len(by_outputs), *values, *ctx.leaves))
            by_leaves = [None if each is None else each + next(zeros) for each in by_leaves]
        return None, None, None, *by_leaves

    @staticmethod
    def jvp(ctx: Any, *tangents: torch.Tensor | None) -> tuple[torch.Tensor, ...]:
        leaves = zip(tangents[3:], ctx.leaves, strict=True)
        along = [torch.zeros_like(leaf) if each is None else each for each, leaf in leaves]
        once = _Once.apply(*(_primal(leaf) for leaf in ctx.leaves))
        return tuple(each + once.to(each) for each in _Tangent.apply(ctx.products, *along))

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[Any, Any]:
        raise ValueError("torch.vmap over the inputs of a solve: loop over designs")


class _Products:
    """The derivatives of results by leaves as products, of arrays with the Jacobian and its transpose.

    outputs: dtype of each result. leaves: (shape, dtype, device) of each leaf. wanted: by which leaves; all by default.
    """

    def __init__(
        self,
        adjoint: Adjoint | MotionAdjoint,
        outputs: list[torch.dtype],
        leaves: list[tuple[Any, ...]],
        wanted: tuple[bool, ...] | None = None,
    ):
        self._adjoint, self._outputs, self._leaves = adjoint, outputs, leaves
        self._wanted = (True,) * len(leaves) if wanted is None else wanted
        self.by_outputs: Sequence[torch.Tensor] = ()  # with their graph

    def by(self, wanted: tuple[bool, ...] | None) -> _Products:
        """Return the derivatives by some of the leaves, or by all."""
        return _Products(self._adjoint, self._outputs, self._leaves, wanted)

    def transposed(self, by_outputs: Sequence[torch.Tensor]) -> list[torch.Tensor]:
        """Return the gradients by the wanted leaves."""
        found = self._adjoint.gradients([numbers_of(each) for each in by_outputs], self._wanted)
        like = zip(found, self._leaves, strict=True)
        return [
            torch.from_numpy(np.array(each)).to(dtype=dtype, device=device)
            for each, (_, dtype, device) in like
            if each is not None
        ]

    def tangent(self, along: Sequence[torch.Tensor]) -> list[torch.Tensor]:
        """Return the tangents of the results."""
        found = self._adjoint.tangents([numbers_of(each) for each in along])
        return [
            torch.from_numpy(each).to(dtype=dtype) for each, dtype in zip(found, self._outputs, strict=True)
        ]

    def zeros(self) -> list[torch.Tensor]:
        """Return zeros in the shapes of the wanted leaves."""
        shapes = zip(self._wanted, self._leaves, strict=True)
        return [
            torch.zeros(shape, dtype=dtype, device=device)
            for is_wanted, (shape, dtype, device) in shapes
            if is_wanted
        ]

    def curvature(
        self, by_outputs: Sequence[torch.Tensor], along: Sequence[torch.Tensor]
    ) -> list[torch.Tensor]:
        """Return the change of the gradients by all leaves along changes of all leaves. Raises NoGradient without one."""
        if not hasattr(self._adjoint, "curvature"):
            raise NoGradient(_SECOND)
        found = self._adjoint.curvature(*([numbers_of(each) for each in of] for of in (by_outputs, along)))
        like = zip(found, self._leaves, strict=True)
        return [torch.from_numpy(each).to(dtype=dtype, device=device) for each, (_, dtype, device) in like]

    def wanted_of(self, all_leaves: Sequence[torch.Tensor]) -> list[torch.Tensor]:
        """Return those of tensors of all leaves that are wanted."""
        return [each for each, is_wanted in zip(all_leaves, self._wanted, strict=True) if is_wanted]

    def all_along(self, given: Sequence[torch.Tensor]) -> list[torch.Tensor]:
        """Return tangents of all leaves from those of the wanted ones; zeros for the others."""
        some = iter(given)
        return [
            next(some) if is_wanted else torch.zeros(shape, dtype=dtype, device=device)
            for is_wanted, (shape, dtype, device) in zip(self._wanted, self._leaves, strict=True)
        ]


class _Transposed(torch.autograd.Function):
    """Products of derivatives by results with the Jacobian of a solve, linear in them; forward and backward."""

    @staticmethod
    def forward(products: _Products, *by_outputs: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return tuple(products.transposed(by_outputs))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        ctx.products, *_ = inputs

    @staticmethod
    def backward(ctx: Any, *motions: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        return None, *_Tangent.apply(ctx.products, *ctx.products.all_along(motions))

    @staticmethod
    def jvp(ctx: Any, *tangents: torch.Tensor | None) -> tuple[torch.Tensor, ...]:
        return _Transposed.apply(ctx.products, *tangents[1:])

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[tuple[torch.Tensor, ...], Any]:
        return looped(_Transposed, info.batch_size, in_dims, inputs)


class _Tangent(torch.autograd.Function):
    """Products of the Jacobian of a solve with tangents of its leaves, linear in them; forward and backward."""

    @staticmethod
    def forward(products: _Products, *along: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return tuple(products.tangent(along))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        ctx.products, *_ = inputs

    @staticmethod
    def backward(ctx: Any, *by_outputs: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        return None, *_Transposed.apply(ctx.products.by(None), *by_outputs)

    @staticmethod
    def jvp(ctx: Any, *tangents: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return _Tangent.apply(ctx.products, *tangents[1:])

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[tuple[torch.Tensor, ...], Any]:
        return looped(_Tangent, info.batch_size, in_dims, inputs)


def looped(
    function: Any, count: int, in_dims: tuple[Any, ...], inputs: tuple[Any, ...]
) -> tuple[tuple[torch.Tensor, ...], tuple[int, ...]]:
    """Apply a function to each member of a batch, and stack the results."""
    found = [
        function.apply(
            *(
                each.select(dim, member) if isinstance(dim, int) else each
                for each, dim in zip(inputs, in_dims, strict=True)
            )
        )
        for member in range(count)
    ]
    stacked = tuple(torch.stack(each) for each in zip(*found, strict=True))
    return stacked, (0,) * len(stacked)


class _ZeroWithCurvature(torch.autograd.Function):
    """Zeros added to gradients by the wanted leaves, with the derivatives that these gradients have by all leaves.

    Gradients are linear in the derivatives by the results, and are differentiable by these otherwise. count: of results.
    """

    @staticmethod
    def forward(products: _Products, count: int, *tensors: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return tuple(products.zeros())

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        ctx.products, ctx.count, *tensors = inputs
        ctx.leaves = tensors[ctx.count :]
        ctx.save_for_backward(*tensors[: ctx.count])
        ctx.save_for_forward(*tensors[: ctx.count])

    @staticmethod
    def backward(ctx: Any, *motions: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        along = ctx.products.all_along(motions)
        # With their graph where they are the same, so that third derivatives raise NoGradient by them, too.
        pairs = zip(ctx.products.by_outputs, ctx.saved_tensors, strict=True)
        by_outputs = [value if is_transformed(live) else live for live, value in pairs]
        found = _Curvature.apply(ctx.products, ctx.count, *by_outputs, *ctx.leaves, *along)
        return (None, None, *(None for _ in range(ctx.count)), *found)

    @staticmethod
    def jvp(ctx: Any, *tangents: torch.Tensor | None) -> tuple[torch.Tensor, ...]:
        leaves = zip(tangents[2 + ctx.count :], ctx.leaves, strict=True)
        along = [torch.zeros_like(_primal(leaf)) if each is None else each for each, leaf in leaves]
        given = map(_primal, (*ctx.saved_tensors, *ctx.leaves))
        found = _Curvature.apply(ctx.products, ctx.count, *given, *along)
        return tuple(ctx.products.wanted_of(found))

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[tuple[torch.Tensor, ...], Any]:
        return looped(_ZeroWithCurvature, info.batch_size, in_dims, inputs)


class _Curvature(torch.autograd.Function):
    """The changes of gradients by all leaves along changes of all leaves, at fixed derivatives by the results."""

    @staticmethod
    def forward(products: _Products, count: int, *tensors: torch.Tensor) -> tuple[torch.Tensor, ...]:
        along = tensors[
            (count + len(tensors)) // 2 :
        ]  # after the leaves, which only connect the result to themselves
        return tuple(products.curvature(tensors[:count], along))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        pass

    @staticmethod
    def backward(ctx: Any, *_: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        raise NoGradient(_THIRD_OF_SOLVES)

    @staticmethod
    def jvp(ctx: Any, *_: torch.Tensor) -> tuple[torch.Tensor, ...]:
        raise NoGradient(_THIRD_OF_SOLVES)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[tuple[torch.Tensor, ...], Any]:
        return looped(_Curvature, info.batch_size, in_dims, inputs)


_THIRD_OF_SOLVES = "no third derivatives of a solve: take differences of the second ones"


class _Once(torch.autograd.Function):
    """A zero connected to the leaves, added to tangents, so that their derivatives by the leaves raise NoGradient.

    Tangents are linear in those of the leaves, and are differentiable by these. They depend on the leaves as well, in a way
    that has no derivative here.
    """

    @staticmethod
    def forward(*leaves: torch.Tensor) -> torch.Tensor:
        return torch.zeros((), dtype=torch.float64)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[torch.Tensor, ...], output: torch.Tensor) -> None:
        pass

    @staticmethod
    def backward(ctx: Any, *_: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        raise NoGradient(_SECOND)

    @staticmethod
    def jvp(ctx: Any, *_: torch.Tensor) -> torch.Tensor:
        raise NoGradient(_SECOND)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *leaves: torch.Tensor) -> tuple[torch.Tensor, None]:
        return torch.zeros((), dtype=torch.float64), None


class _Notes:
    """The tangents of leaves as arrays; none until they are noted."""

    numbers: Sequence[np.ndarray] = ()


class _Asked(torch.autograd.Function):
    """A zero connected to leaves: forward mode asks for its tangent with those of the leaves, which _Noted notes."""

    @staticmethod
    def forward(noted: _Notes, *leaves: torch.Tensor) -> torch.Tensor:
        return torch.zeros((), dtype=torch.float64)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
        ctx.noted, *ctx.leaves = inputs

    @staticmethod
    def jvp(ctx: Any, _: None, *tangents: torch.Tensor | None) -> torch.Tensor:
        pairs = zip(tangents, ctx.leaves, strict=True)
        along = [torch.zeros_like(_primal(leaf)) if each is None else each for each, leaf in pairs]
        return _Noted.apply(ctx.noted, *along)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[torch.Tensor, None]:
        return torch.zeros((), dtype=torch.float64), None


class _Noted(torch.autograd.Function):
    """A zero that notes the numbers of tensors, except inside torch.func.vmap."""

    @staticmethod
    def forward(noted: _Notes, *tensors: torch.Tensor) -> torch.Tensor:
        noted.numbers = [numbers_of(each) for each in tensors]
        return torch.zeros((), dtype=torch.float64)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
        pass

    @staticmethod
    def jvp(ctx: Any, *_: torch.Tensor | None) -> torch.Tensor:
        return torch.zeros((), dtype=torch.float64)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], *inputs: Any) -> tuple[torch.Tensor, None]:
        return torch.zeros((), dtype=torch.float64), None


def tangents_of(leaves: Sequence[torch.Tensor]) -> Sequence[np.ndarray] | None:
    """Return the tangents of leaves for which forward mode asks now; None if it does not, or they are no plain numbers."""
    noted = _Notes()
    _Asked.apply(noted, *leaves)
    return noted.numbers if any(map(np.any, noted.numbers)) else None


_SECOND = (
    "no second derivatives of this solve, in this order: equilibria have those of gradients (create_graph=True, "
    "torch.func.hessian), other solves and tangents have none. Take differences of gradients: "
    "H v = (g(x + h v) - g(x - h v)) / 2h."
)


class _Mapped(torch.autograd.Function):
    """Results of a solve inside torch.func.vmap: the members of the map become one batch of solves.

    solves: has `solve(tensors) -> results`, of tensors with a leading axis, and afterwards `gradients(by_results)`.
    """

    @staticmethod
    def forward(solves: Any, *tensors: torch.Tensor) -> tuple[torch.Tensor, ...]:
        raise NoGradient("no batch of solves here: none of the values is inside torch.func.vmap")

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        ctx.solves, *ctx.tensors = inputs

    @staticmethod
    def backward(ctx: Any, *by_results: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        return None, *_MappedTransposed.apply(ctx.solves, len(by_results), *by_results, *ctx.tensors)

    @staticmethod
    def jvp(ctx: Any, *tangents: torch.Tensor | None) -> tuple[torch.Tensor, ...]:
        raise NoGradient(
            "no tangents inside torch.func.vmap: batch=k has them, by torch.func.jvp around the solve"
        )

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], solves: Any, *tensors: torch.Tensor) -> tuple[Any, Any]:
        if any(map(is_batched, tensors)):
            raise ValueError(
                "torch.vmap inside of torch.vmap: reshape both axes to one, map once, and reshape the results"
            )
        found = solves.solve(_in_front(info.batch_size, in_dims[1:], tensors))
        return found, (0,) * len(found)


class _MappedTransposed(torch.autograd.Function):
    """Gradients by the values of solves inside torch.func.vmap. The tensors say which map it is."""

    @staticmethod
    def forward(solves: Any, count: int, *given: torch.Tensor) -> tuple[torch.Tensor, ...]:
        raise NoGradient("no gradient here: none of the values is inside torch.func.vmap")

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        pass

    @staticmethod
    def backward(ctx: Any, *_: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        raise NoGradient(_SECOND)

    @staticmethod
    def vmap(
        info: Any, in_dims: tuple[Any, ...], solves: Any, count: int, *given: torch.Tensor
    ) -> tuple[Any, Any]:
        given = _in_front(info.batch_size, in_dims[2:], given)
        found = solves.gradients([numbers_of(each) for each in given[:count]])
        parts = zip(found, given[count:], strict=True)
        by_tensors = tuple(torch.from_numpy(np.array(each)).to(like) for each, like in parts)
        return by_tensors, (0,) * len(by_tensors)


def _in_front(count: int, in_dims: tuple[Any, ...], tensors: Sequence[torch.Tensor]) -> list[torch.Tensor]:
    """Return tensors with the axis of a map in front; one that has none is repeated."""
    return [
        each.expand(count, *each.shape) if dim is None else each.movedim(dim, 0)
        for each, dim in zip(tensors, in_dims, strict=True)
    ]


def mapped(solves: Any, tensors: Sequence[torch.Tensor]) -> tuple[torch.Tensor, ...]:
    """Return the results of solves whose values, or some of them, are inside torch.func.vmap."""
    return _Mapped.apply(solves, *tensors)


def is_followed_in_map(tensor: torch.Tensor) -> bool:
    """Return whether a transform inside of torch.func.vmap, such as torch.func.grad, follows a tensor."""
    functorch = torch._C._functorch
    while _is_wrapped(tensor) and not functorch.is_batchedtensor(tensor):
        if functorch.is_gradtrackingtensor(tensor):
            return True
        tensor = functorch.get_unwrapped(tensor)
    return False


class _LinearMap(torch.autograd.Function):
    """A linear map of a tensor, computed on arrays."""

    @staticmethod
    def forward(ctx: Any, apply: Callable[..., Any], transposed: Callable[..., Any], given: torch.Tensor):
        ctx.maps = apply, transposed
        return torch.from_numpy(apply(given.detach().cpu().numpy())).to(given)

    @staticmethod
    def backward(ctx: Any, by_image: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        apply, transposed = ctx.maps
        return None, None, _LinearMap.apply(transposed, apply, by_image)


def linear_map(
    apply: Callable[[np.ndarray], np.ndarray],
    transposed: Callable[[np.ndarray], np.ndarray],
    given: torch.Tensor,
) -> torch.Tensor:
    """Return a linear function of a tensor that is computed on arrays; `transposed` is its transpose."""
    return _LinearMap.apply(apply, transposed, given)


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


def chained(
    leaves: Sequence[torch.Tensor], tensors: Sequence[torch.Tensor], by_leaves: Sequence[np.ndarray | None]
) -> list[np.ndarray | None]:
    """Return gradients by tensors from those by leaves that were computed from them; None where there is no connection."""
    given = [
        (leaf, torch.from_numpy(np.array(each)).to(leaf))
        for leaf, each in zip(leaves, by_leaves, strict=True)
        if each is not None
    ]
    if not given:
        return [None for _ in tensors]
    found = products([leaf for leaf, _ in given], tensors, [each for _, each in given])
    return [None if each is None else numbers_of(each) for each in found]


def numbers_of(by_output: torch.Tensor) -> np.ndarray:
    """Return a derivative by a result as an array. Raises NoGradient inside transforms that cannot be served."""
    if why := why_not(by_output):
        raise NoGradient(f"no gradient here: the one by a result {why}")
    return numbers_outside_transforms(by_output).astype(np.float64, copy=False)


def solved(
    adjoint: Adjoint | MotionAdjoint, arrays: tuple[np.ndarray, ...], dtype: torch.dtype, leaves: list[Any]
) -> tuple[torch.Tensor, ...]:
    """Return the arrays as tensors that are connected to the leaves by the adjoint."""
    return Solved.apply(adjoint, arrays, dtype, *leaves)


class _Refused(torch.autograd.Function):
    """Numbers in the graph of a tensor by which they have no gradient: its own, if there are no others."""

    @staticmethod
    def forward(tensor: torch.Tensor, numbers: np.ndarray | None, why: str) -> torch.Tensor:
        return tensor.clone() if numbers is None else torch.from_numpy(numbers).to(tensor)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
        ctx.why = inputs[2]

    @staticmethod
    def backward(ctx: Any, *by_outputs: torch.Tensor) -> None:
        raise NoGradient(ctx.why)

    @staticmethod
    def jvp(ctx: Any, *tangents: torch.Tensor) -> None:
        raise NoGradient(ctx.why)


def refused(tensor: torch.Tensor, name: str, why: str) -> torch.Tensor:
    """Return the numbers of a tensor; NoGradient says why there is no gradient by it where one is asked for."""
    return _Refused.apply(tensor, None, f"no gradient by {name}: {why}")


def numbers_refusing(numbers: np.ndarray, source: torch.Tensor, why: str) -> torch.Tensor:
    """Return numbers as a tensor in the graph of another one, the source: a gradient by it raises NoGradient(why)."""
    return _Refused.apply(source, np.array(numbers, dtype=np.float64), why)


def is_transformed(tensor: torch.Tensor) -> bool:
    """Return whether a tensor is wrapped by torch.func or has a tangent of forward-mode differentiation."""
    return _is_wrapped(tensor) or _has_tangent(tensor)


def within_transform() -> bool:
    """Return whether a transform of torch.func is at work."""
    try:
        return torch._C._functorch.peek_interpreter_stack() is not None
    except AttributeError:  # a torch without this function
        return False


def is_batched(tensor: torch.Tensor) -> bool:
    """Return whether a tensor stands for several, one for each member of a batch of torch.vmap."""
    while _is_wrapped(tensor):
        functorch = torch._C._functorch
        if functorch.is_batchedtensor(tensor) or functorch.is_legacy_batchedtensor(tensor):
            return True
        tensor = functorch.get_unwrapped(tensor)
    return False


def outside_transforms(tensor: torch.Tensor, function: Callable[[torch.Tensor], Any]) -> Any:
    """Return a function of a tensor without its wrappers of torch.func and its tangent; it must not be batched."""
    from torch._functorch.pyfunctorch import temporarily_clear_interpreter_stack

    while _is_wrapped(tensor):
        tensor = torch._C._functorch.get_unwrapped(tensor)
    with temporarily_clear_interpreter_stack():
        return function(_primal(tensor))


def _primal(tensor: torch.Tensor) -> torch.Tensor:
    return torch.autograd.forward_ad.unpack_dual(tensor).primal if _has_tangent(tensor) else tensor


def _has_tangent(tensor: torch.Tensor) -> bool:
    return torch.autograd.forward_ad.unpack_dual(tensor).tangent is not None


def _is_wrapped(tensor: torch.Tensor) -> bool:
    try:
        functorch = torch._C._functorch
        return functorch.is_functorch_wrapped_tensor(tensor) or functorch.is_legacy_batchedtensor(tensor)
    except AttributeError:  # a torch without these functions raises its own error later
        return False
