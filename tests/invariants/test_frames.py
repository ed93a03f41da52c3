"""A scene that is turned, mirrored, moved, in other units, with other numbers or beside another one moves alike."""

import warnings
from functools import cache

import numpy as np
import pytest
from framed_scenes import EXTENT, FEATURES, INTEGRATORS, OBLIQUE, PAIRS, build, names
from frames import Frame

import magshell as ms

FRAMES = {
    "turned": Frame(turn=OBLIQUE, shift=(0.1, -0.2, 0.3)),
    "mirrored": Frame(turn=OBLIQUE @ np.diag([1.0, 1.0, -1.0])),
    "in other units": Frame(length=3.0, mass=0.7, time=1.3),
    "renumbered": Frame(numbers_from=1),
}
TOLERANCE = 1e-9  # of the extent
# The table of what is not held, with its bound. The friction of two edges takes the spin of one of the two triangles beside
# the second one: the first in the order of the numbers.
NOT_HELD = {("rubbing", "renumbered"): 1e-3, ("six_nodes + rubbing", "renumbered"): 1e-3}


def moved(name: str, integrator: str, frame: Frame) -> np.ndarray:
    """Return the positions of a motion, in the axes, units and numbers of the description."""
    made = build(name, frame)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return made.positions(made.simulate(INTEGRATORS[integrator]))


@cache
def plain(name: str, integrator: str) -> np.ndarray:
    return moved(name, integrator, Frame())


def distance(name: str, integrator: str, frame: str) -> float:
    """Return how far a motion in a frame is from that without, over the extent."""
    here, there = plain(name, integrator), moved(name, integrator, FRAMES[frame])
    assert np.ptp(here, axis=0).max() > 1e-4 * EXTENT  # something moves
    return float(np.abs(there - here).max()) / EXTENT


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("name", names())
def test_scene_moves_alike_in_another_frame(name, frame):
    assert distance(name, "TRBDF2", frame) < NOT_HELD.get((name, frame), TOLERANCE)


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("name", PAIRS)
def test_pair_moves_alike_in_another_frame(name, frame):
    assert distance(name, "TRBDF2", frame) < NOT_HELD.get((name, frame), TOLERANCE)


@pytest.mark.parametrize(
    "name",
    [name for name in FEATURES if name not in ("magnetized", "solid", "attracting")],
)
def test_scene_moves_alike_beside_itself(name):
    away = np.array((1.0, 2.0, 3.0))
    both = build(name, Frame())
    both.frame = Frame(shift=tuple(away))
    FEATURES[name](both)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        move = both.simulate(ms.TRBDF2())
    both.frame = Frame()
    alone = plain(name, "TRBDF2")
    first, second = np.split(both.positions(move), [alone.shape[1]], axis=1)
    assert np.abs(first - alone).max() < TOLERANCE * EXTENT
    assert np.abs(second - away - alone).max() < TOLERANCE * EXTENT
