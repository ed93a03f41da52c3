"""Methods by which results, scenes and meshes draw and save themselves: short forms of functions of rooms above theirs,
which offer them as they are imported."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from .frozen import Frozen

F = TypeVar("F", bound=Callable)

_FUNCTIONS: dict[str, Callable] = {}


def offered(function: F) -> F:
    """A function that is a method of what it is about, too."""
    _FUNCTIONS[function.__name__] = function
    return function


class Drawn(Frozen):
    """What ms.plot draws."""

    def plot(self, **options: Any) -> Any:
        """A picture: ms.plot(self, ...), with its keywords."""
        return _FUNCTIONS["plot"](self, **options)


class Kept(Drawn):
    """A result that ms.save writes."""

    _way = (
        "It is what a solve found; to go on from other positions, start the next solve from a changed copy: "
        "ms.equilibrium(scene, start=positions)"
    )

    def save(self, path: Any) -> None:
        """Writes it into one .npz file: ms.save(path, self). ms.load(path, scene) makes it again."""
        _FUNCTIONS["save"](path, self)


class Filmed(Kept):
    """A result of several states, one after another."""

    def animate(self, path: Any, **options: Any) -> Any:
        """Writes a movie, a .gif or an .mp4: ms.animate(self, path, ...), with its keywords."""
        return _FUNCTIONS["animate"](self, path, **options)
