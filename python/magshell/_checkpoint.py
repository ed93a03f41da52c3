"""Files that are either the old one or the new one, never a part of either."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from ._tensors import require_torch


def save(path: str | Path, contents: dict) -> None:
    torch = require_torch("a checkpoint")
    replace_file(path, lambda file: torch.save(contents, file))


def replace_file(path: str | Path, write: Callable[[BinaryIO], object]) -> None:
    """Replaces the file at once: it is written beside its place and then renamed."""
    path = Path(path)
    handle, written = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            write(file)
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
