"""Penalties on fields in time: functions of the values (n, 3) T of a series.

They are means over the series, so that they do not depend on its number of steps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..._input.tensors import positive_number
from .. import objectives
from ._arguments import tensor
from .signals import oscillation

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


def field_strength(flux_density: Numbers) -> torch.Tensor:
    """Return the mean of |B|^2 [T2]. flux_density: (n, 3) T.

    >>> import magshell as ms
    >>> import numpy as np
    >>> field = np.array([(3e-3, 0, 0), (0, 4e-3, 0)])  # T
    >>> round(ms.control.field_strength(field).item(), 9)
    1.25e-05
    """
    return (tensor("flux_density", "T", flux_density, ("n", 3)) ** 2).sum(-1).mean()


def field_rate(flux_density: Numbers, time_step: Numbers) -> torch.Tensor:
    """Return the mean of |dB/dt|^2 [T2/s2], from differences of successive values.

    flux_density: (n, 3) T, n > 1. time_step: s.

    >>> import magshell as ms
    >>> import numpy as np
    >>> field = np.array([(3e-3, 0, 0), (0, 4e-3, 0)])  # T
    >>> round(ms.control.field_rate(field, 0.1).item(), 9)  # (5 mT / 0.1 s)^2
    0.0025
    """
    flux_density = tensor("flux_density", "T", flux_density, ("n", 3))
    if len(flux_density) < 2:
        raise ValueError(f"flux_density [T] must have at least 2 rows, got {len(flux_density)}")
    return ((flux_density.diff(dim=0) / positive_number("time_step", "s", time_step)) ** 2).sum(-1).mean()


def field_excess(flux_density: Numbers, limit: float) -> torch.Tensor:
    """Return the mean of sum_i max(|B_i| - limit, 0)^2 [T2]: zero within the limit, with a continuous derivative.

    It is meant for optimizers without bounds; those of ms.optim satisfy bounds exactly. flux_density: (n, 3) T. limit: T.

    >>> import magshell as ms
    >>> import numpy as np
    >>> field = np.array([(3e-3, 0, 0), (0, 4e-3, 0)])  # T
    >>> ms.control.field_excess(field, 5e-3).item()
    0.0
    """
    flux_density = tensor("flux_density", "T", flux_density, ("n", 3))
    return ((flux_density.abs() - positive_number("limit", "T", limit)).clamp(min=0) ** 2).sum(-1).mean()


def field_limit(flux_density: Numbers, limit: float, sharpness: float | None = None) -> torch.Tensor:
    """Return constraints g <= 0 that keep all components within a limit: (B_i / limit)^2 - 1.

    They are meant for MMA and GCMMA, with fields that are not bounded by their parameters, such as Fourier series.
    flux_density: (n, 3) T. limit: T. There is one constraint for each component, (3 n,), or with a sharpness a single one,
    as in `ms.objectives.limit`, which limits the norm instead of each component.

    >>> import magshell as ms
    >>> import numpy as np
    >>> field = np.array([(3e-3, 0, 0), (0, 4e-3, 0)])  # T
    >>> ms.control.field_limit(field, 5e-3).max().item() <= 0
    True
    """
    flux_density = tensor("flux_density", "T", flux_density, ("n", 3))
    return objectives.limit(flux_density.reshape(-1, 1), positive_number("limit", "T", limit), sharpness)


def low_frequency_penalty(
    flux_density: Numbers,
    times: Numbers,
    angular_frequencies: Numbers,
    cosine_amplitudes: Numbers,
    sine_amplitudes: Numbers,
) -> torch.Tensor:
    """Return the mean squared distance of a field from a sum of a few oscillations: F_DMP of [Chen22] 6.3.

    This regulariser, there after Pan and Manocha 2018, draws a field to a low-frequency one; all its arguments may
    be optimized. The mean over the times [T2] is of

        F_DMP(B, t) = sum_i (B_i - sum_j (alpha_j cos(w_j t) + beta_j sin(w_j t)))^2,     i = 1 ... 3, j = 1 ... J

    flux_density: (n, 3) T at times (n,) s. angular_frequencies: (J,) rad/s; the paper takes J = 5. Amplitudes: (J, 3) T;
    or (J,) T as printed, without an index i, which draws the three components to the same signal. A frequency of zero
    gives a constant. `harmonics` and `fit_fourier` find values to begin with.

    cosine_amplitudes, sine_amplitudes: T, alpha and beta above.

    >>> import magshell as ms
    >>> import numpy as np
    >>> times = np.linspace(0, 1, 5)
    >>> turning = np.stack([np.cos(7 * times), np.sin(7 * times), 0 * times], axis=1)
    >>> one, other = np.array([[1.0, 0, 0]]), np.array([[0, 1.0, 0]])
    >>> float(ms.control.low_frequency_penalty(turning, times, [7.0], one, other))
    0.0
    """
    flux_density = tensor("flux_density", "T", flux_density, ("n", 3))
    times = tensor("times", "s", times, (len(flux_density),))
    signal = oscillation(times, angular_frequencies, cosine_amplitudes, sine_amplitudes)
    return ((flux_density - (signal if signal.ndim == 2 else signal[:, None])) ** 2).sum(-1).mean()
