"""The output whose error is asked for: a smooth function of the positions of a result, and its derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import is_tensor, require_torch

if TYPE_CHECKING:
    from ...model.scene.scene import Scene

_STEP = 1e-6  # [-] step of the difference that checks the derivative, over the size of the bodies
# [-] Largest difference between the derivative and a difference of the output, over the larger one; fixed by
# test_outputs_that_are_not_smooth_scalars_are_refused.
_AGREE = 1e-2
_ROUND_OFF = 1e-14  # [-] of the output's terms: differences below tell nothing


class PositionsOfResult:
    """The scene, positions and displacements of a result, as tensors, that an output is called with.

    scene: of the result. positions: (n_v, 3) m, a tensor. rest: (n_v, 3) m.
    """

    def __init__(self, scene: Scene, positions: Any, rest: Any):
        self.scene: Scene = scene
        self.positions: Any = positions
        self._rest = rest

    @property
    def displacements(self) -> Any:
        """The displacements from the rest shape, (n_v, 3) m."""
        return self.positions - self._rest

    def __getitem__(self, body: Any) -> PositionsOfResult:
        """Return the positions of one body of the scene."""
        vertices = self.scene._bodies.spans[self.scene._bodies.number(body)].vertices
        return PositionsOfResult(self.scene, self.positions[vertices], self._rest[vertices])

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(
            f"an output whose error is estimated is a function of positions, displacements and scene, not of {name!r}"
        )


class Output:
    """A scalar function of positions, with a check that it is one.

    function: called with a PositionsOfResult; returns a scalar tensor. Raises ValueError if it does not.
    """

    def __init__(self, function: Callable[[Any], Any], scene: Scene):
        if not callable(function):
            raise ValueError(
                f"output must be a function of a result, such as lambda rest: rest.positions[0, 2], got {function!r:.60}"
            )
        self._function, self._scene = function, scene
        self._rest = np.array(scene.mesh.rest_positions)

    def value(self, positions: np.ndarray) -> float:
        """Return the output at positions (n_v, 3) m."""
        return float(self._called(positions).detach())

    def gradient(self, positions: np.ndarray) -> np.ndarray:
        """Return the derivative of the output by positions, (n_v, 3) per m.

        Raises ValueError if the output does not depend on them through torch.
        """
        torch = require_torch("an output")
        given = torch.tensor(positions, dtype=torch.float64, requires_grad=True)
        found = self._of(given)
        if not found.requires_grad:
            raise ValueError(
                "the output does not depend on the positions by functions of torch, so that it has no derivative: compute "
                "it from result.positions without numpy, .detach(), .item() or comparisons"
            )
        found.backward()
        slope = np.zeros_like(positions) if given.grad is None else given.grad.numpy()
        if not np.isfinite(slope).all():
            raise ValueError(
                "the derivative of the output by the positions is not finite: it is not smooth here"
            )
        return slope

    def check_smooth(self, positions: np.ndarray, slope: np.ndarray, motion: np.ndarray) -> None:
        """Raise ValueError if the derivative differs from differences along a motion (n_v, 3) m of the positions."""
        largest = np.abs(motion).max()
        if largest == 0.0:
            return
        step = _STEP * max(self._scene._bodies.extent, np.abs(positions).max()) / largest
        ahead, behind = (self.value(positions + sign * step * motion) for sign in (1.0, -1.0))
        here = self.value(positions)
        expected = step * float((slope * motion).sum())
        size = max(abs(ahead - here), abs(here - behind), abs(expected))
        off = max(abs(ahead - here - expected), abs(here - behind - expected))
        rounding = _ROUND_OFF * max(abs(here), float(np.abs(slope * positions).sum()))
        if off > _AGREE * size + 1e2 * rounding + step * _AGREE * float(np.abs(slope * motion).sum()):
            raise ValueError(
                f"the output is not smooth at these positions: its derivative promises a change of {expected:.3g}, but it "
                f"changes by {ahead - here:.3g} ahead and by {here - behind:.3g} behind. Do not use max, abs, sign, "
                "rounding or detached tensors where they matter"
            )

    def _called(self, positions: np.ndarray) -> Any:
        torch = require_torch("an output")
        return self._of(torch.tensor(positions, dtype=torch.float64))

    def _of(self, positions: Any) -> Any:
        rest = positions.new_tensor(self._rest)
        found = self._function(PositionsOfResult(self._scene, positions, rest))
        if not is_tensor(found) or found.ndim != 0:
            shape = (
                f"a tensor of shape {tuple(found.shape)}" if is_tensor(found) else f"a {type(found).__name__}"
            )
            raise ValueError(
                f"the output must return a scalar tensor, computed from result.positions, got {shape}"
            )
        if not bool(found.isfinite()):
            raise ValueError(f"the output is {float(found.detach())}, not a finite number")
        return found
