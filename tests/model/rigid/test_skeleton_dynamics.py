"""Mass matrices and accelerations of a chain of links against those of Pinocchio."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magshell as ms

# Reference set of the project, case K4a: a chain of five hinges, tables of Pinocchio 4.1.
# Axis, placement (R, p) in the parent's joint frame, mass, sides of the box, its center in the joint frame.
CHAIN = [
    (
        [0.2234169897, 0.8175128361, 0.5308084508],
        [
            [0.1866471963, -0.1773787112, -0.9662813342],
            [-0.7956456501, 0.5496660034, -0.2545884604],
            [0.5762905722, 0.8163357627, -0.03853698155],
        ],
        [0.04837072125, -0.133404345, 0.005704516028],
        1.251619769,
        [0.08824861869, 0.3332445506, 0.2040861679],
        [-0.06956877815, -0.07991617109, -0.01410651063],
    ),
    (
        [-0.233950342, 0.9302488706, 0.2826734445],
        [
            [-0.9734767824, 0.2287377878, -0.004688132395],
            [0.1279367108, 0.5612405689, 0.8177048501],
            [0.1896711686, 0.7954169022, -0.5756186233],
        ],
        [-0.07628392997, -0.2139574152, 0.09532477663],
        0.8205979567,
        [0.3496814602, 0.3449917182, 0.0824130462],
        [0.06999630901, -0.02712652863, 0.05081844508],
    ),
    (
        [-0.1330524204, -0.9283054454, -0.3471974273],
        [
            [0.9542130723, -0.2004982675, 0.2219861648],
            [-0.1185354475, -0.9348069125, -0.3347915532],
            [0.2746393277, 0.2931492472, -0.9157711278],
        ],
        [-0.07817928601, 0.1054966958, 0.1207573076],
        1.022515383,
        [0.1381936629, 0.1050309955, 0.1425376139],
        [0.07835168766, 0.05111663867, 0.05568471644],
    ),
    (
        [-0.5757920616, 0.7314931429, -0.3652140245],
        [
            [0.7699846829, -0.03146369424, -0.6372861398],
            [0.6180427477, 0.285004726, 0.7326632707],
            [0.1585772686, -0.9580095731, 0.2388951817],
        ],
        [0.1291929951, -0.2235853355, -0.153900101],
        1.288115883,
        [0.3883200956, 0.1352521092, 0.1299403982],
        [-0.09108089036, -0.006608865247, -0.07979091892],
    ),
    (
        [-0.9606640756, -0.1082499828, 0.2557468966],
        [
            [0.4631394911, -0.4992202598, 0.7323120538],
            [0.1252288504, 0.8548419567, 0.5035503591],
            [-0.87739361, -0.1415074604, 0.458427848],
        ],
        [0.09848408066, 0.01383585807, 0.1818465895],
        0.5350215887,
        [0.1296047537, 0.3047763748, 0.2661308468],
        [0.05132464405, 0.01285005308, 0.0047005739],
    ),
]
STATES = [  # angles, mass matrix, rates, torques, accelerations
    (
        [0.7822994381, 0.3416445152, -0.09155344826, -0.8065330244, -0.1990115037],
        [
            [0.1949946776, 0.07104764536, 0.05160139706, 0.03730983, -0.001322345598],
            [0.07104764536, 0.1308631454, 0.08843612264, 0.03321135278, -0.0006308476629],
            [0.05160139706, 0.08843612264, 0.0944402947, 0.01857309311, 0.0002556364725],
            [0.03730983, 0.03321135278, 0.01857309311, 0.04225864775, -0.002051307393],
            [-0.001322345598, -0.0006308476629, 0.0002556364725, -0.002051307393, 0.00730079314],
        ],
        [-1.771163183, -0.5355460971, 0.3885968299, 0.526642434, -0.4448215538],
        [-2.39937253, 2.934116245, 0.9074485584, -2.655097487, 0.2635068162],
        [-41.95971256, 89.71569552, -11.63484457, -96.16242602, -4.38304511],
    ),
    (
        [0.3287118591, -0.02718849188, 0.6720106119, -0.449335702, 0.8682717594],
        [
            [0.2305195984, 0.08024466267, 0.07754803071, 0.03771262968, -0.0006888504751],
            [0.08024466267, 0.1115197933, 0.07539150171, 0.02375080257, 0.0005564626552],
            [0.07754803071, 0.07539150171, 0.08288555714, 0.01458827402, -0.001071357359],
            [0.03771262968, 0.02375080257, 0.01458827402, 0.04179678639, -0.003202715959],
            [-0.0006888504751, 0.0005564626552, -0.001071357359, -0.003202715959, 0.00730079314],
        ],
        [-1.729263223, 1.32276037, 1.636320111, -0.8750379116, 0.8112597673],
        [2.737673144, -1.695134039, 1.200580842, -1.126018888, -2.522876406],
        [-2.240876844, -28.54192234, 72.19532327, -68.97957144, -370.8942492],
    ),
]


def in_state(angles, rates=(None,) * 5, torques=(None,) * 5, **scene):
    """Return the chain in a posture that is its rest shape."""
    links, joints, frame, origin = [], [], np.eye(3), np.zeros(3)
    for angle, rate, torque, link in zip(angles, rates, torques, CHAIN, strict=True):
        axis, placement, offset, mass, sides, com = link
        origin = origin + frame @ offset
        before = frame @ np.array(placement)
        turned = before @ Rotation.from_rotvec(angle * np.array(axis)).as_matrix()
        squares = np.square(sides)
        box = mass / 12 * np.diag(squares.sum() - squares)
        link = ms.Link(mass=mass, inertia=turned @ box @ turned.T, center=origin + turned @ com)
        joints.append(
            ms.Revolute(
                link,
                links[-1] if links else None,
                origin=origin,
                axis=before @ np.array(axis),
                rate=rate,
                torque=torque,
            )
        )
        links.append(link)
        frame = turned
    return ms.Scene(ms.Skeleton(links, joints), **scene)


@pytest.mark.parametrize(("angles", "mass_matrix"), [state[:2] for state in STATES])
def test_mass_matrix_is_that_of_pinocchio(angles, mass_matrix):
    scene = in_state(angles)
    model = scene._model
    size, starts, rows, _ = model.hessian(model.rest_state(), np.zeros(scene._load_parameter_layout.size))
    values = model.free_weight_values(scene._values.masses)
    found = np.zeros((size, size))
    for column in range(size):
        for k in range(starts[column], starts[column + 1]):
            found[rows[k], column] = found[column, rows[k]] = values[k]
    lengths = np.array([place.length for place in scene._rigid])  # coordinates are angles times these
    found *= np.outer(lengths, lengths)
    np.testing.assert_allclose(found, mass_matrix, rtol=0, atol=2e-9)


@pytest.mark.parametrize(("angles", "mass_matrix", "rates", "torques", "accelerations"), STATES)
def test_accelerations_are_those_of_pinocchio(angles, mass_matrix, rates, torques, accelerations):
    """Compute the change of rates over short steps, extrapolated to a step of zero."""
    scene = in_state(angles, rates, torques, gravity=(0, 0, -9.81))
    found = []
    for time_step in (3.2e-3, 1.6e-3, 8e-4, 4e-4):  # shorter ones magnify the round-off of positions
        move = ms.simulate(scene, steps=1, time_step=time_step, solver=ms.MixedNewton(tolerance=1e-13))
        end = np.array([move[joint].rate for joint in scene.joints])
        np.testing.assert_allclose(end[:, 0], rates, rtol=1e-12)
        found.append((end[:, 1] - end[:, 0]) / time_step)
    for order in (1, 2, 3):  # Richardson
        found = [(2**order * fine - rough) / (2**order - 1) for rough, fine in itertools.pairwise(found)]
    np.testing.assert_allclose(found[0], accelerations, atol=1e-6 * np.abs(accelerations).max())
