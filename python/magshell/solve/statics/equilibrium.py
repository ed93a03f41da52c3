"""The result of ms.equilibrium: the state of a scene at rest, the cost of finding it, and the ways not taken."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached, plain_arrays
from ..._input.without_gradient import without_gradient
from ..._runtime.frozen import FixedDict, immutable
from ..._runtime.mixins import SaveMixin
from ...model.contact.body_contact import BodyContact
from ...model.contact.contact import Contact
from ...model.results.crossings import describe_crossings
from ...model.results.result_lookup import OfOneBody, displacements_of, result_of
from ...model.results.solid_result import describe_strains
from ...model.scene.contact_state import ContactState, compute_contact_state
from ...model.scene.reactions import Reaction, reaction_in
from ...model.scene.scene import Scene
from ...model.scene.values import Values
from ...model.shells.strains import Largest, strains_of
from ...model.supports.displacement_ties import Periodic
from ...model.supports.supports import Clamp, Pin, SymmetryPlane
from .magnetic_state import MagneticState
from .solve_log import SolveLog, SolveStep

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers
    from ...model.fields.field import AppliedField
    from ...model.rigid.rigid import RigidBody
    from ...model.shells.shell import Shell
    from ...model.solids.solid import Solid


# For messages: the energies of a result have no gradients, and these functions have.
INSTEAD_OF_ENERGIES = (
    "ms.energy and ms.energies have one, at positions and edge_rotations with the values of the solve"
)


@immutable
@dataclass(frozen=True, repr=False)
class Equilibrium(SaveMixin, OfOneBody):
    """A scene at rest. Arrays have the rows of all bodies one after another; `equilibrium[body]` has those of one body.

    positions: (n_v, 3) m; edge_rotations: (n_e,) rad, zero where an edge has none.
    remanent_magnetization: (n_f, 3) A/m, or None; applied_flux_density: (3,) T, the uniform part.
    stable: whether no direction lowers the energy. n_negative_eigenvalues: the number of directions that do. Under forces
        without potential: the number of growing motions if the scene moved against friction; it may still flutter.
    residual: relative to the forces that cancel in it, and to their round-off. at_roundoff: whether round-off ended the
        solve above the solver's tolerance, which happens for very thin sheets and long chains.
    saddles_escaped: the number of unstable states that the solve left along their lowest modes. symmetric_saddles: the
        number of those where the energy falls equally on both sides, within 1e-6 of its decrease. The solve then took the
        side on which the largest displacement of the mode is positive; `branches` has starts for the other side.
    load_fraction: the share of the change of the load parameters that was reached, 1 unless a solve failed.
    wall_time, linear_time: s, of the whole solve, and of factorizations and back-substitutions. memory: bytes, of the core.

    Where an input was a tensor that requires a gradient, energies, strains, stresses and forces are in torch's graph too,
    and raise NoGradient if they are differentiated. Copies, pickles and files hold arrays in place of all tensors.
    """

    scene: Scene
    positions: Any
    edge_rotations: Any
    remanent_magnetization: Any
    applied_flux_density: Any
    _energies: dict[str, float] = field(repr=False)
    stable: bool
    n_negative_eigenvalues: int
    iterations: int
    factorizations: int
    failed_factorizations: int
    load_steps: int
    relaxation_steps: int
    saddles_escaped: int
    symmetric_saddles: int
    residual: float
    at_roundoff: bool
    load_fraction: float
    _largest_membrane_strain: float = field(repr=False)
    _largest_bending_strain: float = field(repr=False)
    wall_time: float
    linear_time: float
    memory: int
    factorization: str
    _state: np.ndarray = field(repr=False)
    _angle_branches: list[Any] = field(repr=False)
    _load_parameters: Any = field(repr=False)
    _values: Any = field(repr=False)
    _own_points: Any = field(repr=False, default=None)  # (10 a rigid part, 3)
    _driving: Any = field(repr=False, default=None)  # (m,) N m or N, of motors in joints, in the core's order
    _steps: tuple[tuple[Any, ...], ...] = field(repr=False, default=())  # as in SolveStep
    _branches: tuple[tuple[Any, ...], ...] = field(
        repr=False, default=()
    )  # saddle and state in the core, cause
    _inputs: Any = field(repr=False, default=None)  # the Inputs, if tensors are among them
    _rest: Any = field(repr=False, default=None)  # (n_v, 3) m, the rest positions, if a tensor was given

    def __copy__(self) -> Equilibrium:
        return self  # immutable

    def __getstate__(self) -> dict[Any, Any]:
        """Return the data of a copy, another process or a file: tensors as arrays, without their gradients."""
        return {**plain_arrays(vars(self)), "_values": self._values.to_state(), "_inputs": None}

    def __setstate__(self, state: dict[Any, Any]) -> None:
        values = Values.from_state(state["scene"], state["_values"])
        SaveMixin.__setstate__(self, {**state, "_values": values})

    def __getitem__(self, body: Any) -> Any:
        """Return the results of one object of the scene, such as a body or a joint."""
        return result_of(self, body)

    @property
    def displacements(self) -> Computed:
        """The displacements from the rest shape, (n_v, 3) m."""
        return displacements_of(self)

    def _values_at(self, index: int):
        return self._values

    def _tensors_at(self, index: int) -> dict[tuple[Any, str], Any]:
        """Return the tensors with a gradient that the solve was given, {(object or None, name): tensor}."""
        if self._inputs is None or not self._inputs.leaves:
            return {}
        from ..adjoint.given import given_tensors

        return given_tensors(self._inputs.leaves)

    @property
    def _load_factors(self) -> np.ndarray:
        """The load factor of the only state, ()."""
        return self.scene._load_parameter_layout.of(self._load_parameters, "scene", "load_factor")[0]

    def _state_at(self, index: int) -> np.ndarray:
        return self._state

    @property
    def energies(self) -> Computed:
        """The potential energies of the terms, {name: J}."""
        energies = FixedDict(self._energies)
        return without_gradient(energies, self.positions, "result.energies[name]", INSTEAD_OF_ENERGIES)

    @property
    def energy(self) -> Computed:
        """The potential energy, all terms together, J."""
        return without_gradient(self._energy, self.positions, "result.energy", INSTEAD_OF_ENERGIES)

    @property
    def _energy(self) -> float:
        return sum(self._energies.values())

    @property
    def largest_membrane_strain(self) -> Computed:
        """The largest magnitude of the membrane strains in `strains`.

        Beyond 0.2 the material law is not valid, and ms.LargeStrainWarning warns.
        """
        largest = self._largest_membrane_strain
        return without_gradient(largest, self.positions, "result.largest_membrane_strain")

    @property
    def largest_bending_strain(self) -> Computed:
        """The largest magnitude of the bending strains in `strains`; valid up to 0.2 as well."""
        largest = self._largest_bending_strain
        return without_gradient(largest, self.positions, "result.largest_bending_strain")

    @property
    def _largest_strains(self) -> Largest:
        return Largest(self._largest_membrane_strain, self._largest_bending_strain)

    @property
    def log(self) -> SolveLog:
        """The steps of the solve and what each of them cost, as SolveLog: `print(result.log)` shows a table."""
        return SolveLog(tuple(SolveStep(*step) for step in self._steps))

    @property
    def branches(self) -> tuple[Branch, ...]:
        """The ways out of unstable states that round-off decided against, each with a start for the equilibrium there.

        Empty if nothing was decided by round-off where the solve left an unstable state. A load step that goes past a
        bifurcation without coming to rest at it is not told.
        """
        n_v, points = self.scene.mesh.n_vertices, self.scene._model.points
        with self._values.in_core():
            return tuple(
                Branch(points(saddle)[:n_v], points(state)[:n_v], cause)
                for saddle, state, cause in self._branches
            )

    def strains(self) -> Any:
        """Return the principal strains of all faces of the shells, as Strains; with one solid alone, those of result[solid].

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
        >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
        >>> ends = [ms.Pin(mesh.vertices_at(x=0.0)), ms.Pin(mesh.vertices_at(x=0.1), displacement=(0.01, 0, 0))]
        >>> rest = ms.equilibrium(ms.Scene(sheet, supports=ends))
        >>> rest.strains().membrane[0].round(3)  # (1.1^2 - 1)/2 along, nothing across
        array([0.105, 0.   ])
        """
        return without_gradient(self._strains(), self.positions, "result.strains()")

    def _strains(self, index: int = -1) -> Any:
        if (solid := self._one_solid()) is not None:
            return solid._states()
        with self._values.growth_in_core():
            return strains_of(self.scene, self._state, self._values.all_shells.thickness)

    def contact_state(self, contact: BodyContact | Contact) -> ContactState:
        """Return the active pairs of a contact and their forces."""
        return without_gradient(self._contact_state(contact), self.positions, "result.contact_state(contact)")

    def _contact_state(self, contact: BodyContact | Contact, index: int = -1) -> ContactState:
        return compute_contact_state(self.scene, self._values, contact, self._state)

    def reaction(self, support: Pin | Clamp | SymmetryPlane | Periodic) -> Reaction:
        """Return the forces of a support on the scene.

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
        >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
        >>> clamp = ms.Clamp(mesh.edges_at(x=0.0))
        >>> rest = ms.equilibrium(ms.Scene(sheet, supports=[clamp], gravity=(0, 0, -9.81)))
        >>> round(float(rest.reaction(clamp).force[2]), 5)  # the weight of 2 g
        0.01962
        """
        return without_gradient(self._reaction(support), self.positions, "result.reaction(support)")

    def _reaction(self, support: Pin | Clamp | SymmetryPlane | Periodic, index: int = -1) -> Reaction:
        with self._values.in_core():
            held = self.scene._model.held_forces(self._state, self._angle_branches, self._load_parameters)
        return reaction_in(self.scene, support, self._state, held.reshape(-1, 3))

    def magnetic_force(self, body: Shell | Solid | RigidBody | AppliedField) -> Computed:
        """Return the magnetic force on a body or on a magnet, (3,) N, as ms.field_of(result).magnetic_force does."""
        return MagneticState(self).magnetic_force(body)

    def magnetic_torque(
        self, body: Shell | Solid | RigidBody | AppliedField, center: Numbers | None = None
    ) -> Computed:
        """Return the torque of these forces about `center` (3,) m, by default that of the body, (3,) N m."""
        return MagneticState(self).magnetic_torque(body, center)

    def self_intersections(self) -> np.ndarray:
        """Return the pairs of faces that intersect, (k, 2), as TriangleMesh.self_intersections does."""
        return self.scene.mesh.self_intersections(detached(self.positions))

    def __repr__(self) -> str:
        moved = float(np.linalg.norm(np.asarray(detached(self.displacements)), axis=1).max(initial=0.0))
        kind = "stable" if self.stable else f"unstable in {self.n_negative_eigenvalues} directions"
        if not self.stable and self.n_negative_eigenvalues == 0:
            kind = "not known to be stable"
        if self.load_fraction < 1.0:
            kind += f", {self.load_fraction:.1%} of the way"
        energies = ", ".join(f"{name} {value:.4g}" for name, value in self._energies.items())
        crossings = describe_crossings(self.scene, np.asarray(detached(self.positions))[None])
        extra = f", {self.saddles_escaped} saddles left" if self.saddles_escaped else ""
        tie = (
            "\n  round-off decided how an unstable state was left: result.branches has starts for the other ways, "
            "and ms.find_equilibria finds the other equilibria"
            if self._branches
            else ""
        )
        extra += f", {self.relaxation_steps} relaxation steps" if self.relaxation_steps else ""
        ended = " at round-off" if self.at_roundoff else ""
        return (
            f"Equilibrium: {kind}; largest displacement {moved:.4g} m\n"
            f"  {describe_strains(self, self._largest_strains)}\n"
            f"  {crossings}\n"
            f"  energy {self._energy:.6g} J ({energies})\n"
            f"  {self.iterations} iterations, {self.factorizations} factorizations, {self.load_steps} load steps{extra}\n"
            f"  {self.log.summary() or 'no step was necessary'}\n"
            f"  residual {self.residual:.1e}{ended}, {self.wall_time:.3g} s, {self.memory / 1e6:.3g} MB, "
            f"{self.factorization}{tie}"
        )


@immutable
@dataclass(frozen=True, repr=False)
class Branch:
    """A way out of an unstable equilibrium that a solve did not take, though only round-off decided against it.

    saddle: (n_v, 3) m, the unstable equilibrium. positions: (n_v, 3) m, a state of lower energy on this way: as `start=` of
        ms.equilibrium it leads to the equilibrium on this side.
    cause: "other side" if the energy falls equally on both sides of the mode along which the solve left, within 1e-6 of its
        decrease. "other mode" if a second mode is as unstable, its eigenvalue the same within 1e-3; it may be left on both
        sides.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.04, 0.01, cells=(12, 3))
    >>> sheet = ms.Shell(mesh, thickness=1e-4, young_modulus=1e6)
    >>> pushed = ms.Clamp(mesh.edges_at(x=0.04), displacement=(-1e-5, 0, 0))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0)), pushed])
    >>> up = ms.equilibrium(scene)  # the strip buckles to either side
    >>> branch = up.branches[0]
    >>> branch
    Branch: other side, of a mode that moves vertex 6 most
    >>> down = ms.equilibrium(scene, start=branch.positions)
    >>> bool(abs(up.positions - down.positions * (1, 1, -1)).max() < 1e-8)  # m
    True
    """

    saddle: np.ndarray
    positions: np.ndarray
    cause: str

    @property
    def mode(self) -> np.ndarray:
        """The displacement from the saddle along this way, (n_v, 3), its largest component 1 or -1."""
        moved = self.positions - self.saddle
        return moved / np.abs(moved).max()

    def __repr__(self) -> str:
        most = int(np.argmax(np.linalg.norm(self.positions - self.saddle, axis=1)))
        return f"Branch: {self.cause}, of a mode that moves vertex {most} most"
