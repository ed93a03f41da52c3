"""Equilibria of a scene: ms.equilibrium."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from . import _core
from ._adjoint import Adjoint
from ._inputs import Inputs
from ._replacements import requested
from ._start import starting_point
from ._tensors import is_tensor, like
from .equilibrium import Equilibrium
from .errors import Interrupted, NotConverged
from .scene import Scene
from .solvers import MixedNewton, Newton


def equilibrium(
    scene: Scene,
    *,
    remanent_magnetization=None,
    applied_flux_density=None,
    load_factor: float = 1.0,
    gravity_factor: float = 1.0,
    field_factor: float = 1.0,
    motion_factor: float = 1.0,
    thickness=None,
    young_modulus=None,
    poisson_ratio=None,
    mass_density=None,
    curvature_scale=None,
    vertex_loads=None,
    values: dict | None = None,
    start: Equilibrium | np.ndarray | None = None,
    require_stable: bool = True,
    solver: Newton | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Equilibrium:
    """A stable equilibrium of a scene.

    remanent_magnetization: A/m, rest frame, world axes: (n_f, 3), or (3,) on every face. Needed in a scene with a field.
    applied_flux_density: T, (3,): the value of the scene's UniformField.
    load_factor, gravity_factor, field_factor, motion_factor: on the loads, gravity, the field sources, and on how far
        supports with a prescribed motion have gone.
    thickness, young_modulus, poisson_ratio, mass_density, curvature_scale: stand in for the shell's own in this solve.
    vertex_loads: N, (n_v, 3): stand in for all forces of the scene's loads.
    values: {object of the scene: {name: value}}, stand in for what the objects were made with: the values of loads, the
        displacement, rotation and center of supports that move, positions and moments of Dipoles, the flux_density of a
        SampledField, and {scene: {"gravity": value}}. The scene is not analysed again.
    start: an earlier Equilibrium of this scene, from whose controls the solve goes to the new ones; or positions
        (n_v, 3) m. By default the rest shape, unloaded.
    require_stable: leave saddles downhill. False accepts any equilibrium; `stable` says which kind it is.
    solver: MixedNewton() by default.
    progress: called now and then with how far the controls have come (0 to 1) and the residual.

    Raises NotConverged and Interrupted (on Ctrl-C), both with the last converged state as `last_good`; ValueError on
    bad input. With torch tensors among the inputs, positions and edge rotations come back as tensors, and gradients go
    back from them to every input above but `start`. Each costs one back-substitution with the factorization at the
    solution, kept as long as the result is. Asked for where the solve did not converge, or at an equilibrium that is
    not stable, they raise NoGradient.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    >>> rest = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=(0, 0, 2e-3))
    >>> rest.stable, bool(rest.positions[:, 2].max() > 0.01)
    (True, True)
    """
    solver = MixedNewton() if solver is None else solver
    if not isinstance(solver, Newton):
        raise ValueError(f"solver must be a MixedNewton or a Newton, got {type(solver).__name__}")
    if not isinstance(require_stable, bool):
        raise ValueError(f"require_stable must be True or False, got {require_stable!r}")
    if progress is not None and not callable(progress):
        raise ValueError(f"progress must be a function of (progress, residual), got {progress!r}")
    replaced = None
    if isinstance(scene, Scene):
        replaced = requested(
            scene,
            vertex_loads,
            values,
            thickness=thickness,
            young_modulus=young_modulus,
            poisson_ratio=poisson_ratio,
            mass_density=mass_density,
            curvature_scale=curvature_scale,
        )
    inputs = Inputs(
        scene,
        remanent_magnetization,
        applied_flux_density,
        replaced=replaced,
        differentiable=True,
        load_factor=load_factor,
        gravity_factor=gravity_factor,
        field_factor=field_factor,
        motion_factor=motion_factor,
    )
    state, memory, from_, at_rest = starting_point(scene, start, inputs)
    options = solver._options()
    options.require_stable = require_stable
    options.start_at_rest = at_rest

    return solve(inputs, state, memory, from_, inputs.controls, options, progress)


def solve(inputs: Inputs, state: np.ndarray, memory: list, from_, to, options, progress=None) -> Equilibrium:
    """The core's search for an equilibrium at the controls `to`, from a state at `from_`."""
    scene = inputs.scene
    options.keep_factor = bool(inputs.leaves)
    began = time.perf_counter()
    with inputs.in_core():
        found = _core.find_equilibrium(scene._model, state, memory, from_, to, options, progress)
        result = _result(scene, inputs, found, time.perf_counter() - began)
    if found.outcome == _core.Outcome.interrupted:
        raise Interrupted(f"interrupted at {found.progress:.3g} of the way to the new controls", result)
    if found.outcome == _core.Outcome.failed:
        raise NotConverged(_failure(found, options.start_at_rest), result)
    return result


def _result(scene: Scene, inputs: Inputs, found, wall_time: float) -> Equilibrium:
    model = scene._model
    positions, edge_rotations = _outputs(inputs, found)
    return Equilibrium(
        scene=scene,
        positions=positions,
        edge_rotations=edge_rotations,
        remanent_magnetization=inputs.given_magnetization,
        applied_flux_density=_flux_density(inputs, found),
        energies=model.energies(found.state, found.controls),
        stable=found.stable,
        unstable_directions=found.unstable_directions,
        iterations=found.iterations,
        factorizations=found.factorizations,
        failed_factorizations=found.failed_factorizations,
        load_steps=found.load_steps,
        relaxation_steps=found.relaxation_steps,
        saddles_left=found.saddles_left,
        residual=found.residual,
        progress=found.progress,
        wall_time=wall_time,
        linear_time=found.linear_time,
        memory=found.bytes,
        factorization=found.factorization,
        _state=found.state,
        _memory=found.memory,
        _controls=found.controls,
        _magnetization=inputs.magnetization,
        _values=inputs.values,
    )


def _outputs(inputs: Inputs, found):
    """Positions and edge rotations, as tensors in a graph where an input asks for a gradient."""
    model = inputs.scene._model
    arrays = np.ascontiguousarray(model.positions(found.state)), model.edge_rotations(found.state)
    if not inputs.leaves:
        return tuple(like(array, *inputs.given) for array in arrays)
    from .autograd import at_rest

    return at_rest(Adjoint(inputs, found), *arrays, inputs.given[0].dtype, inputs.tensors)


def _flux_density(inputs: Inputs, found):
    if found.progress == 1.0 and is_tensor(inputs.given_flux_density):
        return inputs.given_flux_density
    return like(np.array(found.controls.flux_density), *inputs.given)


def _failure(found, at_rest: bool) -> str:
    if found.progress >= 1.0:
        return (
            f"no stable equilibrium was found at the new controls, in {found.iterations} iterations: {found.reason}. "
            "The unstable one is in `error.last_good`; require_stable=False accepts it."
        )
    advice = (
        "Load it in smaller steps (first_load_step of the solver), or start from a nearby equilibrium."
        if at_rest
        else "Start from positions closer to an equilibrium."
    )
    return (
        f"the solve stopped at {found.progress:.3g} of the way to the new controls, after {found.iterations} iterations: "
        f"{found.reason}. {advice} The last converged state is in `error.last_good`."
    )
