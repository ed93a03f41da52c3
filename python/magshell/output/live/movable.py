"""Sources of a field that a live view can move: magnets, placed fields, and single dipoles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from ...mesh.triangles.triangle_mesh import TriangleMesh
from ...model.contact.obstacles.obstacle import Obstacle
from ...model.fields.field import AppliedField, Dipoles
from ...model.fields.magnets import Magnet
from ...model.fields.posed_field import PlacedField
from ...model.scene.scene import Scene
from ..plot import colors
from ..plot.solids import arrows
from ..results.magnets import surfaces_of

MOST_DIPOLES = 8  # of one field that are moved one by one; more of them stay
NORTH, SOUTH = "#d8705f", "#5b8fc9"  # halves of a magnet, by the sign of x . M_r
_DIPOLE = 0.12  # [-] length of a dipole's arrow over the size of the bodies
_POSE = ("center", "rotation")
_SAME = 1e-9  # [m] distance of centers at which an obstacle belongs to a magnet

Surface = tuple[np.ndarray, np.ndarray, str]  # vertices (n, 3) m, faces (m, 3), "#rrggbb"


@dataclass
class Movable:
    """A source with its pose: a center (3,) m and a rotation vector (3,) rad.

    row: the number of a dipole among those of its field, otherwise None. covers: obstacles with the same center, which move
    along.
    """

    source: AppliedField
    center: np.ndarray
    rotation: np.ndarray
    row: int | None = None
    moment: np.ndarray | None = None
    covers: tuple[Obstacle, ...] = ()

    def values(self) -> dict[Any, dict[str, np.ndarray]]:
        """Return the values of the source and its covers in its present pose, as a solve takes them."""
        if self.row is None:
            found = {self.source: {"center": self.center, "rotation": self.rotation}}
        else:
            moment = scipy.spatial.transform.Rotation.from_rotvec(self.rotation).apply(self.moment)
            found = {self.source: {"positions": self.center, "moments": moment}}
        turned = (
            scipy.spatial.transform.Rotation.from_rotvec(self.rotation)
            * scipy.spatial.transform.Rotation.from_rotvec(self.first_rotation).inv()
        )
        for cover in self.covers:
            rotation = (
                turned * scipy.spatial.transform.Rotation.from_rotvec(np.array(cover.rotation))
            ).as_rotvec()
            found[cover] = {"center": self.center, "rotation": rotation}
        return found

    def __post_init__(self) -> None:
        self.first_rotation: np.ndarray = np.array(self.rotation)

    def surfaces(self, size: float) -> list[Surface]:
        """Return the surfaces of the source in a frame at its center that turns with it. size: of the bodies, m."""
        if self.moment is not None:
            along = self.moment / (np.linalg.norm(self.moment) or 1.0) * (_DIPOLE * size)
            arrow = arrows(-0.5 * along[None], along[None], 0.1 * _DIPOLE * size, colors.MAGNET)
            return [(arrow.positions, arrow.faces, colors.MAGNET)]
        back = scipy.spatial.transform.Rotation.from_rotvec(np.array(self.source.rotation)).inv()
        own = [(back.apply(points - self.source.center), faces) for points, faces in surfaces_of(self.source)]
        if not isinstance(self.source, Magnet):
            return [(points, faces, colors.MAGNET) for points, faces in own]
        own = [_refined(*each) for each in own]  # so that faces end where its halves meet
        north = [points[faces].mean(axis=1) @ self.source.remanent_magnetization > 0 for points, faces in own]
        return [
            (points, faces[half], color)
            for (points, faces), above in zip(own, north, strict=True)
            for half, color in ((above, NORTH), (~above, SOUTH))
        ]


def movables_of(scene: Scene, values: dict[Any, Any] | None) -> list[Movable]:
    """Return the sources of a scene that can be moved, in the poses of `values` if these have them."""
    found = []
    for source in scene.fields:
        given = (values or {}).get(source, {})
        if isinstance(source, Magnet | PlacedField):
            center, rotation = (
                np.array(given.get(name, getattr(source, name)), dtype=float) for name in _POSE
            )
            covers = tuple(each for each in scene.obstacles if _covers(each, source))
            found.append(Movable(source, center, rotation, covers=covers))
        elif isinstance(source, Dipoles) and len(source.positions) <= MOST_DIPOLES:
            places, moments = (
                np.array(given.get(name, getattr(source, name)), dtype=float)
                for name in ("positions", "moments")
            )
            found += [
                Movable(source, place, np.zeros(3), row, moment)
                for row, (place, moment) in enumerate(zip(places, moments, strict=True))
            ]
    return found


def values_of(movables: list[Movable]) -> dict[Any, dict[str, np.ndarray]]:
    """Return the values of all sources in their present poses; the dipoles of one field are put together."""
    found: dict[Any, dict[str, np.ndarray]] = {}
    rows: dict[Any, list[dict[str, np.ndarray]]] = {}
    for each in movables:
        values = each.values()
        if each.row is None:
            found |= values
        else:
            rows.setdefault(each.source, []).append(values[each.source])
    stacked = {
        source: {name: np.stack([row[name] for row in of_source]) for name in of_source[0]}
        for source, of_source in rows.items()
    }
    return found | stacked


def _refined(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    mesh = TriangleMesh(points, faces).refined()
    return mesh.rest_positions, mesh.faces


def _covers(obstacle: Obstacle, source: Magnet | PlacedField) -> bool:
    """Return whether an obstacle without a motion of its own has the center of a magnet."""
    return obstacle.motion is None and np.abs(obstacle.center - source.center).max() <= _SAME
