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
    from .batch import TrajectoryBatch


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

    steps: the number of time steps; with ms.Adaptive, or an array of time steps, the number of intervals of the time grid,
        at whose times states are recorded and arrays in time are given.
    {keywords}
    start: positions (n_v, 3) m, an Equilibrium of this scene, or a Trajectory or MotionState, from which the motion goes on
        with the same bits as in one piece. By default the rest shape.
    values: as in ms.equilibrium. Load parameters and damping may also be given as values={scene: {name: value}}; the
        keywords are short forms of it. Every shell needs a mass density.
    values in time: positions and moments of Dipoles; center, rotation and magnetization of a PlacedField or a magnet; center
        and rotation of an obstacle; displacement, rotation and center of a Clamp or Pin that has one of them. Each is a
        function of the time [s], or an array with one more axis in front for the ends of all steps, (steps + 1, ...),
        between which values (rotation vectors too) are interpolated linearly, at the stages of a step as well. Field
        sources may be given per step, (steps, ...), and then jump. For friction, the velocity of an obstacle at the end
        of a step is that of a parabola through three neighbouring ends, interpolated linearly between them.
    integrator: TRBDF2() by default; TRBDF2(implicit_contact=True) if the scene has contacts, with which bodies rebound
        correctly where the steps resolve the impact and lose energy where they do not. Others: ImplicitEuler(), SDIRK2(),
        SDIRK3(), ProjectiveDynamics().
    record_every: the number of steps (or intervals) between recorded states. The start is recorded too.
    adjoint_storage: what is stored for gradients: "stages" (all states), "checkpoints", "factors", or an ms.AdjointStorage,
        which also limits the bytes. By default all states if they fit into 2 GB, else checkpoints.
    solver: of each step, MixedNewton() by default; its load steps are not used. ProjectiveDynamics needs none.
    progress: whether to show a bar once the motion has taken two seconds.
    batch, threads: as in ms.equilibrium. The result is a TrajectoryBatch. In a value that varies in time the axis of the
        members comes first, (k, steps, ...). The members share the bytes of `adjoint_storage`.

    A step that does not converge is divided, down to 1/64 of its length; with ms.Adaptive it is repeated with a shorter
    length, like one whose error is too large. ms.StepErrorWarning warns of steps that are too long. Raises NotConverged and
    Interrupted with the motion so far as `last_good`, and ValueError on bad input.

    If an input is a torch tensor, positions, velocities and edge rotations are tensors, with gradients with respect to
    every continuous input, including time_step, damping, start (positions or an Equilibrium) and velocities. An input
    without a gradient (a Trajectory as start; time_step if a function of the time leaves torch) raises NoGradient. So do
    second derivatives; the product of the Hessian with v is (g(x + h v) - g(x - h v)) / 2h.

    Tangents (forward mode: torch.autograd.forward_ad, torch.func.jvp and jacfwd) follow a change of the inputs through the
    stages. One that is asked for with the motion (dual numbers, torch.func.jvp) is computed step by step with the
    factorizations of the motion; others, such as those of jacfwd, from the stored stages with new ones. Along rest
    positions four or eight scenes are made for all steps.

    Gradients are exact where the motion is differentiable, which includes impact, stick and slip on smooth obstacles. It is
    not differentiable where a point touches a kink of an obstacle (Trajectory.nonsmooth_vertices), where a small change
    divides a step differently (Trajectory.substeps), and in water whose tables have kinks (Water.is_smooth). Gradients
    there are one-sided.

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
        return run(scene, arguments, options, bar.to, bar.note).result
