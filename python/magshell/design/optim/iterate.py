"""The current design of an optimizer: its parameters as one vector, and the closure's result there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from ..._runtime.tried_designs import trying_designs
from .sample import Sample, Trial

_SAMPLE = "sample_"


class Iterate:
    """The design of an optimizer with `param_groups`, and its sample, which is computed once.

    With another closure object, or parameters that were changed in between, `evaluate` calls the closure again.
    """

    takes_residuals = False  # whether the closure returns residuals, not an objective
    _sample_type: type[Sample] = Sample

    def __init__(self):
        self._sample: Sample | None = None
        self._sample_x: np.ndarray | None = None
        self._closure: Callable[..., Any] | None = None

    @property
    def parameters(self) -> list[torch.Tensor]:
        """The parameters of all groups, group by group."""
        return [parameter for group in self.param_groups for parameter in group["params"]]

    def evaluate(self, closure: Callable[..., Any]) -> Sample:
        """Return the sample at the current parameters; calls the closure only if it is not known yet."""
        if not callable(closure):
            raise ValueError(
                f"{type(self).__name__}.step needs a closure that returns the objective, got {closure!r:.60}"
            )
        x = self._read()
        self._check_design(x)
        known = self._sample is not None and np.array_equal(x, self._sample_x)
        if not (known and self._closure in (None, closure)):
            self._store(x, self.trial_of(closure).differentiate())
        self._closure = closure
        return self._sample

    def _check_design(self, x: np.ndarray) -> None:
        """Check a design at which a step is to begin. Raises ValueError."""

    def _read(self) -> np.ndarray:
        """Return the parameters as one vector, (n,) float64."""
        return torch.cat([p.detach().reshape(-1).double().cpu() for p in self.parameters]).numpy()

    def _write(self, x: np.ndarray) -> np.ndarray:
        """Set the parameters; returns their values, which their dtype may have rounded."""
        chunks = torch.from_numpy(x).split([parameter.numel() for parameter in self.parameters])
        with torch.no_grad():
            for parameter, chunk in zip(self.parameters, chunks, strict=True):
                parameter.copy_(chunk.reshape(parameter.shape))
        return self._read()

    def _leave_gradients(self, gradient: np.ndarray) -> None:
        """Set the parameters' `.grad` from a vector (n,)."""
        chunks = torch.from_numpy(gradient).split([parameter.numel() for parameter in self.parameters])
        for parameter, chunk in zip(self.parameters, chunks, strict=True):
            parameter.grad = chunk.reshape(parameter.shape).to(parameter)

    def _trial(self, x: np.ndarray) -> tuple[np.ndarray, Trial]:
        """Return the design x as the parameters store it, and the closure's values there."""
        x = self._write(x)
        with trying_designs():
            return x, self.trial_of(self._closure)

    def trial_of(self, closure: Callable[..., Any]) -> Any:
        """Return the values of a closure at the current parameters."""
        return Trial(closure, self.parameters)

    def _store(self, x: np.ndarray, sample: Sample) -> None:
        self._sample_x, self._sample = x, sample

    def _sample_state(self) -> dict[Any, Any]:
        """Return the design and its sample as tensors and numbers."""
        if self._sample is None:
            return {}
        state = {_SAMPLE + name: as_tensor(value) for name, value in vars(self._sample).items()}
        return {**state, _SAMPLE + "x": as_tensor(self._sample_x)}

    def _load_sample(self, state: dict[Any, Any]) -> None:
        sample = {
            name.removeprefix(_SAMPLE): as_array(value)
            for name, value in state.items()
            if name.startswith(_SAMPLE)
        }
        self._sample_x = sample.pop("x", None)
        self._sample = self._sample_type(**sample) if sample else None
        self._closure = None


class Restoring:
    """A context manager that restores the parameters and their gradients if the block raises."""

    def __init__(self, iterate: Iterate):
        self._iterate = iterate

    def __enter__(self) -> None:
        self._kept = [(p, p.detach().clone(), p.grad) for p in self._iterate.parameters]

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            with torch.no_grad():
                for parameter, value, gradient in self._kept:
                    if not torch.equal(parameter, value):  # a copy ends what torch knows of a graph
                        parameter.copy_(value)
                    parameter.grad = gradient


def as_tensor(value: Any) -> Any:
    return torch.from_numpy(value.copy()) if isinstance(value, np.ndarray) else value


def as_array(value: Any) -> Any:
    return value.detach().cpu().numpy().copy() if isinstance(value, torch.Tensor) else value
