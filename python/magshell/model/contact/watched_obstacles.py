"""Obstacles that move and may slip through a mesh, between the points at which contact acts.

Contact acts at vertices and sample points on faces. An obstacle that is small compared with the faces meets no force between
them. Where an obstacle moves in a solve, no face may therefore sweep over points on its middle.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshQualityWarning
from .contacts_to_core import contact_points, obstacles_of

if TYPE_CHECKING:
    from ..scene.scene import Scene
    from .contact import Contact
    from .obstacles.obstacle import Obstacle

# [-] Radius of the largest ball between the points in contact of equilateral faces, over their edge, by face_samples; see
# test_a_ball_that_fits_between_the_contact_points_is_warned_of.
_GAPS = {0: 1.0 / np.sqrt(3.0), 1: 1.0 / 3.0, 3: 0.5 / np.sqrt(3.0)}


def watched_obstacles(
    scene: Scene, moving: Iterable[Obstacle], only_small: bool = False
) -> list[_core.WatchedObstacle]:
    """Return the given obstacles, which move, or the mesh over them, for the core, with the faces not to slip through.

    Warns if an obstacle is so small that it fits between the points in contact. only_small: leaves out the others, which
    no short step can pass through.
    """
    ids = {id(each) for each in moving}
    watched = []
    for contact in scene._obstacle_contacts if ids else ():
        if contact.shapes:
            continue
        faces = _faces_in_contact(scene, contact)
        if not len(faces):
            continue
        corners = scene.mesh.rest_positions[faces]
        edge = float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))
        for number, obstacle in enumerate(obstacles_of(scene._obstacle_contacts)):
            if id(obstacle) not in ids or not any(obstacle is each for each in contact.obstacles):
                continue
            middles, radius = obstacle._middle
            gap = _GAPS[contact.face_samples] * edge
            if len(middles) and radius < gap:
                _warn_of_gap(contact, obstacle, radius, edge)
            if len(middles) and (radius < gap or not only_small):
                watched.append(_core.WatchedObstacle(number, middles, faces))
    return watched


def _faces_in_contact(scene: Scene, contact: Contact) -> np.ndarray:
    """Return the faces whose corners are all in contact, (k, 3) vertices of the scene."""
    vertices, _ = contact_points(scene._bodies, contact)
    alone = vertices[vertices[:, 1] < 0, 0]
    faces = scene.mesh.faces
    return faces[np.isin(faces, alone).all(axis=1)].astype(np.int32)


def _warn_of_gap(contact: Contact, obstacle: Obstacle, radius: float, edge: float) -> None:
    gap = _GAPS[contact.face_samples] * edge
    samples = ", or face_samples=3 in the Contact" if contact.face_samples != 3 else ""
    warnings.warn(
        f"{obstacle!r} may enter the faces of the mesh between the points in contact without a force: a ball of "
        f"up to {gap:.3g} m radius fits between them (edges of {edge:.3g} m), and the obstacle's radius is {radius:.3g} m. "
        f"Use shorter edges{samples}",
        MeshQualityWarning,
        stacklevel=callers_level(),
    )
