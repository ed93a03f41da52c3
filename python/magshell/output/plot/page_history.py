"""The curves of probes on a page, with the numbers of every recorded state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..results.probes import Probe
from ..results.series_probes import probe_columns
from ..results.tables import coordinate_of


def page_history(
    what: Any, probes: Probe | Sequence[Probe], positions: Any
) -> tuple[str, np.ndarray, dict[str, np.ndarray]] | None:
    """Return the name and the values (n,) of what curves are drawn over, and the columns {name: (n,)}; None without probes.

    Raises ValueError as `probe_columns` does.
    """
    columns = probe_columns(what, probes, positions)
    if not columns:
        return None
    name, values = coordinate_of(what)
    along = np.zeros(1) if values is None else np.asarray(values, dtype=np.float64)
    return {"time": "time [s]", None: ""}.get(name, name), along, columns
