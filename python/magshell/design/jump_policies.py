"""What a search has beside its objective: objects with a state, some of which can let an equilibrium jump."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from .._input.checked_list import listed


def checked_stateful(stateful: Sequence[Any]) -> list[Any]:
    stateful = listed("stateful", stateful, lambda given: hasattr(given, "state_dict"))
    for each in stateful:
        for method in ("state_dict", "load_state_dict"):
            if not callable(getattr(each, method, None)):
                raise ValueError(
                    f"every object in `stateful` needs {method}(), and {type(each).__name__} has none"
                )
    return stateful


def offering(objective: Callable[..., Any], stateful: Sequence[Any]) -> list[Any]:
    """Those that have accept_jumps(), each once."""
    return list({id(each): each for each in (objective, *stateful) if hasattr(each, "accept_jumps")}.values())


@contextmanager
def jumps_accepted(offering: Sequence[Any]) -> Iterator[None]:
    """Inside, the equilibrium may jump, as far as these offer it."""
    with ExitStack() as stack:
        for each in offering:
            stack.enter_context(each.accept_jumps())
        yield
