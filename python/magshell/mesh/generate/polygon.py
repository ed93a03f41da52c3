"""Checks and intersections of planar polygons and polylines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import quantity

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


def is_polyline(points: object) -> bool:
    """Return whether the points are a single polyline, (n, 2), rather than a list of polylines."""
    try:
        shape = np.shape(points)
    except ValueError:  # lists of different lengths
        return False
    return len(shape) == 2 and shape[1] == 2


def checked_polyline(name: str, points: Numbers, least: int) -> np.ndarray:
    """Check a polyline and return it, (n, 2) m: finite points, n >= least, no two consecutive ones equal."""
    array = quantity(name, "m", points, ("n", 2))
    if len(array) < least:
        raise ValueError(f"{name} must have at least {least} points, got {len(array)}")
    same = np.flatnonzero((array[1:] == array[:-1]).all(axis=1))
    if len(same):
        raise ValueError(
            f"{name} repeats point {same[0]} as point {same[0] + 1}, {array[same[0]].tolist()} m"
        )
    return array


def checked_polygon(name: str, points: Numbers) -> np.ndarray:
    """Check a polygon and return it, (n, 2) m: it must not intersect itself, nor repeat its first point at the end."""
    polygon = checked_polyline(name, points, 3)
    if (polygon[0] == polygon[-1]).all():
        raise ValueError(f"{name} ends with its first point; leave that out, polygons close by themselves")
    crossing = _meeting_sides(polygon)
    if crossing is not None:
        raise ValueError(f"{name} intersects itself: its sides {crossing[0]} and {crossing[1]} meet")
    return polygon


def sides(polygon: np.ndarray) -> np.ndarray:
    """Return the start and end of each side of a polygon, (n, 2, 2)."""
    return np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1)


def segments(polyline: np.ndarray) -> np.ndarray:
    """Return the start and end of each segment of a polyline, (n - 1, 2, 2)."""
    return np.stack([polyline[:-1], polyline[1:]], axis=1)


def contains(polygon: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return whether each point (n, 2) is inside a polygon, by the parity of crossings of a ray along +x.

    The result is undefined for points on a side.
    """
    start, end = np.moveaxis(sides(polygon), 1, 0)
    x, y = points[:, None, 0], points[:, None, 1]
    spans = (start[:, 1] > y) != (end[:, 1] > y)
    rise = np.where(end[:, 1] == start[:, 1], 1.0, end[:, 1] - start[:, 1])
    reached = start[:, 0] + (y - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
    return (spans & (x < reached)).sum(axis=1) % 2 == 1


def distance_to(polygon: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the distance of each point (n, 2) from the nearest side of a polygon, (n,)."""
    start, end = np.moveaxis(sides(polygon), 1, 0)
    along = end - start
    offset = points[:, None] - start
    t = np.clip((offset * along).sum(-1) / (along**2).sum(-1), 0.0, 1.0)
    return np.linalg.norm(offset - t[..., None] * along, axis=-1).min(axis=1)


def crossings(first: np.ndarray, second: np.ndarray, include_contacts: bool) -> np.ndarray:
    """Return the pairs of segments (k, 2), one of each list, that cross.

    first, second: (n, 2, 2) and (m, 2, 2), the ends of the segments. include_contacts: count as well segments that only
    share a point.
    """
    block = max(1, 1_000_000 // max(len(second), 1))  # rows at a time, so that memory stays bounded
    starts = range(0, len(first), block)
    found = [np.array([k, 0]) + _crossings(first[k : k + block], second, include_contacts) for k in starts]
    return np.concatenate(found)


def meeting_point(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the point (2,) at which the lines through two crossing segments (2, 2) meet."""
    along, across = first[1] - first[0], second[1] - second[0]
    offset = second[0] - first[0]
    t = (offset[0] * across[1] - offset[1] * across[0]) / (along[0] * across[1] - along[1] * across[0])
    return first[0] + t * along


def _crossings(first: np.ndarray, second: np.ndarray, include_contacts: bool) -> np.ndarray:
    a, b = first[:, None, 0], first[:, None, 1]
    c, d = second[None, :, 0], second[None, :, 1]
    abc, abd = _orientation(a, b, c), _orientation(a, b, d)
    cda, cdb = _orientation(c, d, a), _orientation(c, d, b)
    hit = (abc * abd < 0) & (cda * cdb < 0)
    if include_contacts:
        for side, p, q, r in ((abc, a, b, c), (abd, a, b, d), (cda, c, d, a), (cdb, c, d, b)):
            within = ((np.minimum(p, q) <= r) & (r <= np.maximum(p, q))).all(axis=-1)
            hit |= (side == 0) & within
    return np.argwhere(hit)


def _orientation(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Return the orientation of the triangles p, q, r: +1 counter-clockwise, -1 clockwise, 0 collinear up to round-off."""
    u, v = q - p, r - p
    cross = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    magnitude = np.abs(u[..., 0] * v[..., 1]) + np.abs(u[..., 1] * v[..., 0])
    return np.where(np.abs(cross) <= 1e-14 * magnitude, 0.0, np.sign(cross))


def _meeting_sides(polygon: np.ndarray) -> tuple[int, int] | None:
    """Find two sides of a polygon that meet and are not neighbours, or overlapping neighbours; None if there are none."""
    n = len(polygon)
    all_sides = sides(polygon)
    for i, j in crossings(all_sides, all_sides, include_contacts=True):
        if i < j and (j - i) not in (1, n - 1):
            return int(i), int(j)
    for i in range(n):  # adjacent sides share a point; they must not run back onto each other
        before, here, after = polygon[i - 1], polygon[i], polygon[(i + 1) % n]
        if _orientation(before, here, after) == 0 and np.dot(here - before, after - here) < 0:
            return (i - 1) % n, i
    return None
