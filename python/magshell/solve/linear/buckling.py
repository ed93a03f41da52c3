"""Buckling loads of linear theory: ms.linear_buckling."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ..._input.arrays import count
from ..._input.tensors import detached, dtype_like, like
from ..._runtime.frozen import immutable
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import solve_entry
from ..._runtime.warning_stacklevel import callers_level
from ...errors import LinearTheoryWarning, NotConverged
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ..adjoint.buckling import BucklingAdjoint
from ..adjoint.factorized import StiffnessParts
from ..adjoint.stress_stiffness import stress_stiffness
from ..statics.equilibrium import Equilibrium
from .base_state import StiffnessAbout, leaves_of, linear_inputs, residual_of
from .mode_shapes import mode_shapes
from .operator_pencils import OperatorBucklingPencil
from .rest import RestStiffness, pulling_parts, refuse_springs
from .small_displacement import smallness
from .stiffness import Stiffness

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


_LARGEST_CHANGE = 1e100  # over the stiffness itself: its square still is a number
_LARGEST_DISPLACEMENT = 1.0  # before buckling, over the size of the bodies: linear theory says nothing beyond


@immutable
@dataclass(frozen=True, repr=False)
class Buckling:
    """The lowest buckling modes of a scene.

    factors: (k,), ascending: by which the load parameters are multiplied where the scene buckles in mode k; about an
        equilibrium, the fraction of the way from its load parameters to those given. A tensor if inputs are tensors.
    modes: (k, n_v, 3), displacements of the vertices, the largest component 1.
    edge_rotations: (k, n_e), rad, that go with them. equilibrium: that one, or None.
    """

    scene: Scene
    factors: Any
    modes: np.ndarray = field(repr=False)
    edge_rotations: np.ndarray = field(repr=False)
    factorizations: int
    wall_time: float
    equilibrium: Equilibrium | None = field(repr=False, default=None)

    def __repr__(self) -> str:
        factors = ", ".join(f"{factor:.6g}" for factor in detached(self.factors))
        of = (
            "times the load parameters"
            if self.equilibrium is None
            else "of the way to the new load parameters"
        )
        return f"Buckling: at {factors} {of}; {self.wall_time:.3g} s"


@solve_entry
def linear_buckling(
    scene: Scene,
    equilibrium: Equilibrium | None = None,
    *,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: float = 1.0,
    gravity_factor: float = 1.0,
    field_factor: float = 1.0,
    support_factor: float = 1.0,
    values: dict[Any, Any] | None = None,
    modes: int = 1,
) -> Buckling:
    """Compute the smallest positive multiples of the load parameters at which a scene buckles, by linear theory.

    With K the Hessian, c the load parameters, and u the linear response to them,

        (K + lambda (K_s + K_l)) v = 0,     K_s = sum_i s'_i d2d_i/dq2,   s' = C J u     [Pa m]

    K_s is the stiffness of the stresses s that grow with u (initial stress or geometric stiffness, as in *BUCKLE of Abaqus
    and CalculiX), for strains d with the Jacobian J and the moduli C; K_l is the stiffness of the loads and fields. So the
    stresses before buckling are taken to be proportional to lambda, and the shape to be that without them. This is exact in
    the limit of small displacements before buckling: columns, plates loaded in their plane, closed shells. Where the
    displacements at the first factor are not small, ms.LinearTheoryWarning says so. A shallow arch, a bent plate or an open
    section that bends and twists softens before it buckles, and needs ms.follow_path. The stiffness of a CustomEnergy and
    of contacts with obstacles stays what it is.

    With own_field the magnetic field of the bodies themselves is a load like others: at rest the factors multiply it with
    them, and about an equilibrium it is a part of K.

    Forces on a susceptible shell are quadratic in the field: in a scene with one the factors multiply the field, u, K_s and
    K_l go with the square of the factor, and nothing but the field on such shells may load the scene.

    {keywords}
    values: as in ms.equilibrium.

    equilibrium: a stable one of this scene, such as a grown or loaded sheet, or one in a field. K is then its
    stiffness, u the
        response to the change from its load parameters to those given here (`ms.linear_response`), and the factors are
        fractions of this change: the parameter of ms.follow_path(..., start=). Magnetization and values are those of the
        equilibrium.

    modes: the number of modes to find. Modes for which linear theory does not hold are left out: where the bodies have moved
        by their size, or at a thousand times the first factor of either sign.

    Refused are joints that pull at rest or have motors, since no load parameter multiplies them; actuators that are springs;
    and bodies in contact, since a contact bears in one direction only, so that a mode and its opposite have different
    factors. ms.follow_path follows opening and closing contacts.

    Factors are differentiable but for those of susceptible shells, by perturbation of first order: by values and load
    parameters that are tensors, and by the inputs of an equilibrium that was found with tensors, with the change of the
    equilibrium. A gradient costs some dozens of evaluations of the stiffness for each factor asked for; with own_field these
    take most of the time. Factors that equal the next one to 1e-6 have none, nor those of loads
    with which supports move, nor those about an equilibrium with muscles, elastic tendons or closed cavities, whose forces
    change: NoGradient says so.
    Modes are arrays.

    Raises ValueError on bad input, about an equilibrium that is not stable or with its own load parameters; in a scene with
    contact of bodies, where the supports leave the sheet a motion without stiffness, where the load parameters do nothing,
    and where the sheet does not buckle under them (a column that is pulled); Interrupted.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.01, cells=(20, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (-1.0, 0, 0))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    >>> round(float(ms.linear_buckling(scene).factors[0]), 3)  # pi^2 E h^3 / (48 L^2) = 0.0206 N/m
    0.021
    """
    arguments = given_to("linear_buckling", locals())
    modes = count("modes", modes)
    inputs = linear_inputs(scene, equilibrium, arguments)
    refuse_springs(inputs)
    if scene._body_contacts:
        raise ValueError(
            "the scene has contact of bodies, which holds in one direction only, so that no linear mode "
            "buckles: ms.follow_path "
            "follows it as it opens and closes, or leave it out"
        )
    driven = [joint for joint in map(inputs.values.current, scene.joints) if joint._driven]
    if equilibrium is None and (acting := [*pulling_parts(inputs), *driven]):
        raise ValueError(
            f"linear buckling multiplies the load parameters, and {acting[0]!r:.80} acts whatever they are: "
            "take ms.follow_path"
        )
    quadratic = scene.has_susceptible_shells
    if quadratic and equilibrium is not None:
        raise ValueError(
            "the stiffness of a susceptible shell is quadratic in the field, and linear buckling about an equilibrium takes "
            "it to be linear: ms.follow_path(..., start=) finds where it buckles"
        )
    began = time.perf_counter()
    model = scene._model
    if modes >= model.free_size:
        raise ValueError(
            f"modes must be below the {model.free_size} free degrees of freedom of the scene, got {modes}"
        )
    with inputs.in_core():
        stiffness = RestStiffness(inputs) if equilibrium is None else StiffnessAbout(equilibrium)
        stiffness.factorize()
        response = stiffness.response(inputs)
        displacement = float(np.abs(model.points(response)).max())
        if quadratic:
            _refuse_odd_loads(scene, stiffness, inputs)
        change = _stiffness_change(stiffness, response, inputs)
        if (change.operators or stiffness.parts.operators) and change.fits_dense:
            stiffness, change = stiffness.dense(), change.dense()
    leaves = leaves_of(inputs, equilibrium)
    asked = modes + bool(leaves and modes + 1 < model.free_size)  # whether the last one is simple
    factors, vectors = _lowest(stiffness, change, asked, _LARGEST_DISPLACEMENT * _size(scene), displacement)
    if quadratic:
        factors = np.sqrt(factors)
    _warn_of_displacements(scene, stiffness, response, float(factors[0]), quadratic)
    shapes, edge_rotations = mode_shapes(model, vectors[:, :modes])
    return Buckling(
        scene=scene,
        factors=_differentiable(inputs, equilibrium, stiffness, response, factors, vectors, modes),
        modes=shapes,
        edge_rotations=edge_rotations,
        factorizations=2,
        wall_time=time.perf_counter() - began,
        equilibrium=equilibrium,
    )


def _differentiable(
    inputs: Inputs,
    equilibrium: Equilibrium | None,
    stiffness: Stiffness,
    response: np.ndarray,
    factors: np.ndarray,
    vectors: np.ndarray,
    modes: int,
) -> Any:
    """Return the factors as a tensor that is connected to the inputs, if some of these require a gradient."""
    leaves, kept, model = leaves_of(inputs, equilibrium), factors[:modes], inputs.scene._model
    about = None if equilibrium is None else equilibrium._inputs
    given = [*inputs.given, *(() if about is None else about.given)]
    if not leaves:
        return like(kept, *given)
    from ..adjoint.autograd import solved

    layout = inputs.scene._load_parameter_layout
    here = residual_of(inputs, equilibrium)
    with inputs.in_core():
        rate = model.prescribed_rate(here.load_parameters)
    further = layout.of(inputs.load_parameters - here.load_parameters, "scene", "support_factor")
    refusal = ""
    if inputs.scene.has_susceptible_shells:
        refusal = "no gradient of buckling factors with a susceptibility"
    moves = rate.any() and (further.any() or any(leaf.name == "support_factor" for leaf, _ in leaves))
    adjoint = BucklingAdjoint(
        here,
        stiffness.solve,
        inputs.load_parameters,
        response,
        factors,
        np.stack([model.expand(each) for each in vectors.T], axis=1),
        leaves,
        complete=len(factors) == modes,
        at_rest=equilibrium is None,
        refusal="no gradient of buckling factors: supports move with the loads" if moves else refusal,
    )
    return solved(adjoint, (kept.copy(),), dtype_like(*given), adjoint.tensors)[0]


def _size(scene: Scene) -> float:
    """Return the size of the bodies of a scene, m; that of its links if there are no others."""
    if scene._bodies.extent > 0.0:
        return scene._bodies.extent
    return float(np.ptp(scene._model.points(scene._model.rest_state()), axis=0).max())


def _refuse_odd_loads(scene: Scene, stiffness: Stiffness, inputs: Inputs) -> None:
    """Raise ValueError unless forces and stiffness at rest are the same for reversed load parameters: those of a field on
    susceptible shells are, to the last bit, and others are not.
    """
    model, state, load_parameters = scene._model, stiffness.state, inputs.load_parameters
    moved = model.prescribed_rate(stiffness.load_parameters).any()
    same_forces = np.array_equal(
        model.gradient(state, load_parameters), model.gradient(state, -load_parameters)
    )
    if (
        moved
        or not same_forces
        or not np.array_equal(*(model.hessian(state, c)[3] for c in (load_parameters, -load_parameters)))
    ):
        raise ValueError(
            "the forces on a susceptible shell are quadratic in the field, and something else loads the scene (a remanent "
            "magnetization, a load, a support that moves), which is linear: one factor cannot multiply both. ms.follow_path "
            "finds where it buckles"
        )


def _stiffness_change(stiffness: Stiffness, response: np.ndarray, inputs: Inputs) -> StiffnessParts:
    """Return K_s + K_l, in the pattern of K, for load parameters that go from those of K to those of the inputs.

    With susceptible shells both are those of the squares of the load parameters.
    """
    change = stress_stiffness(
        inputs.scene._model, stiffness.state, stiffness.load_parameters, response, inputs.load_parameters
    )
    values = change.triangle[3]
    if not values.any() and not change.operators and not change.low_rank:
        raise ValueError(
            "the load parameters neither load the scene nor change its stiffness: nothing buckles"
        )
    largest = np.abs(values).max()
    if not largest < _LARGEST_CHANGE * abs(stiffness.matrix).max():  # NaN too
        raise ValueError(
            f"the load parameters change the stiffness by {largest:g} N/m, beyond what numbers hold: are their units right?"
        )
    return change


def _warn_of_displacements(
    scene: Scene, stiffness: Stiffness, response: np.ndarray, factor: float, quadratic: bool
) -> None:
    """Warn if the displacements at a factor are too large for linear theory."""
    model = scene._model
    multiple = factor**2 if quadratic else factor
    found = smallness(scene, model.positions(stiffness.state), model.positions(response))
    if reason := found.describe(multiple):
        message = (
            f"linear buckling takes displacements before buckling to be small, and at the factor {factor:.4g} {reason}: the "
            "scene softens or stiffens before, and may not buckle there at all. ms.follow_path finds what it does"
        )
        warnings.warn(LinearTheoryWarning(message), stacklevel=callers_level())


def _lowest(
    stiffness: Stiffness, change: StiffnessParts, count: int, max_displacement: float, displacement: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the positive factors (k,), ascending, and their modes (n, k), k <= count.

    max_displacement: m, before buckling; factors that would need more are left out.
    """
    has_operators = bool(change.operators or stiffness.parts.operators)
    pencil = (OperatorBucklingPencil if has_operators else BucklingPencil)(stiffness, change)
    try:
        # The search ends where the theory does: factors beyond belong to strains of order one, are closely spaced and mean
        # nothing.
        of_extreme = 1e3 / pencil.extreme()
        largest = min(of_extreme, max_displacement / displacement if displacement > 0.0 else np.inf)
        factors, modes = pencil.lowest(count, largest)
    except scipy.sparse.linalg.ArpackError as error:
        raise NotConverged(f"the buckling modes did not converge: {error}. Ask for fewer modes.") from error
    if len(factors) == 0:
        raise ValueError(
            "nothing buckles under these load parameters, as far as linear theory reaches; under reversed ones it may"
        )
    return factors, modes


