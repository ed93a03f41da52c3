"""Optimizers for designs, as torch optimizers with closures: `MMA`, `GCMMA`, `LBFGS`, `GaussNewton` and
`NewtonCG`.

torch is imported when one of them is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ..._input.tensors import require_torch

_HOMES = {
    "GCMMA": ".gcmma",
    "GaussNewton": ".gauss_newton",
    "LBFGS": ".lbfgs",
    "MMA": ".mma",
    "NewtonCG": ".newton_cg",
}

__all__ = ["GCMMA", "LBFGS", "MMA", "GaussNewton", "NewtonCG"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    require_torch(f"optim.{name}")
    return getattr(import_module(_HOMES[name], __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)
