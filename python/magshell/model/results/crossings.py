"""The sentence in printed results that tells whether bodies pass through each other or through themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...mesh.triangles.self_intersections import describe_self_intersections
from ..contact.body_contact import BodyContact

if TYPE_CHECKING:
    from ..scene.scene import Scene


def describe_crossings(scene: Scene, states: np.ndarray) -> str:
    """Describe whether surfaces of a scene pass through each other in its states, (n, n_v, 3) m.

    It names the bodies, and the contact that would keep them apart.
    """
    return describe_self_intersections(scene.mesh, states, lambda positions: _of_bodies(scene, positions))


def crossing_bodies(scene: Scene, positions: np.ndarray) -> str:
    """Return the names of the first two bodies that pass through each other, such as "body 0 and body 2", or ""."""
    return next((_names(*pair) for pair in sorted(_crossings(scene, positions)) if pair[0] != pair[1]), "")


def describe_attraction(scene: Scene) -> str:
    """Return a sentence for a solve that fails if bodies attract each other and no contact keeps them apart, else ""."""
    if scene.own_field is None or len(scene.bodies) < 2 or scene._body_contacts:
        return ""
    return (
        "Bodies with an own field attract each other until they touch, and nothing but an ms.Contact of two of them keeps "
        "them apart."
    )


def _of_bodies(scene: Scene, positions: np.ndarray) -> str:
    found = []
    for (first, second), count in sorted(_crossings(scene, positions).items()):
        if first == second:
            whose = "a sheet" if len(scene.bodies) == 1 else f"body {first}"
            apart = "as nothing keeps parts of {} apart"
            if _has_contact(scene, first, second):
                apart = "in spite of the contact of {} with itself"
            found.append(apart.format(whose))
        else:
            names = f"{_names(first, second)} pass through each other ({count})"
            apart = (
                "in spite of their contact"
                if _has_contact(scene, first, second)
                else "as no ms.Contact of the two keeps them apart"
            )
            found.append(f"{names}, {apart}")
    return "; ".join(found)


def _crossings(scene: Scene, positions: np.ndarray) -> dict[tuple[int, int], int]:
    """Return the number of pairs of faces that cross, of each pair of bodies."""
    pairs = scene.mesh.self_intersections(positions)
    if not len(pairs):
        return {}
    firsts = np.array([span.first_face for span in scene._bodies.spans])
    bodies = np.sort(np.searchsorted(firsts, pairs, side="right") - 1, axis=1)
    kinds, counts = np.unique(bodies, axis=0, return_counts=True)
    return {(int(a), int(b)): int(count) for (a, b), count in zip(kinds, counts, strict=True)}


def _has_contact(scene: Scene, first: int, second: int) -> bool:
    one, other = scene.bodies[first], scene.bodies[second]
    return any(
        {id(one), id(other)} <= {id(each) for each in contact._sides}
        for contact in scene.contacts
        if isinstance(contact, BodyContact)
    )


def _names(first: int, second: int) -> str:
    return f"body {first} and body {second}"
