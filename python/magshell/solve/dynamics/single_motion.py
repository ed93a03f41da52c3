"""One motion: from checked arguments to a result, or to an error that holds one."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ... import _core
from ..._input.tensors import detached, dtype_like, like
from ..._runtime.log import log
from ..._runtime.progress import stop_at_once
from ..._runtime.solve_keywords import names_of
from ...errors import Interrupted, NotConverged
from ...model.contact.contacts_to_core import check_apart
from ...model.fields.magnets import describe_magnet_overlap
from ...model.results.crossings import crossing_bodies, describe_attraction
from ...model.scene.field_sampling import (
    element_errors,
    sampling_errors,
    warn_of_elements,
    warn_of_entry,
    warn_of_sampling,
)
from ...model.scene.fine_faces import fine_faces
from ...model.scene.own_field_errors import gap_errors, warn_of_gaps
from ...model.scene.own_field_overlap import check_magnets_apart
from ...model.scene.replacements import requested
from ...model.scene.reshaped import reshaped, turning_supports
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ...model.scene.values import Values
from ...model.shells.obtuse_faces import warn_of_obtuse_faces
from ...model.shells.shell import Shell
from ...model.shells.strains import StrainHistory, warn_if_large
from ..adjoint.dynamic import MotionAdjoint
from ..adjoint.motion_tangent import motion_with_tangents
from ..options import (
    DEFAULT_SOLVER,
    SDIRK2,
    SDIRK3,
    Adaptive,
    AdjointStorage,
    ImplicitEuler,
    Integrator,
    Newton,
    ProjectiveDynamics,
    as_adjoint_storage,
)
from ..statics.equilibrium import Equilibrium
from .conditions import MotionConditions
from .differentiable_state import DifferentiableState
from .motion_inputs import MotionInputs
from .schedule import split_schedules
from .step_errors import warn_of_gains, warn_of_steps
from .trajectory import MotionState, Trajectory


@dataclass(frozen=True)
class MotionOptions:
    """The arguments of ms.simulate that are no quantities of the scene."""

    steps: Any
    start: Any = None
    integrator: Integrator | None = None
    record_every: Any = 1
    adjoint_storage: str | AdjointStorage | None = None
    solver: Newton | None = None


class Motion(NamedTuple):
    """A motion, its inputs, and the result of the core, with what it stored for gradients."""

    result: Trajectory
    motion_inputs: MotionInputs
    found: Any


def preparation(
    scene: Scene, arguments: dict[str, Any], options: MotionOptions
) -> Callable[..., MotionInputs]:
    """Return a function that checks the arguments of ms.simulate and translates them for the core.

    Its arguments: the lengths of the steps that an Adaptive has chosen, or None, and values of the scene whose faces that
    sample the field finely are those of the motion, by default none. Raises ValueError on bad input.
    """
    arguments = dict(arguments)
    integrator, solver = options.integrator, DEFAULT_SOLVER if options.solver is None else options.solver
    if integrator is not None and not isinstance(integrator, Integrator):
        what = (
            f"the class {integrator.__name__}: call it" if isinstance(integrator, type) else repr(integrator)
        )
        raise ValueError(
            "integrator must be ms.TRBDF2(), ImplicitEuler(), SDIRK2(), SDIRK3() or ProjectiveDynamics(), "
            f"got {what}"
        )
    if not isinstance(solver, Newton):
        raise ValueError(f"solver must be a MixedNewton or a Newton, got {type(solver).__name__}")
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
    scene, values = _reshaped(scene, arguments.pop("values"), options.start)
    replaced = requested(
        scene,
        arguments.pop("vertex_loads"),
        values,
        moving=True,
        in_time=True,
        **{name: arguments.pop(name) for name in names_of("shell")},
    )
    replaced, schedules = split_schedules(scene, replaced)
    uniform = np.zeros(3) if scene.has_uniform_field else None
    held = [
        part for part in scene.rigid_parts if part.vertices is not None or scene._bodies.skeleton_of(part)
    ]
    if held and isinstance(integrator, SDIRK2 | SDIRK3):
        raise ValueError(
            f"{type(integrator).__name__} falls to first order where rigid parts with joints or vertices turn, as its first "
            "stage is of first order only: take TRBDF2(), which keeps the second, or ImplicitEuler()"
        )
    if scene._constraints.tied and isinstance(integrator, ProjectiveDynamics):
        raise ValueError(
            "ProjectiveDynamics does not support EqualDisplacement and Periodic: choose another integrator"
        )
    magnetization = arguments.pop("remanent_magnetization")

    def prepared(chosen: list[float] | None, fine_faces_of: Values | None = None) -> MotionInputs:
        inputs = Inputs(scene, magnetization, uniform, replaced=replaced, differentiable=True, moving=True)
        return MotionInputs(
            inputs,
            arguments,
            steps=options.steps,
            record_every=options.record_every,
            adjoint_storage=as_adjoint_storage(options.adjoint_storage),
            start=options.start,
            integrator=integrator,
            solver=solver,
            schedules=schedules,
            chosen=chosen,
            fine_faces_of=fine_faces_of,
        )

    return prepared


def _ignore(text: str) -> None:
    """Discard a note on the progress."""


def run(
    scene: Scene,
    arguments: dict[str, Any],
    options: MotionOptions,
    progress: Callable[[float], None],
    note: Callable[[str], None] = _ignore,
) -> Motion:
    """Simulate one motion, with the arguments and the errors of ms.simulate.

    progress: called now and then with the fraction that is done. note: called once if many steps are taken in parts.
    """
    time_step = arguments["time_step"]
    prepared = preparation(scene, arguments, options)
    motion_inputs = prepared(None)
    scene = motion_inputs.inputs.scene  # another scene if values replace rest positions
    began = time.perf_counter()
    watch = stop_at_once if motion_inputs.interrupted else Watch(progress, note)
    along = None if isinstance(time_step, Adaptive) else _requested_tangents(motion_inputs)
    known = None
    check_magnets_apart(motion_inputs.inputs.values, motion_inputs.start.state)
    with motion_inputs.inputs.in_core():
        check_apart(scene, motion_inputs.start.state)
        if along is None:
            leaves = bool(motion_inputs.inputs.leaves)
            found = _core.simulate(
                scene._model,
                motion_inputs.core,
                leaves,
                motion_inputs.memory_budget,
                motion_inputs.keep,
                watch,
            )
        else:
            found, tangents = motion_with_tangents(motion_inputs, along, watch)
            known = along, tangents
    if isinstance(time_step, Adaptive):
        motion_inputs = prepared(found.time_steps, motion_inputs.inputs.values)
    result = _with_strains(_trajectory(motion_inputs, found, time.perf_counter() - began, known))
    log.debug(
        "simulate: %s, %d of %d steps, %d in parts, %d iterations, %d factorizations, %.3g s",
        found.outcome.name,
        result.steps_done,
        motion_inputs.steps,
        len(result.substeps),
        found.iterations,
        found.factorizations,
        result.wall_time,
    )
    if found.outcome == _core.Outcome.interrupted:
        raise Interrupted(f"interrupted after {result.steps_done} of {options.steps} steps", result)
    if found.outcome == _core.Outcome.failed:
        count = len(motion_inputs.time_steps)
        where = f"{found.steps_done} of {count}, at {result.end.time:.6g} s, failed even in parts of 1/64"
        if isinstance(time_step, Adaptive):
            shortest = motion_inputs.time_steps.clock.time_step / 2**time_step._deepest
            where = f"{found.steps_done}, at {result.end.time:.6g} s, failed even with a length of {shortest:.3g} s"
        advice = _advice(result, isinstance(time_step, Adaptive), found.reason)
        raise NotConverged(
            f"step {where}: {found.reason}. {advice} The motion until there is in `error.last_good`.", result
        )
    bending = result._energies.get("bending", np.zeros(len(result)))
    most = int(np.argmax(bending))
    positions = np.asarray(detached(result.positions[most]), dtype=np.float64)
    where = f"the motion, at {result.times[most]:.4g} s,"
    warn_of_obtuse_faces(scene, positions, motion_inputs.inputs.values.all_shells, bending[most], where)
    _warn(result)
    warn_of_steps(result)
    warn_of_gains(result)
    try:  # a field may be a function of the caller's, in which Ctrl-C can come
        _warn_of_fields(result)
    except KeyboardInterrupt as stopped:
        raise Interrupted("interrupted while the sampling of the field was checked", result) from stopped
    return Motion(result, motion_inputs, found)


class Watch:
    """Passes on what the core reports while it takes steps: the fraction that is done, and once, in a note, the
    shortest part [s] of many divided steps.
    """

    def __init__(self, progress: Callable[[float], None], note: Callable[[str], None]):
        self._progress, self._note, self._told = progress, note, False

    def __call__(self, fraction: float, shortest_part: float) -> None:
        if shortest_part > 0.0 and not self._told:
            self._told = True
            self._note(f"ten steps were too long and divided: steps of {shortest_part:.2g} s would do")
        self._progress(fraction)


def _reshaped(scene: Scene, values: Any, start: Any) -> tuple[Scene, Any]:
    """Return the scene with the rest positions among the values, and the values by its objects; raise as `reshaped` does.

    Raises ValueError too for a state from which the motion cannot go on with these.
    """
    last = vars(scene).get("_reshaped", (None, scene))[1]
    turned = turning_supports(scene) if isinstance(start, Equilibrium) else ()
    there, values = reshaped(scene, values, no_gradient_with=turned)
    if there not in (scene, last) and isinstance(start, MotionState | DifferentiableState):
        raise ValueError(
            "start is the state of a motion at other rest_positions: hand over its "
            "positions and velocities instead"
        )
    return there, values


def _advice(result: Trajectory, chosen: bool, reason: str) -> str:
    """Return the advice for an error message about a step that failed, and why. chosen: by ms.Adaptive."""
    fields = map(result._values_at(len(result) - 1).current, result.scene.fields)
    positions = np.asarray(detached(result.positions[-1]), dtype=np.float64)
    if result.scene.own_field is not None and (met := crossing_bodies(result.scene, positions)):
        return (
            f"{met} attract each other by their own field and have met: nothing but an ms.Contact of the two keeps them "
            "apart."
        )
    if "forces of friction" in reason and isinstance(result.integrator, ImplicitEuler):
        return (
            "Take the default integrator, ms.TRBDF2(implicit_contact=True), which finds them in longer steps, shorter "
            "steps, or Contact(lagged_friction=True)."
        )
    overlap = describe_magnet_overlap(fields, positions, result.scene.mesh.edge_lengths)
    if overlap or not chosen:
        return overlap or f"Take shorter steps. {describe_attraction(result.scene)}".rstrip()
    return (
        "Take a larger tolerance, or more halvings; errors that do not fall with the step come from motors that jump, from "
        "contacts that open and close in every step, or from round-off."
    )


def _with_strains(result: Trajectory) -> Trajectory:
    """Return the motion with its largest strains computed again, state by state, if sheets grew during it."""
    if not any(isinstance(owner, Shell) for owner, _ in result._varied):
        return result
    strain = StrainHistory.of_each(result._strains(k) for k in range(len(result)))
    return replace(result, _largest_membrane_strain=strain.membrane, _largest_bending_strain=strain.bending)


def _warn(result: Trajectory) -> None:
    strain = result._largest_strains
    k = strain.worst
    warn_if_large(
        result, strain.at(k), f"the motion, in recorded state {k}, at {result.times[k]:.6g} s", (k,)
    )


def _warn_of_fields(result: Trajectory) -> None:
    """Warn of coarsely sampled fields in the state of largest magnetic energy, where magnets are nearest."""
    if result.scene.own_field is not None:
        energies = result._energies["own field"]
        for k in sorted({int(np.argmin(energies)), int(np.argmax(energies))}):  # bodies are nearest at one
            where = f"the motion, in recorded state {k}, at {result.times[k]:.6g} s"
            warn_of_gaps(gap_errors(result._values_at(k), result._state_at(k)), where)
    if not result.scene.fields:
        return
    k = int(np.argmax(np.abs(result._energies.get("magnetic", np.zeros(len(result))))))
    flux_density = result.applied_flux_density
    where = f"the motion, in recorded state {k}, at {result.times[k]:.6g} s"
    state = (
        result._values_at(k),
        np.asarray(detached(result.positions[k]), dtype=np.float64),
        float(result._field_factors[k]),
        None if flux_density is None else np.reshape(detached(flux_density), (-1, 3))[k],
    )
    warn_of_sampling(sampling_errors(*state), where)
    warn_of_elements(element_errors(*state), where)
    warn_of_entry(*state[:2], where)


def _requested_tangents(motion_inputs: MotionInputs) -> Sequence[np.ndarray] | None:
    """Return the changes of all leaves along which forward mode asks for tangents now; None if it does not."""
    if not motion_inputs.inputs.leaves:
        return None
    from ..adjoint.autograd import tangents_of

    return tangents_of(motion_inputs.inputs.tensors)


def _trajectory(motion_inputs: MotionInputs, found, wall_time: float, known=None) -> Trajectory:
    scene, model, values = (
        motion_inputs.inputs.scene,
        motion_inputs.inputs.scene._model,
        motion_inputs.inputs.values,
    )
    points, edge_rotations, velocities, driving = _outputs(motion_inputs, found, known)
    rigid, n_v = bool(scene.rigid_parts), scene.mesh.n_vertices
    recorded = len(found.kinetic_energy)
    grid, after = motion_inputs.time_steps, np.array(found.steps_recorded, dtype=np.int64)
    ended = grid.clock_after(found.steps_done)
    thickness = values.all_shells.thickness
    with values.growth_in_core():
        strain = StrainHistory.of(found.largest_strains(model, thickness))
    by_term = np.array(found.energies).reshape(recorded, -1)
    return Trajectory(
        scene=scene,
        integrator=motion_inputs.integrator,
        times=grid.grid_times[motion_inputs.record_every * np.arange(recorded)],
        positions=points[:, :n_v] if rigid else points,
        velocities=velocities[:, :n_v] if rigid else velocities,
        edge_rotations=edge_rotations,
        remanent_magnetization=motion_inputs.inputs.given_magnetization,
        applied_flux_density=motion_inputs.recorded("applied_flux_density", after),
        _kinetic_energy=np.array(found.kinetic_energy),
        _energies=_by_name(model.term_names, by_term),
        _largest_membrane_strain=strain.membrane,
        _largest_bending_strain=strain.bending,
        steps=motion_inputs.steps,
        steps_done=int(np.searchsorted(grid.grid_ends, found.steps_done, side="right")) - 1,
        substeps={step: len(parts) for step, parts in found.substeps.items() if len(parts) > 1},
        fallback_steps=tuple(
            step for step, parts in found.substeps.items() if any(calm for _, _, calm in parts)
        ),
        energy_gain_steps=tuple(found.gaining),
        energy_watched=found.watched_energy,
        time_steps=np.array(found.time_steps),
        step_errors=np.array(found.step_errors),
        end=MotionState(
            ended.time,
            found.last_state,
            found.last_velocity,
            found.last_turns,
            found.last_acceleration,
            found.last_strain_rates(model),
            found.last_maxwell_strains(model),
            found.last_maxwell_strain_rates(model),
            ended,
            found.begun or motion_inputs.start.rotations_known,
            found.last_contact_acceleration,
            fine_faces(values),
            found.last_momentum_rate,
        ),
        iterations=found.iterations,
        factorizations=found.factorizations,
        adjoint_storage=found.keep.name,
        bytes=found.bytes,
        wall_time=wall_time,
        linear_time=found.linear_time,
        _field_factors=motion_inputs.recorded("field_factor", after),
        _load_factors=motion_inputs.recorded("load_factor", after),
        _varied=motion_inputs.varied(after),
        _step_factorizations=np.array(found.step_factorizations, dtype=np.int64),
        _thickness=thickness,
        _values=values,
        _directions=found.directions(model),
        _held_forces=found.held_forces(model),
        _own_points=points[:, n_v:] if rigid else None,
        _own_velocities=velocities[:, n_v:] if rigid else None,
        _driving=driving,
        _rest=motion_inputs.inputs.given_rest,
        _tensors=motion_inputs.tensors_in_states(after),
        _keeps_energy=motion_inputs.keeps_energy,
        _conditions=MotionConditions.of(motion_inputs, found),
    )


def _by_name(names: list[str], by_term: np.ndarray) -> dict[str, np.ndarray]:
    """Return the energies by name, {name: (n,)}, from those of all terms (n, terms); terms of one name are summed."""
    sums: dict[str, np.ndarray] = {}
    for name, each in zip(names, by_term.T, strict=True):
        sums[name] = sums[name] + each if name in sums else each
    return sums


def arrays_of(motion_inputs: MotionInputs, found: _core.MotionResult) -> tuple[np.ndarray, ...]:
    """Return positions, edge rotations and velocities, with the points of rigid bodies, and the forces of motors."""
    model = motion_inputs.inputs.scene._model
    return found.positions(model), found.edge_rotations(model), found.velocities(model), found.driving()


def _outputs(motion_inputs: MotionInputs, found, known):
    """Return the arrays as tensors if an input is a tensor, connected to those that require a gradient."""
    inputs, arrays = motion_inputs.inputs, arrays_of(motion_inputs, found)
    if not inputs.leaves:
        return tuple(like(array, *inputs.given) for array in arrays)
    from ..adjoint.autograd import solved

    return solved(
        MotionAdjoint(motion_inputs, found, known), arrays, dtype_like(*inputs.given), inputs.tensors
    )