class BucklingPencil:
    """A positive definite K and its change G without operators: -G v = (1/f) K v, so that the smallest positive factors f
    are the largest eigenvalues.
    """

    def __init__(self, stiffness: Stiffness, change: StiffnessParts):
        self._whole, self._change = stiffness, change
        matrix, parts = stiffness.matrix, stiffness.parts
        self._size = matrix.shape[0]
        self._solve = stiffness.solve
        self._stiffness = matrix
        if parts.low_rank:
            self._stiffness = self._operator(lambda v: matrix @ v + parts.times_others(v))
        self._negative_change = -stiffness.with_values(change.triangle[3])
        if change.low_rank:
            negative = self._negative_change
            self._negative_change = self._operator(lambda v: negative @ v - change.times_others(v))

    def extreme(self) -> float:
        """Return the inverse of the factor nearest to zero, of either sign, by its size."""
        return abs(self._search(self._negative_change, 1, which="LM", return_eigenvectors=False)[0])

    def lowest(self, count: int, largest: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest positive factors (k,) up to the largest one, ascending, and modes (n, k) with v . K v = 1."""
        # By Sylvester's law, K + f dK has as many negative directions as there are factors between 0 and f.
        count = min(count, self._whole.negative_directions(self._change, largest))
        if count == 0:
            return np.zeros(0), np.zeros((self._size, 0))
        inverses, vectors = self._search(self._negative_change, count, which="LA")
        order = np.argsort(-inverses)
        return 1.0 / inverses[order], vectors[:, order]

    def _search(self, negative_change: Any, count: int, **options: Any) -> Any:
        start = np.random.default_rng(0).standard_normal(self._size)  # one that no symmetry is orthogonal to
        return scipy.sparse.linalg.eigsh(
            negative_change,
            count,
            M=self._stiffness,
            Minv=self._operator(self._solve),
            v0=start,
            **options,
        )

    def _operator(self, product: Callable[[np.ndarray], np.ndarray]) -> scipy.sparse.linalg.LinearOperator:
        return scipy.sparse.linalg.LinearOperator(
            (self._size, self._size), matvec=lambda v: product(v.ravel()), dtype=np.float64
        )
