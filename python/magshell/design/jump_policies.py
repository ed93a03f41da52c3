"""Checks the stateful objects of a search, and lets an equilibrium jump if they allow it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from .._input.checked_list import listed


def checked_stateful(stateful: Sequence[Any]) -> list[Any]:
    """Return the objects of `stateful` as a list. Raises ValueError if one lacks state_dict() or load_state_dict()."""
    stateful = listed("stateful", stateful, lambda given: hasattr(given, "state_dict"))
    for each in stateful:
        for method in ("state_dict", "load_state_dict"):
            if not callable(getattr(each, method, None)):
                raise ValueError(
                    f"every object in `stateful` needs {method}(), and {type(each).__name__} has none"
                )
    return stateful


def offering(objective: Callable[..., Any], stateful: Sequence[Any]) -> list[Any]:
    """Return those of the objective and the stateful objects that have accept_jumps(), each once."""
    return list({id(each): each for each in (objective, *stateful) if hasattr(each, "accept_jumps")}.values())


@contextmanager
def jumps_accepted(offering: Sequence[Any]) -> Iterator[None]:
    """Let the equilibrium jump inside the block, by the accept_jumps() of these objects."""
    with ExitStack() as stack:
        for each in offering:
            stack.enter_context(each.accept_jumps())
        yield
