"""One search for an equilibrium: from checked arguments to a result, or to an error that holds one."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._input.scalars import flag
from ..._input.tensors import dtype_like, is_tensor, like
from ..._runtime.frozen import remember
from ..._runtime.keywords import FACTORS
from ..._runtime.log import log
from ..._runtime.progress import stop_at_once
from ..._runtime.solve_keywords import names_of
from ...errors import Interrupted, NotConverged
from ...model.contact.contacts_to_core import check_apart
from ...model.contact.watched_obstacles import watched_obstacles
from ...model.results.resolution import unresolved, warn_of_resolution
from ...model.scene.field_sampling import (
    element_errors,
    is_suspect,
    sampling_errors,
    warn_of_elements,
    warn_of_entry,
    warn_of_sampling,
)
from ...model.scene.fine_faces import Errors, keeping_fine_faces, with_fine_faces, with_fine_faces_and_errors
from ...model.scene.own_field_errors import gap_errors, warn_of_gaps
from ...model.scene.own_field_overlap import check_magnets_apart
from ...model.scene.replacements import requested
from ...model.scene.reshaped import reshaped
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ...model.shells.obtuse_faces import warn_of_obtuse_faces
from ...model.shells.strains import Largest, largest_of, warn_if_large
from ..adjoint.static import Adjoint
from ..options import MixedNewton, Newton
from .along_path import AlongPath, all_can_move, moving_obstacles
from .diagnosis import has_given_pressure, why_not
from .equilibrium import Equilibrium
from .solve_log import steps_of
from .start import Origin, starting_point

if TYPE_CHECKING:
    from ..._input.kinds import Starting
    from ...model.scene.values import Values


# Largest number of repeated searches, each with more faces that sample the field finely than the one before; one is
# usually enough.
_MOST_REFINEMENTS = 4


class Solution(NamedTuple):
    """An equilibrium, the result of the core (with the factorization, if it was to be stored), and the inputs."""

    equilibrium: Equilibrium
    found: Any
    inputs: Inputs


# [-] Part of max_factorizations in scenes with cavities of a given pressure: none of the cases of tests/hard takes more than
# 114 there, and a body that is blown up without an end takes all
_LESS_UNDER_PRESSURE = 10


def _ignore(text: str) -> None:
    """Discard a note on the progress."""


@dataclass(frozen=True)
class Search:
    """The options of a search for an equilibrium. Raises ValueError for an option of the wrong kind.

    progress: called with the fraction of the load path that is done, and the residual. note: called with a text on the
        progress.
    ignore_velocity_forces: leave out friction and water.
    """

    solver: Newton = field(default_factory=MixedNewton)
    require_stable: bool = True
    progress: Callable[[float, float], None] | None = None
    ignore_velocity_forces: bool = False
    note: Callable[[str], None] = _ignore

    def __post_init__(self) -> None:
        if not isinstance(self.solver, Newton):
            raise ValueError(f"solver must be a MixedNewton or a Newton, got {type(self.solver).__name__}")
        if not isinstance(self.require_stable, bool):
            raise ValueError(f"require_stable must be True or False, got {self.require_stable!r}")
        flag("ignore_velocity_forces", self.ignore_velocity_forces)

    def options(self) -> _core.StaticsOptions:
        options = self.solver._options()
        options.require_stable = self.require_stable
        return options


def find(
    scene: Scene,
    arguments: dict[Any, Any],
    start: Starting | Origin | None = None,
    search: Search | None = None,
    store_factor: bool = False,
) -> Solution:
    """Find the equilibrium of one load case, with the arguments and the errors of ms.equilibrium."""
    search = Search() if search is None else search
    scene, values = reshaped(scene, arguments.get("values"))
    arguments = {**arguments, "values": values}
    inputs = inputs_of(scene, arguments, search.ignore_velocity_forces)
    if isinstance(start, Equilibrium | Origin):
        inputs = keeping_fine_faces(
            inputs, start._values if isinstance(start, Equilibrium) else start.inputs.values
        )
    state, angle_branches, from_, at_rest = starting_point(scene, start, inputs)
    moving = None
    if isinstance(start, Equilibrium) and start.scene is scene and not at_rest:
        at_rest = all_can_move(inputs, start)
        # Obstacles and supports are moved along the path, so that they push bodies; if they jumped, they would pass
        # through them.
        moving = AlongPath(inputs, start, at_once=True) if scene.obstacles and not at_rest else None
        moving = AlongPath(inputs, start) if at_rest else moving
    options = search.options()
    options.start_at_rest = at_rest
    options.keep_factor = store_factor
    # A load step changes the volume of a cavity by at most the step's fraction of the load path times the volume at rest.
    filling = max((each._filling(scene) for each in map(inputs.values.current, scene.actuators)), default=0.0)
    options.smallest_step /= max(filling, 1.0)
    if has_given_pressure(inputs.values):
        options.max_factorizations = max(options.max_factorizations // _LESS_UNDER_PRESSURE, 1)
    with inputs.in_core():
        check_apart(scene, state)
    check_magnets_apart(inputs.values, state)
    return solve(
        inputs, state, angle_branches, from_, inputs.load_parameters, options, search.progress, moving
    )


def inputs_of(scene: Scene, arguments: dict[Any, Any], ignore_velocity_forces: bool = False) -> Inputs:
    """Check the arguments of ms.equilibrium against the scene and return them as Inputs."""
    given = dict(arguments)
    shell = {name: given.pop(name, None) for name in names_of("shell")}
    vertex_loads, values = given.pop("vertex_loads", None), given.pop("values", None)
    replaced = requested(scene, vertex_loads, values, **shell) if isinstance(scene, Scene) else None
    magnetization = given.pop("remanent_magnetization", None)
    flux_density = given.pop("applied_flux_density", None)
    factors = {name: given.pop(name, 1.0) for name in FACTORS}
    if given:
        raise TypeError(f"equilibrium() got an unexpected keyword argument {next(iter(given))!r}")
    return Inputs(
        scene,
        magnetization,
        flux_density,
        replaced=replaced,
        differentiable=True,
        without_forces_of_motion=ignore_velocity_forces,
        **factors,
    )


def solve(
    inputs: Inputs,
    state: np.ndarray,
    angle_branches: list[Any],
    from_: np.ndarray,
    to: np.ndarray,
    options: _core.StaticsOptions,
    progress: Callable[[float, float], None] | None = None,
    moving: AlongPath | None = None,
) -> Solution:
    """Run the core's search for an equilibrium at the load parameters `to`, from a state at those of `from_`.

    moving: values of the scene that change along with the load parameters.
    """
    scene, entries, end = inputs.scene, [], to
    try:  # Ctrl-C may arrive in a field that is a Python function of the caller
        inputs = with_fine_faces(inputs, state, to)
    except KeyboardInterrupt:
        progress = stop_at_once
    options.watched = watched_obstacles(scene, moving_obstacles(scene, moving, from_, to))
    if moving is not None:
        from_, to = np.concatenate([from_, moving.before]), np.concatenate([to, moving.after])
        entries = moving.entries
    options.keep_factor = options.keep_factor or bool(inputs.leaves)
    began = time.perf_counter()
    with inputs.in_core():
        found = _core.find_equilibrium(
            scene._model, state, angle_branches, from_, to, options, progress, entries
        )
        if moving is not None and found.load_fraction < 1.0:
            inputs = inputs.with_values(moving.values(found.load_fraction))
    found, inputs, errors, stopped = _with_fine_faces_at_end(found, inputs, end, options, progress)
    with inputs.in_core():
        energies, arrays = _energies(scene, found), arrays_of(scene, found)
        strain = largest_of(scene, found.state, inputs.values.all_shells.thickness)
    result = _result(inputs, found, energies, arrays, strain, time.perf_counter() - began)
    log.debug(
        "equilibrium: %s, %.4g of the way, %d iterations, %d factorizations, residual %.2g, %.3g s",
        found.outcome.name,
        found.load_fraction,
        found.iterations,
        found.factorizations,
        found.residual,
        result.wall_time,
    )
    if found.outcome == _core.Outcome.interrupted or energies is None:
        raise Interrupted(
            f"interrupted at {found.load_fraction:.3g} of the way to the new load parameters", result
        )
    if found.outcome == _core.Outcome.failed:
        raise NotConverged(why_not(inputs, found, options.start_at_rest), result)
    if stopped is not None:
        raise Interrupted("interrupted while the sampling of the field was checked", result) from stopped
    positions = scene._model.positions(found.state)
    warn_of_obtuse_faces(
        scene, positions, inputs.values.all_shells, result._energies.get("bending", 0.0), "this equilibrium"
    )
    warn_if_large(result, result._largest_strains, "the equilibrium")
    layout = scene._load_parameter_layout
    field_factor = float(layout.of(found.load_parameters, "scene", "field_factor")[0])
    flux_density = layout.of(found.load_parameters, "scene", "applied_flux_density")[0]
    _check_resolution(inputs.values, found.state, flux_density)
    at = (inputs.values, positions, field_factor, flux_density)
    try:  # Ctrl-C may arrive in a field that is a Python function of the caller
        if is_suspect(found.field_sampling_error):
            of_faces = sampling_errors(*at) if errors.faces is None else errors.faces
            warn_of_sampling(of_faces, "this equilibrium")
        of_elements = element_errors(*at) if errors.elements is None else errors.elements
        warn_of_elements(of_elements, "this equilibrium")
        warn_of_entry(inputs.values, positions, "this equilibrium")
        warn_of_gaps(gap_errors(inputs.values, found.state), "this equilibrium")
    except KeyboardInterrupt as stopped:
        raise Interrupted("interrupted while the sampling of the field was checked", result) from stopped
    return Solution(result, found, inputs)


def _check_resolution(values: Values, state: np.ndarray, flux_density: np.ndarray) -> None:
    """Warn of a mesh that is too coarse, in the first, the second, the fourth, ... equilibrium of a scene."""
    scene = values.scene
    count = scene._n_equilibria + 1
    remember(scene, _n_equilibria=count)
    if count & (count - 1) == 0:
        warn_of_resolution(unresolved(values, state), values, flux_density, "this equilibrium")


def _with_fine_faces_at_end(
    found: _core.StaticsResult,
    inputs: Inputs,
    to: np.ndarray,
    options: _core.StaticsOptions,
    progress: Callable[[float, float], None] | None,
) -> tuple[_core.StaticsResult, Inputs, Errors, KeyboardInterrupt | None]:
    """Repeat the search with more faces that sample the field finely, until the state needs no more.

    Returns the result, the inputs, the errors of sampling in the state that was found as far as they are known, and the
    KeyboardInterrupt that was raised meanwhile, or None.
    """
    for _ in range(_MOST_REFINEMENTS):
        if found.outcome != _core.Outcome.converged:
            break
        try:
            finer, errors = with_fine_faces_and_errors(
                inputs, found.state, found.load_parameters, found.field_sampling_error
            )
        except KeyboardInterrupt as stopped:
            return found, inputs, Errors(), stopped
        if finer is inputs:
            return found, inputs, errors, None
        options.start_at_rest = False
        with finer.in_core():
            again = _core.find_equilibrium(
                inputs.scene._model,
                found.state,
                found.angle_branches,
                found.load_parameters,
                to,
                options,
                progress,
                [],
            )
        again.add_effort_of(found)
        found, inputs = again, finer
    return found, inputs, Errors(), None


def _energies(scene: Scene, found) -> dict[str, float] | None:
    """Return the energies by term; None if Ctrl-C arrived meanwhile in a field function of the caller."""
    try:
        return scene._model.energies(found.state, found.load_parameters)
    except KeyboardInterrupt:
        return None


def _result(
    inputs: Inputs,
    found: _core.StaticsResult,
    energies: dict[str, float] | None,
    arrays: tuple[np.ndarray, ...],
    strain: Largest,
    wall_time: float,
) -> Equilibrium:
    """Make the Equilibrium. The lock on the scene must be free: tangents of tensors in forward mode are computed here."""
    scene = inputs.scene
    points, edge_rotations, driving = _outputs(inputs, found, arrays)
    n_v = scene.mesh.n_vertices
    return Equilibrium(
        scene=scene,
        positions=points[:n_v] if scene.rigid_parts else points,
        edge_rotations=edge_rotations,
        remanent_magnetization=inputs.given_magnetization,
        applied_flux_density=_flux_density(inputs, found),
        _energies=dict.fromkeys(scene._model.term_names, np.nan) if energies is None else energies,
        stable=found.stable,
        n_negative_eigenvalues=found.n_negative_eigenvalues,
        iterations=found.iterations,
        factorizations=found.factorizations,
        failed_factorizations=found.failed_factorizations,
        load_steps=found.load_steps,
        relaxation_steps=found.relaxation_steps,
        saddles_escaped=found.saddles_escaped,
        symmetric_saddles=sum(not each.other_mode for each in found.other_branches),
        residual=found.residual,
        at_roundoff=found.at_roundoff,
        load_fraction=found.load_fraction,
        _largest_membrane_strain=strain.membrane,
        _largest_bending_strain=strain.bending,
        wall_time=wall_time,
        linear_time=found.linear_time,
        memory=found.bytes,
        factorization=found.factorization,
        _state=found.state,
        _angle_branches=found.angle_branches,
        _load_parameters=found.load_parameters,
        _values=inputs.values,
        _own_points=points[n_v:] if scene.rigid_parts else None,
        _driving=driving,
        _steps=steps_of(found),
        _branches=tuple(
            (each.saddle, each.state, "other mode" if each.other_mode else "other side")
            for each in found.other_branches
        ),
        _inputs=inputs if inputs.given else None,
        _rest=inputs.given_rest,
    )


def arrays_of(scene: Scene, found: _core.StaticsResult) -> tuple[np.ndarray, ...]:
    """Return the positions with the points of rigid bodies, the edge rotations and the forces of motors."""
    model, driven = scene._model, any(joint._driven for joint in scene.joints)
    return (
        np.ascontiguousarray(model.points(found.state)),
        model.edge_rotations(found.state),
        model.driving(found.state, found.load_parameters, found.angle_branches) if driven else np.zeros(0),
    )


def _outputs(inputs: Inputs, found: _core.StaticsResult, arrays: tuple[np.ndarray, ...]) -> tuple[Any, ...]:
    """Return the arrays as tensors if an input is a tensor, connected to those that require a gradient."""
    if not inputs.leaves:
        return tuple(like(array, *inputs.given) for array in arrays)
    from ..adjoint.autograd import solved

    return solved(Adjoint(inputs, found), arrays, dtype_like(*inputs.given), inputs.tensors)


def _flux_density(inputs: Inputs, found):
    if found.load_fraction == 1.0 and is_tensor(inputs.given_flux_density):
        return inputs.given_flux_density
    flux_density = inputs.scene._load_parameter_layout.of(
        found.load_parameters, "scene", "applied_flux_density"
    )
    return like(flux_density[0].copy(), *inputs.given)
