"""The motion of a scene on finer meshes, in the steps of that on the coarse ones, and the adjoint of an output of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.solve_keywords import SOLVE_KEYWORDS
from ...errors import Interrupted, NotConverged
from ...mesh.finer import FinerMesh
from ...model.scene.finer_scene import finer_scene
from ...model.scene.solve_inputs import Inputs
from ..dynamics.conditions import MotionConditions
from ..dynamics.motion_inputs import MotionInputs
from ..dynamics.trajectory import MotionState, Trajectory
from ..options import AdjointStorage, ProjectiveDynamics
from .enriched import at_all_vertices, at_coarse_vertices, equilibrium_on

if TYPE_CHECKING:
    from ...model.scene.scene import Scene

_EVEN = 1e-6  # [-] differences of damping over mass, between vertices, that are round-off


class Stage(NamedTuple):
    """One stage of a motion, of all unknowns: forces f on its residual would change the output by adjoint . f."""

    adjoint: np.ndarray
    state: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    load_parameters: np.ndarray


@dataclass(frozen=True)
class StoredMotion:
    """A motion with the states of its stages. given: its inputs. found: that of the core."""

    given: MotionInputs
    found: _core.MotionResult

    @cached_property
    def end(self) -> np.ndarray:
        """The positions of all vertices at the end, (n_v, 3) m."""
        return self.found.positions(self.given.inputs.scene._model)[-1]

    def stages(self, by_end: np.ndarray) -> tuple[Iterator[Stage], int]:
        """Return all stages, the first one first, with the adjoint of an output, and the factorizations that took.

        by_end: the derivative of the output by the positions at the end, (n_v, 3).
        """
        model, recorded = self.given.inputs.scene._model, len(self.found.kinetic_energy)
        by_positions = np.zeros((recorded, *by_end.shape))
        by_positions[-1] = by_end
        no_rotations = np.zeros((recorded, self.given.inputs.scene._bodies.n_rotations))
        with self.given.inputs.in_core():
            back = _core.pull_back_motion(
                model,
                self.given.core,
                self.found,
                by_positions,
                no_rotations,
                np.zeros_like(by_positions),
                stages=True,
            )
        names = ("adjoints", "states", "velocities", "accelerations", "load_parameters")
        return map(Stage, *(back[f"stage_{name}"] for name in names)), back["factorizations"]


@dataclass(frozen=True)
class FinerMotion:
    """A motion on finer meshes of all bodies, in the steps of that on the coarse ones up to a recorded state.

    factorizations: of the finer motion, and of the equilibrium that it starts from. damping_rate: 1/s, the damping of
    vertices over their mass.
    """

    scene: Scene
    finer: tuple[FinerMesh, ...]
    fine: StoredMotion
    factorizations: int
    damping_rate: float
    _motion: Trajectory
    _index: int

    @property
    def positions(self) -> np.ndarray:
        """The positions at the vertices of the coarse meshes at the end, (n_v of the coarse meshes, 3) m."""
        return at_coarse_vertices(self.scene, self.finer, self.fine.end)

    def stages(self, by_end: np.ndarray) -> tuple[Iterator[Stage], int]:
        """Return the stages of the finer motion, as StoredMotion does, from the derivative at coarse vertices."""
        return self.fine.stages(at_all_vertices(self.scene, self.finer, by_end))

    def coarse(self) -> StoredMotion:
        """Return the coarse motion, simulated once more to store the states of its stages."""
        given: MotionConditions = self._motion._conditions
        return _repeated(
            self._motion,
            self._index,
            given.inputs,
            start=given.start,
            damping=given.damping,
            velocities=given.velocities,
            fine_faces_of=self._motion._values,
        )


def check_motion(motion: Trajectory, index: int) -> None:
    """Raise ValueError for a motion whose discretization error cannot be estimated, with the reason."""
    given: MotionConditions | None = motion._conditions
    if given is None:
        raise ValueError(
            "the motion comes from a file, a copy or another process, and its loads in time are not kept there: give the "
            "result of ms.simulate itself"
        )
    if given.varying:
        raise ValueError(
            f"values of objects that change in time cannot go over to a finer mesh yet: {', '.join(given.varying)}"
        )
    if isinstance(given.start, str):
        raise ValueError(
            f"the motion starts from a {given.start}, which has no shape on a finer mesh: start from the rest shape or from "
            "an Equilibrium"
        )
    if isinstance(motion.integrator, ProjectiveDynamics):
        raise ValueError(
            "errors of motions by ProjectiveDynamics are not estimated: choose another integrator"
        )
    done = given.grid_ends[index * given.record_every]
    if any(step < done for step in (*motion.substeps, *motion.fallback_steps)):
        raise ValueError(
            "the motion took steps in parts, which a finer mesh takes in other ones: simulate it with shorter steps"
        )


def finer_motion(motion: Trajectory, index: int, finer: tuple[FinerMesh, ...]) -> FinerMotion:
    """Simulate a motion on finer meshes up to a recorded state, in the same steps from the same start.

    Raises ValueError for objects that a finer mesh cannot take over; NotConverged if a step fails there.
    """
    given: MotionConditions = motion._conditions
    scene = finer_scene(motion.scene, motion._values, _by_body(motion.scene, finer))
    rate = _damping_rate(given, motion)
    start, spent = _start(given, scene, finer)
    uniform = np.zeros(3) if scene.has_uniform_field else None
    fine = _repeated(
        motion,
        index,
        Inputs(scene, None, uniform, moving=True),
        start=start,
        damping=rate * scene._values.vertex_masses,
        velocities=_velocities(given, motion.scene, finer),
    )
    return FinerMotion(scene, finer, fine, spent + fine.found.factorizations, rate, motion, index)


def _repeated(
    motion: Trajectory,
    index: int,
    inputs: Inputs,
    *,
    start: Any,
    damping: np.ndarray,
    velocities: np.ndarray | None,
    fine_faces_of: Any = None,
) -> StoredMotion:
    """Return a motion in the steps and under the loads of another one, up to a recorded state of that."""
    given: MotionConditions = motion._conditions
    intervals = index * given.record_every
    arguments: dict[str, Any] = {
        **dict.fromkeys(SOLVE_KEYWORDS),
        **given.keywords(intervals),
        "time_step": motion.time_steps[: int(given.grid_ends[intervals])],
        "damping": damping,
        "velocities": velocities,
    }
    asked = MotionInputs(
        inputs,
        arguments,
        steps=intervals,
        record_every=intervals,
        adjoint_storage=AdjointStorage(),
        start=start,
        integrator=motion.integrator,
        solver=given.solver,
        fine_faces_of=fine_faces_of,
    )
    if asked.interrupted:
        raise Interrupted("interrupted before there was an estimate")
    model = asked.inputs.scene._model
    with asked.inputs.in_core():
        found = _core.simulate(model, asked.core, True, asked.memory_budget, asked.keep, None)
    if found.outcome == _core.Outcome.interrupted:
        raise Interrupted("interrupted before there was an estimate")
    if found.outcome != _core.Outcome.converged:
        raise NotConverged(
            f"the motion on the finer mesh failed in step {found.steps_done} of {len(motion.time_steps)}: {found.reason}",
            None,
        )
    if found.substeps:
        raise NotConverged(
            "the finer mesh took steps in parts, so that the outputs differ by more than the meshes: simulate the motion "
            "with shorter steps",
            None,
        )
    return StoredMotion(asked, found)


def _by_body(scene: Scene, finer: tuple[FinerMesh, ...]) -> dict[int, FinerMesh]:
    return {id(body): each for body, each in zip(scene.bodies, finer, strict=True)}


def _start(
    given: MotionConditions, scene: Scene, finer: tuple[FinerMesh, ...]
) -> tuple[MotionState | None, int]:
    """Return the start on finer meshes, None for the rest shape, and the factorizations that it took.

    A motion from an equilibrium starts from that on the finer meshes.
    """
    before = given.start
    if before is None:
        return None, 0
    there = finer_scene(before.scene, before._values, _by_body(before.scene, finer))
    found = equilibrium_on(before, there, finer)
    state = MotionState(0.0, found._state, np.zeros(scene._model.size), found._angle_branches)
    return state, found.factorizations


def _velocities(given: MotionConditions, scene: Scene, finer: tuple[FinerMesh, ...]) -> np.ndarray | None:
    """Return the velocities at the start, interpolated within the coarse elements, or None."""
    if given.velocities is None:
        return None
    parts = zip(scene._bodies.spans, finer, strict=True)
    return np.concatenate([each.interpolation @ given.velocities[span.vertices] for span, each in parts])


def _damping_rate(given: MotionConditions, motion: Trajectory) -> float:
    """Return the damping of the vertices over their masses, 1/s. Raises ValueError if that differs between vertices."""
    rate = given.damping / motion._values.vertex_masses
    if np.ptp(rate) > _EVEN * rate.max():
        raise ValueError(
            "damping [N s/m] of vertices cannot go over to a finer mesh unless it is in proportion to their masses: give "
            "damping=rate * body.vertex_masses with one rate [1/s], or stiffness_damping"
        )
    return float(rate.mean())
