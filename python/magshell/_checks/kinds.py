"""What numbers may come as, for type checkers: nothing of it is needed to run."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeAlias

    import torch
    from numpy.typing import ArrayLike

    # A number, an array, a tensor, or sequences of those.
    Numbers: TypeAlias = ArrayLike | torch.Tensor | Sequence["Numbers"]

    # The same, or a function of time [s].
    InTime: TypeAlias = Numbers | Callable[[float], Numbers]
