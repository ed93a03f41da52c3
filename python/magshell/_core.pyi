"""
The C++ core of magshell; use the functions of the package, not this module.
"""

from __future__ import annotations

import collections.abc
import typing

import numpy
import numpy.typing

__all__: list[str] = [
    "AppliedField",
    "AttackCurve",
    "BroadPhase",
    "CriticalKind",
    "CriticalPoint",
    "CuboidMagnet",
    "CylinderMagnet",
    "Dipoles",
    "FaceEnergy",
    "Factor",
    "FactorReport",
    "FailedAttempt",
    "GroupEnergy",
    "Keep",
    "Model",
    "MotionInput",
    "MotionResult",
    "NewtonOptions",
    "Obstacle",
    "OperatorPart",
    "OtherBranch",
    "Outcome",
    "PathOptions",
    "PathPoint",
    "PathResult",
    "PlacedField",
    "PythonField",
    "PythonGroupEnergy",
    "SampledField",
    "ShapeCore",
    "SmallDeflection",
    "SolveStep",
    "StaticsOptions",
    "StaticsResult",
    "SurfaceTension",
    "TriangleMesh",
    "WatchedObstacle",
    "Water",
    "added_mass_faces",
    "analyze",
    "at_nodes",
    "build_info",
    "directions_below",
    "distances",
    "drag_faces",
    "drag_gradients",
    "element_energies",
    "elimination_fronts",
    "factor_backends",
    "factor_orderings",
    "fibre_states",
    "find_equilibrium",
    "fine_face_points",
    "first_order_change",
    "follow_path",
    "freeze_stress_rates",
    "keeps_energy",
    "kinds_of_terms",
    "lane_angles",
    "lane_logarithms",
    "loaded_part",
    "lowest_modes",
    "motion_balance",
    "moved",
    "nearest_neighbours",
    "nearest_point",
    "num_threads",
    "pair_energies",
    "pair_energies_by_law",
    "pair_free_shares",
    "pair_frictions",
    "pair_proximities",
    "pair_sums",
    "prescribed_vjp",
    "pull_back",
    "pull_back_motion",
    "push_forward",
    "push_forward_motion",
    "rasterized",
    "release_stresses",
    "sample_fields",
    "set_num_threads",
    "shape_friction",
    "shell_stresses",
    "simulate",
    "simulate_with_tangent",
    "solid_point_states",
    "solve_with_operator",
    "state_on_joints",
    "strain_rates",
    "stress_work_vjp",
    "term_gradients",
    "touching_pairs",
    "vacuum_permeability",
    "vjp",
    "without_rest_gradient",
    "without_stress_work_vjp",
]

class FactorReport:
    """
    How a factorization went.
    """
    def __repr__(self) -> str: ...
    @property
    def negative_pivots(self) -> int:
        """
        the number of negative eigenvalues
        """
    @property
    def perturbed_pivots(self) -> int:
        """
        pivots that were zero to rounding and were replaced; solve() then refines
        """
    @property
    def pivot_growth(self) -> float:
        """
        max l_ik^2 |d_k| over the largest entry: about 1 or less when definite; 10^p costs about p digits
        """
    @property
    def reason(self) -> str:
        """
        why not, and what it means; empty on success
        """
    @property
    def succeeded(self) -> bool: ...

