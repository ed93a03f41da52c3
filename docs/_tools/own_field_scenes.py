"""The pictures of the examples with an own field, as in example_scenes.py."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from example_scenes import film, shown
from front_page_scenes import ACCENT, SHEET, Scene

import magshell as ms


def snapping_flaps() -> dict[str, Any]:
    from _own_field.flaps import flaps

    pair = flaps((12, 4), own_field=True)
    fields = [0.0, -0.25e-3, -0.5e-3, -1e-3, 0.0, *np.linspace(1e-3, 6e-3, 6)]
    states = [state.positions for state in pair.states(np.array(fields))]
    lower, upper = pair.flaps
    first = lower.mesh.n_vertices
    parts = [(lower.mesh.faces, SHEET), (upper.mesh.faces + first, ACCENT)]
    return shown(_eased(states), parts, (12, -70), held=8)


def self_folding() -> dict[str, Any]:
    from _own_field.leaves import folding_strip, program

    strip = folding_strip(26, own_field=True)
    states = [state.positions for state in strip.states(program(8))]
    leaf = strip.shell.mesh.face_barycenters[:, 0] > 19.5e-3
    parts = [
        (strip.shell.mesh.faces[~leaf], SHEET),
        (strip.shell.mesh.faces[leaf], ACCENT),
    ]
    return shown(_eased(states), parts, (14, -70), held=8)


def bead_chain() -> dict[str, Any]:
    from _own_field.beads import DIAMETER, DIRECTIONS, chain

    ball = ms.meshes.spherical_cap(0.5 * DIAMETER, 0.0, np.pi, cells=(12, 8))
    around = ball.rest_positions - ball.rest_positions.mean(axis=0)
    chains = [chain(moments, own_field=True, cells=4) for moments in DIRECTIONS]
    gap = np.array([0.0, 0.012, 0.0])
    parts: list[tuple[np.ndarray, Any]] = []
    first, frames = 0, []
    for each in chains:
        parts.append((each.scene.mesh.faces + first, SHEET))
        first += each.scene.mesh.n_vertices
        for _ in each.beads:
            parts.append((ball.faces + first, ACCENT))
            first += ball.n_vertices
    starts: list[Any] = [None, None]
    for weight in np.linspace(0.0, 1.0, 6):
        points = []
        for number, each in enumerate(chains):
            state = starts[number] = each.hanging(weight, starts[number])
            points.append(np.asarray(state.positions) + number * gap)
            points += [
                np.asarray(state[bead].center) + around + number * gap
                for bead in each.beads
            ]
        frames.append(np.concatenate(points))
    return shown(_eased(frames), parts, (14, -70), held=8, back=True)


def hu_sheet() -> dict[str, Any]:
    from hu_sheet import sheet_scene, states_of

    scene = sheet_scene(own_field=True, cells=(12, 4))
    states = [np.asarray(state.positions) for state in states_of(scene)]
    parts = [(scene.mesh.faces, SHEET)]
    return shown(_eased(states), parts, (14, -70), held=8, back=True)


def _eased(states: list[np.ndarray]) -> list[np.ndarray]:
    """Return states with one half-way between each two, except across a snap."""
    found = []
    size = np.ptp(states[0], axis=0).max()
    for before, after in pairwise(states):
        found.append(before)
        if np.abs(after - before).max() < 0.3 * size:
            found.append(0.5 * (before + after))
    return [*found, states[-1]]


SCENES = {
    "snapping_flaps": Scene(
        "Two flaps hold each other and let go", snapping_flaps, film
    ),
    "self_folding": Scene("A strip stays folded by its own field", self_folding, film),
    "bead_chain": Scene(
        "Beads stiffen or soften the thread that carries them", bead_chain, film
    ),
    "hu_sheet": Scene("A small robot bends to a C in a field", hu_sheet, film),
}
