"""Probes in series of files: numbers of each state, as field data of its VTU file."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..._runtime.files import replace_file
from .probes import Probe, checked_probes
from .tables import is_result

_GRID = b"<UnstructuredGrid>"
_BLOCK = 32768  # bytes of the blocks that meshio compresses


def probe_columns(what: Any, probes: Probe | Sequence[Probe], positions: Any) -> dict[str, np.ndarray]:
    """Return the numbers of probes in all states of a result, {name with unit: (n,)}.

    Raises ValueError for probes of what is no result, and if a caller shows other positions than those of the result.
    """
    chosen = checked_probes(probes)
    if not chosen:
        return {}
    if not is_result(what):
        raise ValueError(f"probes are of one result, got a {type(what).__name__}")
    if positions is not None:
        raise ValueError("probes are of the result's own states: leave out positions=")
    return {
        f"{name} [{unit}]": np.atleast_1d(np.asarray(values, dtype=np.float64))
        for probe in chosen
        for name, (unit, values) in probe.columns(what).items()
    }


def add_field_data(path: Path, numbers: dict[str, float]) -> None:
    """Add numbers to a VTU file as its field data, where ParaView finds them under their names."""
    from xml.sax.saxutils import quoteattr  # late, as it loads all of urllib

    arrays = [
        f'<DataArray type="Float64" Name={quoteattr(name)} NumberOfTuples="1" format="binary">{_packed(value)}</DataArray>'
        for name, value in numbers.items()
    ]
    before, grid, after = path.read_bytes().partition(_GRID)
    if not grid:
        raise ValueError(f"{path.name!r} is not a VTU file of an unstructured grid")
    data = f"<FieldData>{''.join(arrays)}</FieldData>".encode()
    replace_file(path, lambda file: file.writelines([before, grid, data, after]))


def _packed(value: float) -> str:
    """Encode a number as the files of meshio do: one compressed block behind its header. Text could not be NaN."""
    number = np.array([value], dtype=np.float64).tobytes()
    block = zlib.compress(number)
    header = np.array([1, _BLOCK, len(number), len(block)], dtype=np.uint32).tobytes()
    return (base64.b64encode(header) + base64.b64encode(block)).decode()
