"""Cost of contact for each pair and each face: tables of `python -m benchmarks kernels`."""

from __future__ import annotations

from typing import Any

import numpy as np

import magshell as ms
from magshell import _core

from .report import print_table
from .timing import measure

PAIRS, QUICK_PAIRS = 4000, 200
CELLS, QUICK_CELLS = (32, 96), (8,)
ALLOWED = 0.6  # [us] time per pair, gradient and Hessian, on one core (ipctk 1.6: 3.1)
LAW = {"stiffness": 1e5, "activation_distance": 0.4, "min_distance": 0.0, "smoothing": 0.1, "penalty": False}


def contacts(quick: bool, rounds: int) -> dict[str, Any]:
    """Print the tables of pairs in contact and of sheets on each other; returns their numbers, times in s."""
    pairs = [
        cost_of_pairs(kind, QUICK_PAIRS if quick else PAIRS, rounds)
        for kind in ("point_triangle", "edge_edge")
    ]
    rows = [
        [
            each["kind"].replace("_", " and "),
            *(f"{1e6 * each[name] / each['pairs']:.3f}" for name in ("exact", "cautious", "path")),
        ]
        for each in pairs
    ]
    print_table(
        f"Microseconds a pair that touches, best of {rounds} (gradient and Hessian: at most {ALLOWED})",
        ["contact", "gradient and Hessian", "made positive", "how far it may move"],
        rows,
    )
    searches = [cost_of_search(cells, rounds) for cells in (QUICK_CELLS if quick else CELLS)]
    rows = [
        [
            str(each["faces"]),
            str(each["pairs"]),
            *(f"{1e6 * each[name] / each['faces']:.3f}" for name in ("near", "way", "apart")),
        ]
        for each in searches
    ]
    print_table(
        f"Microseconds a face, of two sheets on each other, best of {rounds}",
        ["faces", "pairs", "which are near", "on their way", "when far apart"],
        rows,
    )
    return {"pairs": pairs, "searches": searches}


def cost_of_pairs(kind: str, count: int, rounds: int) -> dict[str, Any]:
    """Measure the cost of random pairs nearer than three quarters of the activation distance."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.0, 1.0, (20 * count, 4, 3))
    points = points[_core.pair_proximities(kind, points)[0] < 0.75 * LAW["activation_distance"]][:count]
    ends = points + 0.1 * rng.standard_normal(points.shape)
    parallel = 1e-3 if kind == "edge_edge" else 0.0
    return {
        "kind": kind,
        "pairs": len(points),
        "exact": measure(
            lambda: _core.pair_sums(kind, points, 1.0, parallel, LAW, False), rounds=rounds
        ).best,
        "cautious": measure(
            lambda: _core.pair_sums(kind, points, 1.0, parallel, LAW, True), rounds=rounds
        ).best,
        "path": measure(lambda: _core.pair_free_shares(kind, points, ends, 0.0, 0.1), rounds=rounds).best,
    }


def cost_of_search(cells: int, rounds: int) -> dict[str, Any]:
    """Measure the cost of the broad phase for two curved sheets, a fifth of a cell apart, within two fifths."""
    mesh, cell = ms.meshes.rectangle(1.0, 1.0, cells=(cells, cells), irregular=0.2), 1.0 / cells
    lower = (
        mesh.rest_positions
        + np.c_[np.zeros((mesh.n_vertices, 2)), 0.05 * np.sin(4 * mesh.rest_positions[:, 0])]
    )
    both = np.concatenate([lower, lower + cell * np.array([0.3, 0.2, 0.2])])
    moved = both + 0.1 * cell * np.random.default_rng(0).standard_normal(both.shape)
    apart = both.copy()
    apart[mesh.n_vertices :, 2] += 1.0
    search = _core.BroadPhase(both, [mesh.faces, mesh.faces + mesh.n_vertices], [(0, 1)])
    margins = [0.4 * cell]
    return {
        "faces": 2 * mesh.n_faces,
        "pairs": len(search.near(both, margins)["kind"]),
        "near": measure(lambda: search.near(both, margins), rounds=rounds).best,
        "way": measure(lambda: search.near_on_the_way(both, moved, [0.0]), rounds=rounds).best,
        "apart": measure(lambda: search.near(apart, margins), rounds=rounds).best,
    }
