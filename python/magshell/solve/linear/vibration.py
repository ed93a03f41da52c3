"""Small vibrations about an equilibrium: ms.vibration_modes."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ... import _core
from ..._input.tensors import detached, dtype_like, is_tensor, like
from ..._runtime.frozen import immutable
from ..._runtime.solver_entry_point import solve_entry
from ...errors import NotConverged
from ...model.scene.replacements import requested
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ...model.scene.values import Values
from ...model.shells.shell import Shell
from ...model.solids.solid import Solid
from ...model.supports.displacement_ties import DisplacementTie
from ..adjoint.eigenvalue import FrequencyAdjoint
from ..adjoint.residual import Residual
from ..statics.equilibrium import Equilibrium
from .base_state import idle_inputs, inputs_about, set_state
from .mode_shapes import mode_shapes
from .rest import refuse_what_acts
from .stiffness import symmetric

if TYPE_CHECKING:
    from ..._input.kinds import Computed


def consistent_masses(values: Values) -> scipy.sparse.csc_array:
    """Return the consistent mass matrix of the free degrees of freedom, (n, n) kg, zero for edge rotations.

    Raises ValueError if there are rigid bodies or ties of displacements, or if a body has no density.
    """
    scene = values.scene
    if scene.rigid_parts:
        raise ValueError(
            'mass="consistent" is for scenes without rigid parts, whose masses are lumped: mass="lumped"'
        )
    if any(isinstance(support, DisplacementTie) for support in scene.supports):
        raise ValueError(
            'mass="consistent" is for scenes without EqualDisplacement and Periodic, which couple masses: mass="lumped"'
        )
    values.vertex_masses  # noqa: B018 - says which body has no density
    of_vertices = masses_of_vertices(values)
    # Each free degree of freedom moves one vertex: along a world axis, or along an axis of the local frame of a support.
    model, n_v = scene._model, scene.mesh.n_vertices
    total = scipy.sparse.csc_array((model.free_size, model.free_size))
    for axis in range(3):
        ones, numbered = np.zeros((n_v, 3)), np.zeros((n_v, 3))
        ones[:, axis], numbered[:, axis] = 1.0, np.arange(1, n_v + 1)
        shares, products = (model.reduce(model.full_vector(rows)) for rows in (ones, numbered))
        moved = np.flatnonzero(np.abs(shares) > 1e-9)
        vertices = np.rint(products[moved] / shares[moved]).astype(int) - 1
        motions = scipy.sparse.csc_array((shares[moved], (vertices, moved)), shape=(n_v, model.free_size))
        total = total + motions.T @ of_vertices @ motions
    return scipy.sparse.csc_array(total)


def masses_of_vertices(values: Values) -> scipy.sparse.csc_array:
    """Return the masses between vertices (n_v, n_v), kg; welded vertices are the first of them. Raises ValueError where a
    body has no density."""
    scene = values.scene
    original, n_v = scene._bodies.original, scene.mesh.n_vertices
    rows, columns, numbers = [], [], []
    for span, body in zip(scene._bodies.spans, values.deformable, strict=True):
        skin = getattr(body, "skin", None)
        for nodes, masses in (body.element_masses, *(() if skin is None else (skin.element_masses,))):
            at = original[span.vertices][nodes]
            rows.append(np.broadcast_to(at[:, :, None], masses.shape).ravel())
            columns.append(np.broadcast_to(at[:, None, :], masses.shape).ravel())
            numbers.append(masses.ravel())
    joined = (np.concatenate(each) for each in (rows, columns))
    return scipy.sparse.csc_array(
        scipy.sparse.coo_array((np.concatenate(numbers), tuple(joined)), shape=(n_v, n_v))
    )


def nonzeros_in_pattern(matrix: scipy.sparse.csc_array, starts: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the entries of a symmetric matrix (n, n) at the nonzeros of a lower triangle that is given by columns."""
    columns = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    lower = scipy.sparse.coo_array(matrix)
    size = matrix.shape[0]
    keys = lower.col.astype(np.int64) * size + lower.row
    order = np.argsort(keys)
    wanted = columns.astype(np.int64) * size + rows
    found = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    hit = keys[order][found] == wanted
    return np.where(hit, lower.data[order][found], 0.0)


_ROUND_OFF_SHARE = (
    64.0 * np.finfo(float).eps
)  # of the fastest vibration's square: below, a square is round-off
MASSES = ("lumped", "consistent")
_SHIFT_GROWTH = 8.0
_ATTEMPTS = 3  # each searches a larger space
_TOLD_APART = (
    1e-6  # squares that differ by less, relative to their distance from the shift, are not told apart
)


