"""Equilibria of a scene: ms.equilibrium."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from ..._input.quantity import arguments_of_dlpack
from ..._runtime.progress import solve_progress
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import grouped, solve_entry
from ...model.scene.scene import Scene
from ..adjoint.mapped import is_mapped
from ..options import MixedNewton, Newton
from .batch import find_along, find_batch, from_starts
from .cases import find_all, split, starts_of
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .mapped import find_mapped
from .single_solve import Search, find

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from .equilibrium_batch import EquilibriumBatch


@overload
def equilibrium(
    scene: Scene,
    *,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
    start: Equilibrium | EquilibriumSet | np.ndarray | None = None,
    require_stable: bool = True,
    ignore_velocity_forces: bool = False,
    solver: Newton | None = None,
    progress: bool | Callable[[float, float], None] = True,
    batch: None = None,
    threads: int | None = None,
) -> Equilibrium | Any: ...  # EquilibriumSet of load cases
@overload
def equilibrium(
    scene: Scene,
    *,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
    start: Equilibrium | EquilibriumSet | np.ndarray | None = None,
    require_stable: bool = True,
    ignore_velocity_forces: bool = False,
    solver: Newton | None = None,
    progress: bool | Callable[[float, float], None] = True,
    batch: int,
    threads: int | None = None,
) -> EquilibriumBatch: ...
@grouped(solver=MixedNewton)
@solve_entry
def equilibrium(
    scene: Scene,
    *,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
    start: Equilibrium | EquilibriumSet | np.ndarray | None = None,
    require_stable: bool = True,
    ignore_velocity_forces: bool = False,
    solver: Newton | None = None,
    progress: bool | Callable[[float, float], None] = True,
    batch: int | None = None,
    threads: int | None = None,
) -> Equilibrium | Any:  # EquilibriumSet of load cases, EquilibriumBatch of a batch
    """Find a stable equilibrium of a scene, one for each of several load cases, or one for each member of a batch.

    {keywords}
    values: {object of the scene: {name: value}}, which replace the values that the objects were made with, in this solve:
        numbers of loads, actuators, joints, materials and Water; displacement, rotation and center of supports that move;
        positions and moments of Dipoles; sizes, magnetization, center and rotation of a magnet; center and rotation of
        an obstacle or a PlacedField; flux_density of a SampledField; the law of a Contact; rest_positions of shells and
        solids; and {scene: {"gravity": value}}. `scene.objects` lists the objects. The keywords applied_flux_density and the
        factors are short forms of {scene: {name: value}}. The structure of the matrix is kept, except with rest_positions.
    start: an earlier Equilibrium of this scene, from whose load parameters and values the solve goes to the new ones; or
        positions (n_v, 3) m. By default the unloaded rest shape. With load cases also an EquilibriumSet. From an
        Equilibrium, obstacles and supports move along straight lines to their new places, in load steps so short that
        no point of a body passes through an obstacle; if that is not possible, NotConverged names the vertex.
    require_stable: whether saddle points are left along a direction in which the energy falls. False accepts any
        equilibrium; `stable` tells its kind.
    ignore_velocity_forces: whether a scene with friction or water is solved without them, since they act on moving bodies
        only. By default such a scene is refused: with friction, where it comes to rest depends on its motion (ms.simulate).
    solver: MixedNewton() by default.
    progress: whether to show a bar once the solve has taken two seconds; or a function, called now and then with the
        share of the load steps done (0 to 1, of all load cases) and the residual.
    batch: the number of members k. Any value or load parameter, and `start`, may then have a leading axis of length
        k; others are the same for all members. The members are solved in parallel threads, each with the same bits as
        in a single call. The result is an EquilibriumBatch; if a member fails, the others are kept. Gradients use the
        threads too.
    threads: the number of threads of a batch, at most the number of processors that this process may use, which is the
        default. Each thread has a core model of its own.

    Raises NotConverged, Interrupted (on Ctrl-C) and ValueError (on bad input). The first two have the last converged
    state as `last_good`; on Ctrl-C its `residual` tells how well it is converged.

    If an input is a torch tensor, positions and edge rotations are tensors, with gradients by every input above but `start`.
    A gradient costs one back-substitution with the factorization at the solution, which is kept as long as the result.
    If the last step was so short that it took none, each gradient assembles the stiffness there, and takes two or three.
    If the solve did not converge, or the equilibrium is not stable, it raises NoGradient.

    Second derivatives are those of gradients (create_graph=True, torch.func.hessian, torch.autograd.functional.hvp): a
    product of a Hessian with a direction costs three back-substitutions and four or eight evaluations of the stiffness, and
    has a relative error of about 1e-8. With rigid bodies, own_field and pressures without potential, and after forward mode,
    they raise NoGradient. So do third derivatives.

    Tangents (forward mode) along a change of the inputs cost one back-substitution, too, and four or eight evaluations of
    forces: torch.autograd.forward_ad, torch.func.jvp and jacfwd. torch.func.grad, vjp, jacrev and functional_call work as
    well; torch.func.vmap solves a batch.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    >>> rest = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=(0, 0, 2e-3))
    >>> rest.stable, bool(rest.positions[:, 2].max() > 0.01)
    (True, True)
    """
    arguments = arguments_of_dlpack(given_to("equilibrium", locals()))
    with solve_progress("equilibrium", progress) as (advance, note):
        search = Search(
            MixedNewton() if solver is None else solver, require_stable, advance, ignore_velocity_forces, note
        )
        if is_mapped(arguments):
            if batch is not None:
                raise ValueError("batch and torch.func.vmap are both axes of members: take one of them")
            return find_mapped(
                scene,
                arguments,
                lambda axis: find_along(
                    axis, scene, None, from_starts(scene, start, search, axis.members), search
                ),
            )
        if batch is not None:
            return find_batch(scene, arguments, batch, threads, start, search)
        if threads is not None:
            raise ValueError(
                "threads is the number of threads of a batch: give batch=k, or ms.set_num_threads"
            )
        cases = split(arguments)
        if cases is None:
            return find(scene, arguments, start, search).equilibrium
        return find_all(scene, cases, starts_of(start, len(cases)), search)
