"""Names the bodies of a scene in messages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..shells.shell import Shell
from ..solids.solid import Solid


def called(bodies: Iterable[Any]) -> str:
    """Return "the sheet" for one Shell, "the solids" for several Solids, "the body" or "the bodies" otherwise.

    >>> import magshell as ms
    >>> sheet = ms.Shell(ms.meshes.rectangle(0.1, 0.02, cells=(10, 2)), thickness=1e-3, young_modulus=1e5)
    >>> called([sheet]), called([sheet, ms.RigidBody(mass=1.0, inertia=1.0, center=(0, 0, 0))])
    ('the sheet', 'the bodies')
    """
    every = list(bodies)
    kinds = {
        "sheet" if isinstance(body, Shell) else "solid" if isinstance(body, Solid) else "" for body in every
    }
    if kinds in ({"sheet"}, {"solid"}):
        return f"the {kinds.pop()}{'' if len(every) == 1 else 's'}"
    return "the body" if len(every) == 1 else "the bodies"