@immutable
@dataclass(frozen=True, repr=False)
class VibrationModes:
    """The slowest small vibrations of a scene about an equilibrium, with their frequencies and shapes.

    squares: (k,) 1/s2, ascending: of the angular frequencies. Zero for a motion that nothing resists, negative for one
        that grows: the equilibrium is not stable. A tensor if the equilibrium or a value has tensors.
    modes: (k, n_v, 3), displacements of the vertices, the largest component 1.
    edge_rotations: (k, n_e), rad, that go with them.
    unstable: the number of modes that grow, which may exceed k.
    """

    scene: Scene
    squares: Any
    modes: np.ndarray = field(repr=False)
    edge_rotations: np.ndarray = field(repr=False)
    unstable: int
    factorizations: int
    wall_time: float

    @property
    def frequencies(self) -> Computed:
        """The frequencies, (k,) Hz; NaN for a mode that grows instead of vibrating."""
        if is_tensor(self.squares):
            nothing = self.squares.new_full((), np.nan)
            return self.squares.where(self.squares >= 0.0, nothing).sqrt() / (2.0 * np.pi)
        vibrating = np.where(self.squares < 0.0, np.nan, self.squares)
        return np.sqrt(vibrating) / (2.0 * np.pi)

    @property
    def growth_rates(self) -> np.ndarray:
        """The rates r of the modes that grow as exp(r t), (k,) 1/s; zero for those that vibrate."""
        return np.sqrt(np.maximum(-detached(self.squares), 0.0))

    def __repr__(self) -> str:
        frequencies = ", ".join(f"{each:.5g}" for each in detached(self.frequencies)[self.unstable :])
        text = f"VibrationModes: {frequencies} Hz; {self.wall_time:.3g} s"
        if self.unstable:
            rates = ", ".join(f"{each:.4g}" for each in self.growth_rates[: self.unstable])
            text += f"\n  unstable: {self.unstable} mode(s) grow, at rates of {rates} 1/s"
        return text


@solve_entry
def vibration_modes(
    scene: Scene,
    equilibrium: Equilibrium | None = None,
    *,
    values: dict[Any, Any] | None = None,
    count: int = 6,
    mass: str = "lumped",
) -> VibrationModes:
    """Compute the slowest small vibrations of a scene about an equilibrium, loaded, magnetised or buckled.

        K x = w^2 M x

    with K the Hessian there, M the masses and the edge rotations without mass; what supports hold stands still. Damping
    does not count.

    equilibrium: of this scene, with the load parameters and values it was found for; one that is not stable has modes that
        grow. By default the rest shape without loads and fields.
    values: as in ms.equilibrium, where there is no equilibrium, which has its own.
    count: how many modes.
    mass: "lumped" to the vertices, as motions have it: frequencies are off by the square of the size of the elements, 3 %
        for a cube of 6 quadratic cells a side; or "consistent" with the elements' shapes: 1 % of it with 4, and from above.

    Squares and frequencies are differentiable, by perturbation of first order: by `values` that are tensors, and by the
    inputs of an equilibrium that was found with tensors, with the change of the equilibrium itself. A gradient costs one
    factorization and some thirty evaluations of the stiffness for each frequency asked for. Frequencies that equal the next
    one to 1e-6 have none, as their modes mix; nor those of consistent masses, of rigid bodies, and under pressures without
    potential: NoGradient says so. Modes are arrays.

    Raises ValueError on bad input, NotConverged where the search for the modes does not come to its end, Interrupted.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.01, cells=(20, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    >>> modes = ms.vibration_modes(scene, count=2)
    >>> modes.frequencies.round(1)  # 3.516 and 22.03 sqrt(E h^2 / 12 rho) / (2 pi L^2)
    array([0.5, 3.2])
    """
    inputs = _inputs(scene, equilibrium, values)
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
        raise ValueError(f"count must be an integer of at least 1, got {count!r}")
    if not isinstance(mass, str) or mass not in MASSES:
        raise ValueError(f"mass must be one of {MASSES}, got {mass!r:.60}")
    began = time.perf_counter()
    model = scene._model
    consistent = consistent_masses(inputs.values) if mass == "consistent" else None
    masses = model.free_weights(inputs.values.masses) if consistent is None else consistent.diagonal()
    if count >= np.count_nonzero(masses):
        raise ValueError(
            f"count must be below the {np.count_nonzero(masses)} degrees of freedom with mass, got {count}"
        )
    with inputs.in_core():
        if equilibrium is None:
            refuse_what_acts(inputs)
            stiffness = model.hessian(model.rest_state(), scene._load_parameter_layout.zeros())
        else:
            set_state(equilibrium)
            stiffness = model.hessian(equilibrium._state, equilibrium._load_parameters)
        low_rank = model.low_rank()
        inertia = None
        if scene.rigid_parts:
            masses = model.free_weights(inputs.values.masses)  # as the parts are turned there
            inertia = model.free_weight_values(inputs.values.masses)
    slow = min(map(_slow_square, inputs.values.deformable), default=1.0)
    if consistent is not None:
        inertia = nonzeros_in_pattern(consistent, *stiffness[1:3])
    pencil = _Pencil(stiffness, low_rank, model.free_points, masses, slow, inertia, consistent)
    next_too = bool(inputs.leaves) and count + 1 < np.count_nonzero(masses)  # whether the last one is simple
    squares, vectors = pencil.lowest(int(count) + next_too)
    modes, edge_rotations = mode_shapes(model, vectors[:, : int(count)])
    return VibrationModes(
        scene=scene,
        squares=_differentiable(
            inputs, equilibrium, squares, vectors, masses, next_too, consistent is not None
        ),
        modes=modes,
        edge_rotations=edge_rotations,
        unstable=pencil.growing(),
        factorizations=pencil.factorizations,
        wall_time=time.perf_counter() - began,
    )


