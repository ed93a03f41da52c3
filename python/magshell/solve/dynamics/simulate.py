"""Motions of a scene in time: ms.simulate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

from ..._input.quantity import arguments_of_dlpack
from ..._runtime.progress import SolveBar
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import grouped, solve_entry
from ...model.scene.scene import Scene
from ..options import Adaptive, AdjointStorage, Integrator, MixedNewton, Newton
from .batch import simulate_batch
from .single_motion import MotionOptions, run
from .trajectory import MotionState, Trajectory

if TYPE_CHECKING:
    from ..._input.kinds import InTime, Numbers
    from ..statics.equilibrium import Equilibrium
    from .trajectory_batch import TrajectoryBatch


@overload
def simulate(
    scene: Scene,
    *,
    steps: int,
    time_step: Numbers | Adaptive,
    remanent_magnetization: InTime | None = None,
    applied_flux_density: InTime | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    damping: Any = 0.0,
    stiffness_damping: Any = 0.0,
    maxwell_modulus: Any = 0.0,
    maxwell_time: InTime | None = None,
    start: Numbers | Equilibrium | Trajectory | MotionState | None = None,
    velocities: InTime | None = None,
    thickness: InTime | None = None,
    young_modulus: InTime | None = None,
    poisson_ratio: InTime | None = None,
    mass_density: InTime | None = None,
    curvature_scale: InTime | None = None,
    vertex_loads: InTime | None = None,
    values: dict[Any, Any] | None = None,
    integrator: Integrator | None = None,
    record_every: int = 1,
    adjoint_storage: str | AdjointStorage | None = None,
    solver: Newton | None = None,
    progress: bool = True,
    batch: None = None,
    threads: int | None = None,
) -> Trajectory | Any: ...
@overload
def simulate(
    scene: Scene,
    *,
    steps: int,
    time_step: Numbers | Adaptive,
    remanent_magnetization: InTime | None = None,
    applied_flux_density: InTime | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    damping: Any = 0.0,
    stiffness_damping: Any = 0.0,
    maxwell_modulus: Any = 0.0,
    maxwell_time: InTime | None = None,
    start: Numbers | Equilibrium | Trajectory | MotionState | None = None,
    velocities: InTime | None = None,
    thickness: InTime | None = None,
    young_modulus: InTime | None = None,
    poisson_ratio: InTime | None = None,
    mass_density: InTime | None = None,
    curvature_scale: InTime | None = None,
    vertex_loads: InTime | None = None,
    values: dict[Any, Any] | None = None,
    integrator: Integrator | None = None,
    record_every: int = 1,
    adjoint_storage: str | AdjointStorage | None = None,
    solver: Newton | None = None,
    progress: bool = True,
    batch: int,
    threads: int | None = None,
) -> TrajectoryBatch: ...
@grouped(solver=MixedNewton, adjoint_storage=AdjointStorage)
@solve_entry
def simulate(
    scene: Scene,
    *,
    steps: int,
    time_step: Numbers | Adaptive,
    remanent_magnetization: InTime | None = None,
    applied_flux_density: InTime | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    damping: Any = 0.0,
    stiffness_damping: Any = 0.0,
    maxwell_modulus: Any = 0.0,
    maxwell_time: InTime | None = None,
    start: Numbers | Equilibrium | Trajectory | MotionState | None = None,
    velocities: InTime | None = None,
    thickness: InTime | None = None,
    young_modulus: InTime | None = None,
    poisson_ratio: InTime | None = None,
    mass_density: InTime | None = None,
    curvature_scale: InTime | None = None,
    vertex_loads: InTime | None = None,
    values: dict[Any, Any] | None = None,
    integrator: Integrator | None = None,
    record_every: int = 1,
    adjoint_storage: str | AdjointStorage | None = None,
    solver: Newton | None = None,
    progress: bool = True,
    batch: int | None = None,
    threads: int | None = None,
) -> Trajectory | Any:  # TrajectoryBatch of a batch
    """Simulate the motion of a scene in time, or one for each member of a batch.

    steps: how many; with ms.Adaptive, or more lengths than that, the number of intervals of the time grid: states are
        recorded at its times, and arrays in time are given at them.
    {keywords}
    start: positions (n_v, 3) m, an Equilibrium of this scene, a Trajectory or MotionState to go on from with the same
        bits. By default the rest shape.
    values: as in ms.equilibrium. Load parameters and damping may stand in values={scene: {name: value}} as well:
        keywords are their short forms. Every shell needs a mass density.
    values in time: positions and moments of Dipoles, center and rotation of a PlacedField, an obstacle or a magnet, and
        its magnetization, displacement, rotation and center of a Clamp or Pin that has one of them: a function of the time
        [s], or an array with one more axis in front, at the ends of all steps (steps + 1, ...). As everything that is given
        there, they lie on straight lines between (rotation vectors too), also at the stages within a step. Of field sources
        one a step may be given, which lets them jump. The surface of an obstacle moves, for friction, with the slopes of
        parabolas through three neighbouring ends, on straight lines between those: of second order, as its places are.
    integrator: TRBDF2() by default, ImplicitEuler() where the scene has contacts; SDIRK2(), SDIRK3(), ProjectiveDynamics().
        A method of higher order makes an impact bounce, and each of its steps there is much work, unless the steps resolve
        it. TRBDF2(implicit_contact=True) bounces right where steps resolve an impact, and loses energy where they do not.
    record_every: steps (or intervals) between the states that come back, the start first.
    adjoint_storage: for gradients; "stages" (all states), "checkpoints", "factors", or an ms.AdjointStorage,
        which says how many bytes it may
        take. By default all states if they fit into 2 GB, else checkpoints.
    solver: of a step; MixedNewton() by default, of which the load steps are not used. ProjectiveDynamics needs none.
    progress: show a bar once the motion has taken two seconds.
    batch, threads: as in ms.equilibrium. The result is a TrajectoryBatch. In a value that varies in time the axis of the
        members comes first, (k, steps, ...). The members share the bytes of `adjoint_storage`.

    A step that does not converge is taken in halves, down to 1/64 of it; with ms.Adaptive it is made shorter, as is one
    whose error is too large. ms.StepErrorWarning warns of steps that are too long. Raises NotConverged and Interrupted
    with the motion until then as `last_good`; ValueError on bad input. With torch tensors among the inputs, positions,
    velocities and edge rotations come back as tensors, and gradients go back from them to every input that is
    continuous, time_step, damping, start (positions or an Equilibrium) and velocities among them. Where an input has
    none (a Trajectory as start; time_step where a function of the time leaves torch), they raise NoGradient; so do
    second derivatives: (g(x + h v) - g(x - h v)) / 2h is the Hessian's product with v.

    They are exact where the motion is differentiable: through impact, stick and slip on smooth obstacles too. It is not
    where a point touches a kink of an obstacle (Trajectory.nonsmooth_vertices says where), where a little more
    makes a step fail or
    be taken in other parts (Trajectory.substeps), and in water whose tables have kinks (Water.is_smooth); gradients there
    are those of one side.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    >>> turning = lambda t: (0, 0, 2e-3 * t)
    >>> move = ms.simulate(scene, steps=20, time_step=5e-3, remanent_magnetization=(4e4, 0, 0), applied_flux_density=turning)
    >>> move.positions.shape, bool(move.positions[-1, :, 2].max() > 1e-4)
    ((21, 33, 3), True)
    """
    arguments = arguments_of_dlpack(given_to("simulate", locals()))
    options = MotionOptions(steps, start, integrator, record_every, adjoint_storage, solver)
    if batch is not None:
        with SolveBar("simulate", progress) as bar:
            return simulate_batch(scene, arguments, options, batch, threads, bar.to)
    if threads is not None:
        raise ValueError("threads is the number of threads of a batch: give batch=k, or ms.set_num_threads")
    with SolveBar("simulate", progress) as bar:
        return run(scene, arguments, options, bar.to).result
