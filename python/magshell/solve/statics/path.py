"""Paths of equilibria through limit points: ms.follow_path."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.arrays import count, number
from ..._input.scalars import positive
from ..._input.tensors import detached
from ..._runtime.frozen import immutable
from ..._runtime.log import log
from ..._runtime.mixins import AnimateMixin
from ..._runtime.progress import SolveBar, stop_at_once
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import grouped, solve_entry
from ...errors import Interrupted, NotConverged
from ...model.contact.watched_obstacles import watched_obstacles
from ...model.results.crossings import describe_crossings
from ...model.results.result_lookup import OfOneBody, result_of
from ...model.results.solid_result import describe_strains
from ...model.scene.element_sampling import has_elements
from ...model.scene.field_sampling import (
    element_errors,
    is_suspect,
    sampling_errors,
    warn_of_elements,
    warn_of_entry,
    warn_of_sampling,
)
from ...model.scene.fine_faces import keeping_fine_faces, with_fine_faces
from ...model.scene.own_field_errors import gap_errors, warn_of_gaps
from ...model.scene.own_field_overlap import check_magnets_apart
from ...model.scene.reshaped import reshaped
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs, plain_inputs
from ...model.scene.values import Values
from ...model.shells.obtuse_faces import warn_of_obtuse_faces
from ...model.shells.strains import StrainHistory, strains_of, warn_if_large
from ..options import MixedNewton, Newton
from .along_path import AlongPath, moving_obstacles
from .balance import EnergyBalance, balance_of_path
from .critical_point import CriticalPoint, critical_point
from .equilibrium import Equilibrium
from .path_events import PathEvent, events_along
from .single_solve import solve
from .start import starting_point

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


@immutable
@dataclass(frozen=True, repr=False)
class EquilibriumPath(AnimateMixin, OfOneBody):
    """A path of equilibria, stable and unstable. `path[body]` has those of one body.

    parameters: (n,), 0 at the load parameters of the start, 1 at the new ones. positions: (n, n_v, 3) m.
    n_negative_eigenvalues: (n,), zero where the equilibrium is stable. critical: CriticalPoints, in order.
    remanent_magnetization: (n_f, 3) or (3,) A/m, or None.
    largest_membrane_strain, largest_bending_strain: (n,), 1, the largest magnitudes of the strains that `strains` returns.
        The model is for strains below 0.2; ms.LargeStrainWarning warns beyond.
    """

    scene: Scene
    parameters: np.ndarray
    positions: np.ndarray
    n_negative_eigenvalues: np.ndarray
    critical: tuple[CriticalPoint, ...]
    remanent_magnetization: Any
    largest_membrane_strain: np.ndarray
    largest_bending_strain: np.ndarray
    iterations: int
    factorizations: int
    failed_factorizations: int
    wall_time: float
    reason: str
    _points: list[Any] = field(repr=False)
    _inputs: Inputs = field(repr=False)
    _moving: AlongPath = field(repr=False)
    _from: Any = field(repr=False)
    _to: Any = field(repr=False)
    _options: Any = field(repr=False)
    _start: Any = field(repr=False)

    def switch_branch(
        self,
        critical: CriticalPoint,
        side: int = 1,
        *,
        until: Callable[[float, np.ndarray], bool] | None = None,
        max_step: float | None = None,
        max_points: int | None = None,
        progress: bool = True,
    ) -> EquilibriumPath:
        """Follows the branch that crosses this path at a bifurcation, beginning there along its mode.

        critical: a bifurcation of this path. side: 1 or -1, the direction along `critical.mode`; the two halves of a
        symmetric branch mirror each other. until, progress: as in ms.follow_path. max_step, max_points: by default
        those of this path.

        The first step has the length max_step. If the path itself is found again instead of the branch, a smaller
        max_step helps.

        Raises NotConverged and Interrupted with the path so far as `last_good`; ValueError on bad input.
        Source: Keller (1977), Numerical solution of bifurcation and nonlinear eigenvalue problems.

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
        >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
        >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (-0.4, 0, 0))
        >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
        >>> straight = ms.follow_path(scene)
        >>> buckled = straight.switch_branch(straight.critical[0])
        >>> bool(straight.stable[-1]), bool(buckled.stable[-1])
        (False, True)
        """
        if not any(critical is each for each in self.critical):
            raise ValueError("critical must be one of path.critical of this path")
        if critical.kind != "bifurcation":
            raise ValueError(
                f"critical must be a bifurcation, where another branch crosses; this one is a {critical.kind} point"
            )
        if side not in (1, -1):
            raise ValueError(f"side must be 1 or -1, got {side!r}")
        options = _core.PathOptions()
        for name in ("newton", "first_step", "min_parameter", "locate_critical", "watched"):
            setattr(options, name, getattr(self._options, name))
        options.max_step = self._options.max_step if max_step is None else positive("max_step", "", max_step)
        options.max_points = (
            self._options.max_points if max_points is None else count("max_points", max_points, least=2)
        )
        options.branch_at, options.branch_side = critical._found, float(side)
        found = critical._found.point
        return _follow(
            self._inputs,
            self._moving,
            (found.state, found.angle_branches, self._from, self._start),
            options,
            _checked_until(until),
            progress,
        )

    @cached_property
    def events(self) -> tuple[PathEvent, ...]:
        """The events along the path, in order: its critical points, and contacts that are made and lost.

        A contact, of a body and an obstacle or of two bodies, is made where its first points touch and lost where its
        last ones part. If this happens between two points of the path, equilibria between them are computed until the
        parameter of the event is known to a millionth of the step.
        """
        return events_along(self)

    def equilibrium(self, index: int) -> Equilibrium:
        """Return one of the points, stable or not, as an Equilibrium, from which another solve may start."""
        index = range(len(self))[index]
        load_parameters = self._load_parameters[index]
        options = MixedNewton()._options()
        options.require_stable = False
        point = self._points[index]
        inputs = self._inputs.with_values(self._moving.values(self.parameters[index])).without_tensors()
        return solve(
            inputs, point.state, point.angle_branches, load_parameters, load_parameters, options
        ).equilibrium

    def balance(self) -> EnergyBalance:
        """Return the work of loads, supports, fields and others along the path against the change of energy.

        The work between two points follows the trapezoidal rule: the rest falls with the square of `max_step`.

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
        >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
        >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.01))
        >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
        >>> bending = ms.follow_path(scene).balance()
        >>> sorted(bending.work), bending.rest_fraction < 0.01
        (['loads'], True)
        """
        return balance_of_path(self)

    def _solved_from(self, point: Any, parameter: float) -> Any:
        """Return the core's equilibrium at another parameter, searched from a point nearby; None if none is found."""
        load_parameters = (1.0 - parameter) * self._from + parameter * self._to
        options = MixedNewton()._options()
        options.newton, options.require_stable, options.start_at_rest = self._options.newton, False, False
        inputs = self._inputs.with_values(self._moving.values(parameter)).without_tensors()
        with inputs.in_core():
            found = _core.find_equilibrium(
                self.scene._model,
                point.state,
                point.angle_branches,
                load_parameters,
                load_parameters,
                options,
                None,
                [],
            )
        return found if found.outcome == _core.Outcome.converged else None

    def strains(self, index: int = -1) -> Any:
        """Return the principal strains of all faces of the shells at one of the points, by default the last, as Strains.

        In a scene of one solid, return those of path[solid].
        """
        return self._strains(index)

    def _strains(self, index: int = -1) -> Any:
        if (solid := self._one_solid()) is not None:
            return solid._states(index)
        with self._values_at(index).growth_in_core():
            return strains_of(self.scene, self._state_at(index), self._inputs.values.all_shells.thickness)

    @property
    def _largest_strains(self) -> StrainHistory:
        return StrainHistory(self.largest_membrane_strain, self.largest_bending_strain)

    def __getitem__(self, body: Any) -> Any:
        """Return the results of one object of the scene, a row for each point; `equilibrium` returns points."""
        return result_of(self, body)

    @property
    def displacements(self) -> np.ndarray:
        """The displacements from the rest shape, (n, n_v, 3) m."""
        return self.positions - self.scene.mesh.rest_positions

    @property
    def edge_rotations(self) -> np.ndarray:
        """The edge rotations, (n, n_e) rad, zero where an edge has none."""
        return self._at_points(self.scene._model.edge_rotations)

    @property
    def _own_points(self) -> np.ndarray:
        """The points of rigid bodies, ten each, (n, k, 3) m."""
        return self._at_points(self.scene._model.points)[:, self.scene.mesh.n_vertices :]

    @property
    def _driving(self) -> np.ndarray:
        """The torques and forces of motors in joints, (n, m) N m or N."""
        model, rows = self.scene._model, []
        for k, (point, load_parameters) in enumerate(zip(self._points, self._load_parameters, strict=True)):
            with self._values_at(k).in_core():
                rows.append(model.driving(point.state, load_parameters, point.angle_branches))
        return np.array(rows)

    def _at_points(self, function: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return a function of the state at each point, (n, ...)."""
        shape = function(self.scene._model.rest_state()).shape
        return np.reshape([function(point.state) for point in self._points], (len(self), *shape))

    def _state_at(self, index: int) -> np.ndarray:
        return self._points[index].state

    @property
    def _load_factors(self) -> np.ndarray:
        return self._load_parameter("load_factor")[:, 0]

    def _tensors_at(self, index: int) -> dict[tuple[Any, str], Any]:
        return {}  # positions along a path are arrays

    def _values_at(self, index: int):
        return self._moving.values(self.parameters[index])

    @property
    def applied_flux_densities(self) -> np.ndarray:
        """The uniform field at each point, (n, 3) T."""
        return self._load_parameter("applied_flux_density")[:, 0]

    @property
    def _load_parameters(self) -> np.ndarray:
        """The load parameters at each point, (n, m), interpolated linearly."""
        along = self.parameters[:, None]
        return (1.0 - along) * self._from + along * self._to

    def _load_parameter(self, name: str) -> np.ndarray:
        return self.scene._load_parameter_layout.of(self._load_parameters, "scene", name)

    @property
    def stable(self) -> np.ndarray:
        """The stability of each point, (n,) of bool."""
        return self.n_negative_eigenvalues == 0

    def __len__(self) -> int:
        return len(self.parameters)

    def __repr__(self) -> str:
        lines = [f"Path: {len(self)} equilibria"]
        if len(self):
            lowest, highest = self.parameters.min(), self.parameters.max()
            lines[0] += f", {int(self.stable.sum())} of them stable, parameter {lowest:.4g} to {highest:.4g}"
        lines += [
            f"  {event.kind} at {event.parameter:.6g}, after point {event.after_point}"
            for event in self.events
        ]
        lines.append(f"  {describe_strains(self, self._largest_strains)}")
        lines.append(f"  {describe_crossings(self.scene, self.positions)}")
        lines.append(
            f"  {self.iterations} iterations, {self.factorizations} factorizations, {self.wall_time:.3g} s"
        )
        return "\n".join(lines)


@grouped(solver=MixedNewton)
@solve_entry
def follow_path(
    scene: Scene,
    *,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: float = 1.0,
    gravity_factor: float = 1.0,
    field_factor: float = 1.0,
    support_factor: float = 1.0,
    values: dict[Any, Any] | None = None,
    start: Equilibrium | None = None,
    until: Callable[[float, np.ndarray], bool] | None = None,
    first_step: float = 0.05,
    max_step: float = 0.02,
    min_parameter: float = -np.inf,
    max_points: int = 1000,
    locate_critical: bool = True,
    solver: Newton | None = None,
    progress: bool = True,
) -> EquilibriumPath:
    """Follows a path of equilibria by arc length, from `start` as its load parameters go towards the new ones.

    The path parameter is 0 at the load parameters of `start` (an Equilibrium of this scene; by default the unloaded rest
    shape) and 1 at those given here; it decreases again beyond limit points. The path ends where the parameter passes 1 or
    `min_parameter`, or where until(parameter, positions) returns True.

    {keywords}
    values: as in ms.equilibrium. Places of field sources, obstacles and supports, and activations of muscles, change
        linearly along the path from those of `start` to these; all other values must be the same as those of `start`.

    first_step: change of the parameter in the first step. max_step: the largest root mean square displacement between two
        points, over the mesh's size. max_points: the largest number of points.
    locate_critical: whether to find limit points and bifurcations between points whose numbers of unstable directions
        differ.
    progress: show a bar once a path has taken two seconds.

    Raises NotConverged and Interrupted with the path so far as `last_good`; ValueError on bad input.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (-0.4, 0, 0))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    >>> path = ms.follow_path(scene)  # straight, beyond where it buckles
    >>> path.critical[0].kind
    'bifurcation'
    """
    arguments = given_to("follow_path", locals())
    solver = MixedNewton() if solver is None else solver
    if not isinstance(solver, Newton):
        raise ValueError(f"solver must be a MixedNewton or a Newton, got {type(solver).__name__}")
    first_step, max_step = (
        positive("first_step", "", first_step),
        positive("max_step", "", max_step),
    )
    max_points = count("max_points", max_points, least=2)
    min_parameter = number("min_parameter", min_parameter)
    if not min_parameter < 0:
        raise ValueError(f"min_parameter must be below 0, where the path starts, got {min_parameter}")
    until = _checked_until(until)
    if start is not None and not isinstance(start, Equilibrium):
        raise ValueError(f"start must be an Equilibrium of this scene, got {type(start).__name__}")
    scene, arguments["values"] = reshaped(scene, arguments["values"])
    if start is not None and start.scene is not scene and start.scene._family is scene._family:
        raise ValueError("start is an equilibrium at other rest_positions: a path keeps those of its start")
    inputs = plain_inputs(scene, differentiable=True, **arguments)
    if start is not None:
        inputs = keeping_fine_faces(inputs, start._values)
    state, angle_branches, from_, _ = starting_point(scene, start, inputs)
    check_magnets_apart(inputs.values, state)
    interrupted = False
    if start is None:  # a given equilibrium keeps its fine faces: with others it would not be in equilibrium
        try:  # Ctrl-C may arrive in a field that is a Python function of the caller
            inputs = with_fine_faces(inputs, state, inputs.load_parameters)
        except KeyboardInterrupt:
            interrupted = True
    moving = AlongPath(inputs, start)
    options = _core.PathOptions()
    options.newton = solver._newton_options()
    options.first_step, options.max_step = first_step, max_step
    options.min_parameter, options.max_points = max(min_parameter, -1e300), max_points
    options.locate_critical = locate_critical
    options.watched = watched_obstacles(scene, moving_obstacles(scene, moving, from_, inputs.load_parameters))

    return _follow(
        inputs, moving, (state, angle_branches, from_, start), options, until, progress, interrupted
    )


def _checked_until(until: Any) -> Any:
    """Return a function that ends a path, or None; raise ValueError on anything else."""
    if until is not None and not callable(until):
        raise ValueError(f"until must be a function of (parameter, positions), got {until!r}")
    return until


def _follow(
    inputs: Inputs,
    moving: AlongPath,
    start: tuple[Any, ...],
    options: Any,
    until: Any,
    progress: bool,
    interrupted: bool = False,
) -> EquilibriumPath:
    """Follow a path in the core.

    start: the state at parameter 0, the branches of its angles, its load parameters, and the Equilibrium there, or None.
    interrupted: whether Ctrl-C has arrived already; the path then ends at its start.
    """
    scene = inputs.scene
    state, angle_branches, from_, first = start
    began = time.perf_counter()
    with inputs.in_core(), SolveBar("path", progress) as bar:
        found = _core.follow_path(
            scene._model,
            state,
            angle_branches,
            np.concatenate([from_, moving.before]),
            np.concatenate([inputs.load_parameters, moving.after]),
            options,
            moving.entries,
            until,
            stop_at_once if interrupted else _advance(bar),
        )
        bending = _bending_energies(scene, found, inputs.load_parameters)
    path = _path(inputs, moving, found, (from_, first), options, time.perf_counter() - began)
    log.debug("path: %s, %d points, %.3g s", found.outcome.name, len(path), path.wall_time)
    if found.outcome == _core.Outcome.interrupted:
        raise Interrupted(f"interrupted after {len(path)} points of the path", path)
    if found.outcome == _core.Outcome.failed:
        raise NotConverged(
            f"the path ended after {len(path)} points, at parameter {path.parameters[-1] if len(path) else 0:.4g}: "
            f"{found.reason}. What it has so far is in `error.last_good`.",
            path,
        )
    if len(bending):
        most = int(np.argmax(bending))
        where = f"the path, at parameter {path.parameters[most]:.4g},"
        warn_of_obtuse_faces(scene, path.positions[most], inputs.values.all_shells, bending[most], where)
    strain = path._largest_strains
    k = strain.worst
    warn_if_large(path, strain.at(k), f"the path, at point {k}, parameter {path.parameters[k]:.4g}", (k,))
    try:  # Ctrl-C may arrive in a field that is a Python function of the caller
        _warn_of_fields(path)
    except KeyboardInterrupt as stopped:
        raise Interrupted("interrupted while the sampling of the field was checked", path) from stopped
    return path


def _warn_of_fields(path: EquilibriumPath) -> None:
    """Warn of the point with the largest error of the magnetic force, if this error is too large."""
    if not len(path):
        return
    errors = np.array([point.field_sampling_error for point in path._points])
    k = int(np.argmax(np.where(np.isnan(errors), np.inf, errors)))
    if is_suspect(errors[k]):
        found = sampling_errors(*_fields_at(path, k))
        warn_of_sampling(found, f"the path, at point {k}, parameter {path.parameters[k]:.4g}")
    if has_elements(path._values_at(0)):
        k = int(np.argmax(np.abs(_energies_of(path, "magnetic"))))  # magnets are nearest there
        found = element_errors(*_fields_at(path, k))
        warn_of_elements(found, f"the path, at point {k}, parameter {path.parameters[k]:.4g}")
    k = len(path) - 1
    warn_of_entry(path._values_at(k), path.positions[k], f"the path, at its end, point {k}")
    if path.scene.own_field is not None:
        energies = _energies_of(path, "own field")
        for k in sorted({int(np.argmin(energies)), int(np.argmax(energies))}):  # bodies are nearest at one
            found = gap_errors(path._values_at(k), path._points[k].state)
            warn_of_gaps(found, f"the path, at point {k}, parameter {path.parameters[k]:.4g}")


def _fields_at(path: EquilibriumPath, k: int) -> tuple[Values, np.ndarray, float, np.ndarray]:
    """Return the arguments of sampling_errors() and element_errors() for a point."""
    return (
        path._values_at(k),
        path.positions[k],
        float(path._load_parameter("field_factor")[k, 0]),
        path._load_parameter("applied_flux_density")[k, 0],
    )


def _energies_of(path: EquilibriumPath, term: str) -> np.ndarray:
    """Return the energy of a term at each point [J]."""
    energies = []
    for k, (point, load_parameters) in enumerate(zip(path._points, path._load_parameters, strict=True)):
        with path._values_at(k).in_core():
            terms = path.scene._model.energies(point.state, load_parameters)
        energies.append(terms.get(term, 0.0))
    return np.array(energies)


def _bending_energies(scene: Scene, found, load_parameters) -> list[float]:
    """Return the bending energies of the points if the mesh has obtuse faces, for whose warning they are needed; else []."""
    if not scene._bodies.has_only_three_node_shells or not scene._obtuse_faces.faces.size:
        return []
    return [scene._model.energies(point.state, load_parameters).get("bending", 0.0) for point in found.points]


def _advance(bar):
    def advance(parameter: float, residual: float) -> None:
        bar.note(f"parameter {parameter:.4g}")
        bar.to(parameter)

    return advance


def _path(inputs: Inputs, moving: AlongPath, found, begin, options, wall_time: float) -> EquilibriumPath:
    scene, (from_, start) = inputs.scene, begin
    model = scene._model
    points = found.points
    strain = StrainHistory.of([_largest(model, moving.values(point.parameter), point) for point in points])
    return EquilibriumPath(
        scene=scene,
        parameters=np.array([point.parameter for point in points]),
        positions=np.array([model.positions(point.state) for point in points]).reshape(
            len(points), scene.mesh.n_vertices, 3
        ),
        n_negative_eigenvalues=np.array([point.n_negative_eigenvalues for point in points], dtype=int),
        critical=tuple(critical_point(inputs, moving, start, from_, point) for point in found.critical),
        remanent_magnetization=detached(inputs.given_magnetization),
        largest_membrane_strain=strain.membrane,
        largest_bending_strain=strain.bending,
        iterations=found.iterations,
        factorizations=found.factorizations,
        failed_factorizations=found.failed_factorizations,
        wall_time=wall_time,
        reason=found.reason,
        _points=points,
        _inputs=inputs,
        _moving=moving,
        _from=from_,
        _to=inputs.load_parameters,
        _options=options,
        _start=start,
    )


def _largest(model, values: Values, point) -> tuple[Any, ...]:
    with values.growth_in_core():
        return model.largest_strains(point.state, values.all_shells.thickness)