def _differentiable(
    inputs: Inputs,
    equilibrium: Equilibrium | None,
    squares: np.ndarray,
    vectors: np.ndarray,
    masses: np.ndarray,
    next_too: bool,
    consistent: bool,
) -> Any:
    """Return the squares as a tensor that is connected to the inputs, if some of these require a gradient.

    next_too: the last square only tells whether the one before is simple, and is left out.
    """
    kept = squares[: len(squares) - next_too]
    if not inputs.leaves:
        return like(kept, *inputs.given)
    from ..adjoint.autograd import solved

    model, layout = inputs.scene._model, inputs.scene._load_parameter_layout
    normed = vectors / np.sqrt((masses[:, None] * vectors**2).sum(axis=0))
    at = (model.rest_state(), [], layout.zeros())
    if equilibrium is not None:
        at = (equilibrium._state, equilibrium._angle_branches, equilibrium._load_parameters)
    adjoint = FrequencyAdjoint(
        Residual(inputs, *at),
        squares,
        np.stack([model.expand(each) for each in normed.T], axis=1),
        complete=not next_too,
        at_rest=equilibrium is None,
        consistent=consistent,
    )
    return solved(adjoint, (kept.copy(),), dtype_like(*inputs.given), inputs.tensors)[0]


class _Pencil:
    """K and M, and a factorization of K - shift M with the shift below every square of a frequency.

    stiffness: (n, column starts, rows, nonzeros), the lower triangle of K. low_rank: columns (n, k) and their stiffnesses,
    the rest of K. points: (n, 3) m, where the degrees of freedom are.
    masses: (n,), the diagonal of M, zero for edge rotations. inertia: M at the nonzeros of K, if it is not diagonal.
    consistent: M (n, n), if it is the consistent matrix, of which no root is computed.
    slow_square: 1/s2, estimate of the lowest square of a sheet that is held.
    """

    def __init__(
        self,
        stiffness: tuple[Any, ...],
        low_rank: tuple[Any, ...],
        points: np.ndarray,
        masses: np.ndarray,
        slow_square: float,
        inertia: np.ndarray | None = None,
        consistent=None,
    ):
        *pattern, self._values = stiffness
        self._low_rank = low_rank
        self._diagonal = pattern[1][:-1]
        self._masses = masses
        self._moving = np.flatnonzero(masses)
        self._inertia = inertia
        self._consistent = consistent
        if consistent is None:
            self._root = (
                _root(masses) if inertia is None else _coupled_root(symmetric(*pattern, inertia), masses)
            )
        self._factor = _core.analyze(*pattern, points=points)
        self.factorizations = 0
        stiffest = self._values[self._diagonal][self._moving] / masses[self._moving]
        self._lost = _ROUND_OFF_SHARE * stiffest.max()
        # Below zero, because nothing may resist a rigid motion; and further, the faster something grows.
        self._shift = -max(slow_square, 16.0 * self._lost)
        while self._squares_below(self._shift):
            self._shift *= _SHIFT_GROWTH
            if self._shift < -16.0 * stiffest.max():
                raise NotConverged(
                    "the edge rotations are not stable by themselves, so there are no frequencies"
                )

    def growing(self) -> int:
        """Count the negative squares, which are modes that grow."""
        return self._squares_below(-self._lost)

    def lowest(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest squares (k,), ascending, and their modes of all free degrees of freedom (n, k)."""
        for attempt in range(_ATTEMPTS):
            squares, modes = self._search(count, seed=attempt, space=(2 * count + 20) << attempt)
            # A search may miss one of several equal ones. By Sylvester's law K - s M has as many negative pivots as
            # there are squares below s.
            below = squares[-1] - max(_TOLD_APART * (squares[-1] - self._shift), 2.0 * self._lost)
            if self._squares_below(below) == np.count_nonzero(squares < below):
                squares[np.abs(squares) <= self._lost] = 0.0
                return squares, modes
        raise NotConverged(f"some of the {count} slowest modes were not found. Ask for more, or for fewer.")

    def _search(self, count: int, seed: int, space: int) -> tuple[np.ndarray, np.ndarray]:
        # With M = L L^T, y = L^T x and the edge rotations at rest: L^T (K - shift M)^-1 L y = y / (w^2 - shift).
        self._factorize(self._shift)
        if self._consistent is not None:
            return self._search_generalized(count, seed, space)
        times_root, times_transposed = self._root

        def moved_by(y: np.ndarray) -> np.ndarray:
            forces = np.zeros(len(self._masses))
            forces[self._moving] = y.ravel()
            return self._factor.solve(times_root(forces))

        size = len(self._moving)
        inverse = scipy.sparse.linalg.LinearOperator(
            (size, size), matvec=lambda y: times_transposed(moved_by(y))[self._moving], dtype=np.float64
        )
        start = np.random.default_rng(seed).standard_normal(size)  # one that no symmetry is orthogonal to
        try:
            inverses, vectors = scipy.sparse.linalg.eigsh(
                inverse, count, which="LA", v0=start, ncv=min(space, size)
            )
        except scipy.sparse.linalg.ArpackError as error:
            raise NotConverged(f"the vibration modes did not converge: {error}. Ask for fewer.") from error
        order = np.argsort(-inverses)
        modes = np.stack([moved_by(vectors[:, k]) for k in order], axis=1)
        return 1.0 / inverses[order] + self._shift, modes

    def _search_generalized(self, count: int, seed: int, space: int) -> tuple[np.ndarray, np.ndarray]:
        """Find modes of K x = w^2 M x with M in the inner product: those nearest to the shift are the lowest."""
        size = len(self._masses)
        inverse = scipy.sparse.linalg.LinearOperator(
            (size, size), matvec=self._factor.solve, dtype=np.float64
        )
        start = self._factor.solve(self._consistent @ np.random.default_rng(seed).standard_normal(size))
        try:
            squares, modes = scipy.sparse.linalg.eigsh(
                inverse,  # K itself is not needed
                count,
                M=self._consistent,
                sigma=self._shift,
                OPinv=inverse,
                v0=start,
                ncv=min(space, len(self._moving)),
            )
        except scipy.sparse.linalg.ArpackError as error:
            raise NotConverged(f"the vibration modes did not converge: {error}. Ask for fewer.") from error
        order = np.argsort(squares)
        return squares[order], modes[:, order]

    def _squares_below(self, square: float) -> int:
        return self._factorize(square).negative_pivots

    def _factorize(self, shift: float) -> _core.FactorReport:
        values = self._values.copy()
        if self._inertia is None:
            values[self._diagonal] -= shift * self._masses
        else:
            values -= shift * self._inertia
        self.factorizations += 1
        report = self._factor.factorize(values, *self._low_rank)
        if not report.succeeded:
            raise NotConverged(f"the vibration modes: {report.reason}")
        return report


def _root(masses: np.ndarray) -> tuple[Any, ...]:
    """Return the functions that multiply by L and by L^T, for a diagonal M = L L^T."""
    roots = np.sqrt(masses)
    return (lambda x: roots * x), (lambda x: roots * x)


def _coupled_root(inertia, masses: np.ndarray) -> tuple[Any, ...]:
    """Return the functions that multiply by L and by L^T, for an M whose last rows, of rigid bodies, are coupled."""
    coupled = inertia.copy()
    coupled.setdiag(0.0)
    coupled.eliminate_zeros()
    first = coupled.indices.min(initial=len(masses))
    root = scipy.sparse.diags_array(np.sqrt(masses)).tolil()
    if first < len(masses):
        root[first:, first:] = np.linalg.cholesky(inertia[first:, first:].toarray())
    root = root.tocsc()
    return (lambda x: root @ x), (lambda x: root.T @ x)


def _inputs(scene: Scene, equilibrium: Equilibrium | None, values: dict[Any, Any] | None) -> Inputs:
    """Return the inputs of the equilibrium; without one, the scene's own values without a field."""
    if equilibrium is not None:
        inputs = inputs_about(scene, equilibrium, values=values)
        return inputs if equilibrium._inputs is None else equilibrium._inputs
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
    return idle_inputs(scene, requested(scene, None, values, moving=True), differentiable=True)


def _slow_square(body: Shell | Solid) -> float:
    """Estimate the square of the slowest angular frequency of a body that is held, D / (rho h size^4), 1/s2."""
    if isinstance(body, Solid):
        mesh = body.mesh
        modulus, thickness = (
            body.material._wave_modulus(mesh.n_tetrahedra),
            2.0 * mesh.volume / mesh.face_areas.sum(),
        )
    else:
        modulus, thickness = body.young_modulus, body.thickness
    each = modulus * thickness**2 / body.mass_density
    return float(each.mean()) / (12.0 * body.mesh.size**4)
