"""The values of one state of a result as its formulas read them: tensors where the solve was given tensors.

The tension of a spring, say, depends on its stiffness through the positions and directly; its gradient has both parts.
"""

from __future__ import annotations

from typing import Any

from .._runtime.frozen import variant


def as_given(result: Any, item: Any, index: int) -> Any:
    """Return an object of the scene as it was in a state, with tensors in place of the numbers that were given so."""
    now = result._values_at(index).current(item)
    tensors = {name: tensor for (owner, name), tensor in result._tensors_at(index).items() if owner is item}
    return variant(now, **tensors) if tensors else now


def load_factor_of(result: Any, index: int) -> Any:
    """Return the load factor of a state, a tensor if it was given so."""
    factors = result._load_factors
    number = float(factors if factors.ndim == 0 else factors[index])
    return result._tensors_at(index).get((None, "load_factor"), number)


def rest_tensor_of(result: Any) -> Any:
    """Return the rest positions that the solve was given, (n_v, 3) m, if they are a tensor; else None."""
    return getattr(result, "_rest", None)
