"""What the optimizers share: parameters as one vector in a box, one sample a design, a state that survives a
restart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from . import box as boxes
from .box import Box
from .sample import Sample, Trial

_SAMPLE = "sample_"


class BoxOptimizer(torch.optim.Optimizer):
    """A torch optimizer whose groups have bounds. `step(closure)` moves the parameters and returns the new
    objective.

    The closure returns the objective (or the objective and constraints) of the parameters as they stand and
    does not
    call backward. What it says of the design that a step ends at is kept for the next step; another closure
    object, or
    parameters that were changed in between, make the next step ask again.

    A step that raises leaves parameters and state as they were.
    """

    _copied = ("_run", "_sample", "_sample_x")  # what a copy takes along, beyond torch's own

    def __init__(self, params, defaults: dict):
        self._run: dict = {}
        self._sample: Sample | None = None
        self._sample_x: np.ndarray | None = None
        self._closure: Callable | None = None
        super().__init__(params, defaults)

    def add_param_group(self, param_group: dict) -> None:
        if self._run:
            raise ValueError("a parameter group cannot join a run that has begun: make a new optimizer")
        unknown = set(param_group) - {"params", "param_names", *self.defaults}
        if unknown:
            raise ValueError(
                f"unknown option {sorted(unknown)[0]!r}; the options of a group are {sorted(self.defaults)}"
            )
        super().add_param_group(param_group)
        group = self.param_groups[-1]
        try:
            for parameter in group["params"]:
                _check_parameter(parameter)
            for name in ("lower", "upper", "scale"):
                if group[name] is not None:
                    group[name] = boxes.option_tensors(name, group[name], group["params"])
            self._check_group(group, boxes.group_box(len(self.param_groups) - 1, group))
        except ValueError:
            self.param_groups.pop()
            raise

    def _check_group(self, group: dict, box: Box) -> None:
        """What a method asks of a group's options beyond its bounds."""

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Every parameter, group by group."""
        return [parameter for group in self.param_groups for parameter in group["params"]]

    def evaluate(self, closure: Callable) -> Sample:
        """The sample of the parameters as they stand; asks the closure only if it is not known yet."""
        if not callable(closure):
            raise ValueError(
                f"{type(self).__name__}.step needs a closure that returns the objective, got {closure!r:.60}"
            )
        x = self._read()
        self._box().check_inside(x)
        known = self._sample is not None and np.array_equal(x, self._sample_x)
        if not (known and self._closure in (None, closure)):
            self._keep(x, Trial(closure, self.parameters).differentiate())
        self._closure = closure
        return self._sample

    def state_dict(self) -> dict:
        """torch's state dict, with the run's own numbers under "run"; safe to load with `weights_only`."""
        run = {name: _as_tensor(value) for name, value in self._run.items()}
        if self._sample is not None:
            run |= {_SAMPLE + name: _as_tensor(value) for name, value in vars(self._sample).items()}
            run[_SAMPLE + "x"] = _as_tensor(self._sample_x)
        return {**super().state_dict(), "run": run}

    def load_state_dict(self, state_dict: dict) -> None:
        if "run" not in state_dict:
            raise ValueError(f"this is not a state of {type(self).__name__}: it has no 'run'")
        rest = {name: value for name, value in state_dict.items() if name != "run"}
        super().load_state_dict(rest)
        run = {name: _as_array(value) for name, value in state_dict["run"].items()}
        sample = {name.removeprefix(_SAMPLE): run.pop(name) for name in list(run) if name.startswith(_SAMPLE)}
        self._sample_x = sample.pop("x", None)
        self._sample = Sample(**sample) if sample else None
        self._run = run
        self._closure = None

    def __getstate__(self) -> dict:
        kept = {name: getattr(self, name) for name in self._copied}
        return {**super().__getstate__(), **kept, "_closure": None}

    def _box(self) -> Box:
        return boxes.join([boxes.group_box(number, group) for number, group in enumerate(self.param_groups)])

    def _option(self, name: str) -> np.ndarray:
        """A group's number, (n,): one entry for each entry of its parameters."""
        sizes = [sum(parameter.numel() for parameter in group["params"]) for group in self.param_groups]
        return np.repeat([float(group[name]) for group in self.param_groups], sizes)

    def _read(self) -> np.ndarray:
        return torch.cat([p.detach().reshape(-1).double().cpu() for p in self.parameters]).numpy()

    def _write(self, x: np.ndarray) -> np.ndarray:
        """Sets the parameters; returns what they hold now, which their dtype may have rounded."""
        chunks = torch.from_numpy(x).split([parameter.numel() for parameter in self.parameters])
        with torch.no_grad():
            for parameter, chunk in zip(self.parameters, chunks, strict=True):
                parameter.copy_(chunk.reshape(parameter.shape))
        return self._read()

    def _leave_gradients(self, gradient: np.ndarray) -> None:
        """Sets the parameters' `.grad`, (n,)."""
        chunks = torch.from_numpy(gradient).split([parameter.numel() for parameter in self.parameters])
        for parameter, chunk in zip(self.parameters, chunks, strict=True):
            parameter.grad = chunk.reshape(parameter.shape).to(parameter)

    def _trial(self, x: np.ndarray) -> tuple[np.ndarray, Trial]:
        """The design x as the parameters hold it, and the closure's values there."""
        x = self._write(x)
        return x, Trial(self._closure, self.parameters)

    def _keep(self, x: np.ndarray, sample: Sample) -> None:
        self._sample_x, self._sample = x, sample


class Restoring:
    """Puts the parameters and their gradients back where they were if the block raises."""

    def __init__(self, optimizer: BoxOptimizer):
        self._optimizer = optimizer

    def __enter__(self) -> None:
        self._kept = [(p, p.detach().clone(), p.grad) for p in self._optimizer.parameters]

    def __exit__(self, kind, *_) -> None:
        if kind is not None:
            with torch.no_grad():
                for parameter, value, gradient in self._kept:
                    parameter.copy_(value)
                    parameter.grad = gradient


def require_range(group: dict, name: str, low: float, high: float) -> None:
    """A group's option that must lie strictly between two numbers."""
    value = group[name]
    if not (isinstance(value, int | float) and low < value < high):
        raise ValueError(f"{name} must be a number between {low:g} and {high:g}, got {value!r}")


def _check_parameter(parameter: torch.Tensor) -> None:
    if not parameter.is_floating_point():
        raise ValueError(f"a parameter must be real, got dtype {parameter.dtype}")
    if not parameter.requires_grad:
        raise ValueError(f"the parameter of shape {tuple(parameter.shape)} needs requires_grad=True")


def _as_tensor(value):
    return torch.from_numpy(value.copy()) if isinstance(value, np.ndarray) else value


def _as_array(value):
    return value.detach().cpu().numpy().copy() if isinstance(value, torch.Tensor) else value
