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
from ..options import MixedNewton, Newton
from .batch import find_batch
from .cases import find_all, split, starts_of
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .mapped import find_mapped, is_mapped
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
    values: {object of the scene: {name: value}}, stand in for what the objects were made with: the values of loads, the
        displacement, rotation and center of supports that move, positions and moments of Dipoles, the sizes,
        magnetization, center and rotation of a magnet, the rest_positions of shells, the flux_density of a
        SampledField, the center and rotation of a PlacedField, the law of a Contact, the center and rotation of an
        obstacle, the numbers of Water, and {scene: {"gravity": value}}. Of applied_flux_density and the factors, the
        keywords are short forms of {scene: {name: value}}. The scene is not analysed again, but for rest_positions.
        `scene.objects` lists the objects.
    start: an earlier Equilibrium of this scene, from whose controls the solve goes to the new ones; or positions
        (n_v, 3) m. By default the rest shape, unloaded. Load cases may have an EquilibriumSet. From an Equilibrium,
        obstacles and supports go to their new places on straight ways, in load steps so short that no point of a body
        passes through an obstacle; where that cannot be had, NotConverged says which vertex would.
    require_stable: leave saddles downhill. False accepts any equilibrium; `stable` says which kind it is.
    ignore_velocity_forces: of a scene with friction or water, the equilibrium without them, which act on what
        moves only. By default such
        a scene is refused: with friction, where it comes to rest depends on how it got there, which ms.simulate tells.
    solver: MixedNewton() by default.
    progress: show a bar once it has taken two seconds; or a function, called now and then with how far the controls have
        come (0 to 1, of all load cases) and the residual.
    batch: number of members k. Any value or load parameter may then have a leading axis of length k; others are the same for
        all members. The members are solved at once over threads, each with the bits of a single call, and the result is an
        EquilibriumBatch: a member that fails loses no other. Gradients are computed over threads too. `start` may have
        the axis as well.
    threads: number of threads of a batch, at most the processors that this process may use; by default all of them. Each
        has a core model of its own.

    Raises NotConverged and Interrupted (on Ctrl-C), both with the last converged state as `last_good`, which on Ctrl-C may
    be as rough as its residual says; ValueError on bad input. With torch tensors among the inputs, positions and edge
    rotations come back as tensors, and gradients go back from them to every input above but `start`. Each costs one
    back-substitution with the factorization at the solution, kept as long as the result is. Asked for where the solve did
    not converge, or at an equilibrium that is not stable, they raise NoGradient.

    Second derivatives are those of gradients (create_graph=True, torch.func.hessian, torch.autograd.functional.hvp): a
    product of a Hessian with a direction costs three back-substitutions and four or eight evaluations of the stiffness, and
    is right to some 1e-8. They raise NoGradient with rigid bodies, own_field and pressures without potential, and after
    forward mode. Third ones do too.

    Tangents (forward mode) along a change of the inputs cost one back-substitution too, and four or eight evaluations of
    forces: by torch.autograd.forward_ad, torch.func.jvp and jacfwd. torch.func.grad, vjp, jacrev and functional_call work as
    well; torch.func.vmap solves a batch. By the origins, axes and pitches of joints, and by rest positions, there are
    gradients, but no tangents.

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
            return find_mapped(scene, arguments, start, search)
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
