"""Lists what happens along a path of equilibria: ms.PathEvent."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached
from ..._runtime.frozen import immutable
from ...model.scene.contact_state import compute_contact_state

_LOCATED = 1e-6  # of the step between two points of the path, to which a change of a contact is located

if TYPE_CHECKING:
    from ...model.contact.body_contact import BodyContact
    from ...model.contact.contact import Contact
    from .path import EquilibriumPath


@immutable
@dataclass(frozen=True)
class PathEvent:
    """Describes what happens at one place of a path of equilibria.

    kind: "limit", "bifurcation" or "flutter", as CriticalPoint has them, or "contact made" or "contact lost".
    parameter: on the path; of contacts to a millionth of the step, or that of the first point after the change where no
        equilibrium between both points is found.
    after_point: index of the last point of the path before it. contact: the one that is made or lost, else None.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (-0.4, 0, 0))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    >>> ms.follow_path(scene).events[0].kind
    'bifurcation'
    """

    kind: str
    parameter: float
    after_point: int
    contact: Contact | BodyContact | None = field(default=None, repr=False)


def events_along(path: EquilibriumPath) -> tuple[PathEvent, ...]:
    """Return the critical points of a path and the changes of its contacts, in their order along it."""
    events = [
        PathEvent(point.kind, float(detached(point.parameter)), point.after_point) for point in path.critical
    ]
    for contact in path.scene.contacts:
        in_contact = [_acts(path, contact, path.parameters[k], path._state_at(k)) for k in range(len(path))]
        events += [
            PathEvent(
                "contact made" if in_contact[k] else "contact lost",
                _parameter_of_change(path, contact, k, in_contact[k]),
                k - 1,
                contact,
            )
            for k in np.flatnonzero(np.diff(in_contact)) + 1
        ]
    return tuple(sorted(events, key=lambda event: (event.after_point, _along_step(path, event))))


def _along_step(path: EquilibriumPath, event: PathEvent) -> float:
    """Return how far an event is from the point before it, as a parameter of the path."""
    return abs(event.parameter - float(path.parameters[event.after_point]))


def _acts(path: EquilibriumPath, contact: Any, parameter: float, state: np.ndarray) -> bool:
    """Return whether any points of a contact touch in a state of the path."""
    now = compute_contact_state(path.scene, path._moving.values(parameter), contact, state)
    return bool(np.any(now.normal_forces > 0.0))


def _parameter_of_change(path: EquilibriumPath, contact: Any, k: int, made: bool) -> float:
    """Return the parameter at which a contact changes between the points k - 1 and k, by bisection.

    A state between them is solved for from the one before it. It must lie between both points, not on another branch;
    where none does, the parameter of point k is returned.
    """
    last = float(path.parameters[k])
    before, after = (float(path.parameters[k - 1]), path._points[k - 1]), (last, path._points[k])
    step = np.linalg.norm(after[1].state - before[1].state)
    allowed = _LOCATED * abs(last - before[0]) + np.spacing(abs(last) + abs(before[0]))
    while abs(after[0] - before[0]) > allowed:
        middle = 0.5 * (before[0] + after[0])
        found = path._solved_from(before[1], middle)
        if found is None or np.linalg.norm(found.state - before[1].state) > step:
            return last
        if _acts(path, contact, middle, found.state) == made:
            after = middle, found
        else:
            before = middle, found
    return after[0]
