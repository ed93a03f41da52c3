"""Decorators of the functions that users call: checks of keywords, Ctrl-C, torch's compiler and tracers."""

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
    Within torch.compile the solve runs uncompiled, between the graphs. A tracer, which records operations of torch to
    run them again, would record the numbers of this one solve as constants: ValueError refuses it. Load parameters among
    `values` become the keywords of the same names. A line "{keywords}" of its docstring is replaced by the texts of
    solve_keywords.py.
    """
    known = set(inspect.signature(function).parameters)
    function.__doc__ = with_keywords(function.__name__, function.__doc__)

    @functools.wraps(function)
    def called(*arguments, **named):
        if tracer := _tracer():
            raise ValueError(_TRACED.format(function.__name__, tracer))
        try:
            scene = arguments[0] if arguments else named.get("scene")
            return _untraced(function)(*arguments, **as_keywords(scene, named, known))
        except Interrupted:
            raise
        except KeyboardInterrupt as stopped:
            name = function.__name__
            raise Interrupted(f"{name}: interrupted before there was a result") from stopped

    return called


_TRACED = (
    "{0} inside {1}: a trace records operations of torch, and a solve is none of them, so its results would be constants "
    "there. Call {0} itself; torch.compile does, and torch.func.jvp has what torch.func.linearize returns"
)


def _tracer() -> str:
    """Return the name of what records the operations of torch at the moment, "" if nothing does."""
    torch = sys.modules.get("torch")
    if torch is None:
        return ""
    if torch.jit.is_tracing():
        return "torch.jit.trace"
    proxies = sys.modules.get("torch.fx.experimental.proxy_tensor")
    if proxies is not None and proxies.get_proxy_mode() is not None:
        return "make_fx (which torch.func.linearize and torch.export use)"
    symbolic = sys.modules.get("torch.fx._symbolic_trace")
    if symbolic is not None and getattr(symbolic, "_is_fx_tracing_flag", False):
        return "torch.fx.symbolic_trace"
    stack = getattr(torch._C._functorch, "peek_interpreter_stack", lambda: None)()
    if stack is not None and stack.key().name == "Functionalize":
        return "torch.func.functionalize"
    return ""


_disabled: dict[Callable[..., Any], Callable[..., Any]] = {}


def _untraced(function: Callable[..., Any]) -> Callable[..., Any]:
    """Hide the function from torch.compile, if that has been loaded; loading it takes seconds."""
    if "torch._dynamo" not in sys.modules:
        return function
    if function not in _disabled:
        _disabled[function] = sys.modules["torch"].compiler.disable(function)
    return _disabled[function]
