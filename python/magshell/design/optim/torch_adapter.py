"""Gives other torch optimizers the interface that `ms.minimize` uses."""

from __future__ import annotations

import copy
import inspect
from collections.abc import Callable
from typing import Any

import torch

from ...errors import DesignRejected
from .base import check_parameter, group_options
from .iterate import Iterate, Restoring
from .sample import Sample


class AnyTorch(Iterate):
    """A torch optimizer that is asked for one step after the other, and knows the objective at the current design.

    Each step gets a closure, which returns the stored sample if the design is known; an optimizer whose step takes
    no closure finds the parameters' gradients. There are no constraints and no bounds. A step that leads to a
    rejected design, or meets one on its way, is undone and repeated with half the learning rate, up to
    `max_backtracks` times; a line search of torch's own, which extends steps, may meet it again each time. A step
    that raises leaves parameters and the optimizer's state as they were.
    """

    max_backtracks: int
    optimizer: Any

    def __init__(self, optimizer: torch.optim.Optimizer, max_backtracks: int = 6):
        super().__init__()
        self.optimizer, self.max_backtracks = optimizer, max_backtracks
        self._takes_closure = bool(inspect.signature(optimizer.step).parameters)
        for parameter in self.parameters:
            check_parameter(parameter)

    @property
    def param_groups(self) -> list[dict[Any, Any]]:
        return self.optimizer.param_groups

    def step(self, closure: Callable[..., Any]) -> float:
        """Move the parameters by one step, with the learning rate halved after each rejection, and return the
        objective there."""
        for shortening in range(self.max_backtracks + 1):
            try:
                return self._step(closure, factor=0.5**shortening)
            except DesignRejected:
                if shortening == self.max_backtracks:
                    raise

    def full_step(self, closure: Callable[..., Any]) -> float:
        """Take the step at the full learning rate, whatever the objective is there."""
        return self._step(closure, factor=1.0)

    def state_dict(self) -> dict[Any, Any]:
        return {"optimizer": self.optimizer.state_dict(), "sample": self._sample_state()}

    def load_state_dict(self, state_dict: dict[Any, Any]) -> None:
        self.optimizer.load_state_dict(state_dict["optimizer"])
        self._load_sample(state_dict["sample"])

    def configuration(self) -> dict[Any, Any]:
        """Return {name: value} of the groups' options."""
        return {"max_backtracks": self.max_backtracks, **group_options(self.param_groups, set())}

    def _step(self, closure: Callable[..., Any], factor: float) -> float:
        """Take a step with the learning rates times a factor, and return the objective there."""
        begin = self.evaluate(closure)
        self._refuse_constraints(begin)
        x, state = self._sample_x, copy.deepcopy(self.optimizer.state_dict())
        rates = [group.get("lr") for group in self.param_groups]
        self._leave_gradients(begin.gradient)
        try:
            with Restoring(self):
                for group, rate in zip(self.param_groups, rates, strict=True):
                    if rate is not None:
                        group["lr"] = factor * rate
                self._move(closure)
                reached = self.evaluate(closure)
        except BaseException:
            self.optimizer.load_state_dict(state)
            self._store(x, begin)
            raise
        finally:
            for group, rate in zip(self.param_groups, rates, strict=True):
                if rate is not None:
                    group["lr"] = rate
        return reached.objective

    def _move(self, closure: Callable[..., Any]) -> None:
        def answer() -> torch.Tensor:
            sample = self.evaluate(closure)
            self._refuse_constraints(sample)
            self._leave_gradients(sample.gradient)
            return torch.tensor(sample.objective, dtype=torch.float64)

        if self._takes_closure:
            self.optimizer.step(answer)
        else:
            self.optimizer.step()

    def _refuse_constraints(self, sample: Sample) -> None:
        if len(sample.constraints):
            raise ValueError(
                f"{type(self.optimizer).__name__} knows no constraints: "
                "use ms.optim.MMA or GCMMA, or add them to the objective as a penalty"
            )
