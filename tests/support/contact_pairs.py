"""Pairs of points, edges and triangles for tests of contact: random ones, and those that are hard."""

import numpy as np

KINDS = ("point_triangle", "edge_edge")
ALL_KINDS = (*KINDS, "point_edge", "point_point")
LAW = {
    "stiffness": 2.0e3,
    "activation_distance": 0.4,
    "min_distance": 0.0,
    "smoothing": 0.1,
    "penalty": False,
}  # Pa, m


def random_pairs(kind, count, seed=0, gap=None):
    """Return random pairs (count, 4, 3) [m], of size 1; with `gap` the parts are moved to about that distance."""
    from magshell import _core

    rng = np.random.default_rng(seed)
    x = rng.uniform(-1.0, 1.0, (count, 4, 3))
    if gap is not None:
        first = 2 if kind == "edge_edge" else 1
        for _ in range(2):  # once more, where another corner is nearest after the first
            distances, _, normals, _ = _core.pair_proximities(kind, x)
            shift = (gap * rng.uniform(0.5, 1.5, count) - distances)[:, None] * normals
            x[:, :first] += shift[:, None, :]
    return x


def hard_pairs(kind, gap=1e-3):
    """Return difficult pairs (n, 4, 3) and their names: nearly parallel edges, touching and aligned corners,
    needles.
    """
    up = np.array([0.0, 0.0, gap])
    o, x, y = np.zeros(3), np.eye(3)[0], np.eye(3)[1]
    if kind == "point_triangle":
        cases = {
            "above a corner": (o + up, o, x, y),
            "above an edge": (0.3 * x + up, o, x, y),
            "beside an edge, in the plane": (0.4 * x - gap * y, o, x, y),
            "beyond a corner, in the plane": (-gap * (x + y), o, x, y),
            "above the inside": (0.2 * x + 0.3 * y + up, o, x, y),
            "on the line of an edge": ((1.0 + gap) * x, o, x, y),
            "above a needle": (0.4 * x + up, o, x, 0.5 * x + 1e-9 * y),
            "above a triangle without area": (0.4 * x + up, o, x, 0.5 * x),
            "above a point": (up, o, o, o),
        }
    else:
        cases = {
            "crossed": (-x, x, -y + up, y + up),
            "parallel, side by side": (o, x, up, x + up),
            "parallel, shifted": (o, x, 0.5 * x + up, 1.5 * x + up),
            "parallel, one after the other": (o, x, (1.0 + gap) * x, 2.0 * x),
            "antiparallel": (o, x, x + up, up),
            "nearly parallel": (o, x, up - 1e-7 * y, x + up + 1e-7 * y),
            "a little less parallel": (o, x, up - 1e-3 * y, x + up + 1e-3 * y),
            "corner on corner": (o, x, up, y + up),
            "corner on inside": (o, x, 0.5 * x + up, 0.5 * x + y + up),
            "an edge without length": (o, x, 0.5 * x + up, 0.5 * x + up),
        }
    return np.array(list(cases.values())), list(cases)


def differences(function, x, step=1e-6):
    """Return the derivatives (n, ..., 3 m) of a function of (n, m, 3) with values (n, ...), by central differences."""
    columns = []
    for k in range(3 * x.shape[1]):
        shift = np.zeros(x.shape[1:])
        shift.flat[k] = step
        columns.append((function(x + shift) - function(x - shift)) / (2.0 * step))
    return np.stack(columns, axis=-1)


def relative(got, expected):
    """Return the largest difference of a row, over the largest number of that row."""
    n = len(expected)
    size = np.abs(expected).reshape(n, -1).max(1)
    return (np.abs(got - expected).reshape(n, -1).max(1) / np.where(size > 0.0, size, 1.0)).max()
