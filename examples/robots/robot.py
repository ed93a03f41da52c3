"""The common base of the robots that swim or carry to a target, [Qiao21] Figure 4."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from magshell.model.scene.scene import Scene
from magshell.model.solids.solid import Solid
from magshell.solve.dynamics.simulate import simulate
from magshell.solve.dynamics.trajectory import Trajectory
from magshell.solve.options import ImplicitEuler, MixedNewton

if TYPE_CHECKING:
    import torch

    from magshell._input.kinds import Computed, Numbers


class Robot:
    """A scene controlled by a few numbers a step, in which one body's center of mass is to reach a target.

    scene; traveller: the Solid whose center of mass is to reach a target. Classes of robots say how many `numbers` a
    step takes, each from -1 to 1, how many `steps` of which `time_step` [s] the way takes, and where `target` [m] is.
    Controls are (steps, numbers), a tensor where gradients are wanted.
    """

    numbers: ClassVar[int]
    steps: ClassVar[int]
    time_step: ClassVar[float]
    target: ClassVar[tuple[float, float, float]]
    solver: ClassVar[MixedNewton] = MixedNewton(tolerance=1e-4)
    stiffness_damping: ClassVar[float] = 0.0  # s
    keep: ClassVar[str | None] = None  # for gradients, as ms.simulate has it

    scene: Scene
    traveller: Solid

    def values(self, controls: torch.Tensor | np.ndarray) -> dict[Any, Any]:
        """Return the values of the scene's objects over the time of a motion, as ms.simulate takes them."""
        raise TypeError(f"{type(self).__name__} does not say what its controls are")

    def first_controls(self, steps: int) -> np.ndarray:
        """Return the controls that a search starts from."""
        raise TypeError(f"{type(self).__name__} does not say where a search begins")

    def motion(self, controls: torch.Tensor | np.ndarray, solver: MixedNewton | None = None) -> Trajectory:
        """Simulate the motion from rest, of as many steps as controls has rows."""
        return simulate(
            self.scene,
            steps=len(controls),
            time_step=self.time_step,
            values=self.values(controls),
            integrator=ImplicitEuler(),
            solver=self.solver if solver is None else solver,
            stiffness_damping=self.stiffness_damping,
            adjoint_storage=self.keep,
            progress=False,
        )

    @cached_property
    def weights(self) -> np.ndarray:
        """The fraction of the traveller's mass at each of its vertices, (n_v,)."""
        masses = self.traveller.vertex_masses
        return masses / masses.sum()

    def displacement(self, motion: Trajectory) -> Computed:
        """Return the displacement of the center of mass until the end, (3,) m."""
        moved = motion[self.traveller].displacements[-1]
        weights = self.weights if isinstance(moved, np.ndarray) else moved.new_tensor(self.weights)
        return weights @ moved

    def relative_distance(self, motion: Trajectory, target: Numbers | None = None) -> Computed:
        """Return the final distance of the center of mass from the target, (3,) m, over the initial one.

        For gradients minimize its square, which is differentiable at the target.
        """
        goal = np.array(self.target if target is None else target, dtype=float)
        moved = self.displacement(motion)
        away = moved - (goal if isinstance(moved, np.ndarray) else moved.new_tensor(goal))
        return (away**2).sum() ** 0.5 / float(np.linalg.norm(goal))
