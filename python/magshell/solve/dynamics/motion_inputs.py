"""Checks the inputs of a motion and translates them for the core."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.arrays import count
from ..._input.quantity import quantity
from ..._input.tensors import detached, is_tensor, requires_gradient
from ..._runtime.solve_keywords import SOLVE_KEYWORDS
from ...model.contact.contacts_to_core import check_outside, poses
from ...model.contact.watched_obstacles import watched_obstacles
from ...model.fields.field import AppliedField
from ...model.rigid.equimomental_points import check_joints, check_rigid, own_velocities
from ...model.scene.fine_faces import having_fine_faces, keeping_fine_faces, with_fine_faces
from ...model.scene.plausible import warn_of_field
from ...model.scene.solve_inputs import Inputs, check_flux_density
from ..options import Adaptive, Clock, Integrator, Newton, clock_of
from ..statics.equilibrium import Equilibrium
from ..statics.start import check_faces
from .contact_method import check_contact_method, default_integrator
from .differentiable_state import DifferentiableState
from .schedule import Schedule
from .scheduled_values import ScheduledValues
from .step_errors import tolerance_of
from .time_steps import TimePoints, TimeSteps, steps_of
from .trajectory import MotionState, Trajectory

if TYPE_CHECKING:
    from ...model.scene.values import Values
    from ..options import AdjointStorage

# Times at which sources that move are looked at, for the faces that come near them.
_TIMES_OF_MOVING_SOURCES = 8

_BYTES_PER_TIME_POINT = 200  # of the load parameters at one time, in Python and in the core


class MotionInputs:
    """The inputs of one motion, checked. Tensors among them that require a gradient join the leaves of `inputs`.

    arguments: the keywords of ms.simulate that are in the table of solve_keywords.py, but those of `inputs`.
    chosen: the lengths of the steps that an Adaptive has accepted [s]; None: it is still to choose them.
    fine_faces_of: values whose faces that sample the field finely are those of the motion; None: to be decided.
    """

    inputs: Inputs
    integrator: Integrator
    record_every: int
    steps: int
    keep: Any
    memory_budget: int
    time_steps: TimeSteps
    solver: Newton

    def __init__(
        self,
        inputs: Inputs,
        arguments: dict[str, Any],
        *,
        steps: int,
        record_every: int,
        adjoint_storage: AdjointStorage,
        start: Any,
        integrator: Integrator | None,
        solver: Newton,
        schedules: Iterable[Schedule] = (),
        chosen: list[float] | None = None,
        fine_faces_of: Values | None = None,
    ):
        integrator = default_integrator(inputs) if integrator is None else integrator
        check_contact_method(inputs, integrator)
        self.inputs, self.integrator, self.solver = inputs, integrator, solver
        self.steps, self.record_every = count("steps", steps), count("record_every", record_every)
        if self.record_every > self.steps:
            raise ValueError(
                f"record_every must be at most steps = {self.steps}, got {self.record_every}: "
                "only the start would be recorded"
            )
        given = arguments["time_step"]
        adaptive = given if isinstance(given, Adaptive) else None
        _check_memory(self.steps, self.record_every, len(integrator._times) + 1, inputs.scene._model.size)
        self.keep, self.memory_budget = (
            getattr(_core.Keep, adjoint_storage.what or "nothing"),
            int(adjoint_storage.memory_budget),
        )
        chooses = adaptive is not None and chosen is None
        self._outside = None
        self.starts_at_rest: bool = start is None
        self.tolerance: float = tolerance_of(inputs.scene, adaptive)
        self._mass = inputs.values.masses
        self._damping = self._damping_of_points(arguments["damping"])
        law = self._law = self._viscosity(arguments)
        self._given_start = start
        self._begins_anew: bool = not isinstance(start, Trajectory | MotionState | DifferentiableState)
        self.start: MotionState = self._begin(start, arguments["velocities"])
        clock = clock_of(self.start)
        if adaptive is None or chosen is None:
            self.time_steps: TimeSteps = steps_of(inputs, clock, self.steps, given)
        else:
            self.time_steps = TimeSteps.chosen(inputs, clock, self.steps, adaptive, chosen)
        self.time_points: TimePoints = TimePoints(self.time_steps, integrator._times)
        self._schedules = {
            name: self._schedule_of_keyword(name, value)
            for name, value in arguments.items()
            if name in SOLVE_KEYWORDS and SOLVE_KEYWORDS[name].varies
        }
        self._load_parameters = {name: self._of_keyword(each) for name, each in self._schedules.items()}
        schedules = list(schedules)
        self._scheduled = ScheduledValues(self, schedules)
        self.varying: tuple[str, ...] = tuple(
            f"{each.name} of a {type(each.owner).__name__}" for each in schedules
        )
        self.interrupted: bool = False
        if fine_faces_of is not None:
            self.inputs = keeping_fine_faces(self.inputs, fine_faces_of)
        else:
            try:  # a field may be a function of the caller's, in which Ctrl-C can come
                self.inputs = self._with_fine_faces(start)
            except KeyboardInterrupt:
                self.interrupted = True
        if self._outside is not None:
            check_outside(inputs.scene, inputs.values, self._outside, 0.0)
        self._rows = self._all_load_parameters()
        self.core: _core.MotionInput = _core.MotionInput(
            inputs.scene._model,
            {
                "state": self.start.state,
                "velocity": self.start.velocity,
                "angle_branches": self.start.angle_branches,
                **self._history(law),
                "rotations_given": self.start.rotations_known,
                **law,
                "mass": self._mass,
                "damping": self._damping,
                "integrator": integrator._name,
                "implicit_contact": getattr(integrator, "implicit_contact", False),
                "time_steps": [] if chooses else self.time_steps.lengths,
                "recorded": [0] if chooses else self.time_steps.grid_ends[:: self.record_every],
                "adaptive": self._ladder(adaptive) if chooses else None,
                "load_parameters": self._rows,
                "varying": self._scheduled.entries,
                "newton": solver._newton_options(),
                "projective": getattr(integrator, "_projective", None),
                "watched": watched_obstacles(inputs.scene, inputs.scene.obstacles, only_small=True),
            },
        )

    @property
    def keeps_energy(self) -> bool:
        """Tell whether no force puts energy in or takes it out: all have potentials, none is damped or changes in time."""
        law, rows = self._law, self._rows
        is_damped = self._damping.any() or law["stiffness_damping"] != 0.0 or len(law["maxwell_modulus"]) > 0
        return (
            _core.keeps_energy(self.inputs.scene._model) and not is_damped and bool((rows == rows[0]).all())
        )

    def recorded(self, name: str, after: np.ndarray) -> np.ndarray:
        """Return a load parameter at the states recorded after so many steps, the start among them, (n, *row)."""
        return self._load_parameters[name][self.time_points.recorded(after)]

    def varied(self, after: np.ndarray) -> dict[tuple[Any, ...], np.ndarray]:
        """Return the varying values of objects at the states recorded after so many steps, {(object, name): (n, ...)}."""
        at = self.time_points.recorded(after)
        return {key: rows[at] for key, rows in self._scheduled.varied.items()}

    def tensors_in_states(self, after: np.ndarray) -> dict[tuple[Any, str], tuple[Any, bool]]:
        """Return the tensors with a gradient at the states recorded after so many steps.

        {(object or None, name): (tensor, whether it has a row for each state)}
        """
        if not self.inputs.leaves:
            return {}
        from ..adjoint.given import given_tensors

        at, found = self.time_points.recorded(after), {}
        for (owner, name), tensor in given_tensors(self.inputs.leaves).items():
            item = getattr(owner, "object_in_time", owner)
            varies = item is not owner or (owner is None and name in self._load_parameters)
            found[item, name] = (tensor[at] if varies else tensor, varies)
        return found

    def _with_fine_faces(self, start: Any) -> Inputs:
        """Return the inputs with the faces that sample the field finely during the motion.

        They are those that need it in its first state, with the sources where they are then and at some later times, and
        those of an equilibrium at the start. A motion that goes on from another one has the same.
        """
        inputs, scheduled = self.inputs, self._scheduled.varied
        if len(self.start.fine_faces):
            return having_fine_faces(inputs, self.start.fine_faces)
        if isinstance(start, Equilibrium):
            inputs = keeping_fine_faces(inputs, start._values)
        moving = {each: rows for each, rows in scheduled.items() if isinstance(each[0], AppliedField)}
        factors = np.abs(np.asarray(detached(self._load_parameters["field_factor"]), dtype=np.float64))
        strongest = int(np.argmax(factors))
        layout = inputs.scene._load_parameter_layout
        load_parameters = layout.packed(
            {
                ("scene", name): np.asarray(detached(rows), dtype=np.float64)[strongest]
                for name, rows in self._load_parameters.items()
                if ("scene", name) in layout
            },
            layout.zeros(),
        )
        last = len(self.time_points) - 1
        times = np.unique(np.linspace(0, last, _TIMES_OF_MOVING_SOURCES, dtype=int)) if moving else [0]
        for k in times:
            now: dict[Any, Any] = {}
            for (owner, name), rows in moving.items():
                numbers = np.asarray(detached(rows), dtype=np.float64)[k]
                now[owner] = now.get(owner, inputs.values.current(owner)).replaced(**{name: numbers})
            there = inputs.with_values(inputs.values.with_objects(now)) if now else inputs
            inputs = keeping_fine_faces(
                inputs, with_fine_faces(there, self.start.state, load_parameters).values
            )
        return inputs

    def _ladder(self, adaptive: Adaptive) -> dict[str, Any]:
        """Return the core's description of steps that are to be chosen."""
        return {
            "tolerance": self.tolerance,
            "interval": self.time_steps.clock.time_step,
            "intervals": self.steps,
            "deepest": adaptive._deepest,
            "record_every": self.record_every,
            "load_parameters": self._load_parameters_of_step,
        }

    def _load_parameters_of_step(self, interval: int, begin: float, end: float) -> np.ndarray:
        """Return all load parameters at the time points of a step, from one fraction of an interval to another."""
        points = TimePoints(self.time_steps.part(interval, begin, end), self.integrator._times)
        numbers = {
            name: np.ascontiguousarray(detached(each.at(points)), dtype=np.float64)
            for name, each in self._schedules.items()
        }
        rows, poses = self._scheduled.at(points)
        return self._in_layout(numbers, {**self._poses(points.times), **poses}, rows)

    def _all_load_parameters(self) -> np.ndarray:
        """Return all load parameters at all time points in the core's layout, (time points, m)."""
        moving = self._poses(self.time_points.times)
        if moving and (time_step := self.time_steps.tensor) is not None:
            self.inputs.refuse("time_step", time_step, "obstacles move by a function of the time")
        return self._in_layout(
            self._load_parameters, {**moving, **self._scheduled.poses}, self._scheduled.rows
        )

    def _in_layout(
        self, load_parameters: dict[str, np.ndarray], poses: dict[int, np.ndarray], further: np.ndarray
    ) -> np.ndarray:
        rows = {("scene", name): array for name, array in load_parameters.items()}
        rows |= {(f"obstacle {k}", "pose"): array for k, array in poses.items()}
        if self.inputs.scene.own_field is not None:
            rows["scene", "own_field_factor"] = np.ones(len(further))
        layout = self.inputs.scene._load_parameter_layout
        return np.concatenate([layout.rows(rows, len(further)), further], axis=1)

    def _poses(self, times: np.ndarray) -> dict[int, np.ndarray]:
        """Return the poses at some times of obstacles that have a `motion`, {number: (n, 4, 3)}."""
        values, obstacles = self.inputs.values, self.inputs.scene.obstacles
        moving = {k: values.current(each) for k, each in enumerate(obstacles) if each.motion is not None}
        return {k: poses(each, times) for k, each in moving.items()}

    def _schedule_of_keyword(self, name: str, value: Any) -> Schedule:
        unit, (row,) = SOLVE_KEYWORDS[name].unit, SOLVE_KEYWORDS[name].shapes
        if name == "applied_flux_density" and check_flux_density(self.inputs.scene, value) is None:
            value = np.zeros(3)
        return Schedule(self.inputs.scene, name, unit, row, value)

    def _of_keyword(self, schedule: Schedule) -> np.ndarray:
        numbers = self.at_time_points(schedule)
        if schedule.name == "applied_flux_density":
            warn_of_field(self.inputs.scene, np.asarray(detached(numbers)))
        return np.ascontiguousarray(self.inputs.take(schedule.name, numbers), dtype=np.float64)

    def at_time_points(self, schedule: Schedule) -> Any:
        """Return a value at all time points; a tensor stays in its graph."""
        time_step = self.time_steps.tensor
        numbers = schedule.at(self.time_points)
        if (
            callable(schedule.value)
            and time_step is not None
            and not _differentiable_in_time(numbers, time_step)
        ):
            why = (
                f"{schedule.name} is a function of the time that torch cannot follow; make its values from the time by "
                "torch"
            )
            self.inputs.refuse("time_step", time_step, why)
        return numbers

    def _damping_of_points(self, given) -> np.ndarray:
        """Return the damping of all vertices, zero for the points of rigid bodies, (n,) N s/m."""
        n_v = self.inputs.scene.mesh.n_vertices
        on_vertices = np.broadcast_to(self.inputs.keyword("damping", given), (n_v,))
        if not self.inputs.scene.rigid_parts:
            return on_vertices
        return np.concatenate([on_vertices, np.zeros(len(self._mass) - n_v)])

    def _history(self, law: dict[str, Any]) -> dict[str, np.ndarray]:
        """Return the rates and Maxwell strains of the starting state that this motion can use.

        Raises ValueError if they are of another number of branches.
        """
        start, nothing, n_strains = self.start, np.zeros(0), self.inputs.scene._model.n_strains
        branches = len(law["maxwell_modulus"])
        maxwell = branches > 0
        if maxwell and start.maxwell_strains.size not in (0, branches * n_strains):
            raise ValueError(
                f"maxwell_modulus has {branches} branches, but `start` is from a motion with "
                f"{start.maxwell_strains.size // n_strains}: give as many, or begin with positions and velocities"
            )
        viscous = maxwell or law["stiffness_damping"] > 0 or law["stiffness_damping_varies"]
        rates_known = start.strain_rates.size > 0 or not viscous
        known = rates_known and (start.maxwell_strain_rates.size > 0 or not maxwell)
        return {
            "maxwell_strains": start.maxwell_strains if maxwell else nothing,
            "acceleration": start.acceleration if known else nothing,
            "contact_acceleration": start.contact_acceleration,
            "momentum_rate": start.momentum_rate,
            "strain_rates": start.strain_rates,
            "maxwell_strain_rates": start.maxwell_strain_rates if maxwell else nothing,
        }

    def _viscosity(self, arguments: dict[str, Any]) -> dict[str, Any]:
        """Return the numbers of the viscous stresses: stiffness damping and the Maxwell branches.

        Branches whose moduli are all zero are left out, unless gradients by them are computed.
        """
        modulus, time = arguments["maxwell_modulus"], arguments["maxwell_time"]
        damping = arguments["stiffness_damping"]
        moduli = np.atleast_1d(self.inputs.keyword("maxwell_modulus", modulus))
        times = moduli if time is None else np.atleast_1d(self.inputs.keyword("maxwell_time", time))
        has_branches = bool(moduli.any()) or requires_gradient(modulus) or requires_gradient(time)
        if has_branches and time is None:
            raise ValueError("maxwell_modulus needs the relaxation time of each branch, maxwell_time [s]")
        if len(moduli) != len(times):
            raise ValueError(
                "maxwell_modulus and maxwell_time must have one number for each branch, but there are "
                f"{len(moduli)} moduli and {len(times)} times"
            )
        return {
            "stiffness_damping": float(self.inputs.keyword("stiffness_damping", damping)),
            "stiffness_damping_varies": requires_gradient(damping),
            "maxwell_modulus": moduli if has_branches else np.zeros(0),
            "maxwell_time": times if has_branches else np.zeros(0),
        }

    def _begin(self, start, velocities) -> MotionState:
        inputs, model = self.inputs, self.inputs.scene._model
        origin = self._origin(start)
        if inputs.scene.joints:
            check_joints(inputs, model.points(origin.state))
        goes_on = isinstance(start, Trajectory | MotionState | DifferentiableState)
        own = own_velocities(inputs, start, goes_on)
        if (
            goes_on and inputs.scene.rigid_parts
        ):  # free rigid bodies keep their velocity, whatever the vertices have
            own = model.points(origin.velocity)[inputs.scene.mesh.n_vertices :]
        if velocities is None and (goes_on or not own.any()):
            return origin
        if isinstance(start, DifferentiableState):
            raise ValueError("velocities are those of the DifferentiableState that the motion starts from")
        n_v = inputs.scene.mesh.n_vertices
        given = np.zeros((n_v, 3)) if velocities is None else velocities
        rows = np.broadcast_to(inputs.keyword("velocities", given), (n_v, 3))
        inputs.scene._bodies.check_welded("velocities", "m/s", rows)
        velocity = model.full_vector(np.concatenate([rows, own]))
        if inputs.scene.rigid_parts:
            with inputs.in_core():
                velocity = model.settled_velocity(origin.state, velocity)
            fastest = np.abs(rows).max(initial=0.0)
            check_rigid(inputs.scene, rows, model.positions(velocity), "velocities [m/s]", fastest)
        return MotionState(
            origin.time,
            origin.state,
            velocity,
            origin.angle_branches,
            maxwell_strains=origin.maxwell_strains,
            clock=origin.clock,
            rotations_known=origin.rotations_known,
            fine_faces=origin.fine_faces,
        )

    def _origin(self, start) -> MotionState:
        inputs, model, mesh = self.inputs, self.inputs.scene._model, self.inputs.scene.mesh
        still = np.zeros(model.size)
        if start is None:
            self._outside = mesh.rest_positions
            return MotionState(0.0, model.rest_state(), still, [])
        if isinstance(start, Equilibrium | Trajectory):
            if start.scene is not inputs.scene:
                raise ValueError("start is of another scene; hand over its positions instead")
            if isinstance(start, Trajectory):
                why = "it goes on from another motion, whose history has no gradient: start=first.end takes its numbers"
                inputs.refuse("start", start.positions, why)
                return start.end
            if requires_gradient(start.positions):
                inputs.take("positions", start.positions)
                inputs.take("edge_rotations", start.edge_rotations)
                if inputs.scene.rigid_parts:
                    inputs.take("own_points", start._own_points)
            return MotionState(0.0, start._state, still, start._angle_branches)
        if isinstance(start, MotionState | DifferentiableState):
            state = start if isinstance(start, MotionState) else start._taken_by(inputs)
            return _checked_state(state, model.size, model.n_strains)
        given = inputs.take("positions", start)
        positions = quantity("start", "m", given, (mesh.n_vertices, 3))
        inputs.scene._bodies.check_welded("start", "m", positions)
        check_faces(inputs.scene, positions)
        with inputs.in_core():
            state = model.state(positions, np.zeros(inputs.scene._bodies.n_rotations))
        self._outside = model.points(state)
        check_rigid(inputs.scene, positions, model.positions(state), "start [m]", mesh.size)
        return MotionState(0.0, state, still, rotations_known=False)


