"""Holds the options of solves as objects: methods, integrators, and what a motion stores for its gradient."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .. import _core
from .._input.arrays import count
from .._input.quantity import quantity
from .._input.scalars import not_negative, positive
from .._input.tensors import detached, is_tensor, positive_number
from .._runtime.frozen import immutable

if TYPE_CHECKING:
    from .._input.kinds import Numbers
    from ..model.scene.scene import Scene
    from .dynamics.trajectory import MotionState


@dataclass(frozen=True)
class Clock:
    """Counts the steps of a motion, so that one that is continued has the same times, to the last bit, as one in one piece.

    Adding up time steps would not give the same bits. origin, time_step: s; steps: the number taken since the origin.
    """

    origin: float
    time_step: float = 0.0
    steps: int = 0

    @property
    def time(self) -> float:
        """The time now, s."""
        return self.at(0)

    def at(self, steps: Any, fraction: Any = 0.0) -> Any:
        """Return the times [s] after so many more steps and a fraction of another one: numbers or arrays."""
        return self.origin + ((self.steps + steps) + fraction) * self.time_step

    def after(self, steps: int) -> Clock:
        return Clock(self.origin, self.time_step, self.steps + steps)

    def going_on(self, time_step: float) -> Clock:
        """Return the clock for steps of this length: it starts a new count if the length differs."""
        return self if self.time_step == time_step else Clock(self.time, time_step)

    def moment(self, steps: Any, fraction: float, time_step: Numbers) -> Any:
        """Return the time as `at` does; if `time_step` is a tensor, as a tensor in its graph, the present time constant."""
        time = self.at(steps, fraction)
        if not is_tensor(time_step):
            return time
        time_step = time_step.double()
        return time + (steps + fraction) * (time_step - time_step.detach())


def clock_of(state: MotionState) -> Clock:
    """Return the clock of a MotionState; if its time was set by hand, a clock that starts there."""
    clock = state.clock
    return clock if clock is not None and clock.time == state.time else Clock(float(detached(state.time)))


SHORTEST_STEP = 1e-12  # [s] of a motion
_DEEPEST = 20  # halvings of an interval


@immutable
@dataclass(frozen=True)
class Adaptive:
    """Chooses time steps that keep the estimated error of each step below a tolerance: `time_step` of ms.simulate.

    interval: the spacing of the motion's time grid, s; `steps` counts these intervals. States are recorded and arrays in
        time are given at the grid's times, and no step goes beyond one. Choose it as long as a step may be, and so that
        load parameters have kinks and jumps only at these times. A tensor has a gradient.
    tolerance: of the error of the positions after one step, m, as the root mean square over vertices (that of
        Trajectory.step_errors). By default 1e-4 of the extent, the longest side of a body's bounding box; the error of
        a few hundred steps together is then a few percent of the extent at most.
    max_halvings: the shortest step is interval / 2^max_halvings. At most 20, and so many that this is at least 1e-12 s,
        which is the default.

    Steps are interval / 2^k long and begin at multiples of their length. A step whose error exceeds the tolerance, or that
    fails, is repeated with half or a quarter of the length; the next one is doubled if that is expected to keep the error
    below half of the tolerance. Errors of steps add up: positions at the end are off by more than the tolerance.

    An impact is resolved until a step times the jump of velocity is below the tolerance. Small changes of an input leave
    the steps as they are, and results change smoothly; where they change the steps, results jump by about the tolerance.
    Pass Trajectory.time_steps as `time_step` to repeat a motion with the same steps, for example in a line search.
    Gradients are those of the steps that were accepted.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> move = ms.simulate(scene, steps=4, time_step=ms.Adaptive(0.02, tolerance=2e-5))
    >>> len(move), len(move.time_steps) > 4, bool(move.step_errors.max() <= 2e-5)
    (5, True, True)
    """

    interval: Numbers
    tolerance: float | None = None
    max_halvings: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "interval", positive_number("interval", "s", self.interval))
        interval = float(detached(self.interval))
        if interval < SHORTEST_STEP:
            raise ValueError(f"interval [s] must be at least {SHORTEST_STEP:g} s, got {interval:g}")
        if self.tolerance is not None:
            object.__setattr__(self, "tolerance", positive("tolerance", "m", self.tolerance))
        if self.max_halvings is None:
            return
        if count("max_halvings", self.max_halvings, least=0) > _DEEPEST:
            raise ValueError(f"max_halvings must be at most {_DEEPEST}, got {self.max_halvings}")
        if interval / 2**self.max_halvings < SHORTEST_STEP:
            raise ValueError(
                f"max_halvings = {self.max_halvings} of an interval of {interval:g} s would give steps below "
                f"{SHORTEST_STEP:g} s; at most {self._deepest_possible} are possible"
            )

    @property
    def _deepest_possible(self) -> int:
        return min(_DEEPEST, int(math.log2(float(detached(self.interval)) / SHORTEST_STEP) + 1e-9))

    @property
    def _deepest(self) -> int:
        return self._deepest_possible if self.max_halvings is None else self.max_halvings


@immutable
@dataclass(frozen=True)
class Newton:
    """Solves by Newton's method with the stresses of the trial state, in adaptive load steps. For comparison.

    tolerance: of the residual, relative to the forces that cancel in it. The residual cannot be smaller than what the
        round-off of the positions makes of these forces. With stiff parts, short time steps or long chains of links (angles
        of 200 links over 10 m are known to 1e-13) this floor is above the tolerance, and results have fewer digits.
    max_iterations: the largest number of iterations in a load step; one that needs more is halved.
    first_load_step: the first load step, as a share of the change of the loads, in (0, 1].
    min_load_step: the smallest load step, as a share of the change of the loads. Below it, the solve descends the energy at
        the final loads (proximal continuation). A value up to 1/64 is made smaller where the displacement is many extents.
    max_relaxation_steps: the largest number of steps of that descent.
    max_factorizations: the largest number of factorizations of an equilibrium, after which NotConverged is raised; 20
        iterations without a factorization count as one. No case of tests/hard takes more than half of the default. A tenth
        of it in a scene with an ms.Cavity of a given pressure, whose energy has no lower bound beyond a limit point.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.equilibrium(scene, solver=ms.Newton(max_iterations=500)).stable
    True
    """

    tolerance: float = 1e-10
    max_iterations: int = 20
    first_load_step: float = 1.0
    min_load_step: float = 1.0 / 64.0
    max_relaxation_steps: int = 500
    max_factorizations: int = 5000

    _mixed = False

    def __post_init__(self) -> None:
        if not 0.0 < quantity("tolerance", "1", self.tolerance, ()) < 1.0:
            raise ValueError(f"tolerance must be in (0, 1), got {self.tolerance}")
        for name in ("first_load_step", "min_load_step"):
            if not 0.0 < quantity(name, "1", getattr(self, name), ()) <= 1.0:
                raise ValueError(f"{name} must be in (0, 1], got {getattr(self, name)}")
        for name in ("max_iterations", "max_relaxation_steps", "max_factorizations"):
            count(name, getattr(self, name))

    def _newton_options(self) -> _core.NewtonOptions:
        return _core.NewtonOptions(
            mixed=self._mixed, tolerance=self.tolerance, max_iterations=self.max_iterations
        )

    def _options(self) -> _core.StaticsOptions:
        options = _core.StaticsOptions()
        options.newton = self._newton_options()
        options.first_step = self.first_load_step
        options.smallest_step = self.min_load_step
        options.max_relaxation_steps = self.max_relaxation_steps
        options.max_factorizations = self.max_factorizations
        return options


@immutable
@dataclass(frozen=True)
class MixedNewton(Newton):
    """Solves by Newton's method with stresses as further unknowns (mixed integration points), in adaptive load steps.

    It is the default. A large deflection of a thin shell takes a few iterations where `Newton` takes dozens; the solution is
    the same. Source: D. Magisano, L. Leonetti, G. Garcea, Comput. Methods Appl. Mech. Eng. 313 (2017).

    tolerance, max_iterations, first_load_step, min_load_step, max_relaxation_steps, max_factorizations: as in `Newton`.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.equilibrium(scene, solver=ms.MixedNewton(max_iterations=100)).stable
    True
    """

    _mixed = True


@immutable
@dataclass(frozen=True)
class ProjectiveDynamics:
    """Takes steps of implicit Euler by local and global rounds, with a matrix that stays factorized ([Qiao21] 3).

    The matrix is M/dt^2 + L, where the constant L stands for the stiffness, equal along x, y and z. A round is a
    quasi-Newton step with it on the residual of ms.ImplicitEuler, corrected by the last few steps (L-BFGS). Converged, a
    step is that of ms.ImplicitEuler. It pays for large solids whose steps need not be solved exactly: a table is in
    docs/what-to-choose.md.

    L has these parts:

    - of a solid of `ms.ProjectiveMaterial`, the matrix of Bouaziz et al. 2014; of other solids, their modulus of
      longitudinal waves at rest, 2 mu + lam (Liu, Bouaziz, Kavan 2017). The latter takes more rounds where a solid becomes
      much stiffer.
    - of a shell, its membrane stiffness likewise and its bending stiffness at rest, along normals that turn with the sheet.
      Thin shells take more rounds. bending="midedge" takes as many as "hinge".
    - of a muscle, w m m^T along its fibres, with its stiffness or its peak stress as the weight w.
    - of bodies that touch, the stiffness of the touching pairs, by the Woodbury formula in every round; of more than 1000
      such numbers, the stiffest.

    Loads, fields, water, cells, cavities, tendons, joints and obstacles act as with ms.ImplicitEuler, but have no part in L.
    The stiff ones among them take more rounds, and need a history.

    iterations: the largest number of rounds of a step.
    tolerance: of the residual, relative to the forces that cancel in it, as for Newton's method. A step that does not reach
        it is taken in halves. None: every step takes exactly `iterations` rounds, and there is no gradient.
    history: the number of previous rounds that L-BFGS uses, and Anderson's acceleration with contact="coulomb"; 0: none.
    contact: "penalty": as each ms.Contact and ms.SelfContact says, like the other integrators. "coulomb": hard contact with
        Coulomb's law in every round ([Qiao21] 5; Ly et al. 2020). Vertices keep the `offset` from obstacles; bodies keep the
        sum of the reach and the minimal distance from each other, by pairs of a vertex and a face and pairs of two edges.
        Stiffness, smoothing and sticking speed have no effect. Such motions have no gradient, as forces jump where points
        touch, stick or slip. Supports must hold vertices entirely; rigid parts, points on faces (`face_samples`) and several
        coefficients of friction are refused. Where fine surfaces lie flat on each other, a step takes hundreds of rounds.

    The gradient is that of the solved step, by the exact Hessian, and as exact as the tolerance.

    >>> import magshell as ms
    >>> bar = ms.meshes.box((0.1, 0.02, 0.02), cells=(10, 2, 2))
    >>> soft = ms.ProjectiveMaterial(young_modulus=1e5, poisson_ratio=0.4)
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
        """Return why motions of a scene have no gradient; "" if they have one."""
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


