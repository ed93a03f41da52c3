"""Files that are either the old one or the new one, never a part of either."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from ._tensors import require_torch


def save(path: str | Path, contents: dict) -> None:
    """Replaces the file at once: it is written beside its place and then renamed."""
    torch = require_torch("a checkpoint")
    path = Path(path)
    handle, written = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            torch.save(contents, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(written, path)
    except BaseException:
        Path(written).unlink(missing_ok=True)
        raise


def load(path: str | Path) -> dict:
    """What `save` wrote; a file of anything but tensors and plain values is refused."""
    torch = require_torch("a checkpoint")
    try:
        return torch.load(path, weights_only=True)
    except Exception as error:
        raise ValueError(f"{path} is not a checkpoint of a minimization: {error}") from error
