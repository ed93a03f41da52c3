"""Decorators of the functions that users call: checks of keywords, Ctrl-C, torch.compile."""

from __future__ import annotations

import functools
import inspect
import os
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from ..errors import Interrupted
from .keywords import as_keywords, check_known
from .solve_keywords import with_keywords

F = TypeVar("F", bound=Callable)
_NAMED = inspect.Parameter.KEYWORD_ONLY


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
        kinds = [each.kind for each in parameters.values()]
        most = sys.maxsize if inspect.Parameter.VAR_POSITIONAL in kinds else len(kinds) - kinds.count(_NAMED)

        @functools.wraps(function)
        def called(*arguments, **named):
            check_known(name, named, known, groups)
            if len(arguments) > most:
                raise TypeError(_without_name(name, known, most, arguments[most]))
            return function(*arguments, **named)

        return called

    return decorated


def _without_name(name: str, known: tuple[str, ...], most: int, value: Any) -> str:
    """Return the message for an argument that needs a name. most: the number of those that need none."""
    alone = [each for each in known[:most] if each != "self"]
    takes = f"takes {' and '.join(alone)} without a name" if alone else "takes no argument without a name"
    told = f"{name} {takes}, got {value!r:.40} too"
    told += f": name it, as in {known[most]}=" if most < len(known) else ""
    if name == "plot" and isinstance(value, str | os.PathLike):
        return f"{told}. A picture is saved by ms.plot(...).save({str(value)!r})"
    return told


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
