"""Motions of many designs or load parameters of one scene at once, over threads: ms.simulate(..., batch=k)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import count
from ..._input.quantity import quantity
from ..._input.tensors import is_tensor, requires_gradient
from ..._input.without_gradient import without_gradient
from ..._runtime.frozen import immutable
from ..._runtime.solve_keywords import SOLVE_KEYWORDS
from ..._runtime.worker_threads import checked_threads
from ...errors import Interrupted
from ...model.results.batch_result import BatchOfPositions
from ...model.scene.batch_axis import BatchAxis, row_of
from ...model.scene.time_varying import may_jump, row_in_time
from ..adjoint.batch import Member, OnThreads, solve_members
from ..adjoint.dynamic import MotionAdjoint
from ..options import as_adjoint_storage
from ..statics.equilibria import EquilibriumSet
from ..statics.equilibrium import Equilibrium
from ..statics.equilibrium_batch import EquilibriumBatch
from .single_motion import MotionOptions, arrays_of, preparation, run
from .trajectory import MotionState, Trajectory

if TYPE_CHECKING:
    from ..._input.kinds import Computed
    from ...model.scene.scene import Scene
    from .trajectory import Trajectory


def simulate_batch(
    scene: Scene,
    arguments: dict[str, Any],
    options: MotionOptions,
    members: int,
    threads: int | None,
    progress: Callable[[float], None],
) -> TrajectoryBatch:
    """Simulate the motions of all members, with the arguments of ms.simulate. Raises ValueError on bad input before any
    motion, Interrupted with those that were found; errors of single motions are in the result."""
    members = count("batch", members)
    threads = checked_threads(threads, members)
    steps = count("steps", options.steps)
    arguments = dict(arguments)
    time_step = arguments.pop("time_step")  # of all members
    axis = BatchAxis(scene, arguments, members, refusal_in_time=_InTime(scene, steps))
    on = OnThreads(scene, threads)
    storage = as_adjoint_storage(options.adjoint_storage)
    storage = replace(storage, memory_budget=storage.memory_budget / members)
    each = [
        replace(options, start=start, adjoint_storage=storage) for start in _starts(options.start, members)
    ]
    every = dict.fromkeys(arguments)

    def given(member: int) -> tuple[dict[str, Any], list[Any]]:
        keywords, leaves = axis.arguments(member)
        return {**every, **keywords, "time_step": time_step}, leaves

    if is_tensor(time_step) and time_step.requires_grad:
        raise ValueError("time_step of a batch must be a number: gradients by it need single motions")
    first = preparation(scene, given(0)[0], each[0])(None)  # raises what every member would

    def solve(member: int, check: Callable[[], None]) -> Member:
        keywords, leaves = given(member)
        one = run(scene, keywords, each[member], lambda fraction: check())
        arrays, adjoint = arrays_of(one.motion_inputs, one.found), MotionAdjoint(one.motion_inputs, one.found)
        return Member(one.result, arrays, adjoint, one.motion_inputs.inputs.tensors, leaves)

    def missing() -> tuple[np.ndarray, ...]:
        model, recorded = scene._model, 1 + steps // first.record_every
        rest = model.rest_state()
        points = np.zeros((recorded, *model.points(rest).shape))
        return (
            points,
            np.zeros((recorded, *model.edge_rotations(rest).shape)),
            points,
            np.zeros((recorded, 0)),
        )

    solved = solve_members(on, axis, solve, lambda fraction, residual: progress(fraction), missing)
    points, edge_rotations, velocities, driving = solved.arrays
    n_v, rigid = scene.mesh.n_vertices, bool(scene.rigid_parts)
    rest = axis.rest_positions
    found = [
        None
        if one is None
        else replace(
            _member(axis, k, one.result, n_v, (points[k], edge_rotations[k], velocities[k], driving[k])),
            _rest=row_of(rest, k),
            _tensors=_connected(axis, k, one),
        )
        for k, one in enumerate(solved.members)
    ]
    times = first.time_steps.grid_times[first.record_every * np.arange(points.shape[1])]
    batch = TrajectoryBatch(
        scene,
        times,
        points[:, :, :n_v] if rigid else points,
        velocities[:, :, :n_v] if rigid else velocities,
        edge_rotations,
        solved.failed,
        tuple(found),
        None if rest is None else rest[:, None],
    )
    if solved.interrupt is not None:
        done = int(batch.converged.sum())
        told = f"interrupted: {done} of {members} members of the batch came to their end"
        raise Interrupted(told, batch) from solved.interrupt
    return batch


class _InTime:
    """Says of a value that may vary in time whether its numbers are those of one motion."""

    def __init__(self, scene: Scene, steps: int):
        self._scene, self._steps = scene, steps

    def __call__(self, owner: Any, name: str, numbers: np.ndarray) -> ValueError | str | None:
        """Return the error of the numbers, None if they are those of a motion, "" if they cannot vary in time."""
        keyword = SOLVE_KEYWORDS.get(name) if owner is None or owner is self._scene else None
        row = keyword.shapes[0] if keyword is not None and keyword.varies else None
        if row is None and owner is not None:
            row = row_in_time(owner, name)
        if row is None:
            return ""
        ends = (self._steps + 1, *row)
        shapes = [row, ends]
        if keyword is not None or may_jump(owner):
            shapes.append((self._steps, *row))
        if numbers.shape not in shapes:
            return ValueError(f"{name} must have shape {' or '.join(map(str, shapes))}, got {numbers.shape}")
        try:
            quantity(name, "" if keyword is None else keyword.unit, numbers, numbers.shape)
        except ValueError as error:
            return error
        return None


def _connected(axis: BatchAxis, member: int, one: Member) -> dict[tuple[Any, str], tuple[Any, bool]]:
    """Return the tensors of a member's states as parts of the values of the batch.

    Those that were computed from such parts have no gradient.
    """
    if not one.result._tensors:
        return {}
    from ..adjoint.autograd import refused

    own = [(tensor, each.given_to(member)) for tensor, each in zip(one.tensors, axis.followed, strict=True)]
    found = {}
    for (owner, name), (tensor, varies) in one.result._tensors.items():
        given = [part for copy, part in own if copy is tensor]
        known = given[0] if given else refused(tensor, name, "it was computed from a value of a batch")
        found[owner, name] = known, varies
    return found


def _member(
    axis: BatchAxis, member: int, found: Trajectory, n_vertices: int, arrays: Sequence[Any]
) -> Trajectory:
    """Return the motion of one member with its part of the results, connected to the values of the batch."""
    points, edge_rotations, velocities, driving = arrays
    rigid = bool(found.scene.rigid_parts)
    magnetization = {
        each.name: each.given_to(member)
        for each in axis.values
        if each.owner is None and each.name == "remanent_magnetization" and is_tensor(each.value)
    }
    return replace(
        found,
        positions=points[:, :n_vertices],
        edge_rotations=edge_rotations,
        velocities=velocities[:, :n_vertices],
        _own_points=points[:, n_vertices:] if rigid else None,
        _own_velocities=velocities[:, n_vertices:] if rigid else None,
        _driving=driving,
        **magnetization,
    )


def _starts(start: Any, members: int) -> list[Any]:
    """Return the start of each member. Raises ValueError if there is another number of them, or if a gradient by them
    would be lost.
    """
    several = isinstance(start, EquilibriumSet | EquilibriumBatch | TrajectoryBatch)
    if isinstance(start, np.ndarray | list) or is_tensor(start):
        states = isinstance(start, list) and isinstance(start[0], Equilibrium | Trajectory | MotionState)
        several = states or np.ndim(start) == 3
    if several and len(start) != members:
        raise ValueError(f"start has {len(start)} members, but batch={members}")
    starts = [start[k] for k in range(members)] if several else [start] * members
    if any(map(_requires_gradient, (start, *starts))):
        raise ValueError(
            "start of a batch has no gradient: detach it, solve for it under torch.no_grad(), or simulate each member alone"
        )
    return starts


def _requires_gradient(start: Any) -> bool:
    """Return whether a start is a tensor with a gradient, or a result or state that holds some."""
    return requires_gradient(getattr(start, "positions", start))


@immutable
@dataclass(frozen=True, repr=False)
class TrajectoryBatch(BatchOfPositions):
    """The motions of the k members of a batch, of ms.simulate(..., batch=k).

    times: (n,) s, of the recorded states. positions: (k, n, n_v, 3) m; velocities: (k, n, n_v, 3) m/s; edge_rotations:
    (k, n, n_e) rad; tensors where an input was one. Rows of members that failed are nan. failed: {member: the error that
    its motion raised}, with the motion until then as `last_good`.

    `batch[k]` is the Trajectory of a member; of one that failed it raises the error.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> moves = ms.simulate(scene, steps=4, time_step=2e-3, batch=3, gravity_factor=[0.5, 1.0, 1.5])
    >>> moves.positions.shape, moves.failed, moves[1].steps_done
    ((3, 5, 12, 3), {}, 4)
    """

    scene: Scene
    times: np.ndarray
    positions: Any
    velocities: Any
    edge_rotations: Any
    failed: dict[int, Any]
    _members: tuple[Trajectory | None, ...] = field(repr=False)
    _rest: Any = field(repr=False, default=None)

    @property
    def energy(self) -> Computed:
        """The kinetic and potential energies together, (k, n) J; nan for members that failed."""
        missing = np.full(len(self.times), np.nan)
        energies = np.stack([missing if each is None else each._energy for each in self._members])
        return without_gradient(energies, self.positions, "result.energy")

    def __getitem__(self, index: int) -> Trajectory:
        """Return the motion of one member, or raise the error that it ended with."""
        return self._member(index)
