"""Where a solve starts from."""

from __future__ import annotations

import numpy as np

from . import _core
from ._inputs import Inputs
from ._tensors import to_array
from .equilibrium import Equilibrium
from .scene import Scene


def starting_point(scene: Scene, start, inputs: Inputs):
    """State, controls at which it holds, and whether it is an equilibrium there."""
    model = scene._model
    if start is None:
        return model.rest_state(), _core.Controls(), True
    if isinstance(start, Equilibrium):
        if start.scene is not scene:
            raise ValueError("start is an equilibrium of another scene; hand over its positions instead")
        same = np.array_equal(start._magnetization, inputs.magnetization)
        return start._state, start._controls, same
    positions = np.asarray(to_array("start", start), dtype=np.float64)
    shape = (scene.mesh.n_vertices, 3)
    if positions.shape != shape or not np.isfinite(positions).all():
        raise ValueError(f"start [m] must be an Equilibrium or finite positions of shape (n_v, 3) = {shape}")
    return model.state(positions, np.zeros(scene.mesh.n_edges)), inputs.controls, False
