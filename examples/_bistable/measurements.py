"""The digitised curves of the experiment; each file names its source."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .model import RAMP

FOLDER = Path(__file__).parents[1]


def measured_ramp() -> dict:
    """Return times [s], fields [T] and displacements [m] measured while the field grows by 6.5 mT/s."""
    curve = _curve("bistable_beam_ramp.csv")
    return {**curve, "fields": RAMP * curve["times"]}


def measured_step() -> dict:
    """Return times [s] and displacements [m] measured after a field of 5 mT is switched on."""
    return _curve("bistable_beam_step.csv")


def _curve(name: str) -> dict:
    seconds, millimeters = np.loadtxt(FOLDER / name, delimiter=",").T
    return {"times": seconds, "displacements": 1e-3 * millimeters}
