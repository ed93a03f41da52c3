"""Adapter of the optimizers of torch.optim to the interface that `ms.minimize` uses."""

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


class TorchAdapter(Iterate):
    """An optimizer of torch.optim with the interface of BoxOptimizer, without bounds and constraints.

    The objective and its gradient at the current design are stored, and not computed again for the next step. They are
    passed to torch in the closure of its step and in the `.grad` of the parameters, because some optimizers take no closure.

    If a step ends at a design that the user's closure rejects (`ms.DesignRejected`), or evaluates one on the way, the step
    is undone and repeated with half the learning rate, up to `max_backtracks` times. This may not help an optimizer with a
    line search, which can extend the shorter step to a rejected design again. If a step raises an error, parameters and
    optimizer state remain as they were before it.
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
        """Move the parameters by one step, with the learning rate halved after each rejection.

        Returns the objective at the new parameters. Raises the last DesignRejected after `max_backtracks` halvings.
        """
        for halvings in range(self.max_backtracks + 1):
            try:
                return self._step(closure, factor=0.5**halvings)
            except DesignRejected:
                if halvings == self.max_backtracks:
                    raise

    def full_step(self, closure: Callable[..., Any]) -> float:
        """Take a step at the full learning rate, without repetition after a rejection, and return the objective."""
        return self._step(closure, factor=1.0)

    def state_dict(self) -> dict[Any, Any]:
        return {"optimizer": self.optimizer.state_dict(), "sample": self._sample_state()}

    def load_state_dict(self, state_dict: dict[Any, Any]) -> None:
        self.optimizer.load_state_dict(state_dict["optimizer"])
        self._load_sample(state_dict["sample"])

    def configuration(self) -> dict[Any, Any]:
        """Return {name: value} of `max_backtracks` and of the options of all parameter groups."""
        return {"max_backtracks": self.max_backtracks, **group_options(self.param_groups, set())}

    def _step(self, closure: Callable[..., Any], factor: float) -> float:
        """Take a step with all learning rates multiplied by a factor, and return the objective at the new parameters.

        If it raises, parameters, gradients and optimizer state are restored. The learning rates are restored in any case.
        """
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
                self._take_torch_step(closure)
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

    def _take_torch_step(self, closure: Callable[..., Any]) -> None:
        """Call torch's `step`, with a closure that computes objective and gradients if torch takes one."""

        def torch_closure() -> torch.Tensor:
            sample = self.evaluate(closure)
            self._refuse_constraints(sample)
            self._leave_gradients(sample.gradient)
            return torch.tensor(sample.objective, dtype=torch.float64)

        if self._takes_closure:
            self.optimizer.step(torch_closure)
        else:
            self.optimizer.step()

    def _refuse_constraints(self, sample: Sample) -> None:
        """Raise ValueError if the closure returned constraints."""
        if len(sample.constraints):
            raise ValueError(
                f"{type(self.optimizer).__name__} cannot handle constraints: "
                "use ms.optim.MMA or GCMMA, or add them to the objective as a penalty"
            )
