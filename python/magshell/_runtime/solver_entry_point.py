"""What every solve does as it is called, whatever it solves."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from ..errors import Interrupted
from .keywords import as_keywords, check_known

F = TypeVar("F", bound=Callable)


def grouped(**groups: type[Any]) -> Callable[[F], F]:
    """A function as users call it, some of whose parameters take groups: dataclasses made once and handed to many calls.
    A keyword that it does not have is told with the group that has it, or with those that are most like it."""

    def decorated(function: F) -> F:
        parameters = inspect.signature(function).parameters
        if any(each.kind is each.VAR_KEYWORD for each in parameters.values()):
            return function  # it tells of wrong ones itself
        known = tuple(parameters)
        name = function.__qualname__.removesuffix(".__init__")

        @functools.wraps(function)
        def called(*arguments, **named):
            check_known(name, named, known, groups)
            return function(*arguments, **named)

        return called

    return decorated


def solve_entry(function: F) -> F:
    """A solve as users call it.

    Ctrl-C before there is anything to hand back, in a function of the caller's too, is an Interrupted as anywhere else,
    with no `last_good`. Within torch.compile, the solve runs as it is, between the graphs. Controls among `values` become
    the keywords that are their short forms.
    """
    known = set(inspect.signature(function).parameters)

    @functools.wraps(function)
    def called(*arguments, **named):
        try:
            scene = arguments[0] if arguments else named.get("scene")
            return _untraced(function)(*arguments, **as_keywords(scene, named, known))
        except Interrupted:
            raise
        except KeyboardInterrupt as stopped:
            name = function.__name__
            raise Interrupted(f"{name}: interrupted before there was anything to hand back") from stopped

    return called


_disabled: dict[Callable[..., Any], Callable[..., Any]] = {}


def _untraced(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, hidden from torch.compile where that has been loaded; to load it takes seconds."""
    if "torch._dynamo" not in sys.modules:
        return function
    if function not in _disabled:
        _disabled[function] = sys.modules["torch"].compiler.disable(function)
    return _disabled[function]
