"""Projective Dynamics as a way to take time steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .._checks.arrays import count
from .._checks.quantity import quantity
from .._machine.frozen import immutable

if TYPE_CHECKING:
    from ..scene.scene import Scene


@immutable
@dataclass(frozen=True)
class ProjectiveDynamics:
    """Implicit Euler in local and global steps, with a matrix that stays factorized ([Qiao21] 3, Algorithm 1).

    The matrix is M/dt^2 + L, L a constant in the place of the stiffness, the same along x, y, z: of `ms.Projective` solids
    that of Bouaziz et al. 2014, of other solids with their modulus of waves at rest, 2 mu + lam (Liu, Bouaziz, Kavan 2017),
    which is slower where they get much stiffer; of shells that of waves in their plane, and their bending as it is at rest,
    edge rotations with it, along normals that turn with the sheet. It takes more rounds the thinner they are, and with
    bending="midedge" as many as with "hinge". A round then is a quasi-Newton step on the residual of ms.ImplicitEuler,
    corrected by the last few steps (L-BFGS); converged, a step is that of ms.ImplicitEuler. A muscle adds w m m^T to L, its
    stiffness or peak stress along its fibres. Bodies that touch each other or themselves add the stiffness of the pairs
    that touch to the solution with the matrix in every round; of more than 1000 such numbers, the stiffest. Loads, fields,
    water, cells, cavities, tendons, joints and obstacles act as they do there, without a share in L; what is stiff among
    them takes more rounds, and a history.

    iterations: rounds of a step, at most.
    tolerance: of the residual, relative to the forces that cancel in it, as Newton's. A step that does not reach it is taken
        in halves. None: every step takes just `iterations` rounds, whatever is left; such steps have no gradient.
    history: steps that L-BFGS goes by, and Anderson's acceleration with contact="coulomb"; 0: the rounds as they are.
    contact: "penalty": as each ms.Contact and ms.SelfContact says, as in the other integrators. "coulomb": hard, by
        Coulomb's law, in every round ([Qiao21] 5; Ly et al. 2020): of obstacles vertices keep just the `offset`; bodies keep
        the reach and the minimal distance together from each other, by vertices and faces and by edges that cross.
        Stiffness, smoothing and sticking speed do not count. Such motions have no gradient: forces jump where points touch,
        stick or slip. It takes supports that hold vertices entirely, no rigid parts, no points on faces (`face_samples`)
        and one coefficient of friction. Where fine surfaces lie flat on each other, a step takes hundreds of rounds.

    Gradients are those of the solved step, by the exact Hessian: as of every integrator, and as exact as the tolerance.

    >>> import magshell as ms
    >>> bar = ms.meshes.box((0.1, 0.02, 0.02), cells=(10, 2, 2))
    >>> soft = ms.Projective(young_modulus=1e5, poisson_ratio=0.4)
    >>> solid = ms.Solid(bar, material=soft, mass_density=1e3, element="linear")
    >>> scene = ms.Scene(solid, supports=[ms.Pin(bar.vertices_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> move = ms.simulate(scene, steps=5, time_step=5e-3, integrator=ms.ProjectiveDynamics())
    >>> bool(move.positions[-1, :, 2].min() < -1e-4)
    True
    """

    iterations: int = 500
    tolerance: float | None = 1e-10
    history: int = 8
    contact: str = "penalty"

    _name = "euler"
    _times = (1.0,)

    def __post_init__(self) -> None:
        count("iterations", self.iterations)
        count("history", self.history, least=0)
        if self.contact not in ("penalty", "coulomb"):
            raise ValueError(f'contact must be "penalty" or "coulomb", got {self.contact!r}')
        if self.tolerance is not None and not 0.0 < quantity("tolerance", "1", self.tolerance, ()) < 1.0:
            raise ValueError(f"tolerance must be in (0, 1), or None, got {self.tolerance}")

    def without_gradient(self, scene: Scene) -> str:
        """Why motions of a scene have no gradient; empty where they do."""
        if self.tolerance is None:
            return (
                "ProjectiveDynamics(tolerance=None) stops before its steps are solved, so that they are no function of the "
                "inputs alone; give it a tolerance"
            )
        if self.contact == "coulomb" and scene.contacts:
            return 'forces jump with ProjectiveDynamics(contact="coulomb"); take contact="penalty"'
        return ""

    @property
    def _projective(self) -> tuple[int, float, int, bool]:
        tolerance = 0.0 if self.tolerance is None else self.tolerance
        return self.iterations, tolerance, self.history, self.contact == "coulomb"
