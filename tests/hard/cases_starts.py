"""Starts far from any equilibrium: random, folded, inverted, scaled up. A unique equilibrium is found."""

from __future__ import annotations

import numpy as np
from answers import Answer, at_rest, below, both, near, refused
from registry import case
from sheets import LENGTH, WIDTH, cantilever, shell, strip

import magshell as ms
from magshell.model.supports.supports import rotation_matrix


def idle_strip(cells=(20, 2), thickness=1e-3) -> ms.Scene:
    """Return a scene of a strip without loads, whose equilibrium has no energy."""
    return cantilever(shell(strip(cells), thickness=thickness))


def found_again(start_from, **sizes) -> Answer:
    """Check that a solve from start_from(rest positions) returns to the rest shape.

    sizes: cells and thickness of the strip.
    """
    scene = idle_strip(**sizes)
    rest = np.array(scene.mesh.rest_positions)
    found = ms.equilibrium(scene, start=start_from(rest))
    return both(near("positions", found.positions, rest, rel=1e-7, scale=LENGTH), at_rest(found))


@case("positions off by a {}th of a cell at random", over=(10, 3))
def noise(part):
    rng = np.random.default_rng(1)
    return found_again(lambda x: x + LENGTH / 20 / part * rng.normal(size=x.shape))


@case("folded over at its middle, back onto itself")
def folded():
    def folded_positions(x):
        # By slightly less than 180 degrees: exactly flat, neither side to unfold to would be preferred.
        x, beyond = x.copy(), x[:, 0] > LENGTH / 2
        x[beyond] = np.stack([LENGTH - x[beyond, 0], x[beyond, 1], 1e-4 + 0 * x[beyond, 0]], axis=1)
        return x

    return found_again(folded_positions)


@case("turned end to end: it starts where its clamp is not")
def inverted():
    return found_again(lambda x: x * (-1, 1, 1) + (LENGTH, 0, 0))


@case("turned about its own axis by {} degrees, away from its clamp", over=(60, 120))
def turned(degrees):
    rotation = rotation_matrix(np.array([np.radians(degrees), 0, 0]))
    return found_again(lambda x: (x - (0, WIDTH / 2, 0)) @ rotation.T + (0, WIDTH / 2, 0))


@case("upside down: folded over sharply at its clamp, where creases can hold each other")
def upside_down():
    """Check that any stable equilibrium is reached: the strip crumples at the clamp and may stay so."""
    scene = idle_strip()
    start = (0, WIDTH, 0) + scene.mesh.rest_positions * (1, -1, -1)
    return at_rest(ms.equilibrium(scene, start=start))


@case("{:g} times its size", over=(0.6, 100.0))
def blown_up(factor):
    return found_again(lambda x: factor * x)


@case("half its size: it may burst into folds that hold each other")
def half_size():
    """Check that a stable equilibrium is reached, or a refusal names the cure.

    A flat strip at half its size is pressed together symmetrically, so round-off decides how it bursts. Starts that differ
    by 1e-12 take 2500 to 7100 factorizations, or end where no step lowers the energy.
    """
    return stable_or_refused(0.5)


def stable_or_refused(factor) -> Answer:
    """Solve from the rest shape times a factor: a stable equilibrium, or a refusal that names the cure."""
    scene = idle_strip()
    cure = "Start from positions closer to an equilibrium"
    try:
        return at_rest(ms.equilibrium(scene, start=factor * scene.mesh.rest_positions))
    except ms.NotConverged as error:
        return Answer(f"a stable equilibrium, or ...{cure}...", f"NotConverged: {error}", cure in str(error))


@case("rolled into a scroll of three turns")
def rolled():
    def roll(x):
        angle = 6.0 * np.pi * x[:, 0] / LENGTH
        radius = LENGTH / (6.0 * np.pi) * (1.0 + 0.3 * angle / (6.0 * np.pi))
        return np.stack([radius * np.sin(angle), x[:, 1], radius * (1.0 - np.cos(angle))], axis=1)

    return found_again(roll)


@case("every vertex anywhere in a box: knots, inverted faces, strains of hundreds")
def random_positions():
    """Check that a stable equilibrium of much less energy is reached; a crumpled sheet has many."""
    scene = idle_strip()
    start = np.random.default_rng(7).uniform(-0.5, 0.5, size=scene.mesh.rest_positions.shape) * LENGTH
    found = ms.equilibrium(scene, start=start)
    before = scene._model.energy(
        scene._model.state(start, np.zeros(scene.mesh.n_edges)), found._load_parameters
    )
    return both(below("energy over that of the start", found.energy / before, 1e-2), at_rest(found))


@case("a hundredth of its size: it bursts into crumples of single faces, which nothing keeps from collapsing")
def squeezed():
    """Check that a stable state of crumples is reached, or that the refusal of a collapse to zero area names the cure.

    St. Venant-Kirchhoff material does not resist it, and bending forces are unbounded there.
    """
    return stable_or_refused(0.01)


@case("all vertices in one point: faces without area have no normals, so there is nothing to start from")
def collapsed():
    scene = idle_strip()
    start = np.zeros_like(scene.mesh.rest_positions)
    return refused(lambda: ms.equilibrium(scene, start=start), r"start \[m\] leaves face 0 without area")
