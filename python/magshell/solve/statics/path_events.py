"""Lists what happens along a path of equilibria: ms.PathEvent."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached
from ..._runtime.frozen import immutable
from ...model.scene.contact_state import compute_contact_state

if TYPE_CHECKING:
    from ...model.contact.body_contact import BodyContact
    from ...model.contact.contact import Contact
    from .path import EquilibriumPath


@immutable
@dataclass(frozen=True)
class PathEvent:
    """Describes what happens at one place of a path of equilibria.

    kind: "limit", "bifurcation" or "flutter", as CriticalPoint has them, or "contact made" or "contact lost".
    parameter: on the path; of contacts that of the first point after the change, which is at most a step late.
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
        in_contact = [_is_in_contact(path, contact, k) for k in range(len(path))]
        events += [
            PathEvent(
                "contact made" if in_contact[k] else "contact lost", float(path.parameters[k]), k - 1, contact
            )
            for k in np.flatnonzero(np.diff(in_contact)) + 1
        ]
    return tuple(sorted(events, key=lambda event: event.after_point))


def _is_in_contact(path: EquilibriumPath, contact: Any, index: int) -> bool:
    """Return whether any points of a contact touch at a point of the path."""
    state = compute_contact_state(path.scene, path._values_at(index), contact, path._state_at(index))
    return bool(np.any(state.normal_forces > 0.0))
