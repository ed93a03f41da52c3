"""Base class of the optimizers: bounds of each parameter group, and a state that survives a restart."""

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
from .sample import Sample
from .stagnation import STAGNATION


class BoxOptimizer(Iterate, torch.optim.Optimizer, ABC):
    """A torch optimizer whose groups have bounds. `step(closure)` moves the parameters and returns the new objective.

    The closure returns the objective (or the objective and constraints) at the current parameters and does not call
    backward. Its result at the end of a step is stored for the next step; with another closure object, or parameters
    that were changed in between, the next step calls the closure again.

    A closure may raise `ms.DesignRejected`: the step is then shortened, up to `max_backtracks` times, before the last
    rejection is raised. A step that raises leaves parameters and state as they were.
    """

    _copied = (
        "_run",
        "_sample",
        "_sample_x",
        "max_backtracks",
    )  # attributes that a copy takes along, beyond torch's own

    stagnation = STAGNATION  # the reason to give if a step changes nothing

    def __init__(self, params: Iterable[Any], defaults: dict[Any, Any], max_backtracks: int):
        if not (isinstance(max_backtracks, int) and max_backtracks >= 0):
            raise ValueError(f"max_backtracks must be an integer, 0 or more, got {max_backtracks!r}")
        self.max_backtracks = max_backtracks
        self._run: dict[Any, Any] = {}
        Iterate.__init__(self)
        torch.optim.Optimizer.__init__(self, listed("params", params, is_tensor), defaults)

    def step(self, closure: Callable[..., Any]) -> float:
        """Move the parameters by one step, within their box, and return the objective there.

        closure: a function without arguments that returns the objective at the current parameters, a scalar tensor, or
        (objective, constraints), with constraints <= 0 if satisfied; it does not call backward. Its errors are raised with
        parameters and state as they were; ValueError if it returns anything else.
        """
        sample = self.evaluate(closure)
        self._check_sample(sample)
        with Restoring(self):
            self._advance(sample, self._box(), self._sample_x)
        return self._sample.objective

    def full_step(self, closure: Callable[..., Any]) -> float:
        """Take the step that `step` would try first, whatever the objective is there, and return the objective.

        It reaches a design beyond a jump of the equilibrium, which no shorter step reaches.
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
                check_parameter(parameter)
            for name in ("lower", "upper", "scale"):
                if group[name] is not None:
                    group[name] = boxes.option_tensors(name, group[name], group["params"])
            self._check_group(group, boxes.group_box(len(self.param_groups) - 1, group))
        except ValueError:
            self.param_groups.pop()
            raise

    def state_dict(self) -> dict[Any, Any]:
        """Return torch's state dict, with the state of the run under "run"; safe to load with `weights_only`."""
        run = {name: as_tensor(value) for name, value in self._run.items()}
        return {**super().state_dict(), "run": {**run, **self._sample_state()}}

    def load_state_dict(self, state_dict: dict[Any, Any]) -> None:
        """Continue from the `state_dict` of another optimizer, with the same steps to the bit.

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
        """Return {name: number or array} of all options: the box, the groups' options and the method's."""
        box = self._box()
        options = {
            name: getattr(box, name) + 0.0 for name in ("lower", "upper", "scale")
        }  # adding 0.0 turns -0.0, which is the same bound, into 0.0
        options |= {name: getattr(self, name) for name in self._copied if not name.startswith("_")}
        return options | group_options(self.param_groups, set(options))

    def __getstate__(self) -> dict[Any, Any]:
        """Return what a copy or pickle takes along, all but the closure."""
        copied = {name: getattr(self, name) for name in self._copied}
        return {**super().__getstate__(), **copied, "_closure": None}

    @abstractmethod
    def _advance(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        """Take one step from the design x."""

    @abstractmethod
    def _full_step(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        """Take the first step that `_advance` would try, whatever its objective is."""

    def _check_group(self, group: dict[Any, Any], box: Box) -> None:
        """Check a group's options beyond its bounds. Raises ValueError."""

    def _check_sample(self, sample: Sample) -> None:
        """Check the closure's return value for this method. Raises ValueError."""

    def _check_design(self, x: np.ndarray) -> None:
        self._box().check_inside(x)

    def _box(self) -> Box:
        return boxes.join([boxes.group_box(number, group) for number, group in enumerate(self.param_groups)])

    def _option(self, name: str) -> np.ndarray:
        """Return a group's option, (n,): one entry for each entry of its parameters."""
        sizes = [sum(parameter.numel() for parameter in group["params"]) for group in self.param_groups]
        return np.repeat([float(group[name]) for group in self.param_groups], sizes)


def group_options(groups: list[dict[Any, Any]], without: set[str]) -> dict[Any, Any]:
    """Return the options of parameter groups, {"name of group number": value}."""
    left_out = {"params", "param_names", *without}
    return {
        f"{name} of group {number}": value
        for number, group in enumerate(groups)
        for name, value in group.items()
        if name not in left_out
    }


def require_range(group: dict[Any, Any], name: str, low: float, high: float) -> None:
    """Check that a group's option lies strictly between two numbers. Raises ValueError."""
    value = group[name]
    if not (isinstance(value, int | float) and low < value < high):
        raise ValueError(f"{name} must be a number between {low:g} and {high:g}, got {value!r}")


def check_parameter(parameter: torch.Tensor) -> None:
    """Check that a parameter is real and requires a gradient. Raises ValueError."""
    if not parameter.is_floating_point():
        raise ValueError(f"a parameter must be real, got dtype {parameter.dtype}")
    if not parameter.requires_grad:
        raise ValueError(f"the parameter of shape {tuple(parameter.shape)} needs requires_grad=True")
