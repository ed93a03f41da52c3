"""Any other torch optimizer, in the form that `ms.minimize` drives."""

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
    """A torch optimizer that is asked for one step after the other, and knows the objective where it stands.

    Each step gets a closure, which answers from the kept sample where the design is known; an optimizer whose step
    takes none finds the parameters' gradients. No constraints, no bounds. A step that leads to a rejected design, or
    meets one on its way, is taken back and again with half the learning rate, up to `max_backtracks` times; a line
    search of torch's own, which extends steps, may meet it again each time. A step that raises leaves parameters and
    the optimizer's state as they were.
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
        """Moves the parameters and returns the objective there."""
        for shortening in range(self.max_backtracks + 1):
            try:
                return self._step(closure, share=0.5**shortening)
            except DesignRejected:
                if shortening == self.max_backtracks:
                    raise

    def full_step(self, closure: Callable[..., Any]) -> float:
        """The step at the full learning rate and no other."""
        return self._step(closure, share=1.0)

    def state_dict(self) -> dict[Any, Any]:
        return {"optimizer": self.optimizer.state_dict(), "sample": self._sample_state()}

    def load_state_dict(self, state_dict: dict[Any, Any]) -> None:
        self.optimizer.load_state_dict(state_dict["optimizer"])
        self._load_sample(state_dict["sample"])

    def configuration(self) -> dict[Any, Any]:
        """{name: value} of the groups' options."""
        return {"max_backtracks": self.max_backtracks, **group_options(self.param_groups, set())}

    def _step(self, closure: Callable[..., Any], share: float) -> float:
        begin = self.evaluate(closure)
        self._refuse_constraints(begin)
        x, state = self._sample_x, copy.deepcopy(self.optimizer.state_dict())
        rates = [group.get("lr") for group in self.param_groups]
        self._leave_gradients(begin.gradient)
        try:
            with Restoring(self):
                for group, rate in zip(self.param_groups, rates, strict=True):
                    if rate is not None:
                        group["lr"] = share * rate
                self._move(closure)
                reached = self.evaluate(closure)
        except BaseException:
            self.optimizer.load_state_dict(state)
            self._keep(x, begin)
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
