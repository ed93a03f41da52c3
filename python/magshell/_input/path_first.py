"""Checks that a path comes before what is written there."""

from __future__ import annotations

import os
from typing import Any


def check_path_first(call: str, path: Any, what: Any) -> None:
    """Raise ValueError if a path and what is to be written there were swapped. call: as it should be."""
    if isinstance(what, str | os.PathLike) and not isinstance(path, str | os.PathLike):
        raise ValueError(f"the path comes first, ms.{call}: got {type(path).__name__} for it")
