"""Homogeneous states of solids, case T2a of the validation set: E = 1e6, by root finding to 1e-12."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.solids.solid_stresses import states_of

TINY = 1e-9
# (Poisson's ratio, material, mode) -> rows (stretch, nominal stress, stretch of the free sides).
STRETCHED = {
    (0.45, "ln J", "uniaxial"): [
        (0.5, -1086102.809, 1.350869747),
        (0.7, -433938.7619, 1.170852547),
        (0.9, -110712.8996, 1.048313249),
        (1.1, 91703.44264, 0.9578444644),
        (1.5, 358614.3519, 0.8306789808),
        (2.0, 598796.2703, 0.7259350056),
    ],
    (0.45, "ln J", "equibiaxial"): [
        (0.8, -572676.623, 1.403071547),
        (1.2, 260121.2629, 0.7312851737),
        (1.5, 463407.5608, 0.4839184956),
        (2.0, 676425.278, 0.2770079198),
    ],
    (0.45, "isochoric", "uniaxial"): [
        (0.5, -1170024.716, 1.369383597),
        (0.7, -449264.7614, 1.175642611),
        (0.9, -111799.6801, 1.048721282),
        (1.1, 90907.91525, 0.958171471),
        (1.5, 345160.9674, 0.8363969295),
        (2.0, 557672.8792, 0.7420503532),
    ],
    (0.45, "isochoric", "equibiaxial"): [
        (0.8, -604967.4479, 1.392834952),
        (1.2, 249697.6258, 0.7338272659),
        (1.5, 428444.8055, 0.4956669842),
        (2.0, 597259.9171, 0.2998041702),
    ],
    (0.45, "Corotated", "uniaxial"): [
        (0.5, -500000.0, 1.225),
        (0.7, -300000.0, 1.135),
        (0.9, -100000.0, 1.045),
        (1.1, 100000.0, 0.955),
        (1.5, 500000.0, 0.775),
        (2.0, 1000000.0, 0.55),
    ],
    (0.45, "Corotated", "equibiaxial"): [
        (0.8, -363636.3636, 1.327272727),
        (1.2, 363636.3636, 0.6727272727),
        (1.5, 909090.9091, 0.1818181818),
    ],
    (0.3, "ln J", "uniaxial"): [
        (0.5, -935352.0569, 1.210767391),
        (0.7, -405230.4243, 1.107934733),
        (0.9, -108722.1851, 1.031702434),
        (1.1, 93077.43218, 0.9714929459),
        (1.5, 378280.1764, 0.8801745918),
        (2.0, 646744.6602, 0.7980775445),
    ],
    (0.3, "ln J", "equibiaxial"): [
        (0.8, -370737.9478, 1.187912005),
        (1.2, 233989.4681, 0.8425870041),
        (1.5, 467915.8594, 0.6520185184),
        (2.0, 733611.6647, 0.4303711698),
    ],
    (0.3, "isochoric", "uniaxial"): [
        (0.5, -1098683.378, 1.161002646),
        (0.7, -445549.3667, 1.104472315),
        (0.9, -111874.8166, 1.031696281),
        (1.1, 90689.79426, 0.9716092013),
        (1.5, 338397.1662, 0.8843382454),
        (2.0, 532938.3372, 0.8131437194),
    ],
    (0.3, "isochoric", "equibiaxial"): [
        (0.8, -331009.9841, 1.08645233),
        (1.2, 220744.963, 0.8191968124),
        (1.5, 396208.5072, 0.6007705106),
        (2.0, 549453.1489, 0.3906507385),
    ],
    (0.3, "Corotated", "uniaxial"): [
        (0.5, -500000.0, 1.15),
        (0.7, -300000.0, 1.09),
        (0.9, -100000.0, 1.03),
        (1.1, 100000.0, 0.97),
        (1.5, 500000.0, 0.85),
        (2.0, 1000000.0, 0.7),
    ],
    (0.3, "Corotated", "equibiaxial"): [
        (0.8, -285714.2857, 1.171428571),
        (1.2, 285714.2857, 0.8285714286),
        (1.5, 714285.7143, 0.5714285714),
        (2.0, 1428571.429, 0.1428571429),
    ],
}
# (Poisson's ratio, material) -> rows of simple shear: gamma, P12, P21, P11, P22, P33.
SHEARED = {
    (0.45, "ln J"): [
        (0.1, 34482.75862, 34482.75862, 0.0, 0.0, 0.0),
        (0.5, 172413.7931, 172413.7931, 0.0, 0.0, 0.0),
        (1.0, 344827.5862, 344827.5862, 0.0, 0.0, 0.0),
        (2.0, 689655.1724, 689655.1724, 0.0, 0.0, 0.0),
    ],
    (0.45, "isochoric"): [
        (0.1, 34482.75862, 34597.70115, -1149.425287, -1149.425287, -1149.425287),
        (0.5, 172413.7931, 186781.6092, -28735.63218, -28735.63218, -28735.63218),
        (1.0, 344827.5862, 459770.1149, -114942.5287, -114942.5287, -114942.5287),
        (2.0, 689655.1724, 1609195.402, -459770.1149, -459770.1149, -459770.1149),
    ],
    (0.45, "Corotated"): [
        (0.1, 34912.98659, 34052.53065, 8604.559463, 8604.559463, 7753.777604),
        (0.5, 223892.2411, 120935.3451, 205913.7921, 205913.7921, 191025.9708),
        (1.0, 708871.7552, -19216.58276, 728088.3379, 728088.3379, 732624.7578),
        (2.0, 2709608.406, -1330298.061, 2019953.233, 2019953.233, 2570980.732),
    ],
    (0.3, "ln J"): [
        (0.1, 38461.53846, 38461.53846, 0.0, 0.0, 0.0),
        (0.5, 192307.6923, 192307.6923, 0.0, 0.0, 0.0),
        (1.0, 384615.3846, 384615.3846, 0.0, 0.0, 0.0),
        (2.0, 769230.7692, 769230.7692, 0.0, 0.0, 0.0),
    ],
    (0.3, "isochoric"): [
        (0.1, 38461.53846, 38589.74359, -1282.051282, -1282.051282, -1282.051282),
        (0.5, 192307.6923, 208333.3333, -32051.28205, -32051.28205, -32051.28205),
        (1.0, 384615.3846, 512820.5128, -128205.1282, -128205.1282, -128205.1282),
        (2.0, 769230.7692, 1794871.795, -512820.5128, -512820.5128, -512820.5128),
    ],
    (0.3, "Corotated"): [
        (0.1, 38581.50588, 38341.57105, 2399.348312, 2399.348312, 1441.407375),
        (0.5, 206662.2595, 177953.1251, 57418.26895, 57418.26895, 35511.23816),
        (1.0, 486127.701, 283103.0683, 203024.6327, 203024.6327, 136193.0639),
        (2.0, 1332486.959, 205974.5792, 563256.19, 563256.19, 477938.7258),
    ],
}


def at(body, **where) -> np.ndarray:
    x = body.mesh.rest_positions
    return np.flatnonzero([all(abs(p["xyz".index(k)] - v) < TINY for k, v in where.items()) for p in x])


def block(material: str, poisson_ratio: float, element: str, diagonals: str) -> ms.Solid:
    moduli = {"young_modulus": 1e6, "poisson_ratio": poisson_ratio}
    kind = ms.Corotated(**moduli) if material == "Corotated" else ms.NeoHookean(material, **moduli)
    return ms.Solid(
        ms.meshes.box((1, 1, 1), cells=(1, 1, 1), diagonals=diagonals), material=kind, element=element
    )


def nominal_stresses(solid: ms.Solid, rest: ms.Equilibrium) -> np.ndarray:
    """Compute the first Piola-Kirchhoff stresses, (n_t p, 3, 3) in Pa."""
    found = states_of(rest.scene, solid, rest._state)
    ratios = found.volume_ratios[..., None, None]
    stresses = ratios * found.cauchy_stresses @ np.linalg.inv(found.deformation_gradients).swapaxes(-1, -2)
    return stresses.reshape(-1, 3, 3)


def pull(solid: ms.Solid, pulled: str, stretch: float) -> ms.Scene:
    pins = [ms.Pin(at(solid, **{axis: 0.0}), components=axis) for axis in "xyz"]
    ends = {axis: at(solid, **{axis: 1.0}) for axis in pulled}
    shared = np.intersect1d(ends["x"], ends["y"]) if pulled == "xy" else []
    for axes, vertices in [*((axis, np.setdiff1d(ends[axis], shared)) for axis in pulled), (pulled, shared)]:
        if len(vertices):
            move = np.where([each in axes for each in "xyz"], stretch - 1.0, 0.0)
            pins.append(ms.Pin(vertices, components=axes, displacement=move))
    return ms.Scene(solid, supports=pins)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("case", STRETCHED, ids=lambda case: "{} {} {}".format(*case))
def test_t2a_stretched_blocks(case, element):
    """Stretch a block of one cell; with more, half its length is a saddle between shapes that bulge to one side."""
    poisson_ratio, material, mode = case
    solid = block(material, poisson_ratio, element, "aligned")
    pulled = "x" if mode == "uniaxial" else "xy"
    for stretch, stress, across in STRETCHED[case]:
        rest = ms.equilibrium(pull(solid, pulled, stretch))
        factors = [stretch if axis in pulled else across for axis in "xyz"]
        assert np.allclose(rest.positions, solid.mesh.rest_positions * factors, rtol=0, atol=1e-8), stretch
        expected = np.diag([stress if axis in pulled else 0.0 for axis in "xyz"])
        assert np.allclose(nominal_stresses(solid, rest), expected, rtol=0, atol=1e-8 * abs(stress)), stretch


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("case", SHEARED, ids=lambda case: "{} {}".format(*case))
def test_t2a_sheared_blocks(case, element):
    poisson_ratio, material = case
    solid = block(material, poisson_ratio, element, "crossed")
    x = solid.mesh.rest_positions
    outside = np.abs(x - 0.5).max(axis=1) > 0.5 - TINY
    for gamma, p12, p21, p11, p22, p33 in SHEARED[case]:
        pins = [
            ms.Pin(np.flatnonzero(outside & (np.abs(x[:, 1] - y) < TINY)), displacement=(gamma * y, 0, 0))
            for y in np.unique(np.round(x[outside, 1], 12))
        ]
        stresses = nominal_stresses(solid, ms.equilibrium(ms.Scene(solid, supports=pins)))
        expected = np.array([[p11, p12, 0], [p21, p22, 0], [0, 0, p33]])
        assert np.allclose(stresses, expected, rtol=0, atol=1e-8 * np.abs(expected).max()), gamma
