"""The sentence in printed results that tells whether a shell passes through itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .triangle_mesh import TriangleMesh

# Number of faces that are checked when a result is printed or drawn: this takes some 30 ms.
AFFORDABLE_FACES = 20_000


def describe_self_intersections(
    mesh: TriangleMesh, states: np.ndarray, why: Callable[[np.ndarray], str] | None = None
) -> str:
    """Describe whether a shell passes through itself in its states, (n, n_v, 3) m.

    why: says at the positions (n_v, 3) m of the first state that does what does not keep it from doing so. To stay
    fast, only the last state of a long motion is checked, and no state of a large mesh; the text says so.
    """
    count = len(states)
    if not count or mesh.n_faces > AFFORDABLE_FACES:
        return "whether it passes through itself: ask self_intersections()"
    checked = range(count) if count * mesh.n_faces <= AFFORDABLE_FACES else [count - 1]
    pairs = {k: len(mesh.self_intersections(states[k])) for k in checked}
    crossing = [k for k, found in pairs.items() if found]
    where = "" if count == 1 else " in any state" if len(pairs) == count else " in the last state"
    if not crossing:
        return f"does not pass through itself{where}"
    at = (
        ""
        if count == 1
        else f" in state {crossing[0]}"
        if len(crossing) == 1
        else f" in {len(crossing)} states"
    )
    faces = f"{pairs[crossing[0]]} pairs of faces"
    faces += f", first in state {crossing[0]}" if len(crossing) > 1 else ""
    reason = "as nothing keeps parts of a sheet apart" if why is None else why(states[crossing[0]])
    return f"PASSES THROUGH ITSELF{at} ({faces}), {reason}"
