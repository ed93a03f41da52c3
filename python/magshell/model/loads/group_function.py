"""Evaluates a caller's energy of groups of vertices, with derivatives by torch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensor_kinds import is_tensor
from ..._input.tensors import require_torch

if TYPE_CHECKING:
    import torch

# Entries of the Hessians that are computed at once; it bounds the memory that torch needs for them.
_ENTRIES_AT_ONCE = 10**7
# [-] Largest relative difference between two answers to the same input that round-off explains. Tested by
# test_a_function_that_changes_its_answer_is_refused.
_SAME = 1e-9
# [-] Derivatives by torch are wrong if they differ by the first from differences over the second of the groups' size, where
# these differ among themselves by less than the third. Tested by test_a_derivative_that_torch_does_not_see_is_refused.
_WRONG, _STEP, _SMOOTH = 1e-5, 1e-3, 1e-7


class GroupFunction:
    """A function of the positions (k, 3) of k vertices and of values, mapped over n groups of vertices.

    name: of the energy, for messages. shapes: those of all values, by name: () or (1, ...) where one stands for all groups,
    else (n, ...). The arrays of its methods are flat: positions (3 k n,), values of one name after another.

    Raises ValueError if the function does not return a number, or changes its answer.
    """

    def __init__(
        self,
        name: str,
        function: Callable[..., Any],
        groups: int,
        size: int,
        shapes: dict[str, tuple[int, ...]],
    ):
        self._torch = require_torch("CustomEnergy")
        self._name, self._function = name, function
        self._groups, self._size, self._shapes = groups, size, shapes
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        func = self._torch.func
        shared = [len(shape) == 0 or shape[0] != groups for shape in shapes.values()]
        of_values = tuple(None if each else 0 for each in shared)
        by_position = func.grad_and_value(self._energy)
        at_once = max(1, _ENTRIES_AT_ONCE // (9 * size**2))

        def with_gradient(x: torch.Tensor, *values: torch.Tensor) -> Any:
            gradient, energy = by_position(x, *values)
            return gradient, (gradient, energy)

        def power(x: torch.Tensor, rate: torch.Tensor, *values: torch.Tensor) -> torch.Tensor:
            return (by_position(x, *values)[0] * rate).sum()

        def all_groups(function: Any, more: int = 0, **options: Any) -> Any:
            return func.vmap(function, in_dims=(*(0,) * (1 + more), *of_values), **options)

        self._energies = all_groups(self._energy)
        self._gradients = all_groups(by_position)
        self._hessians = all_groups(func.jacrev(with_gradient, has_aux=True), chunk_size=at_once)
        numbers = tuple(range(1, 1 + len(shapes)))
        self._by_values = all_groups(func.grad(self._energy, argnums=numbers)) if shapes else None
        later = tuple(range(2, 2 + len(shapes)))
        self._power_by_values = all_groups(func.grad(power, argnums=later), 1) if shapes else None

    def _energy(self, x: torch.Tensor, *values: torch.Tensor) -> torch.Tensor:
        """Call the function for one group, and check that it returns a number."""
        energy = self._function(x, **dict(zip(self._shapes, values, strict=True)))
        if not is_tensor(energy):
            raise ValueError(
                f"the function of the energy '{self._name}' must return a torch tensor, the energy [J] of one group, "
                f"got {type(energy).__name__}"
            )
        if energy.shape != () or energy.dtype != self._torch.float64:
            raise ValueError(
                f"the function of the energy '{self._name}' must return one float64 number, the energy [J] of one group, "
                f"got {energy.dtype} of shape {tuple(energy.shape)}"
            )
        return energy

    def sample(self, positions: np.ndarray, values: np.ndarray, order: int) -> tuple[np.ndarray, ...]:
        """Return energies (n,), gradients (3 k n,) and Hessians (9 k^2 n,), as far as the order of derivatives says."""
        with self._plain_torch():
            x, numbers = self._tensors(positions), self._numbers(values)
            if order == 0:
                found = (self._energies(x, *numbers),)
            elif order == 1:
                found = self._gradients(x, *numbers)[::-1]
            else:
                hessians, (gradients, energies) = self._hessians(x, *numbers)
                found = (energies, gradients, hessians)
            arrays = tuple(each.detach().numpy().ravel() for each in found)
        self._compare(positions, values, arrays[0])
        return arrays

    def rate_by_values(self, positions: np.ndarray, values: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Return the derivatives of rates . gradient with respect to all values, (m,)."""
        with self._plain_torch():
            along = self._tensors(positions), self._tensors(rates)
            return self._summed(self._power_by_values(*along, *self._numbers(values)))

    def by_values(self, positions: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return the derivatives of the sum of all energies by all values, (m,)."""
        with self._plain_torch():
            return self._summed(self._by_values(self._tensors(positions), *self._numbers(values)))

    def check(self, positions: np.ndarray, values: np.ndarray, extent: float) -> None:
        """Evaluate the function at rest. Raises ValueError if it is not finite there, or its derivatives are not its own.

        extent: of the bodies, m.
        """
        energies, gradients, hessians = self.sample(positions, values, 2)
        self.sample(positions, values, 0)
        what = (
            (energies, "energy"),
            (gradients, "gradient of the energy"),
            (hessians, "Hessian of the energy"),
        )
        for found, part in what:
            bad = np.flatnonzero(~np.isfinite(found.reshape(self._groups, -1)).all(axis=1))
            if bad.size:
                raise ValueError(
                    f"the {part} '{self._name}' is not finite at rest in group {bad[0]}: its function must be smooth there"
                )
        some = np.random.default_rng(0)
        groups = positions.reshape(self._groups, -1, 3)
        size = np.linalg.norm(groups - groups.mean(axis=1, keepdims=True), axis=2).max() or 0.1 * extent
        there = positions + 0.1 * size * some.normal(
            size=positions.shape
        )  # a symmetric shape may hide a part
        motion = size * some.normal(size=positions.shape)
        slope = float(self.sample(there, values, 1)[1] @ motion)
        self._check_slope(lambda t: (there + t * motion, values), slope, "positions")
        if not self._shapes:
            return
        change = np.where(values == 0.0, 1.0, np.abs(values)) * some.uniform(0.5, 1.0, values.shape)
        slope = float(self.by_values(there, values) @ change)
        self._check_slope(lambda t: (there, values + t * change), slope, "values")

    def _check_slope(
        self, at: Callable[[float], tuple[np.ndarray, np.ndarray]], slope: float, by: str
    ) -> None:
        """Compare a derivative with differences, where these are accurate."""

        def energies(t: float) -> np.ndarray:
            return self.sample(*at(t), 0)[0]

        found = []
        with np.errstate(invalid="ignore"):  # there may be no energy beside this place
            size = np.abs(energies(0.0)).sum()
            for step in (_STEP, 0.5 * _STEP):
                change = energies(step) - energies(-step), energies(2 * step) - energies(-2 * step)
                found.append(float((8.0 * change[0] - change[1]).sum() / (12.0 * step)))
        scale = max(abs(found[1]), abs(slope), 1e-9 * size / _STEP)
        if abs(found[0] - found[1]) <= _SMOOTH * scale and abs(found[1] - slope) > _WRONG * scale:
            raise ValueError(
                f"the energy '{self._name}' has a derivative by its {by} that torch does not see: {found[1]:.6g} by "
                f"differences, {slope:.6g} by torch. Its function must compute with the tensors that it gets, without "
                "detach, no_grad or numpy"
            )

    def _compare(self, positions: np.ndarray, values: np.ndarray, energies: np.ndarray) -> None:
        """Raise ValueError if the energies are others than those of the last call with the same input."""
        before, self._last = self._last, (positions.copy(), values.copy(), energies)
        if before is None or not (np.array_equal(before[0], positions) and np.array_equal(before[1], values)):
            return
        largest = np.abs(energies[np.isfinite(energies)]).max(initial=0.0)
        same = np.isclose(before[2], energies, rtol=_SAME, atol=1e-3 * _SAME * largest, equal_nan=True)
        if not same.all():
            group = int(np.flatnonzero(~same)[0])
            raise ValueError(
                f"the energy '{self._name}' changes its answer for the same input: {before[2][group]:.17g} J, then "
                f"{energies[group]:.17g} J in group {group}. Its function must depend on positions and values only"
            )

    @contextmanager
    def _plain_torch(self) -> Iterator[None]:
        """Let torch record derivatives as outside of all transforms and switches that are on where a solve was called."""
        from torch._functorch.pyfunctorch import temporarily_clear_interpreter_stack

        torch = self._torch
        with temporarily_clear_interpreter_stack(), torch.inference_mode(False), torch.enable_grad():
            yield

    def _tensors(self, positions: np.ndarray) -> torch.Tensor:
        return self._torch.from_numpy(np.array(positions)).reshape(self._groups, self._size, 3)

    def _numbers(self, values: np.ndarray) -> list[torch.Tensor]:
        """Return the values by name as tensors: one row of each for all groups, or one per group."""
        found, first = [], 0
        for shape in self._shapes.values():
            count = int(np.prod(shape, dtype=int))
            each = self._torch.from_numpy(np.array(values[first : first + count])).reshape(shape)
            found.append(each[0] if shape and shape[0] != self._groups else each)
            first += count
        return found

    def _summed(self, by_groups: tuple[torch.Tensor, ...]) -> np.ndarray:
        """Return derivatives with respect to all values in one array from those of each group; shared values get their
        sum.
        """
        parts = [
            each if shape and shape[0] == self._groups else each.sum(dim=0)
            for each, shape in zip(by_groups, self._shapes.values(), strict=True)
        ]
        return np.concatenate([each.detach().numpy().ravel() for each in parts])
