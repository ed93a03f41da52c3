"""Speed of factorizations, compared with numpy's product of large matrices, and in back-substitutions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .report import print_table
from .timing import clocked

SIZE, QUICK_SIZE = 1200, 100  # rows of the matrices


def product_rate(quick: bool) -> float:
    """Return the additions and multiplications of numpy's product of matrices, per second of processor time."""
    size = QUICK_SIZE if quick else SIZE
    matrix = np.random.default_rng(0).random((size, size))
    return 2.0 * size**3 / clocked(lambda: matrix @ matrix).processor


def print_rates(sizes: Sequence[Mapping[str, Any]], product: float) -> None:
    """Print the table for sizes as `scaling.costs` returns them. product: operations per second of a product of matrices."""
    rows = []
    for size in sizes:
        times, operations = size["processor"], size["operations"]["best"]
        rate = operations / times["factorization"]
        rows.append(
            [
                f"{size['faces']}",
                f"{1e-9 * operations:.3g}",
                f"{operations / size['faces']:.3g}",
                f"{1e-9 * rate:.3g}",
                f"{rate / product:.2f}",
                f"{times['factorization'] / times['solve']:.1f}",
            ]
        )
    headings = ["faces", "1e9 operations", "per face", "1e9 per second", "over numpy's product", "in solves"]
    print_table("Factorizations on one thread: additions and multiplications", headings, rows)