def _check_memory(steps: int, record_every: int, times_per_step: int, unknowns: int) -> None:
    """Raise MemoryError if the load parameters and the recorded states of a motion exceed the physical memory.

    times_per_step: time points of a step at which load parameters are needed; unknowns: degrees of freedom.
    """
    load_parameters = _BYTES_PER_TIME_POINT * times_per_step * steps
    states = 32 * unknowns * (steps // record_every)  # positions and velocities, in the core and handed out
    if (there := _physical_memory()) is not None and load_parameters + states > there:
        raise MemoryError(
            f"{steps:,} steps need {load_parameters / 1e9:.3g} GB for their load parameters and {states / 1e9:.3g} GB for "
            f"the recorded states, and this computer has {there / 1e9:.3g} GB: record fewer (record_every), or take the "
            "motion in parts, each with start= the one before"
        )


def _physical_memory() -> int | None:
    """Return the physical memory in bytes, or None if the system does not say."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _checked_state(start: MotionState, size: int, n_strains: int) -> MotionState:
    """Check a MotionState, whose arrays may come from a file or from a caller, and return it."""
    if np.ndim(start.state) == 1 and len(start.state) != size:
        raise ValueError(
            f"start is a state of {len(start.state)} degrees of freedom, but the scene has {size}"
        )
    rates = ("acceleration", "contact_acceleration", "momentum_rate")
    for name in ("state", "velocity", *rates):
        values = getattr(start, name)
        optional = name in rates and np.shape(values) == (0,)
        quantity(f"start.{name}", "SI", values, (0,) if optional else (size,))
    for name in ("strain_rates", "maxwell_strains", "maxwell_strain_rates"):
        values = getattr(start, name)
        branches = np.size(values) // max(n_strains, 1) if name.startswith("maxwell") else 1
        quantity(f"start.{name}", "SI", values, (0 if np.size(values) == 0 else branches * n_strains,))
    if not isinstance(start.angle_branches, list | tuple):
        raise ValueError(
            f"start.angle_branches must be a list of lists of numbers, got {type(start.angle_branches).__name__}"
        )
    for k, each in enumerate(start.angle_branches):
        quantity(f"start.angle_branches[{k}]", "SI", each, ("n",))
    quantity("start.time", "s", start.time, ())
    if not isinstance(start.clock, Clock | None):
        raise ValueError(f"start.clock must be that of a motion, or None, got {type(start.clock).__name__}")
    return start


def _differentiable_in_time(numbers, time_step) -> bool:
    """Return whether a function's values are connected to the time step by torch, or are the same at all times."""
    from ..adjoint.autograd import depends_on

    plain = np.asarray(detached(numbers))
    return bool((plain == plain[0]).all()) or (is_tensor(numbers) and depends_on(numbers, time_step))
