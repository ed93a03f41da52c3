"""How many times as fast more cores can make a factorization: computed from its elimination tree, not measured."""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .report import print_table

CORES = (2, 4, 8, 16, 64)
BLOCK = 32  # [columns] that a front eliminates at once (block_columns in pivot_block.h)
PART = 96  # [rows] of a parallel task within a front (12 slabs of 8 in front.cpp)


def front_work(pivots: float, below: float) -> float:
    """Return the additions and multiplications of a front, as the core counts them."""
    panel = pivots * (pivots + 1) * (2 * pivots + 1) / 6 + below * pivots**2
    return panel + pivots * below * (below + 1)


def front_span(pivots: int, below: int, cores: int) -> float:
    """Return the operations of a front that one of so many cores takes at least, one block of columns after another.

    The rows of a block's diagonal are eliminated by one core; those below, and the update, in parts.
    """
    span = 0.0
    for first in range(0, pivots, BLOCK):
        columns = min(BLOCK, pivots - first)
        of_diagonal = columns * (columns + 1) * (2 * columns + 1) / 6 + first * columns * (columns + 1)
        rows = pivots - first - columns + below
        by_row = columns**2 + 2.0 * first * columns
        parts = [by_row * min(PART, rows - begin) for begin in range(0, rows, PART)]
        span += of_diagonal + makespan(parts, cores)
    ends = [min(begin + PART, below) for begin in range(0, below, PART)]
    # Part of the triangle's columns begin ... end - 1, over the rows from the column to the last.
    update = [
        pivots * sum((below - column) * 2.0 for column in (begin, end - 1)) / 2 * (end - begin)
        for begin, end in zip(range(0, below, PART), ends, strict=True)
    ]
    return span + makespan(update, cores)


def makespan(tasks: Sequence[float], cores: int) -> float:
    """Return when the last of some tasks ends if each core takes the largest one that is left."""
    busy = [0.0] * min(cores, len(tasks))
    for task in sorted(tasks, reverse=True):
        heapq.heapreplace(busy, busy[0] + task)
    return max(busy, default=0.0)


def limits(fronts: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return work, span and gains of a factorization, all in additions and multiplications.

    fronts: of `_core.elimination_fronts`. As the core does it, subtrees are tasks, and the fronts above them follow one
    after another, each by all cores. "gains": {cores: work over the time of the busiest core}; "span": that time without a
    limit of cores; "path": the operations of the dearest way from a leaf to the root, below which no order of whole fronts
    comes without dividing fronts.
    """
    shapes = list(zip(fronts["pivots"].tolist(), fronts["below"].tolist(), strict=True))
    work = [front_work(*shape) for shape in shapes]
    task, parent = fronts["task"], fronts["parent"].tolist()
    subtrees = (
        np.bincount(task[task >= 0], weights=np.array(work)[task >= 0]).tolist() if (task >= 0).any() else []
    )
    above = [shape for shape, number in zip(shapes, task.tolist(), strict=True) if number < 0]

    def time(cores: int) -> float:
        return makespan(subtrees, cores) + sum(front_span(*shape, cores) for shape in above)

    ways = list(work)
    for number, up in enumerate(parent):  # children come first
        if up >= 0:
            ways[up] = max(ways[up], work[up] + ways[number])
    whole = sum(work)
    return {
        "work": whole,
        "span": time(10**9),
        "path": max(ways),
        "gains": {str(cores): whole / time(cores) for cores in CORES},
    }


def print_limits(sizes: Sequence[Mapping[str, Any]]) -> None:
    """Print the table for sizes with "faces" and "cores", as `limits` returns it; nothing where the tree is not known."""
    if any(size["cores"] is None for size in sizes):
        return
    rows = [
        [
            f"{size['faces']}",
            f"{1e-9 * each['work']:.3g}",
            f"{1e-9 * each['span']:.3g}",
            f"{1e-9 * each['path']:.3g}",
            *(f"{each['gains'][str(cores)]:.1f}" for cores in CORES),
        ]
        for size in sizes
        for each in (size["cores"],)
    ]
    print_table(
        "A factorization on more cores, computed from its elimination tree at equal speed per operation; not measured",
        [
            "faces",
            "work, 1e9",
            "span, 1e9",
            "path of whole fronts, 1e9",
            *(f"{cores} cores" for cores in CORES),
        ],
        rows,
    )
