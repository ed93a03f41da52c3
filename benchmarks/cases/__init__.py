"""Cases of the accuracy table. The tests run the same ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .buckling_loads import columns, plate
from .cylinder_roof import snap_through
from .hemisphere import large_deflection, small_deflection
from .linear_cylinders import pinched_cylinder, scordelis_lo
from .magnetic_strip import field_across, field_against, magnetic_end_shear
from .outcome import Comparison, Outcome
from .plates import circular_plate, even_plate, square_plate
from .rolled_strip import end_moment
from .shear_strip import end_shear
from .solids import SOLID_CASES


@dataclass(frozen=True)
class Case:
    """A row of the table. run(mesh, bending) -> Outcome; mesh: that of the table; coarse: one for a quick look."""

    name: str
    title: str
    run: Callable[[Any, str], Outcome]
    mesh: Any
    coarse: Any


CASES = (
    Case("A1", "end shear", end_shear, (40, 4), (20, 2)),
    Case("A2", "end moment", end_moment, (48, 4), (24, 2)),
    Case("A4", "hemisphere", large_deflection, (64, 16), (32, 8)),
    Case("A7a", "roof, arc length", snap_through, (16, 16), (8, 8)),
    Case("B1", "Scordelis-Lo roof", scordelis_lo, (48, 48), (8, 8)),
    Case("B2", "pinched cylinder", pinched_cylinder, (64, 64), (8, 8)),
    Case("B3", "pinched hemisphere", small_deflection, (128, 32), (32, 8)),
    Case("B5", "square plate", square_plate, (32, 32), (8, 8)),
    Case("B5 even", "square plate, even mesh", even_plate, (32, 32), (8, 8)),
    Case("B5 disk", "circular plate", circular_plate, 48, 6),
    Case("B7", "columns", columns, (40, 4), (20, 2)),
    Case("B7 plate", "plate in compression", plate, (32, 32), (8, 8)),
    Case("C1-90", "field across", field_across, (80, 8), (20, 2)),
    Case("C1-180", "field against", field_against, (80, 8), (20, 2)),
    Case("C4", "field and end shear", magnetic_end_shear, (40, 4), (20, 2)),
)

__all__ = ["CASES", "SOLID_CASES", "Case", "Comparison", "Outcome"]
