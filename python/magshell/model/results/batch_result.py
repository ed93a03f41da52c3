"""Holds what the results of all batches share: their members, and the errors of those that failed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import is_tensor
from .result_lookup import displacements_of

if TYPE_CHECKING:
    from ..._input.kinds import Computed


class BatchResult:
    """The members of a batch. `_members` holds the result of each, None where it failed; `failed` the errors."""

    edge_rotations: Any
    failed: dict[int, Any]
    _members: tuple[Any, ...]

    _as_given = ("failed",)

    @property
    def converged(self) -> np.ndarray:
        """Return whether each member was solved to its end, (k,)."""
        return np.array([each is not None for each in self._members])

    def __len__(self) -> int:
        return len(self._members)

    def _member(self, index: int) -> Any:
        """Return the result of one member, or raise the error that it ended with."""
        if isinstance(index, bool) or not isinstance(index, int | np.integer):
            raise TypeError(
                f"{type(self).__name__} takes the number of a member, got {type(index).__name__}; batch[k] has the results "
                "of objects in member k"
            )
        member = range(len(self))[index]  # raises IndexError
        if member in self.failed:
            raise self.failed[member]
        return self._members[member]

    def __repr__(self) -> str:
        failed = ", ".join(f"{k} ({type(error).__name__})" for k, error in self.failed.items())
        kind = "tensors" if is_tensor(self.edge_rotations) else "arrays"
        return f"{type(self).__name__}: {len(self)} members as {kind}; " + (
            f"failed: {failed}" if failed else "none failed"
        )


class BatchOfPositions(BatchResult):
    """The members of a batch whose results hold positions."""

    positions: Any
    _rest: Any  # (k or 1, ..., n_v, 3) m, the rest positions, if some were given

    @property
    def displacements(self) -> Computed:
        """The displacements from the rest shape, in the shape of `positions`, m."""
        return displacements_of(self) if self._rest is None else self.positions - self._rest
