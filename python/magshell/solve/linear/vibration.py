"""Small vibrations about an equilibrium: ms.vibration_modes."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ..._input.tensors import detached, dtype_like, is_tensor, like
from ..._runtime.frozen import immutable
from ..._runtime.solver_entry_point import solve_entry
from ...model.scene.replacements import requested
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ...model.scene.values import Values
from ...model.shells.shell import Shell
from ...model.solids.solid import Solid
from ...model.supports.displacement_ties import DisplacementTie
from ..adjoint.eigenvalue import FrequencyAdjoint
from ..adjoint.factorized import stiffness_parts
from ..adjoint.residual import Residual
from ..statics.equilibrium import Equilibrium
from .base_state import idle_inputs, inputs_about, set_state
from .mode_shapes import mode_shapes
from .operator_pencils import OperatorVibrationPencil
from .rest import refuse_what_acts
from .stiffness import symmetric
from .vibration_pencil import VibrationPencil

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


MASSES = ("lumped", "consistent")


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
        grow. By default the rest shape without loads and fields, the own field of the bodies included.
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
            stiffness = stiffness_parts(model, model.rest_state(), scene._load_parameter_layout.zeros())
        else:
            set_state(equilibrium)
            stiffness = stiffness_parts(model, equilibrium._state, equilibrium._load_parameters)
        inertia = None
        if scene.rigid_parts:
            masses = model.free_weights(inputs.values.masses)  # as the parts are turned there
            inertia = model.free_weight_values(inputs.values.masses)
        if stiffness.operators and stiffness.fits_dense:
            pattern, stiffness = stiffness.triangle[:3], stiffness.dense()
            if inertia is not None:
                inertia = nonzeros_in_pattern(symmetric(*pattern, inertia), *stiffness.triangle[1:3])
    slow = min(map(_slow_square, inputs.values.deformable), default=1.0)
    if consistent is not None:
        inertia = nonzeros_in_pattern(consistent, *stiffness.triangle[1:3])
    kind = OperatorVibrationPencil if stiffness.operators else VibrationPencil
    pencil = kind(stiffness, model.free_points, masses, slow, inertia, consistent)
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
        unstable=pencil.growing(squares),
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
