"""Base class of the optimizers in `ms.optim`: torch optimizers with bounds, whose state can be saved and resumed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import torch

from ..._input.checked_list import listed
from ..._input.tensors import is_tensor
from . import box as boxes
from .box import Box
from .iterate import Iterate, Restoring, as_array, as_tensor
from .sample import STAGNATION, Sample


class BoxOptimizer(Iterate, torch.optim.Optimizer, ABC):
    """A torch optimizer whose parameter groups have bounds (the box) and typical sizes (`scale`).

    `step(closure)` moves the parameters and returns the new objective. The closure returns the objective, or the objective
    and constraints, at the current parameters; unlike torch's closures it does not call backward. Its result at the end of a
    step is stored for the next step. The next step calls the closure again only if it gets another closure object, or if the
    parameters were changed in between.

    A closure may raise `ms.DesignRejected` for a design that it cannot evaluate. The step is then shortened and repeated, up
    to `max_backtracks` times; after that the last DesignRejected is raised. If a step raises an error, parameters and state
    remain as they were before it.

    A subclass defines `_advance` and `_full_step`.
    """

    # Attributes that a copy or pickle contains, in addition to those of torch's optimizer.
    _copied_attributes = ("_run", "_sample", "_sample_x", "max_backtracks")

    stagnation = STAGNATION  # why a search ends if a step changes nothing, in words

    def __init__(self, params: Iterable[Any], defaults: dict[Any, Any], max_backtracks: int):
        if not (isinstance(max_backtracks, int) and max_backtracks >= 0):
            raise ValueError(f"max_backtracks must be an integer, 0 or more, got {max_backtracks!r}")
        self.max_backtracks = max_backtracks
        self._run: dict[
            Any, Any
        ] = {}  # state of the method, such as its history; empty before the first step
        Iterate.__init__(self)
        torch.optim.Optimizer.__init__(self, listed("params", params, is_tensor), defaults)

    def step(self, closure: Callable[..., Any]) -> float:
        """Move the parameters by one step within their bounds, and return the objective at the new parameters.

        closure: a function without arguments that returns the objective at the current parameters, a scalar tensor, or
        (objective, constraints), with constraints <= 0 if satisfied; it does not call backward.

        Raises ValueError or TypeError if the closure returns anything else, and passes on the errors that it raises.
        """
        sample = self.evaluate(closure)
        self._check_sample(sample)
        with Restoring(self):
            self._advance(sample, self._box(), self._sample_x)
        return self._sample.objective

    def full_step(self, closure: Callable[..., Any]) -> float:
        """Take the first step that `step` would try, even if the objective grows, and return the new objective.

        It serves to pass a jump of the equilibrium, at which the objective is discontinuous: `step` would shorten the step
        until it ends before the jump.
        """
        sample = self.evaluate(closure)
        self._check_sample(sample)
        with Restoring(self):
            self._full_step(sample, self._box(), self._sample_x)
        return self._sample.objective

    def add_param_group(self, param_group: dict[Any, Any]) -> None:
        """Add a group, {"params": tensors, "lower": ..., "upper": ..., "scale": ...}, before the first step.

        Raises ValueError after the first step, and for unknown options.
        """
        if self._run:
            raise ValueError("a parameter group cannot be added after the first step: make a new optimizer")
        unknown = set(param_group) - {"params", "param_names", *self.defaults}
        if unknown:
            raise ValueError(
                f"unknown option {sorted(unknown)[0]!r}; the options of a group are {sorted(self.defaults)}"
            )
        super().add_param_group(param_group)
        group = self.param_groups[-1]
        try:
            for parameter in group["params"]:
                check_parameter(parameter)
            for name in ("lower", "upper", "scale"):
                if group[name] is not None:
                    group[name] = boxes.option_tensors(name, group[name], group["params"])
            self._check_group(group, boxes.group_box(len(self.param_groups) - 1, group))
        except ValueError:
            self.param_groups.pop()
            raise

    def state_dict(self) -> dict[Any, Any]:
        """Return torch's state dict, with the state of the method and the stored sample under "run".

        Saved by `torch.save`, it can be loaded with `weights_only=True`.
        """
        run = {name: as_tensor(value) for name, value in self._run.items()}
        return {**super().state_dict(), "run": {**run, **self._sample_state()}}

    def load_state_dict(self, state_dict: dict[Any, Any]) -> None:
        """Continue from a `state_dict`. The next steps are bitwise identical to those of the optimizer that made it.

        Raises ValueError for the state of another kind of optimizer, or of other parameters.
        """
        if "run" not in state_dict:
            raise ValueError(f"this is not a state of {type(self).__name__}: it has no 'run'")
        rest = {name: value for name, value in state_dict.items() if name != "run"}
        super().load_state_dict(rest)
        self._load_sample(state_dict["run"])
        sample = self._sample_state()
        self._run = {name: as_array(value) for name, value in state_dict["run"].items() if name not in sample}

    def configuration(self) -> dict[Any, Any]:
        """Return {name: number or array} of all options: bounds and scales, those of the method and of each group."""
        box = self._box()
        # -0.0 and 0.0 are the same bound: adding 0.0 turns -0.0 into 0.0.
        options = {name: getattr(box, name) + 0.0 for name in ("lower", "upper", "scale")}
        options |= {name: getattr(self, name) for name in self._copied_attributes if not name.startswith("_")}
        return options | group_options(self.param_groups, set(options))

    def __getstate__(self) -> dict[Any, Any]:
        """Return the attributes that a copy or pickle contains. The closure is left out."""
        copied = {name: getattr(self, name) for name in self._copied_attributes}
        return {**super().__getstate__(), **copied, "_closure": None}

    @abstractmethod
    def _advance(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        """Take one step from the design x (n,), at which the closure returned `sample`."""

    @abstractmethod
    def _full_step(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        """Take the first step that `_advance` would try, even if the objective grows."""

    def _check_group(self, group: dict[Any, Any], box: Box) -> None:
        """Check the options of a group other than bounds and scale. Raises ValueError."""

    def _check_sample(self, sample: Sample) -> None:
        """Check that the method can handle what the closure returned, such as constraints. Raises ValueError."""

    def _check_design(self, x: np.ndarray) -> None:
        self._box().check_inside(x)

    def _box(self) -> Box:
        return boxes.join([boxes.group_box(number, group) for number, group in enumerate(self.param_groups)])

    def _option(self, name: str) -> np.ndarray:
        """Return an option of the groups for each entry of the design, (n,)."""
        sizes = [sum(parameter.numel() for parameter in group["params"]) for group in self.param_groups]
        return np.repeat([float(group[name]) for group in self.param_groups], sizes)


def group_options(groups: list[dict[Any, Any]], without: set[str]) -> dict[Any, Any]:
    """Return the options of parameter groups as {"<name> of group <number>": value}.

    without: names of options to leave out.
    """
    left_out = {"params", "param_names", *without}
    return {
        f"{name} of group {number}": value
        for number, group in enumerate(groups)
        for name, value in group.items()
        if name not in left_out
    }


def positive_count(name: str, value: Any) -> int:
    """Return a positive integer. Raises ValueError for anything else."""
    if isinstance(value, bool) or not (isinstance(value, int) and value > 0):
        raise ValueError(f"{name} must be a positive integer, got {value!r}")
    return value


def require_range(group: dict[Any, Any], name: str, low: float, high: float) -> None:
    """Check that a group's option lies strictly between two numbers. Raises ValueError."""
    value = group[name]
    if not (isinstance(value, int | float) and low < value < high):
        raise ValueError(f"{name} must be a number between {low:g} and {high:g}, got {value!r}")


def check_parameter(parameter: torch.Tensor) -> None:
    """Check that a parameter has a floating-point dtype and requires a gradient. Raises ValueError."""
    if not parameter.is_floating_point():
        raise ValueError(f"a parameter must be real, got dtype {parameter.dtype}")
    if not parameter.requires_grad:
        raise ValueError(f"the parameter of shape {tuple(parameter.shape)} needs requires_grad=True")