@immutable
@dataclass(frozen=True)
class ImplicitEuler:
    """Takes one solve a step and has first order, as in [Chen22] (26)-(28).

    It damps: the energy of a vibration of 40 steps a period falls to a share of 1/e in about 6.5 steps.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=1e-3, integrator=ms.ImplicitEuler()).steps_done
    2
    """

    _name = "euler"
    _times = (1.0,)  # of the stages, as fractions of the step


@immutable
@dataclass(frozen=True, repr=False)
class TRBDF2:
    """Takes two solves a step, the trapezoidal rule and then BDF2: second order, L-stable. The default.

    At 40 steps a period, a small vibration loses 0.36 % of its energy over 20 periods, and one that bends a strip by a third
    of its length about 1 %. If a field jumps between two steps, half of its new value acts over the first 0.59 of the next
    step. The first step has no step before it and is one of SDIRK2; with rigid parts, only the first 64th of it is.
    R. E. Bank et al., IEEE Trans. Electron Devices 32 (1985); M. E. Hosea and L. F. Shampine, Appl. Numer. Math. 20 (1996).

    implicit_contact: whether the contact and friction forces at the end of a step act over the whole step, as within
        Newmark's method in C. Kane et al., Int. J. Numer. Methods Eng. 49 (2000). False: they act at the stages like
        all other forces, and after an impact shorter than a step the speed may have any value. True: such an impact
        loses energy, one of 20 steps rebounds with 0.93 to 0.95 of its speed, one of 100 steps with 0.97 to 0.98. The
        method then has first order in contact and second order without.
        ms.simulate takes True where a scene has contacts and no integrator is given.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=1e-3, integrator=ms.TRBDF2()).steps_done
    2
    """

    implicit_contact: bool = False

    _name = "tr_bdf2"
    _times = (2.0 - 2.0**0.5, 1.0)

    def __post_init__(self) -> None:
        if not isinstance(self.implicit_contact, bool):
            raise ValueError(f"implicit_contact must be True or False, got {self.implicit_contact!r:.60}")

    def __repr__(self) -> str:
        return "TRBDF2(implicit_contact=True)" if self.implicit_contact else "TRBDF2()"


