"""The surroundings of bodies in a picture: obstacles as transparent solids, magnets, and what bodies carry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model.contact.obstacles import Obstacle, Plane
from ..results.state import State
from . import colors
from .solids import Solid, ribbons, sheet

OPACITY = 0.35
REACH = 1.6  # [-] side of the square that represents a plane, over the size of the drawing
LARGE = 2.0  # [-] size of an obstacle over that of the bodies, above which it is shown in part only
EDGE_ON = 0.02  # [-] cosine of the angle between the normal of a plane and the eye, below which it is drawn as a line
GROUND = 0.0045  # [-] width of the line of a plane over the size of the drawing
HATCH = 0.03  # [-] distance of the strokes below it, likewise
ROOM = 0.15  # [-] distance from the bodies up to which such an obstacle is shown, over their size


def obstacle_solids(
    states: list[State], size: float, middle: np.ndarray, eye: np.ndarray | None = None
) -> list[Solid]:
    """Return the obstacles and magnets of states in one panel; those that do not move appear once.

    size: of the drawing, m. middle: (3,) m, the point around which the square of a plane lies. eye: (3,), the direction of
    the eye; a plane seen edge-on is a hatched line then.
    """
    shown = {}
    for state in states:
        time = state.time or 0.0
        for obstacle in state.obstacles:
            key = (id(obstacle), None if obstacle.motion is None else time)
            if key not in shown:
                if eye is not None and (line := _ground_line(obstacle, time, middle, size, eye)) is not None:
                    shown[key] = line
                    continue
                vertices, faces = obstacle.surface(time, extent=REACH * size, around=middle)
                surface = sheet(vertices, faces, colors.rgb(colors.OBSTACLE))
                shown[key] = replace(surface, opacity=OPACITY, around=True)
    for state in states:
        for points, faces in state.magnets:
            key = (points.tobytes(), None)
            surface = sheet(points, faces, colors.rgb(colors.MAGNET))
            shown.setdefault(key, replace(surface, around=True, smooth=False))  # blocks have sharp edges
    return list(shown.values())


def inner_solids(state: State) -> list[tuple[str, Solid]]:
    """Return the links, tendons, springs and free rigid bodies of a state, each with its kind."""
    kinds = (
        ("link", state.links, colors.LINK),
        ("tendon", state.tendons, colors.TENDON),
        ("spring", state.springs, colors.SPRING),
        ("rigid_body", state.shapes, colors.LINK),
    )
    return [(name, sheet(*each, colors.rgb(code))) for name, surfaces, code in kinds for each in surfaces]


def _ground_line(
    obstacle: Obstacle, time: float, near: np.ndarray, size: float, eye: np.ndarray
) -> Solid | None:
    """Return a plane that is seen edge-on as a line with strokes on its solid side; None for others."""
    if not isinstance(obstacle, Plane):
        return None
    normal = obstacle.normals(near[None], time)[0]
    if abs(normal @ eye) > EDGE_ON:
        return None
    along = np.cross(eye, normal)
    along /= np.linalg.norm(along)
    foot = near - obstacle.signed_distance(near[None], time)[0] * normal
    half, step = 0.5 * REACH * size, HATCH * size
    starts = foot + np.arange(-half + step, half, step)[:, None] * along
    strokes = np.stack([starts, starts - 0.7 * step * (normal + along)], axis=1)
    line = np.stack([foot - half * along, foot + half * along])[None]
    thick = ribbons(line, eye, GROUND * size, colors.OBSTACLE, 0.0)
    thin = ribbons(strokes, eye, 0.5 * GROUND * size, colors.OBSTACLE, 0.0)
    return replace(
        thick,
        positions=np.concatenate([thick.positions, thin.positions]),
        faces=np.concatenate([thick.faces, thin.faces + len(thick.positions)]),
        colors=np.concatenate([thick.colors, thin.colors]),
        around=True,
    )


def box_of(bodies: list[np.ndarray], around: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corner of a box on the screen around points (n, 2 or 3) of bodies and surroundings.

    Surroundings that are much larger than the bodies are included only near the bodies.
    """
    low, high = (end([end(each, axis=0) for each in bodies], axis=0) for end in (np.min, np.max))
    extent = float((high - low)[:2].max())
    ends = [low, high]
    for points in around:
        if np.ptp(points[:, :2], axis=0).max() > LARGE * extent:
            points = np.clip(points, low - ROOM * extent, high + ROOM * extent)
        ends += [points.min(axis=0), points.max(axis=0)]
    return np.min(ends, axis=0), np.max(ends, axis=0)
