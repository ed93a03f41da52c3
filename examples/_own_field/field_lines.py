"""Draws the lines of the flux density in the plane y = constant that halves a body, with the section of the body."""

from __future__ import annotations

import numpy as np

import magshell as ms

SHEET, COLORS = "#222222", "viridis"


def draw_field_lines(axes, state: ms.Equilibrium, middle: float, box, density: float = 1.1) -> None:
    """Draw them on axes, in mm, colored by the flux density.

    middle: y of the plane, m. box: (x from, x to, z from, z to), m.
    """
    x, z = np.linspace(*box[:2], 90), np.linspace(*box[2:], 90)
    grid = np.stack(np.meshgrid(x, z), axis=-1)
    points = np.stack([grid[..., 0], np.full(grid.shape[:2], middle), grid[..., 1]], axis=-1)
    flux_density = ms.field_of(state).flux_density(points.reshape(-1, 3)).reshape(points.shape)
    strength = np.linalg.norm(flux_density, axis=-1)
    axes.streamplot(
        1e3 * x,
        1e3 * z,
        flux_density[..., 0],
        flux_density[..., 2],
        color=np.log10(np.maximum(1e3 * strength, 1e-3)),
        cmap=COLORS,
        density=density,
        linewidth=0.8,
        arrowsize=0.7,
    )
    mesh = state.scene.mesh
    rest, positions = mesh.rest_positions, np.asarray(state.positions)
    first = 0
    for body in state.scene.bodies:
        rows = np.arange(first, first + body.mesh.n_vertices)
        first += len(rows)
        distance = np.abs(rest[rows, 1] - middle)
        line = rows[distance < distance.min() + 1e-9]
        line = line[np.argsort(rest[line, 0])]
        axes.plot(1e3 * positions[line, 0], 1e3 * positions[line, 2], color=SHEET, lw=2.2)
    axes.set(xlim=1e3 * np.array(box[:2]), ylim=1e3 * np.array(box[2:]), xlabel="x [mm]", aspect="equal")