@immutable
@dataclass(frozen=True)
class SDIRK2:
    """Takes two solves a step: second order, L-stable (R. Alexander, SIAM J. Numer. Anal. 14, 1977).

    Its stability function is that of TRBDF2, so small vibrations are damped alike. Large ones are damped more: one that
    bends a thin strip by a tenth of its length loses 5 to 8 % of its energy over 20 periods of 40 steps, since the
    stages stretch the sheet along its curved motion; with half the step, a quarter of that. A step starts from
    positions and velocities only, without accelerations, which suits fields that jump often.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=1e-3, integrator=ms.SDIRK2()).steps_done
    2
    """

    _name = "sdirk2"
    _times = (1.0 - 0.5**0.5, 1.0)


@immutable
@dataclass(frozen=True)
class SDIRK3:
    """Takes three solves a step: third order, L-stable (R. Alexander, SIAM J. Numer. Anal. 14, 1977).

    It has third order in small motions, and where the steps resolve membrane waves. In large motions of thin sheets,
    and with stiffness-proportional damping, it has second order.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=1e-3, integrator=ms.SDIRK3()).steps_done
    2
    """

    _name = "sdirk3"
    _times = (0.43586652150845899942, 0.5 * (1.0 + 0.43586652150845899942), 1.0)


Integrator = ImplicitEuler | TRBDF2 | SDIRK2 | SDIRK3 | ProjectiveDynamics


