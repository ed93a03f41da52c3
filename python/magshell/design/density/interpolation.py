"""Properties of material between void and solid."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..._input.arrays import number
from ..._input.scalars import positive
from ..._input.tensors import detached, real_tensor
from .cells import checked_density

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


def interpolated(
    density: Numbers, full: Numbers, *, void: float = 0.0, power: float = 3.0, least_density: float = 0.0
) -> torch.Tensor:
    """Return a property of every face between void and solid: full (v + (1 - v) s^p), s = (d - m) / (1 - m), 0 below m.

    It is the modified SIMP law (O. Sigmund, Morphology-based black and white filters for topology optimization, Struct.
    Multidisc. Optim. 33, 2007), with a density m at which the void begins. A power above 1 makes densities between 0 and 1
    inefficient.

    density d: (n_f,) in [0, 1]. full: the property at density 1, a number, (n_f,), or vectors (3,) or (n_f, 3), in any unit.
    void v: the fraction of it that void has, in [0, 1). power p: at least 1. least_density m: in [0, 1).

    >>> import magshell as ms
    >>> ms.parametrize.density.interpolated([0.0, 0.5, 1.0], 1e6, void=1e-3)
    tensor([   1000.0000,  125875.0000, 1000000.0000], dtype=torch.float64)
    """
    density = checked_density("density", density, "n_f")
    full = real_tensor("full", full, ("...",)).to(density)
    if tuple(full.shape) not in ((), (len(density),), (3,), (len(density), 3)):
        raise ValueError(
            f"full must be a number or have shape (n_f,) = ({len(density)},), (3,) or ({len(density)}, 3), got "
            f"{tuple(full.shape)}"
        )
    void, least = fraction("void", void), fraction("least_density", least_density)
    power = positive("power", "1", power)
    if power < 1.0:
        raise ValueError(f"power [1] must be at least 1, got {power:g}")
    share = void + (1.0 - void) * ((density - least) / (1.0 - least)).clamp(min=0.0) ** power
    vectors = full.ndim == 2 or (full.ndim == 1 and len(full) == 3 and len(density) != 3)
    return full * (share[:, None] if vectors else share)


def fraction(name: str, value: float) -> float:
    """Return a number in [0, 1). Raises ValueError for any other."""
    given = number(f"{name} [1]", detached(value))
    if not 0.0 <= given < 1.0:
        raise ValueError(f"{name} [1] must be 0 or more and below 1, got {given:g}")
    return given
