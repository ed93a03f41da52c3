"""What a solve is asked for, checked against its scene."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np

from . import _core
from ._quantity import quantity, real_numbers
from ._tensors import to_array
from .scene import Scene


class Inputs:
    """The controls and the magnetization of one solve. Raises ValueError where they do not fit the scene."""

    def __init__(self, scene: Scene, remanent_magnetization, applied_flux_density, **factors):
        if not isinstance(scene, Scene):
            raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
        self.scene = scene
        self.given = (remanent_magnetization, applied_flux_density)
        self.given_magnetization = remanent_magnetization
        self.magnetization = self._magnetization(to_array("remanent_magnetization", remanent_magnetization))
        flux_density = self._flux_density(to_array("applied_flux_density", applied_flux_density))
        names = {"load_factor": "load", "gravity_factor": "gravity", "field_factor": "field", "motion_factor": "motion"}
        numbers = {names[key]: float(quantity(key, "1", value, ())) for key, value in factors.items()}
        self.controls = _core.Controls(flux_density=flux_density, **numbers)

    def _magnetization(self, given) -> np.ndarray | None:
        if not self.scene.fields:
            if given is not None:
                raise ValueError("remanent_magnetization was given, but the scene has no field: Scene(..., field=...)")
            return None
        if given is None:
            raise ValueError("the scene has a field, so remanent_magnetization [A/m] is needed")
        n_faces = self.scene.mesh.n_faces
        given = real_numbers("remanent_magnetization [A/m]", given)
        shape = given.shape
        if shape not in ((3,), (n_faces, 3)):
            raise ValueError(
                f"remanent_magnetization [A/m] must have shape (n_f, 3) = ({n_faces}, 3) or (3,), got {shape}"
            )
        return np.broadcast_to(quantity("remanent_magnetization", "A/m", given, shape), (n_faces, 3))

    def _flux_density(self, given) -> np.ndarray:
        if given is None:
            if self.scene.has_uniform_field:
                raise ValueError("the scene has a UniformField, so applied_flux_density [T] is needed")
            return np.zeros(3)
        if not self.scene.has_uniform_field:
            raise ValueError("applied_flux_density was given, but the scene has no UniformField")
        return quantity("applied_flux_density", "T", given, (3,))

    @contextmanager
    def in_core(self):
        """The scene's core with this magnetization in it, for one solve; those of other threads wait."""
        with self.scene._exclusive():
            if self.magnetization is not None:
                self.scene._model.set_magnetization(self.magnetization)
            yield
