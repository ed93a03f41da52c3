"""The state of a scene at rest, and what it took to find it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ._tensors import detached
from .scene import Scene


@dataclass(frozen=True, repr=False)
class Equilibrium:
    """A scene at rest.

    positions: (n_v, 3) m; edge_rotations: (n_e,) rad, zero where an edge has none.
    remanent_magnetization: (n_f, 3) A/m, or None; applied_flux_density: (3,) T, the uniform part.
    energies: J, by term. stable: no direction lowers the energy; unstable_directions: how many do.
    residual: relative to the forces that cancel in it. progress: how far the controls got, 1 unless a solve failed.
    wall_time, linear_time: s, in all and in factorizations and back-substitutions. memory: bytes, of the core.
    """

    scene: Scene
    positions: Any
    edge_rotations: Any
    remanent_magnetization: Any
    applied_flux_density: Any
    energies: dict[str, float]
    stable: bool
    unstable_directions: int
    iterations: int
    factorizations: int
    failed_factorizations: int
    load_steps: int
    relaxation_steps: int
    saddles_left: int
    residual: float
    progress: float
    wall_time: float
    linear_time: float
    memory: int
    factorization: str
    _state: np.ndarray = field(repr=False)
    _memory: list = field(repr=False)
    _controls: Any = field(repr=False)
    _values: Any = field(repr=False)

    def __getstate__(self):
        raise TypeError(
            "an Equilibrium cannot be copied or pickled, as it holds the solver's own state: keep its positions, "
            "edge_rotations and energies"
        )

    @property
    def displacements(self):
        """(n_v, 3) m, from the rest shape."""
        rest = self.scene.mesh.rest_positions
        if isinstance(self.positions, np.ndarray):
            return self.positions - rest
        return self.positions - self.positions.new_tensor(np.array(rest))

    @property
    def energy(self) -> float:
        """The potential energy, J."""
        return sum(self.energies.values())

    def __repr__(self) -> str:
        moved = float(np.linalg.norm(np.asarray(detached(self.displacements)), axis=1).max())
        kind = "stable" if self.stable else f"unstable in {self.unstable_directions} directions"
        if not self.stable and self.unstable_directions == 0:
            kind = "not known to be stable"
        if self.progress < 1.0:
            kind += f", {self.progress:.1%} of the way"
        energies = ", ".join(f"{name} {value:.4g}" for name, value in self.energies.items())
        extra = f", {self.saddles_left} saddles left" if self.saddles_left else ""
        extra += f", {self.relaxation_steps} relaxation steps" if self.relaxation_steps else ""
        return (
            f"Equilibrium: {kind}; largest displacement {moved:.4g} m\n"
            f"  energy {self.energy:.6g} J ({energies})\n"
            f"  {self.iterations} iterations, {self.factorizations} factorizations, {self.load_steps} load steps{extra}\n"
            f"  residual {self.residual:.1e}, {self.wall_time:.3g} s, {self.memory / 1e6:.3g} MB, {self.factorization}"
        )
