"""Mixins that give results, scenes and meshes the methods plot(), save(), plot_history() and animate().

The functions behind them belong to packages that import this one; they register themselves here when they are
imported.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from .frozen import Frozen

F = TypeVar("F", bound=Callable)

_FUNCTIONS: dict[str, Callable] = {}


def register_method(function: F) -> F:
    """Register the function that the mixins' method of the same name calls. A decorator."""
    _FUNCTIONS[function.__name__] = function
    return function


def call_registered(name: str, *arguments: Any) -> Any:
    """Call a registered function by its name."""
    return _FUNCTIONS[name](*arguments)


class PlotMixin(Frozen):
    """A mixin for objects that ms.plot can draw."""

    def plot(self, *unnamed: Any, **options: Any) -> Any:
        """Draw a picture: ms.plot(self, ...), with the keywords of ms.plot, which refuses arguments without a name."""
        return _FUNCTIONS["plot"](self, *unnamed, **options)


class SaveMixin(PlotMixin):
    """A mixin for results, which ms.save can write and ms.plot_history can draw."""

    _how_to_change = (
        "It is what a solve found; to go on from other positions, start the next solve from a changed copy: "
        "ms.equilibrium(scene, start=positions)"
    )

    def save(self, path: Any) -> None:
        """Write the result into one .npz file: ms.save(path, self). ms.load(path, scene) reads it."""
        _FUNCTIONS["save"](path, self)

    def plot_history(self, columns: Any, **options: Any) -> Any:
        """Draw columns of the result's table as curves: ms.plot_history(self, columns, ...), with its keywords."""
        return _FUNCTIONS["plot_history"](self, columns, **options)


class AnimateMixin(SaveMixin):
    """A mixin for results with a sequence of states."""

    def animate(self, path: Any, **options: Any) -> Any:
        """Write a movie, a .gif or an .mp4: ms.animate(self, path, ...), with its keywords."""
        return _FUNCTIONS["animate"](self, path, **options)
