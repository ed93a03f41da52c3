"""Equilibria as a differentiable function of JAX, by callbacks from compiled code."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from functools import cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .._input.tensors import detached, require_torch
from .._runtime.keywords import as_keywords, check_known
from .._runtime.solve_keywords import keywords_of
from ..model.scene.batch_axis import BatchAxis
from ..model.scene.scene import Scene
from ..solve.options import MixedNewton, Newton
from ..solve.statics.batch import find_along, from_starts
from ..solve.statics.single_solve import Search

if TYPE_CHECKING:
    from types import ModuleType

    from ..solve.adjoint.batch import BatchAdjoint

_KEPT = 4  # solves of which the factorizations are kept; fixed by test_gradients_repeat_no_solve


class JaxEquilibrium(NamedTuple):
    """The equilibrium of a scene as arrays of JAX.

    positions: (n_v, 3) m. edge_rotations: (n_e,) rad, zero where an edge has none.
    """

    positions: Any
    edge_rotations: Any


def equilibrium(
    scene: Scene,
    *,
    values: dict[Any, Any] | None = None,
    require_stable: bool = True,
    ignore_velocity_forces: bool = False,
    solver: Newton | None = None,
    **keywords: Any,
) -> JaxEquilibrium:
    """Find a stable equilibrium as ms.equilibrium does, as a function of JAX.

    scene, values, require_stable, ignore_velocity_forces, solver, and as keywords remanent_magnetization,
    applied_flux_density, load_factor, thickness, ...: as in ms.equilibrium. Those that are arrays of JAX may be traced:
    jax.jit, grad, vjp, jacrev and value_and_grad work, and jax.vmap solves all members at once over threads, as
    ms.equilibrium(..., batch=k) does. Numbers and gradients are those of ms.equilibrium, to the bit.

    The solve runs in a callback on the processor (jax.pure_callback), so nothing of it is compiled. Gradients need torch, by
    whose means magshell computes them. Forward mode (jvp, jacfwd) and second derivatives raise JAX's errors.

    Raises RuntimeError if JAX computes in single precision, TypeError on an unknown keyword, ValueError on bad input. Inside
    of jax.jit, errors of a solve arrive as JAX's own error, with the message.

    >>> import magshell as ms
    >>> import jax  # doctest: +SKIP
    >>> jax.config.update("jax_enable_x64", True)  # doctest: +SKIP
    >>> height = lambda field: ms.jax.equilibrium(scene, applied_flux_density=field).positions[-1, 2]  # doctest: +SKIP
    >>> jax.grad(height)(jax.numpy.array([0.0, 0.0, 2e-3]))  # doctest: +SKIP
    """
    jax = require_jax("ms.jax.equilibrium")
    require_double_precision(jax, "ms.jax.equilibrium")
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
    known = tuple(each.name for each in keywords_of("equilibrium"))
    check_known("jax.equilibrium", keywords, known, {})
    search = Search(MixedNewton() if solver is None else solver, require_stable, None, ignore_velocity_forces)
    arguments = as_keywords(scene, {**keywords, "values": values}, set(known))
    traced = _arrays(jax.Array, arguments)
    solves = _Solves(scene, arguments, tuple(traced), search)
    arrays = [jax.numpy.asarray(each) for each in traced.values()]
    for (_, name), each in zip(traced, arrays, strict=True):
        if not jax.numpy.issubdtype(each.dtype, jax.numpy.floating) and not jax.numpy.issubdtype(
            each.dtype, jax.numpy.integer
        ):
            raise ValueError(f"{name} must hold real numbers, got {each.dtype}")
    doubles = [each.astype(jax.numpy.float64) for each in arrays]
    return JaxEquilibrium(*_function()(solves, *doubles))


def _arrays(kind: type, arguments: dict[str, Any]) -> dict[tuple[Any, str], Any]:
    """Return the arrays of JAX among the values of a solve, {(owner or None, name): array}."""
    found = {(None, name): value for name, value in arguments.items() if isinstance(value, kind)}
    values = arguments.get("values")
    for owner, named in values.items() if isinstance(values, dict) else ():
        if isinstance(named, dict):
            found |= {(owner, name): each for name, each in named.items() if isinstance(each, kind)}
    return found


@cache
def _function() -> Callable[..., Any]:
    """Return the function of (solves, *arrays) that gives positions and edge rotations, with its gradient, to JAX."""
    jax = require_jax("ms.jax")

    def called(solves: _Solves, differentiable: bool, arrays: Any) -> Any:
        ranks = tuple(each.ndim for each in arrays)
        results = partial(solves.results, ranks, differentiable)
        shapes = tuple(jax.ShapeDtypeStruct(each, np.float64) for each in solves.shapes)
        return jax.pure_callback(results, shapes, *arrays, vmap_method="broadcast_all")

    @partial(jax.custom_vjp, nondiff_argnums=(0,))
    def solved(solves: _Solves, *arrays: Any) -> Any:
        return called(solves, False, arrays)

    def forward(solves: _Solves, *arrays: Any) -> tuple[Any, Any]:
        return called(solves, True, arrays), arrays

    def backward(solves: _Solves, arrays: Any, by_results: Any) -> Any:
        gradients = partial(solves.gradients, tuple(each.ndim for each in arrays))
        shapes = tuple(jax.ShapeDtypeStruct(each.shape, np.float64) for each in arrays)
        return jax.pure_callback(gradients, shapes, arrays, by_results, vmap_method="broadcast_all")

    solved.defvjp(forward, backward)
    return solved


class _Solves:
    """Solves of one scene by numbers, and their gradients. Axes in front of the arrays are members of a batch."""

    def __init__(
        self, scene: Scene, arguments: dict[str, Any], names: tuple[tuple[Any, str], ...], search: Search
    ):
        self._scene, self._arguments, self._names, self._search = scene, arguments, names, search
        model = scene._model
        self._rest = model.rest_state()
        self.shapes = ((scene.mesh.n_vertices, 3), model.edge_rotations(self._rest).shape)
        self._kept: OrderedDict[bytes, tuple[BatchAdjoint, int]] = OrderedDict()
        self._lock = threading.Lock()

    def results(self, ndims: tuple[int, ...], differentiable: bool, *arrays: Any) -> tuple[np.ndarray, ...]:
        """Return positions and edge rotations. differentiable: keep the factorizations for `gradients`."""
        numbers, axes = self._members(ndims, arrays)
        positions, edge_rotations, adjoint, n_driving = self._solve(numbers, differentiable)
        if differentiable:
            self._remember(numbers, adjoint, n_driving)
        return tuple(each.reshape((*axes, *each.shape[1:])) for each in (positions, edge_rotations))

    def gradients(self, ndims: tuple[int, ...], arrays: Any, by_results: Any) -> tuple[np.ndarray, ...]:
        """Return the gradients with respect to the arrays; a solve that is not kept any more is repeated."""
        numbers, axes = self._members(ndims, arrays)
        by_positions, by_rotations = (
            np.asarray(each).reshape((-1, *shape))
            for each, shape in zip(by_results, self.shapes, strict=True)
        )
        by_points = np.zeros((len(by_positions), len(self._scene._model.points(self._rest)), 3))
        by_points[:, : by_positions.shape[1]] = by_positions
        if all(
            (each == each[:1]).all() for each in numbers
        ):  # one solve, several gradients, as of jax.jacrev
            one = [each[:1] for each in numbers]
            rows = [
                self._gradients(one, by_points[k : k + 1], by_rotations[k : k + 1])
                for k in range(len(by_points))
            ]
            found = [np.concatenate(each) for each in zip(*rows, strict=True)]
        else:
            found = self._gradients(numbers, by_points, by_rotations)
        return tuple(
            each.reshape((*axes, *like.shape[1:])) for each, like in zip(found, numbers, strict=True)
        )

    def _gradients(
        self, numbers: list[np.ndarray], by_points: np.ndarray, by_rotations: np.ndarray
    ) -> list[np.ndarray]:
        """Return the gradients of all members by all arrays."""
        with self._lock:
            kept = self._kept.get(_key(numbers))
        if kept is None:
            *_, adjoint, n_driving = self._solve(numbers, True)
            kept = self._remember(numbers, adjoint, n_driving)
        adjoint, n_driving = kept
        outputs = [by_points, by_rotations, np.zeros((len(by_points), n_driving))]
        found = adjoint.gradients(outputs, [True] * len(adjoint.values))
        by_name = {(each.owner, each.name): part for each, part in zip(adjoint.values, found, strict=True)}
        return [np.asarray(by_name[name]) for name in self._names]

    def _members(self, ndims: tuple[int, ...], arrays: Any) -> tuple[list[np.ndarray], tuple[int, ...]]:
        """Return the arrays with one axis of members in front, and the axes that stood there."""
        numbers = [np.asarray(each, dtype=np.float64) for each in arrays]
        front = numbers[0].ndim - ndims[0] if numbers else 0
        axes = numbers[0].shape[:front] if numbers else ()
        return [each.reshape((-1, *each.shape[front:])) for each in numbers], axes

    def _solve(self, numbers: list[np.ndarray], differentiable: bool) -> tuple[Any, ...]:
        """Return positions, edge rotations, what computes gradients, and the number of forces of motors."""
        if differentiable:
            require_torch("a gradient of ms.jax.equilibrium")
        values = {owner: dict(named) for owner, named in (self._arguments.get("values") or {}).items()}
        given = dict(self._arguments)
        for (owner, name), each in zip(self._names, numbers, strict=True):
            if owner is None:
                given[name] = each
            else:
                values[owner][name] = each
        members = len(numbers[0]) if numbers else 1
        known = dict.fromkeys(self._names, differentiable)
        axis = BatchAxis(self._scene, {**given, "values": values or None}, members, known)
        found = from_starts(self._scene, None, self._search, members)
        batch, adjoint = find_along(axis, self._scene, None, found, self._search)
        for error in batch.failed.values():
            raise error
        positions, edge_rotations = map(detached, (batch.positions, batch.edge_rotations))
        return positions, edge_rotations, adjoint, len(batch[0]._driving)

    def _remember(
        self, numbers: list[np.ndarray], adjoint: BatchAdjoint, n_driving: int
    ) -> tuple[BatchAdjoint, int]:
        """Keep what computes the gradients of a solve, and return it."""
        with self._lock:
            kept = self._kept[_key(numbers)] = adjoint, n_driving
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        return kept


def _key(numbers: list[np.ndarray]) -> bytes:
    """Return the bytes of all numbers, by which a solve is found again."""
    return b"".join(np.ascontiguousarray(each).tobytes() for each in numbers)


def require_jax(what: str) -> ModuleType:
    """Return the jax module. Raises ImportError with the command that installs it; what: the feature that needs it."""
    try:
        import jax
    except ImportError as error:
        raise ImportError(f'{what} needs jax: pip install "magshell[jax]"') from error
    return jax


def require_double_precision(jax: ModuleType, what: str) -> None:
    """Raise RuntimeError with the remedy if JAX computes in single precision."""
    if not jax.config.jax_enable_x64:
        raise RuntimeError(
            f'{what} needs double precision, which JAX leaves off by default: jax.config.update("jax_enable_x64", '
            "True) before the first array is made"
        )
