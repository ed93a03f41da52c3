"""Decorators of the functions that users call: checks of keywords, Ctrl-C, torch.compile."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from ..errors import Interrupted
from .keywords import as_keywords, check_known
from .solve_keywords import with_keywords

F = TypeVar("F", bound=Callable)


def grouped(**groups: type[Any]) -> Callable[[F], F]:
    """Wrap a function so that an unknown keyword raises a TypeError with the group that has it, or the most
    similar keywords.

    groups: the dataclasses that some of its parameters take, which group options that are used in many calls.
    """

    def decorated(function: F) -> F:
        parameters = inspect.signature(function).parameters
        if any(each.kind is each.VAR_KEYWORD for each in parameters.values()):
            return function  # it checks its keywords itself
        known = tuple(parameters)
        name = function.__qualname__.removesuffix(".__init__")

        @functools.wraps(function)
        def called(*arguments, **named):
            check_known(name, named, known, groups)
            return function(*arguments, **named)

        return called

    return decorated


def solve_entry(function: F) -> F:
    """Wrap a solve that users call.

    Ctrl-C before there is a result, also in a function of the caller's, raises Interrupted without a `last_good`.
    Within torch.compile the solve runs uncompiled, between the graphs. Load parameters among `values` become the
    keywords of the same names. A line "{keywords}" of its docstring is replaced by the texts of solve_keywords.py.
    """
    known = set(inspect.signature(function).parameters)
    function.__doc__ = with_keywords(function.__name__, function.__doc__)

    @functools.wraps(function)
    def called(*arguments, **named):
        try:
            scene = arguments[0] if arguments else named.get("scene")
            return _untraced(function)(*arguments, **as_keywords(scene, named, known))
        except Interrupted:
            raise
        except KeyboardInterrupt as stopped:
            name = function.__name__
            raise Interrupted(f"{name}: interrupted before there was a result") from stopped

    return called


_disabled: dict[Callable[..., Any], Callable[..., Any]] = {}


def _untraced(function: Callable[..., Any]) -> Callable[..., Any]:
    """Hide the function from torch.compile, if that has been loaded; loading it takes seconds."""
    if "torch._dynamo" not in sys.modules:
        return function
    if function not in _disabled:
        _disabled[function] = sys.modules["torch"].compiler.disable(function)
    return _disabled[function]
