"""The tensors that a solve was given, for results that depend on them directly and not through positions only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .autograd import refused

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Leaf


def given_tensors(leaves: Sequence[Leaf]) -> dict[tuple[Any, str], Any]:
    """Return the tensors of leaves, {(object or None, name): tensor}."""
    return {
        (leaf.owner, leaf.name): refused(leaf.tensor, leaf.name, leaf.refusal)
        if leaf.refusal
        else leaf.tensor
        for leaf in leaves
    }