class OperatorPart:
    """
    The part of a Hessian of the free unknowns that is known by its products only: that of the own field.
    """
    def product(
        self, x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        The product with a vector of the free unknowns (n,).
        """

class Factor:
    """
    An analysed sparse symmetric pattern; factorize() it with values, then solve().
    """
    def factorize(
        self,
        values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        columns: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] = ...,
        stiffness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
        operators: collections.abc.Sequence[
            tuple[typing.SupportsFloat | typing.SupportsIndex, OperatorPart]
        ] = [],
        counted: bool = True,
    ) -> FactorReport:
        """
        Factorizes the matrix with these values (nnz,), in the order of the pattern's rows, and with columns u (n, k) of stiffnesses s (k,) beside it: plus the sum of s u u^T; and with operators [(weight, OperatorPart)]: solves are iterative then, and equal negative eigenvalues count once. counted: whether the report counts the negative eigenvalues of the whole; otherwise those without the operators.
        """
    def residual(
        self,
        values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        solution: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        rhs: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        rhs (n,) minus the matrix with these values (nnz,) times a solution (n,), added up in as many digits as the machine has.
        """
    def solve(self, rhs: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.ndarray:
        """
        The solution for the right-hand side (n,) or (n, k).
        """
    def solve_approximately(
        self,
        rhs: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        tolerance: typing.SupportsFloat | typing.SupportsIndex,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        The solution for the right-hand side (n,). An iterative solve leaves a residual of at most this part of it.
        """
    @property
    def bytes(self) -> int: ...
    @property
    def flops(self) -> float:
        """
        additions and multiplications of one factorization
        """
    @property
    def name(self) -> str: ...
    @property
    def nonzeros(self) -> int:
        """
        entries of L, its diagonal included
        """
    @property
    def size(self) -> int: ...

class TriangleMesh:
    def __init__(
        self,
        rest_positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        faces: typing.Annotated[numpy.typing.ArrayLike, numpy.int64],
    ) -> None: ...
    def self_intersections(
        self, positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> numpy.typing.NDArray[numpy.int32]: ...
    @property
    def edge_faces(self) -> numpy.ndarray: ...
    @property
    def edges(self) -> numpy.ndarray: ...
    @property
    def face_edges(self) -> numpy.ndarray: ...
    @property
    def faces(self) -> numpy.ndarray: ...
    @property
    def rest_positions(self) -> numpy.ndarray: ...

class AppliedField:
    @property
    def name(self) -> str: ...
    @property
    def needs_gil(self) -> bool: ...

class Dipoles(AppliedField):
    def __init__(
        self,
        positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        moments: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> None: ...

class CuboidMagnet(AppliedField):
    def __init__(
        self,
        dimensions: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        remanent_magnetization: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        center: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        rotation: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
    ) -> None: ...

class CylinderMagnet(AppliedField):
    def __init__(
        self,
        radius: typing.SupportsFloat | typing.SupportsIndex,
        height: typing.SupportsFloat | typing.SupportsIndex,
        remanent_magnetization: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        center: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        rotation: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
    ) -> None: ...

class SampledField(AppliedField):
    def __init__(
        self,
        origin: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        spacing: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        flux_density: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> None: ...
    def contains(self, points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> list[bool]: ...

class PythonField(AppliedField):
    def __init__(self, sampler: collections.abc.Callable[..., typing.Any]) -> None: ...

class PlacedField(AppliedField):
    def __init__(
        self,
        field: AppliedField,
        center: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        rotation: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
    ) -> None: ...

class Obstacle:
    @staticmethod
    def box(
        half_extents: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        rounding: typing.SupportsFloat | typing.SupportsIndex,
    ) -> Obstacle: ...
    @staticmethod
    def capsule(
        start: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        end: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        radius: typing.SupportsFloat | typing.SupportsIndex,
    ) -> Obstacle: ...
    @staticmethod
    def ellipsoid(
        semi_axes: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
    ) -> Obstacle: ...
    @staticmethod
    def height_field(
        origin: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(2)"
        ],
        spacing: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(2)"
        ],
        heights: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> Obstacle: ...
    @staticmethod
    def mesh(mesh: TriangleMesh, resolution: typing.SupportsInt | typing.SupportsIndex) -> Obstacle: ...
    @staticmethod
    def plane(
        normal: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
    ) -> Obstacle: ...
    @staticmethod
    def sphere(radius: typing.SupportsFloat | typing.SupportsIndex) -> Obstacle: ...
    @staticmethod
    def tube(
        points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        radii: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        closed: bool,
    ) -> Obstacle: ...
    def inverted(self) -> Obstacle:
        """
        The space around the body, as a body.
        """

class ShapeCore:
    """
    The core of a smooth shape that a rigid body carries.
    """
    def __init__(
        self,
        middle: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        half: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"],
        radius: typing.SupportsFloat | typing.SupportsIndex,
        crown: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...

class AttackCurve:
    @typing.overload
    def __init__(self) -> None:
        """
        2 sin^2 phi
        """
    @typing.overload
    def __init__(
        self,
        knots: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        cubics: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> None:
        """
        Cubics (n, 4) of (phi - knot), the highest power first, between n + 1 knots [rad].
        """
    def samples(
        self, angles: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        Value and slope at angles (n,) [rad] in [0, pi/2]: (n, 2).
        """

class Water:
    def __init__(
        self,
        *,
        fluid_density: typing.SupportsFloat | typing.SupportsIndex,
        velocity: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        drag_coefficient: typing.SupportsFloat | typing.SupportsIndex,
        thrust_coefficient: typing.SupportsFloat | typing.SupportsIndex,
        added_mass: typing.SupportsFloat | typing.SupportsIndex,
        normal_viscous_drag: typing.SupportsFloat | typing.SupportsIndex,
        tangential_viscous_drag: typing.SupportsFloat | typing.SupportsIndex,
        drag_curve: AttackCurve,
        thrust_curve: AttackCurve,
    ) -> None: ...

class FaceEnergy:
    pass

class SurfaceTension(FaceEnergy):
    def __init__(self) -> None: ...

class GroupEnergy:
    pass

class PythonGroupEnergy(GroupEnergy):
    def __init__(
        self,
        sample: collections.abc.Callable[..., typing.Any],
        rate_by_values: collections.abc.Callable[..., typing.Any],
    ) -> None: ...

class SmallDeflection:
    """
    How a scene at rest gives way to small forces.
    """
    @property
    def motion(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n,) of all unknowns; empty where the stiffness is not positive definite
        """
    @property
    def report(self) -> FactorReport:
        """
        of the factorization
        """
    @property
    def unknowns(self) -> int:
        """
        of the matrix that was factorized
        """

class Model:
    def __init__(self, **kwargs: typing.Any) -> None: ...
    def assemble(
        self,
        arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> None:
        """
        Gradient and Hessian, left in the core: what `python -m benchmarks kernels` times.
        """
    def driven_increment(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        How far from a state what motors and supports prescribe at these load parameters is, of all unknowns, (n,); zero elsewhere.
        """
    def driving(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        angle_branches: collections.abc.Sequence[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
        ],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        What the motors of joints do in an equilibrium q, N and N m, one after another.
        """
    def edge_rotations(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def energies(
        self,
        arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> dict[str, typing.Any]: ...
    def energy(
        self,
        arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> float: ...
    def expand(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def field_sampling_error(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> float:
        """
        The estimate of find_equilibrium's result at a state, from samples of its own.
        """
    def free_weight_values(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        The same as a matrix, in the places of hessian(): with rigid parts it is no diagonal. At the state that was evaluated last.
        """
    def free_weights(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Masses, say, of the caller's vertices (n_v,) among the free unknowns; zero elsewhere.
        """
    def full_vector(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Rows of the caller's vertices (n_v, 3) among all unknowns, zero elsewhere.
        """
    def gradient(
        self,
        arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def held_forces(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        angle_branches: collections.abc.Sequence[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
        ],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (3 m,) [N], with which supports pull at the held nodes of a scene at rest.
        """
    def hessian(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        reduced: bool = True,
    ) -> tuple[typing.Any, ...]: ...
    def hessian_parts(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> tuple[typing.Any, ...]:
        """
        The Hessian of the free unknowns at a state: the lower triangle as hessian() has it, columns and stiffnesses as low_rank() has them, and the OperatorPart of the own field, or None.
        """
    def hessian_product(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        The product of the Hessian with a direction, of all unknowns (n,), with the own field.
        """
    def largest_strains(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        thickness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> tuple[typing.Any, ...]: ...
    def linearize(self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        """
        How nodes of links and rigid parts move, at a state: evaluations begin with it.
        """
    def low_rank(
        self, reduced: bool = True
    ) -> tuple[
        typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"],
        typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"],
    ]:
        """
        What hessian(), called last, leaves out: columns u (n, k) and stiffnesses s (k,), the sum of s u u^T. Of cavities, cells and tendons, which couple all of their nodes.
        """
    def magnetic_moments(
        self,
        name: str,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> tuple[
        typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
        typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
    ]:
        """
        Points [m] and magnetic moments [A m2] of the terms of one name, or of all of them, in the applied field, (n, 3) each.
        """
    def not_finite(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> str:
        """
        Which force is not finite at a state, in words; empty where all are.
        """
    def own_energies(
        self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> list[float]:
        """
        The energy of each shell of the own field in its own field alone, (n,) [J].
        """
    def own_field_gap_forces(
        self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> tuple[
        list[str],
        tuple[
            typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
            typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
            list[float],
        ],
        tuple[
            typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
            typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
            list[float],
        ],
        typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
        list[float],
        list[float],
        list[float],
        list[float],
    ]:
        """
        Of each body of the own field: its owner; the force [N] of others on it between near elements, as the energy has it and at more points, (n, 3) each, and the sum of the sizes of the latter on its elements; the same of the couple about its center [N m]; its center (n, 3) [m]; and the distance of the nearest points [m]. Of its own elements that are near now but not at rest: the sums of the sizes of their forces, both ways, and the distance.
        """
    def own_field_on_moments(
        self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> tuple[
        typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
        typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
        typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"],
    ]:
        """
        Of each rigid body with a moment in the own field: the place of the moment [m], the force [N] and the couple [N m] on it, (n, 3) each.
        """
    def own_flux_density(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        The flux density of the magnetized bodies at points outside of them, (n, 3) [T].
        """
    def points(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Positions, then the own points of rigid parts (10 each).
        """
    def positions(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    def prescribed_rate(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        d(all unknowns)/d(progress) of what moving supports hold; zero elsewhere.
        """
    def principal_strains(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        thickness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 4]"]: ...
    def reduce(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def refusal(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> str:
        """
        What is wrong with a state, in words; empty where nothing is.
        """
    def rest_state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def rough_operator_product(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Nearly the product of the own field's Hessian with a direction, of all unknowns (n,), as solves with a large tolerance take it.
        """
    def set_values(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        """
        All of them, rows in the caller's order.
        """
    def settled_velocity(
        self,
        arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Velocities of all unknowns, with those of rigid parts as their vertices say.
        """
    def small_deflection(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        unloaded: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        at_rest: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None = None,
    ) -> SmallDeflection:
        """
        The motion from the rest shape q, of all unknowns, to first order in the load parameters. at_rest (n,): the gradient there, unless it is that without load parameters.
        """
    def state(
        self,
        arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def term_energies(
        self,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        angle_branches: collections.abc.Sequence[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
        ],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> list[typing.Any]:
        """
        [(name, J)] of each term, at a state with these branches of angles.
        """
    def term_gradient(
        self,
        name: str,
        q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        The gradient of the terms of one name, of all unknowns (n,) [N].
        """
    @property
    def analyses(self) -> int: ...
    @property
    def bytes(self) -> int: ...
    @property
    def free_points(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Where each free unknown is at rest (n, 3) [m]: its vertex, or the middle of its edge.
        """
    @property
    def free_size(self) -> int: ...
    @property
    def load_parameters(self) -> list[typing.Any]:
        """
        (owner, name, unit, first, rows, width) of each, in the flat vectors of load parameters.
        """
    @property
    def n_strains(self) -> int: ...
    @property
    def parameters(self) -> list[typing.Any]:
        """
        (owner, name, unit, first, rows, width) of each, in the flat vector of set_values.
        """
    @property
    def recut_faces(self) -> list[int]:
        """
        The caller's faces (k,) whose stretch is measured on other triangles than their own.
        """
    @property
    def size(self) -> int: ...
    @property
    def term_names(self) -> list[typing.Any]: ...

class NewtonOptions:
    def __init__(
        self,
        *,
        mixed: bool = True,
        tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-10,
        max_iterations: typing.SupportsInt | typing.SupportsIndex = 20,
    ) -> None: ...

class WatchedObstacle:
    def __init__(
        self,
        obstacle: typing.SupportsInt | typing.SupportsIndex,
        middles: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        faces: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    ) -> None: ...

class StaticsOptions:
    keep_factor: bool
    newton: NewtonOptions
    require_stable: bool
    start_at_rest: bool
    def __init__(self) -> None: ...
    @property
    def away_from(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]: ...
    @away_from.setter
    def away_from(
        self,
        arg0: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]],
    ) -> None: ...
    @property
    def away_length(self) -> float: ...
    @away_length.setter
    def away_length(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def first_step(self) -> float: ...
    @first_step.setter
    def first_step(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def max_factorizations(self) -> int: ...
    @max_factorizations.setter
    def max_factorizations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def max_relaxation_steps(self) -> int: ...
    @max_relaxation_steps.setter
    def max_relaxation_steps(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def smallest_step(self) -> float: ...
    @smallest_step.setter
    def smallest_step(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def watched(self) -> list[WatchedObstacle]: ...
    @watched.setter
    def watched(self, arg0: collections.abc.Sequence[WatchedObstacle]) -> None: ...

class Outcome:
    """
    Members:

      converged

      failed

      interrupted
    """

    __members__: typing.ClassVar[dict[str, Outcome]]
    converged: typing.ClassVar[Outcome]
    failed: typing.ClassVar[Outcome]
    interrupted: typing.ClassVar[Outcome]
    @typing.overload
    def __eq__(self, other: Outcome) -> bool: ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool: ...
    def __getstate__(self) -> int: ...
    def __hash__(self) -> int: ...
    def __index__(self) -> int: ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __int__(self) -> int: ...
    @typing.overload
    def __ne__(self, other: Outcome) -> bool: ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool: ...
    def __repr__(self) -> str: ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __str__(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class FailedAttempt:
    @property
    def falling(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def last_move(self) -> float: ...
    @property
    def load_parameters(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def shortest_step(self) -> float: ...
    @property
    def state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...

class SolveStep:
    @property
    def displacement(self) -> float: ...
    @property
    def energy(self) -> float: ...
    @property
    def factorizations(self) -> int: ...
    @property
    def failure(self) -> str: ...
    @property
    def iterations(self) -> int: ...
    @property
    def load_fraction(self) -> float: ...
    @property
    def method(self) -> str: ...
    @property
    def negative_pivots(self) -> int: ...

class OtherBranch:
    @property
    def other_mode(self) -> bool: ...
    @property
    def saddle(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...

class StaticsResult:
    def add_effort_of(self, earlier: StaticsResult) -> None:
        """
        Count what an earlier part of the same search did as well.
        """
    @property
    def angle_branches(self) -> list[list[float]]: ...
    @property
    def at_roundoff(self) -> bool: ...
    @property
    def bytes(self) -> int: ...
    @property
    def effort_spent(self) -> bool: ...
    @property
    def factorization(self) -> str: ...
    @property
    def factorizations(self) -> int: ...
    @property
    def failed(self) -> FailedAttempt: ...
    @property
    def failed_factorizations(self) -> int: ...
    @property
    def field_sampling_error(self) -> float: ...
    @property
    def iterations(self) -> int: ...
    @property
    def linear_time(self) -> float: ...
    @property
    def load_fraction(self) -> float: ...
    @property
    def load_parameters(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def load_steps(self) -> int: ...
    @property
    def log(self) -> list[SolveStep]: ...
    @property
    def n_negative_eigenvalues(self) -> int: ...
    @property
    def other_branches(self) -> list[OtherBranch]: ...
    @property
    def outcome(self) -> Outcome: ...
    @property
    def reason(self) -> str: ...
    @property
    def relaxation_steps(self) -> int: ...
    @property
    def residual(self) -> float: ...
    @property
    def saddles_escaped(self) -> int: ...
    @property
    def stable(self) -> bool: ...
    @property
    def state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...

class PathPoint:
    @property
    def angle_branches(self) -> list[list[float]]: ...
    @property
    def field_sampling_error(self) -> float: ...
    @property
    def n_negative_eigenvalues(self) -> int: ...
    @property
    def parameter(self) -> float: ...
    @property
    def state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...

class CriticalKind:
    """
    Members:

      limit

      bifurcation

      flutter
    """

    __members__: typing.ClassVar[dict[str, CriticalKind]]
    bifurcation: typing.ClassVar[CriticalKind]
    flutter: typing.ClassVar[CriticalKind]
    limit: typing.ClassVar[CriticalKind]
    @typing.overload
    def __eq__(self, other: CriticalKind) -> bool: ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool: ...
    def __getstate__(self) -> int: ...
    def __hash__(self) -> int: ...
    def __index__(self) -> int: ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __int__(self) -> int: ...
    @typing.overload
    def __ne__(self, other: CriticalKind) -> bool: ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool: ...
    def __repr__(self) -> str: ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __str__(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class CriticalPoint:
    @property
    def after_point(self) -> int: ...
    @property
    def kind(self) -> CriticalKind: ...
    @property
    def mode(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def point(self) -> PathPoint: ...

class PathOptions:
    branch_at: CriticalPoint | None
    locate_critical: bool
    newton: NewtonOptions
    def __init__(self) -> None: ...
    @property
    def branch_side(self) -> float: ...
    @branch_side.setter
    def branch_side(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def first_step(self) -> float: ...
    @first_step.setter
    def first_step(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def max_parameter(self) -> float: ...
    @max_parameter.setter
    def max_parameter(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def max_points(self) -> int: ...
    @max_points.setter
    def max_points(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def max_step(self) -> float: ...
    @max_step.setter
    def max_step(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def min_parameter(self) -> float: ...
    @min_parameter.setter
    def min_parameter(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def watched(self) -> list[WatchedObstacle]: ...
    @watched.setter
    def watched(self, arg0: collections.abc.Sequence[WatchedObstacle]) -> None: ...

class PathResult:
    @property
    def critical(self) -> list[CriticalPoint]: ...
    @property
    def factorizations(self) -> int: ...
    @property
    def failed_factorizations(self) -> int: ...
    @property
    def iterations(self) -> int: ...
    @property
    def outcome(self) -> Outcome: ...
    @property
    def points(self) -> list[PathPoint]: ...
    @property
    def reason(self) -> str: ...

class MotionInput:
    def __init__(self, model: Model, given: dict[str, typing.Any]) -> None: ...

class Keep:
    """
    Members:

      nothing

      checkpoints

      stages

      factors
    """

    __members__: typing.ClassVar[dict[str, Keep]]
    checkpoints: typing.ClassVar[Keep]
    factors: typing.ClassVar[Keep]
    nothing: typing.ClassVar[Keep]
    stages: typing.ClassVar[Keep]
    @typing.overload
    def __eq__(self, other: Keep) -> bool: ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool: ...
    def __getstate__(self) -> int: ...
    def __hash__(self) -> int: ...
    def __index__(self) -> int: ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __int__(self) -> int: ...
    @typing.overload
    def __ne__(self, other: Keep) -> bool: ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool: ...
    def __repr__(self) -> str: ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def __str__(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class MotionResult:
    def directions(self, arg0: Model) -> numpy.typing.NDArray[numpy.float64]: ...
    def driving(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]: ...
    def edge_rotations(self, arg0: Model) -> numpy.typing.NDArray[numpy.float64]: ...
    def held_forces(self, arg0: Model) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, m, 3) [N], with which supports pulled at the held nodes of recorded states; NaN where no step led to.
        """
    def largest_strains(
        self, model: Model, thickness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> list[typing.Any]: ...
    def last_maxwell_strain_rates(
        self, arg0: Model
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def last_maxwell_strains(
        self, arg0: Model
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def last_strain_rates(
        self, arg0: Model
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def positions(self, arg0: Model) -> numpy.typing.NDArray[numpy.float64]: ...
    def velocities(self, arg0: Model) -> numpy.typing.NDArray[numpy.float64]: ...
    @property
    def begun(self) -> bool: ...
    @property
    def bytes(self) -> int: ...
    @property
    def divided(self) -> list[int]: ...
    @property
    def energies(self) -> list[list[float]]: ...
    @property
    def factorizations(self) -> int: ...
    @property
    def fraction_done(self) -> float: ...
    @property
    def gaining(self) -> list[int]: ...
    @property
    def iterations(self) -> int: ...
    @property
    def keep(self) -> Keep: ...
    @property
    def kinetic_energy(self) -> list[float]: ...
    @property
    def last_acceleration(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def last_contact_acceleration(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def last_momentum_rate(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def last_state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def last_turns(self) -> list[list[float]]: ...
    @property
    def last_velocity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def linear_time(self) -> float: ...
    @property
    def outcome(self) -> Outcome: ...
    @property
    def reason(self) -> str: ...
    @property
    def step_errors(self) -> list[float]: ...
    @property
    def step_factorizations(self) -> list[int]: ...
    @property
    def steps_done(self) -> int: ...
    @property
    def steps_recorded(self) -> list[int]: ...
    @property
    def substeps(self) -> dict[int, list[tuple[float, float, bool]]]: ...
    @property
    def time_steps(self) -> list[float]: ...
    @property
    def watched_energy(self) -> bool: ...

class BroadPhase:
    def __init__(
        self,
        rest_positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        surfaces: collections.abc.Sequence[
            collections.abc.Sequence[
                typing.Annotated[
                    collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"
                ]
            ]
        ],
        contacts: collections.abc.Sequence[
            typing.Annotated[
                collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(2)"
            ]
        ],
    ) -> None: ...
    def crossings(
        self, positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
    ) -> dict[str, typing.Any]: ...
    def make_room(
        self,
        rest_positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        near_at_rest: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
    ) -> None: ...
    def near(
        self,
        positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        margins: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
    ) -> dict[str, typing.Any]:
        """
        Columns of the pairs that are nearer than the margins [m].
        """
    def near_on_the_way(
        self,
        positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        end: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        margins: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
    ) -> dict[str, typing.Any]: ...

def added_mass_faces(
    water: Water,
    positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    velocities: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> dict[str, typing.Any]:
    """
    The energy v . dT/dv - T (n,) [J] of the water that faces push, the momentum that each corner carries (n, 3) [N s], its derivatives by the position of each corner (n, 3, 3, 3) as [face, corner, momentum, position] and by the mean velocity of the corners (n, 3, 3), and the first and second derivatives of T by positions, (n, 3, 3) [N] and (n, 9, 9) [N/m].
    """

def analyze(
    size: typing.SupportsInt | typing.SupportsIndex,
    column_starts: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    rows: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    backend: str = "supernodal",
    ordering: str = "best",
    points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None,
) -> Factor:
    """
    Orders and analyses the lower triangle of a symmetric pattern, given by columns: sorted rows, diagonal present. points (n, 3): where the unknowns are, which makes for better orderings.
    """

def at_nodes(
    model: Model, vector: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
) -> tuple[typing.Any, ...]:
    """
    The rows of all vertices (n_v, 3) and directions (n_d, 3) of three numbers per node, or of all unknowns.
    """

def build_info() -> list[tuple[str, str]]: ...
def directions_below(
    solve: collections.abc.Callable[
        [typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]],
        typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ],
    product: collections.abc.Callable[
        [typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]],
        typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ],
    diagonal: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    bound: typing.SupportsFloat | typing.SupportsIndex,
) -> tuple[bool, typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]]:
    """
    Looks for eigenvalues of A^-1 H below a bound, for a positive definite A (n, n) that is known by solves and its diagonal (n,), and a symmetric H that is known by products. Returns whether none was missed, with an estimated probability of 1e-3, and approximate eigenvectors (n, k), one for equal eigenvalues.
    """

def distances(
    obstacle: Obstacle, points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
) -> tuple[typing.Any, ...]:
    """
    At points (n, 3) [m] of the obstacle's own frame: signed distances (n,) [m], normals (n, 3) and second derivatives (n, 3, 3) [1/m].
    """

def drag_faces(
    water: Water,
    positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    velocities: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> dict[str, typing.Any]:
    """
    The force of water on each corner of every face without added mass (n, 3) [N], and its derivatives by the position of each corner (n, 3, 3, 3) as [face, corner, force, position] and by the mean velocity of the corners (n, 3, 3). All arguments are (n, 3, 3), a row a corner.
    """

def drag_gradients(
    water: Water,
    positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    velocities: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    multipliers: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> dict[str, typing.Any]:
    """
    For each face the gradient of multiplier . f by what describes the water; f is the force on the face without added mass, multipliers are (n, 3).
    """

def element_energies(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> list[typing.Any]:
    """
    [(name, whether of a solid, number of the sheet or solid, J of each element)] of the terms that are sums over elements, in the order of term_energies. Angles are on their first branch.
    """

def elimination_fronts(
    size: typing.SupportsInt | typing.SupportsIndex,
    column_starts: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    rows: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None,
) -> dict[str, typing.Any]:
    """
    The fronts of a pattern, given as to analyze(), in the order of elimination: {'pivots', 'below', 'parent' (-1: none), 'task' (the subtree that one thread takes; -1: above all subtrees)}.
    """

def factor_backends() -> list[str]: ...
def factor_orderings() -> list[str]: ...
def fibre_states(
    model: Model,
    muscle: typing.SupportsInt | typing.SupportsIndex,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None,
) -> tuple[typing.Any, ...]:
    """
    (stretches |F m|, tensions [Pa] a rest area, rest volumes [m3]) at the points of integration of a muscle's elements, (n, p) each. v: velocities of all unknowns [m/s], or None.
    """

def find_equilibrium(
    model: Model,
    start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    angle_branches: collections.abc.Sequence[
        collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
    ],
    from_: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    to: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    options: StaticsOptions,
    progress: typing.Any = None,
    varying: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [],
) -> StaticsResult: ...
def fine_face_points() -> numpy.typing.NDArray[numpy.float64]:
    """
    The points at which a face near a source samples the field: barycentric coordinates, height over the thickness, weight, (n, 5).
    """

def first_order_change(
    model: Model,
    equilibrium: StaticsResult,
    to: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    The change of the state to first order, from an equilibrium whose factor was kept to these load parameters and the values that the model holds now.
    """

def follow_path(
    model: Model,
    start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    angle_branches: collections.abc.Sequence[
        collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
    ],
    from_: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    to: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    options: PathOptions,
    varying: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex],
    until: typing.Any = None,
    progress: typing.Any = None,
) -> PathResult: ...
def freeze_stress_rates(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    motion: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None,
) -> None:
    """
    Hold the stresses of all terms at their rates along a motion of all unknowns (n,) from q, or at zero, until release_stresses: Hessians are then those of these stresses.
    """

def keeps_energy(model: Model) -> bool:
    """
    Whether all forces of the scene, without damping, have a potential.
    """

def kinds_of_terms(model: Model) -> list[typing.Any]:
    """
    (name, number of the body or -1, whether it has no potential) of each term of the energy.
    """

def lane_angles(
    sines: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    cosines: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    single_precision: bool = False,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Angles of unit vectors as the kernels of the own field take them, to be tested.
    """

def lane_logarithms(
    numbers: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> numpy.typing.NDArray[numpy.float64]:
    """
    ln of an array's numbers as the element kernels take it, to be tested.
    """

def loaded_part(
    size: typing.SupportsInt | typing.SupportsIndex,
    column_starts: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    rows: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    forces: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> tuple[typing.Any, ...]:
    """
    Of a symmetric matrix, given as to analyze(), the part that forces (n,) act on: its unknowns, column_starts, rows and values, without zeros off its diagonal. Nothing couples it with the rest. All of the matrix where no force acts.
    """

def lowest_modes(
    model: Model,
    state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    angle_branches: collections.abc.Sequence[
        collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
    ],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    count: typing.SupportsInt | typing.SupportsIndex,
    progress: typing.Any = None,
) -> tuple[typing.Any, ...]:
    """
    Eigenvalues, shapes of all unknowns (largest displacement 1) nearest to zero, and the number of unstable directions of an equilibrium; none where it is neutral.
    """

def motion_balance(
    model: Model,
    input: MotionInput,
    substeps: collections.abc.Mapping[
        typing.SupportsInt | typing.SupportsIndex,
        collections.abc.Sequence[
            tuple[
                typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex, bool
            ]
        ],
    ],
    steps_done: typing.SupportsInt | typing.SupportsIndex,
    progress: typing.Any = None,
) -> tuple[typing.Any, ...]:
    """
    The sums of a motion until each recorded state, which is repeated for them: work and impulses of all forces (n, rows, 7), energies of the terms and of the Maxwell branches, work of parameters that change, kinetic energy and momenta (n, 7); the last state; the names of the terms without energy.
    """

def moved(
    model: Model,
    state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    step: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    A state after a step of all unknowns, as far as bodies in contact let it.
    """

def nearest_neighbours(model: Model, contact: typing.SupportsInt | typing.SupportsIndex) -> tuple[float, str]:
    """
    Of a contact of bodies, by its number, the neighbours along a surface that are nearest each other at rest, if that is nearer than twice its reach and minimal distance: how far [m], and their faces in words.
    """

def nearest_point(
    obstacle: Obstacle,
    core: ShapeCore,
    center: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    axes: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"],
) -> tuple[typing.Any, ...]:
    """
    The distance [m] of a shape from an obstacle, the normal (3,) and the point (3,) [m] of the shape nearest to it, in the obstacle's own frame, where the shape's has this center (3,) [m] and these axes (3, 3).
    """

def num_threads() -> int: ...
def pair_energies(
    kind: str,
    places: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    area: typing.SupportsFloat | typing.SupportsIndex,
    parallel: typing.SupportsFloat | typing.SupportsIndex,
    law: dict[str, typing.Any],
    cautious: bool = False,
    room: typing.SupportsFloat | typing.SupportsIndex = ...,
) -> dict[str, typing.Any]:
    """
    energy (n,), gradient (n, 4, 3), hessian (n, 12, 12), normal_force (n,) and normal_force_by_place (n, 4, 3) of pairs with nodes at (n, 4, 3) [m].
    """

def pair_energies_by_law(
    kind: str,
    places: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    area: typing.SupportsFloat | typing.SupportsIndex,
    parallel: typing.SupportsFloat | typing.SupportsIndex,
    law: dict[str, typing.Any],
    lambda_: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    by_normal_force: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    room: typing.SupportsFloat | typing.SupportsIndex = ...,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Derivatives of lambda . gradient + by_normal_force * normal_force by stiffness, activation_distance, min_distance, smoothing: (n, 4).
    """

def pair_free_shares(
    kind: str,
    from_: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    to: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    thickness: typing.SupportsFloat | typing.SupportsIndex,
    keep: typing.SupportsFloat | typing.SupportsIndex,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Shares (n,) of the ways of pairs from (n, 4, 3) to (n, 4, 3) [m] on which they keep that share of what their distance is above the thickness.
    """

def pair_frictions(
    kind: str,
    places: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    area: typing.SupportsFloat | typing.SupportsIndex,
    parallel: typing.SupportsFloat | typing.SupportsIndex,
    law: dict[str, typing.Any],
    velocities: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    friction: typing.Annotated[
        collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
    ],
    lambda_: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> dict[str, typing.Any]:
    """
    force (n, 4, 3) of pairs that act, with friction = (kinetic, fixed, sticking speed), its derivatives, and those of lambda . force.
    """

def pair_proximities(
    kind: str, places: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]
) -> tuple[typing.Any, ...]:
    """
    (distances (n,), weights (n, 4), normals (n, 3), free places (n,)) of pairs with nodes at (n, 4, 3) [m].
    """

def pair_sums(
    kind: str,
    places: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    area: typing.SupportsFloat | typing.SupportsIndex,
    parallel: typing.SupportsFloat | typing.SupportsIndex,
    law: dict[str, typing.Any],
    cautious: bool = False,
) -> tuple[typing.Any, ...]:
    """
    Sums over pairs of their gradients (4, 3) and of the lower blocks of their Hessians (10, 3, 3).
    """

def prescribed_vjp(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    by_state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> tuple[typing.Any, ...]:
    """
    by_state (size,) . dq_h/dk, with q_h what supports prescribe at a state q: (n,) by every value, (m,) by the load parameters, and by the rest shape, three numbers per node. For scenes without rigid parts.
    """

def pull_back(
    model: Model,
    equilibrium: StaticsResult,
    by_positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    by_edge_rotations: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    by_driving: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
    by_rest: bool = False,
) -> tuple[typing.Any, ...]:
    """
    The gradients by everything a solve takes, of a function of positions (n_v, 3), edge rotations (n_e,) and what motors do (m,) with these gradients; by_rest: also those by rest positions and directions, through the shape of bodies at rest and through what supports prescribe there. The model must hold the values of that solve.
    """

def pull_back_motion(
    model: Model,
    input: MotionInput,
    motion: MotionResult,
    by_positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    by_edge_rotations: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    by_velocities: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    by_driving: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] = ...,
    by_rest: bool = False,
    stages: bool = False,
    progress: typing.Any = None,
) -> dict[str, typing.Any]: ...
def push_forward(
    model: Model,
    equilibrium: StaticsResult,
    gradient_change: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    prescribed_change: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    moved: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
    forces: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    The derivative of the state along a direction of the inputs of a solve, along which the gradient and what supports and motors prescribe change so; if joints change, also a state that stays on them, and the fixed gradient on the free unknowns there. The model must hold the values of that solve.
    """

def push_forward_motion(
    model: Model,
    input: MotionInput,
    motion: MotionResult,
    values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    along: dict[str, typing.Any],
    progress: typing.Any = None,
) -> tuple[typing.Any, ...]:
    """
    The derivatives of positions, edge rotations, velocities and motor forces of recorded states along a direction of the inputs, and the number of factorizations that they took.
    """

def rasterized(
    surfaces: list[typing.Any],
    window: typing.Annotated[
        collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(4)"
    ],
    width: typing.SupportsInt | typing.SupportsIndex,
    height: typing.SupportsInt | typing.SupportsIndex,
    *,
    samples: typing.SupportsInt | typing.SupportsIndex,
    light: typing.Annotated[
        collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
    ],
    ambient: typing.SupportsFloat | typing.SupportsIndex,
    diffuse: typing.SupportsFloat | typing.SupportsIndex,
) -> numpy.typing.NDArray[numpy.uint8]:
    """
    Paints triangles into an image (height, width, 4). surfaces: dictionaries with positions (n, 3) m on the screen and in depth, faces, colors, per_face, lit, crease (degrees) and opacity. window: (left, right, bottom, top) m.
    """

def release_stresses(model: Model) -> None:
    """
    Let stresses follow from strains again.
    """

def sample_fields(
    fields: collections.abc.Sequence[AppliedField],
    scales: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
    points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    moments: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    order: typing.SupportsInt | typing.SupportsIndex,
) -> tuple[typing.Any, ...]:
    """
    The sum of scale * field at the points (n, 3) [m]: flux density, gradient, and second derivative contracted with the moments (n, 3); empty beyond the order.
    """

def set_num_threads(count: typing.SupportsInt | typing.SupportsIndex) -> None: ...
def shape_friction(
    core: ShapeCore,
    center: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    obstacle: Obstacle,
    obstacle_center: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    smoothing: typing.SupportsFloat | typing.SupportsIndex,
    sticking_speed: typing.SupportsFloat | typing.SupportsIndex,
    rest: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    velocities: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
) -> dict[str, typing.Any]:
    """
    The gap [m] between a shape and an obstacle, and the friction's forces (8, 3) [N] on the corners of both rigid bodies, with their derivatives by positions at constant velocities (8, 8, 3, 3), for a contact stiffness and a coefficient of friction of 1.
    """

def shell_stresses(
    model: Model,
    sheet: typing.SupportsInt | typing.SupportsIndex,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> tuple[typing.Any, ...]:
    """
    (Green's strain, change of curvature [1/m], membrane force [N/m], bending moment [N]) of a sheet's faces at rest, in world axes: (n_f, 3, 3) each.
    """

def simulate(
    model: Model,
    input: MotionInput,
    gradients: bool,
    budget: typing.SupportsInt | typing.SupportsIndex,
    keep: Keep,
    progress: typing.Any = None,
) -> MotionResult: ...
def simulate_with_tangent(
    model: Model,
    input: MotionInput,
    budget: typing.SupportsInt | typing.SupportsIndex,
    keep: Keep,
    values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    along: dict[str, typing.Any],
    progress: typing.Any = None,
) -> tuple[typing.Any, ...]:
    """
    A motion in given steps; what push_forward_motion returns of it, or None; and why there is none.
    """

def solid_point_states(
    model: Model,
    solid: typing.SupportsInt | typing.SupportsIndex,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> tuple[typing.Any, ...]:
    """
    (F, Cauchy stress [Pa], rest volumes [m3]) at the points of integration of a solid's elements: (n_t, p, 3, 3) twice and (n_t, p).
    """

def solve_with_operator(
    size: typing.SupportsInt | typing.SupportsIndex,
    column_starts: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    rows: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
    values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    added: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"],
    rhs: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    rough: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"],
    tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.0,
) -> tuple[typing.Any, ...]: ...
def state_on_joints(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    forces: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> tuple[typing.Any, ...]:
    """
    A state with its rigid parts on their joints as the values are now, the increments from there to what motors and supports prescribe, and forces of all unknowns on the free ones there.
    """

def strain_rates(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    motion: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]:
    """
    The rates of the strains of each energy that has a stress, [(k,)], along a motion of all unknowns (n,) from q.
    """

def stress_work_vjp(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    curvatures: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]],
    by_rest: bool = False,
) -> tuple[typing.Any, ...]:
    """
    The derivatives of the stresses at q times fixed strain curvatures, as strain_rates has them: by all unknowns, by every value, by the load parameters, and, if by_rest, by the rest shape, three numbers per node, else none.
    """

def term_gradients(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    angle_branches: collections.abc.Sequence[
        collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
    ],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    The gradient of each term of the energy by all unknowns, (terms, n).
    """

def touching_pairs(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> dict[str, typing.Any]:
    """
    Pairs of bodies in contact: contacts (n,), pairs (n, 4), distances (n,) [m], normal_forces (n,) [N], forces (n, 4, 3) [N], weights (n, 4) of the difference of the closest points, normals (n, 3) on the first part, friction_forces (n, 3) [N] on it and sliding_velocities (n, 3) [m/s] of it; vertex_friction_forces (n, 5, 3) [N] on slip_vertices (n, 5), which have no moment.
    """

def vjp(
    model: Model,
    q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    load_parameters: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    adjoint: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    by_rest: bool = False,
) -> tuple[typing.Any, ...]:
    """
    adjoint . dg/dk at a state q, g the gradient of the energy: (n,) by every value and (m,) by the load parameters; by_rest: also by the rest shape, three numbers per node, else none. What supports prescribe stays.
    """

def without_rest_gradient(model: Model) -> list[typing.Any]:
    """
    The names of the energies and forces that have no derivative by rest positions.
    """

def without_stress_work_vjp(model: Model) -> list[typing.Any]:
    """
    The names of the energies whose stress rates stress_work_vjp leaves out.
    """

__version__: str = "0.1.0"
vacuum_permeability: float = 1.25663706127e-06
