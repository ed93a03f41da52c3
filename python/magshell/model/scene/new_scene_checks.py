"""Checks a scene when it is made, and warns of what is likely a mistake."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..contact.contacts_to_core import check_neighbours
from ..loads.custom_energy import CustomEnergy
from ..solids.mean_volume import warn_of_thin_regions
from ..solids.solid import Solid
from .plausible import warn_of_units

if TYPE_CHECKING:
    from .scene import Scene


def check_new_scene(scene: Scene) -> None:
    """Warn of contact between neighbours, of sizes that no body has, and of solids one cell thick.

    Raises ValueError in the cases of `check_neighbours`, and for a CustomEnergy with the name of another energy.
    """
    _check_names(scene)
    check_neighbours(scene, warns=True)
    warn_of_units(scene, scene._values)
    for span, body in zip(scene._bodies.spans, scene.bodies, strict=True):
        if isinstance(body, Solid) and body.mean_volume:
            warn_of_thin_regions(body.mesh, _held(scene)[span.vertices])


def _check_names(scene: Scene) -> None:
    """Raise ValueError if two energies would have one name in results."""
    names = scene._model.term_names
    for load in scene.loads:
        if isinstance(load, CustomEnergy) and names.count(load.name) > 1:
            custom = [
                each for each in scene.loads if isinstance(each, CustomEnergy) and each.name == load.name
            ]
            other = "CustomEnergy" if len(custom) > 1 else "energy of the scene"
            raise ValueError(
                f"results list energies by name, but another {other} is called {load.name!r} as well: give {load!r} a name "
                "of its own, CustomEnergy(..., name=...)"
            )


def _held(scene: Scene) -> np.ndarray:
    """Return the projections onto the directions in which supports hold each vertex, (n_v, 3, 3)."""
    bodies, constraints = scene._bodies, scene._constraints
    found = np.zeros((len(bodies.original), 3, 3))
    of_vertices = constraints.held_nodes[:, 0] < len(found)
    nodes, counts = constraints.held_nodes[of_vertices, :2].T
    columns = constraints.held_frames[of_vertices] * (np.arange(3) < counts[:, None])[:, None, :]
    found[nodes] = columns @ np.swapaxes(columns, 1, 2)
    return found[bodies.original]
