"""Strain and stress of elements as a file has them: one row an element, matrices by rows."""

from __future__ import annotations

import numpy as np

from ..bodies.shell_stresses import ShellStresses
from ..bodies.solid_states import SolidStates


def element_fields(found: ShellStresses | SolidStates) -> dict[str, np.ndarray]:
    """{name: (n,) or (n, 9)}; von Mises stress of a solid is the mean of an element, of a shell the larger of both
    surfaces'."""
    if isinstance(found, ShellStresses):
        return {
            "von_mises_stress": found.von_mises_stresses.max(axis=1),
            "membrane_force": found.in_space(found.membrane_forces).reshape(-1, 9),
            "bending_moment": found.in_space(found.bending_moments).reshape(-1, 9),
        }
    return {
        "von_mises_stress": found.mean(found.von_mises_stresses),
        "volume_ratio": found.mean(found.volume_ratios),
        "green_strain": found.mean(found.green_strains).reshape(-1, 9),
        "cauchy_stress": found.mean(found.cauchy_stresses).reshape(-1, 9),
        **(found.muscles or {}),
    }
