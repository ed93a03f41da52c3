"""The results of a motion: its recorded states, and the last one in full."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._input.quantity import quantity
from ..._input.tensors import detached, plain_arrays
from ..._input.without_gradient import without_gradient
from ..._runtime.files import replace_file
from ..._runtime.frozen import FixedDict, immutable, remember
from ..._runtime.mixins import AnimateMixin
from ..._runtime.npz import open_npz
from ...model.contact.attached_obstacles import positioned
from ...model.contact.body_contact import BodyContact
from ...model.contact.contact import Contact
from ...model.contact.contacts_to_core import near_kinks
from ...model.results.crossings import describe_crossings
from ...model.results.result_lookup import OfOneBody, displacements_of, result_of
from ...model.results.solid_result import describe_strains
from ...model.scene.contact_state import ContactState, compute_contact_state
from ...model.scene.nonsmooth_contacts import near_body_kinks
from ...model.scene.reactions import Reaction, reaction_in
from ...model.scene.scene import Scene
from ...model.scene.values import Values
from ...model.shells.strains import StrainHistory, strains_of
from ...model.supports.displacement_ties import Periodic
from ...model.supports.supports import Clamp, Pin, SymmetryPlane
from ..options import Clock, Integrator, clock_of
from .balance import MotionBalance, balance_of_motion, describe_energy
from .obstacle_paths import ObstaclePath, ReadPath
from .step_errors import describe_steps

if TYPE_CHECKING:
    from ..._input.kinds import Computed


@immutable
@dataclass(frozen=True)
class MotionState:
    """The full state of a motion at one time, from which ms.simulate(..., start=...) continues it.

    Continued in steps of the same length, the motion has the same bits as one in a single piece.

    time: s, since the start of the motion; clock: the same time counted in steps. rotations_known: False where the edge
    rotations are still to be computed.
    state, velocity, acceleration: of all degrees of freedom in the core's order, (n,). angle_branches: the full turns of
    dihedral and joint angles. strain_rates: of faces. maxwell_strains, maxwell_strain_rates: the same for each Maxwell
    branch, one after another.
    Arrays that the motion did not need are empty: accelerations and strain rates are those of TRBDF2, Maxwell strains those
    of Maxwell branches. contact_acceleration: the share of contact and friction, which `acceleration` does not contain; only
    with TRBDF2(implicit_contact=True). momentum_rate: N, of the added mass of water; only with TRBDF2 in water.
    fine_faces: 1 for each magnetized face that evaluates the applied field at several points, else 0; if it is empty, the
    next motion chooses these faces.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> first = ms.simulate(scene, steps=2, time_step=1e-3)
    >>> ms.simulate(scene, steps=2, time_step=1e-3, start=first.end).times.round(6)
    array([0.002, 0.003, 0.004])
    """

    time: float
    state: np.ndarray = field(repr=False)
    velocity: np.ndarray = field(repr=False)
    angle_branches: Sequence[Any] = field(repr=False, default=())
    acceleration: np.ndarray = field(repr=False, default_factory=lambda: np.zeros(0))
    strain_rates: np.ndarray = field(repr=False, default_factory=lambda: np.zeros(0))
    maxwell_strains: np.ndarray = field(repr=False, default_factory=lambda: np.zeros(0))
    maxwell_strain_rates: np.ndarray = field(repr=False, default_factory=lambda: np.zeros(0))
    clock: Clock | None = field(repr=False, default=None)
    rotations_known: bool = field(repr=False, default=True)
    contact_acceleration: np.ndarray = field(repr=False, default_factory=lambda: np.zeros(0))
    fine_faces: np.ndarray = field(repr=False, default_factory=lambda: np.zeros(0))
    momentum_rate: np.ndarray = field(repr=False, default_factory=lambda: np.zeros(0))

    def save(self, path: str | Path) -> None:
        """Write the state to an .npz file."""
        lengths = np.array([len(each) for each in self.angle_branches], dtype=np.int64)
        remembered = np.concatenate([np.zeros(0), *(np.asarray(each) for each in self.angle_branches)])
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        arrays |= {
            "time": self.time,
            "clock": astuple(clock_of(self)),
            "rotations_known": self.rotations_known,
            "angle_branches": remembered,
            "branch_lengths": lengths,
        }
        replace_file(path, lambda file: np.savez(file, **arrays))

    @classmethod
    def load(cls, path: str | Path) -> MotionState:
        """Read a file that `save` wrote. Raises ValueError if it is something else."""
        try:
            with open_npz(Path(path)) as file:
                time = float(quantity("time", "s", file["time"], ()))
                origin, time_step, steps = quantity("clock", "SI", file["clock"], (3,)).tolist()
                remembered = quantity("angle_branches", "SI", file["angle_branches"], ("n",))
                lengths = index_array("branch_lengths", file["branch_lengths"])
                known = bool(file["rotations_known"])
                # Files of earlier versions have no contact_acceleration, fine_faces and momentum_rate.
                arrays = {name: file[name] for name in _ARRAYS if name in file or name in _REQUIRED}
            clock = Clock(origin, time_step, int(steps))
            parts = np.split(remembered, np.cumsum(lengths)[:-1]) if len(lengths) else []
        except (KeyError, ValueError, TypeError, EOFError) as error:
            raise ValueError(f"{path} is not a saved MotionState: {error}") from error
        return cls(
            time,
            angle_branches=[part.tolist() for part in parts],
            clock=clock,
            rotations_known=known,
            **arrays,
        )


_REQUIRED = ("state", "velocity", "acceleration", "strain_rates", "maxwell_strains", "maxwell_strain_rates")
_ARRAYS = (*_REQUIRED, "contact_acceleration", "fine_faces", "momentum_rate")


@immutable
@dataclass(frozen=True, repr=False)
class Trajectory(AnimateMixin, OfOneBody):
    """The recorded motion of a scene.

    Arrays have the rows of all bodies one after another; `trajectory[body]` has those of one body.

    times: (n,) s, of the recorded states, including the start. positions: (n, n_v, 3) m; velocities: (n, n_v, 3) m/s;
    edge_rotations: (n, n_e) rad.
    remanent_magnetization: as given, A/m, or None; applied_flux_density: (n, 3) T, the uniform part at those times.
    steps: the number of intervals of the time grid, as given. steps_done: equal to `steps` unless the simulation stopped
        early.
    time_steps: (m,) s, the lengths of the steps done: one for each interval, or more where ms.Adaptive or the caller divided
        an interval. Passed as `time_step`, they repeat the motion.
    step_errors: (m,) m, the error of the positions that each step adds: the root mean square over vertices and points of
        rigid bodies, estimated by an embedded formula of one order more. Beyond 1 % of the extent, ms.StepErrorWarning
        warns.
    substeps: {step: number of parts into which it was divided}.
    fallback_steps: the steps that implicit Euler took, wholly or in part, because the integrator would have created
        energy in contact.
    energy_gain_steps: the steps that created energy in contact even in their shortest part; ms.StepErrorWarning warns.
    energy_watched: False if there is contact and loads have no potential (pressure, torques of joints): steps that create
        energy in contact are not found then.
    end: the last state, from which another simulation continues. bytes: memory of the data stored for gradients.

    Where an input was a tensor that requires a gradient, energies, strains, stresses and forces are in torch's graph too,
    and raise NoGradient if they are differentiated. Copies, pickles and files hold arrays in place of all tensors.
    """

    scene: Scene
    integrator: Integrator
    times: np.ndarray
    positions: Any
    velocities: Any
    edge_rotations: Any
    remanent_magnetization: Any
    applied_flux_density: np.ndarray
    _kinetic_energy: np.ndarray = field(repr=False)
    _energies: dict[str, np.ndarray] = field(repr=False)
    _largest_membrane_strain: np.ndarray = field(repr=False)
    _largest_bending_strain: np.ndarray = field(repr=False)
    steps: int
    steps_done: int
    substeps: dict[int, int]
    fallback_steps: tuple[int, ...]
    energy_gain_steps: tuple[int, ...]
    energy_watched: bool
    time_steps: np.ndarray
    step_errors: np.ndarray
    end: MotionState
    iterations: int
    factorizations: int
    adjoint_storage: str
    bytes: int
    wall_time: float
    linear_time: float
    _field_factors: np.ndarray = field(repr=False)
    _load_factors: np.ndarray = field(repr=False)
    # {(actuator, shell or field, name): (n, ...)}, the values that vary in time, in the recorded states
    _varied: dict[Any, Any] = field(repr=False)
    _step_factorizations: np.ndarray = field(repr=False)  # (m,), of each step
    _thickness: np.ndarray = field(repr=False)
    _values: Any = field(repr=False)
    _directions: np.ndarray = field(repr=False)  # (n, 3 n_d), those that clamps and symmetry planes hold
    _held_forces: np.ndarray = field(repr=False)  # (n, m, 3) N, of the constraints' held nodes
    _own_points: Any = field(repr=False, default=None)  # (n, 10 a rigid part, 3)
    _own_velocities: Any = field(repr=False, default=None)
    _driving: Any = field(repr=False, default=None)  # (n, m) N m or N, of motors in joints
    _rest: Any = field(repr=False, default=None)  # (n_v, 3) m, the rest positions, if a tensor was given
    _tensors: Any = field(
        repr=False, default=None
    )  # {(object or None, name): (tensor, whether a row is a state)}
    _keeps_energy: bool = field(repr=False, default=False)  # whether no force puts energy in or takes it out
    _conditions: Any = field(repr=False, default=None)  # MotionConditions; None in copies and files

    def __copy__(self) -> Trajectory:
        return self  # immutable

    def __getstate__(self) -> dict[Any, Any]:
        """Return the data of a copy, another process or a file: tensors as arrays without gradients, and the paths of
        obstacles at the times that the recorded states need."""
        pairs = zip(self.scene.obstacles, self._obstacles, strict=True)
        paths = {
            each: ReadPath.of(now.motion, self.times)
            for each, now in pairs
            if isinstance(now.motion, ObstaclePath | ReadPath)
        }
        values = {**self._values.to_state(), "paths": paths}
        return {**plain_arrays(vars(self)), "_values": values, "_tensors": None, "_conditions": None}

    def __setstate__(self, state: dict[Any, Any]) -> None:
        values = Values.from_state(state["scene"], state["_values"])
        for obstacle, path in state["_values"]["paths"].items():
            values.move(obstacle, path)
        AnimateMixin.__setstate__(self, {**state, "_values": values})

    def __getitem__(self, body: Any) -> Any:
        """Return the results of one object of the scene, such as a body or a joint."""
        return result_of(self, body)

    @property
    def displacements(self) -> Computed:
        """The displacements from the rest shape, (n, n_v, 3) m."""
        return displacements_of(self)

    def _values_at(self, index: int):
        """Return the values of a recorded state, with actuators, growth and field sources as they were then."""
        then: dict[Any, dict[str, Any]] = {}
        for (owner, name), rows in self._varied.items():
            then.setdefault(owner, {})[name] = rows[index]
        now = {each: self._values.current(each).replaced(**named) for each, named in then.items()}
        return self._values.with_objects(now) if now else self._values

    def _tensors_at(self, index: int) -> dict[tuple[Any, str], Any]:
        """Return the tensors with a gradient that hold in a recorded state, {(object or None, name): tensor}."""
        given = (self._tensors or {}).items()
        return {key: tensor[index] if varies else tensor for key, (tensor, varies) in given}

    @property
    def _obstacles(self) -> tuple[Any, ...]:
        """The obstacles of the scene with their motions."""
        return tuple(self._values.current(each) for each in self.scene.obstacles)

    @property
    def energy(self) -> Computed:
        """The kinetic and potential energy together, (n,) J."""
        return without_gradient(self._energy, self.positions, "result.energy")

    @property
    def _energy(self) -> np.ndarray:
        energy = self._kinetic_energy + sum(self._energies.values())
        energy.setflags(write=False)  # as the other arrays
        return energy

    @property
    def energies(self) -> Computed:
        """The potential energies of the terms, {name: (n,)} J, NaN where Ctrl-C interrupted their computation."""
        return without_gradient(FixedDict(self._energies), self.positions, "result.energies[name]")

    @property
    def kinetic_energy(self) -> Computed:
        """The kinetic energy, (n,) J."""
        return without_gradient(self._kinetic_energy, self.positions, "result.kinetic_energy")

    @property
    def largest_membrane_strain(self) -> Computed:
        """The largest magnitudes of the membrane strains that `strains` returns, (n,).

        The model is for strains below 0.2; ms.LargeStrainWarning warns beyond.
        """
        largest = self._largest_membrane_strain
        return without_gradient(largest, self.positions, "result.largest_membrane_strain")

    @property
    def largest_bending_strain(self) -> Computed:
        """The largest magnitudes of the bending strains that `strains` returns, (n,); valid up to 0.2 as well."""
        largest = self._largest_bending_strain
        return without_gradient(largest, self.positions, "result.largest_bending_strain")

    @property
    def _largest_strains(self) -> StrainHistory:
        return StrainHistory(self._largest_membrane_strain, self._largest_bending_strain)

    @property
    def nonsmooth_vertices(self) -> dict[int, np.ndarray]:
        """The vertices in contact where the motion is not differentiable, {recorded state: vertices}.

        They touch an obstacle, within the smoothing, at a sharp edge of a box or a mesh or on its medial surface. Or, for
        bodies in contact, their closest point passes an edge of the other surface that is bent by more than 0.3 rad, or
        its border. A small change may bring such a vertex to another side; gradients are those of the side on which it is.

        Computed on access, in the recorded states only. Opening, closing, sticking and sliding contacts do not count:
        the laws of contact and friction are smooth there, and `contact_state` has them.

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(0.02, 0.02, cells=(2, 2))
        >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
        >>> ridge = ms.obstacles.Box((0.1, 0.1, 0.1), rotation=(0, np.pi / 4, 0), center=(0.01, 0.01, -0.0707105))
        >>> scene = ms.Scene(sheet, contacts=[ms.Contact(ridge)], allow_rigid_motions=True)
        >>> ms.simulate(scene, steps=1, time_step=1e-3, velocities=(0, 0, -1e-4)).nonsmooth_vertices
        {0: array([3, 4, 5], dtype=int32), 1: array([3, 4, 5], dtype=int32)}
        """
        positions, now, bodies = detached(self.positions), self._values.current, self.scene._bodies
        own_points = [None] * len(self.times) if self._own_points is None else detached(self._own_points)
        found = {}
        for k, time in enumerate(self.times):
            near = [
                near_kinks(
                    now(each),
                    [positioned(self.scene, now(obstacle), own_points[k]) for obstacle in each.obstacles],
                    self._values.contact_bodies(each),
                    bodies,
                    positions[k],
                    time,
                )
                for each in self.scene._obstacle_contacts
            ]
            near += [self._near_body_kinks(contact, k) for contact in self.scene._body_contacts]
            if near and (every := np.unique(np.concatenate(near))).size:
                found[k] = every
        return found

    def _near_body_kinks(self, contact: BodyContact, index: int) -> np.ndarray:
        smoothing = self._values.current(contact).smoothing
        positions = self.scene._model.points(self._state_at(index))
        return near_body_kinks(self.scene, self._contact_state(contact, index), smoothing, positions)

    def balance(self) -> MotionBalance:
        """Return where the energy, the momentum and the angular momentum came from and went, as a MotionBalance.

        The steps of the motion are repeated for it once, which takes about as long as the motion did. ms.StepErrorWarning
        warns if the steps made or lost more than 5 % of the largest energy that moved and no other warning has said so.

        Raises ValueError for a motion that was copied, or loaded from a file: ask before, and keep the balance.
        """
        if (known := vars(self).get("_balance")) is None:
            known = balance_of_motion(self)
            remember(self, _balance=known)
        return known

    def strains(self, index: int = -1) -> Any:
        """Return the principal strains of all faces of the shells in a recorded state, by default the last, as Strains.

        In a scene of one solid, return those of trajectory[solid].
        """
        return without_gradient(self._strains(index), self.positions, "result.strains()")

    def _strains(self, index: int = -1) -> Any:
        if (solid := self._one_solid()) is not None:
            return solid._states(index)
        state = self._state_at(index)
        with self._values_at(index).growth_in_core():
            return strains_of(self.scene, state, self._thickness)

    def _state_at(self, index: int) -> np.ndarray:
        """Return the core's vector of a recorded state."""
        positions, rotations = (detached(each)[index] for each in (self.positions, self.edge_rotations))
        model = self.scene._model
        with self._values.in_core():
            state = model.state(
                np.asarray(positions, dtype=np.float64), np.asarray(rotations, dtype=np.float64)
            )
        before = 3 * self.scene._bodies.n_points
        if self._own_points is not None:  # vertices do not determine the positions of free rigid bodies
            own = np.asarray(detached(self._own_points)[index], dtype=np.float64)
            state[:before] = model.full_vector(np.concatenate([positions, own]))[:before]
        state[before : before + self._directions.shape[1]] = self._directions[index]
        return state

    def contact_state(self, contact: BodyContact | Contact, index: int = -1) -> ContactState:
        """Return the active pairs of a contact and their forces in a recorded state, by default the last."""
        found = self._contact_state(contact, index)
        return without_gradient(found, self.positions, "result.contact_state(contact)")

    def _contact_state(self, contact: BodyContact | Contact, index: int = -1) -> ContactState:
        own = () if self._own_velocities is None else (self._own_velocities,)
        velocities = np.concatenate(
            [np.asarray(detached(each)[index], dtype=np.float64) for each in (self.velocities, *own)]
        )
        state, time = self._state_at(index), float(self.times[index])
        return compute_contact_state(self.scene, self._values, contact, state, velocities, time)

    def reaction(self, support: Pin | Clamp | SymmetryPlane | Periodic, index: int = -1) -> Reaction:
        """Return the forces of a support on the scene in a recorded state, by default the last.

        They include inertia and damping and are those at the end of the step that led there; NaN at the start.
        """
        return without_gradient(self._reaction(support, index), self.positions, "result.reaction(support)")

    def _reaction(self, support: Pin | Clamp | SymmetryPlane | Periodic, index: int = -1) -> Reaction:
        return reaction_in(self.scene, support, self._state_at(index), self._held_forces[index])

    def self_intersections(self, index: int = -1) -> np.ndarray:
        """Return the pairs of faces that intersect in a recorded state, (k, 2), as TriangleMesh.self_intersections does."""
        return self.scene.mesh.self_intersections(detached(self.positions)[index])

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        stopped = "" if self.steps_done == self.steps else f" of {self.steps}"
        halved = f", {len(self.substeps)} of them in parts" if self.substeps else ""
        halved += f", {len(self.fallback_steps)} by implicit Euler" if self.fallback_steps else ""
        gains = self.energy_gain_steps
        halved += f", {len(gains)} gained energy in contact" if gains else ""
        watched = (
            ""
            if self.energy_watched
            else "  gains of energy in contact were not watched for, because of follower loads\n"
        )
        crossings = describe_crossings(self.scene, detached(self.positions))
        taken = len(self.time_steps)
        a_step = 1e3 * self.wall_time / max(taken, 1)
        method = repr(self.integrator).removesuffix("()")
        if taken > self.steps:
            halved = f" in {taken}{halved}"
        return (
            f"Trajectory: {self.steps_done}{stopped} steps{halved}, {self.times[-1]:.4g} s, {len(self)} states, "
            f"{method}\n"
            f"  {describe_steps(self)}\n"
            f"  {describe_energy(self)}\n"
            f"  {describe_strains(self, self._largest_strains)}\n"
            f"  {crossings}\n"
            f"{watched}"
            f"  {self.iterations} iterations, {self.factorizations} factorizations\n"
            f"  {self.wall_time:.3g} s, {a_step:.3g} ms a step; for gradients: {self.adjoint_storage}, "
            f"{self.bytes / 1e6:.3g} MB"
        )