KINDS = ("stages", "checkpoints", "factors")


@immutable
@dataclass(frozen=True)
class AdjointStorage:
    """Says what a motion stores for its gradients, and how much of it: `adjoint_storage` of ms.simulate.

    what: "stages": all states. "checkpoints": some states; the gradient repeats the steps between them, some several times.
        "factors": all states and their factorizations, for several gradients of one motion. None: all states if they fit
        into the budget, else checkpoints. `adjoint_storage="factors"` is short for ms.AdjointStorage("factors").
    memory_budget: the largest size of the stored states, bytes.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(4, 1))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> storage = ms.AdjointStorage("checkpoints", memory_budget=1e6)
    >>> ms.simulate(scene, steps=2, time_step=5e-3, adjoint_storage=storage).adjoint_storage
    'nothing'
    """

    what: str | None = None
    memory_budget: float = 2e9

    def __post_init__(self) -> None:
        if self.what not in (None, *KINDS):
            raise ValueError(
                f'adjoint_storage must be "stages", "checkpoints", "factors" or None, got {self.what!r:.60}'
            )
        object.__setattr__(self, "memory_budget", not_negative("memory_budget", "bytes", self.memory_budget))


def as_adjoint_storage(given: str | AdjointStorage | None) -> AdjointStorage:
    """Return the argument `adjoint_storage` of a motion as an AdjointStorage. Raises ValueError for an unknown kind."""
    if given is None:
        return _ANY_STORAGE
    return given if isinstance(given, AdjointStorage) else AdjointStorage(given)


_ANY_STORAGE = AdjointStorage()
DEFAULT_SOLVER = MixedNewton()
