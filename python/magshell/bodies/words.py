"""What messages call the bodies of a scene."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .shell import Shell
from .solid import Solid


def called(bodies: Iterable[Any]) -> str:
    """Return "the sheet" for one Shell, "the solids" for several Solids, "the body" or "the bodies" otherwise.

    >>> import magshell as ms
    >>> called([ms.Solid(ms.meshes.box((1.0, 1.0, 1.0), cells=(2, 2, 2)), material=ms.NeoHookean(young_modulus=1e5))])
    'the solid'
    """
    every = list(bodies)
    kinds = {
        "sheet" if isinstance(body, Shell) else "solid" if isinstance(body, Solid) else "" for body in every
    }
    if kinds in ({"sheet"}, {"solid"}):
        return f"the {kinds.pop()}{'' if len(every) == 1 else 's'}"
    return "the body" if len(every) == 1 else "the bodies"
