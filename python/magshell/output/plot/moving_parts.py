"""The parts of states as surfaces whose points move, for formats that other programs animate: USD and glTF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..results.state import State, states_of, with_times
from ..results.units import length_unit
from . import colors
from .panels import size_of
from .playback import same_faces, speed_of
from .solids import Solid
from .style import colored
from .surfaces import on_surfaces, scalar_on_surfaces
from .surroundings import inner_solids, obstacle_solids

if TYPE_CHECKING:
    from ..._input.kinds import Fielded, Numbers, Shown
    from ...model.contact.obstacles.obstacle import Obstacle

STATES_PER_SECOND = 10.0  # of states without times


@dataclass(frozen=True)
class Part:
    """A surface in all states.

    name: unique among the parts. faces: (m, 3). points: (k, n, 3) m, one row per state; one row for a part that does not
    move. colors: from 0 to 1, (m, 3) or (n, 3) for each state, or one array for all.
    """

    name: str
    faces: np.ndarray
    points: np.ndarray
    colors: list[np.ndarray]
    opacity: float = 1.0


@dataclass(frozen=True)
class Motion:
    """The parts of some states, and the times (k,) s at which a viewer shows them."""

    parts: list[Part]
    times: np.ndarray


def moving_parts(
    what: Shown,
    *,
    positions: Numbers | None = None,
    times: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    field: Fielded | None = None,
    obstacles: Obstacle | Sequence[Obstacle] | None = None,
    color: Any = "auto",
    speed: float | None = None,
) -> Motion:
    """Collect the bodies and their surroundings. Raises ValueError for states of different meshes or surroundings."""
    states = states_of(
        what,
        positions=positions,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
        obstacles=obstacles,
    )
    same_faces(states, "a file")
    states = with_times(states, times)
    speed = speed_of(states, speed)
    size = size_of(states)
    scalar = scalar_on_surfaces(colored(states, color, length_unit(size)), states)
    states = on_surfaces(states)
    mesh = states[0].mesh
    shades = [np.broadcast_to(colors.rgb(colors.SHEET), (mesh.n_faces, 3))]
    if scalar is not None:
        shades = _without_repeats([scalar.colors(number) for number in range(len(states))])
    bodies = Part("bodies", mesh.faces, _without_still(np.stack([s.positions for s in states])), shades)
    return Motion([bodies, *_surroundings(states, size)], _shown_at(states, speed))


def _surroundings(states: list[State], size: float) -> list[Part]:
    middle = np.concatenate([state.positions for state in states]).mean(axis=0)
    frames = [_solids(state, size, middle) for state in states]
    found = []
    for solids in zip(*frames, strict=False):
        name, first = solids[0]
        same = all(np.array_equal(each.faces, first.faces) for _, each in solids)
        if not same or len({len(frame) for frame in frames}) > 1:
            raise ValueError(
                f"the {name} of these states have different faces: write the states into files of their own"
            )
        points = _without_still(np.stack([each.positions for _, each in solids]))
        found.append(Part(f"{name}_{len(found)}", first.faces, points, [first.colors], first.opacity))
    return found


def _solids(state: State, size: float, middle: np.ndarray) -> list[tuple[str, Solid]]:
    """Return the surfaces around the bodies of a state, with their kinds: obstacles, magnets, links, tendons,
    springs, shapes.
    """
    around = [
        ("magnet" if each.opacity == 1.0 else "obstacle", each)
        for each in obstacle_solids([state], size, middle)
    ]
    return around + inner_solids(state)


def _shown_at(states: list[State], speed: float) -> np.ndarray:
    times = [state.time for state in states]
    if times[0] is None:
        return np.arange(len(states)) / STATES_PER_SECOND
    return (np.array(times) - times[0]) / speed


def _without_still(points: np.ndarray) -> np.ndarray:
    """Return one row of points (k, n, 3) if all rows are the same."""
    return points[:1] if (points == points[0]).all() else points


def _without_repeats(shades: list[np.ndarray]) -> list[np.ndarray]:
    return shades[:1] if all(np.array_equal(each, shades[0]) for each in shades) else shades
