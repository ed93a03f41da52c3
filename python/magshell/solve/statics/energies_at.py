"""Energies of a scene at given positions, which need not be an equilibrium, and their derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from ... import _core
from ..._input.quantity import quantity
from ..._input.scalars import flag
from ..._input.tensors import dtype_like, like
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import solve_entry
from ...errors import NoGradient
from ...model.bodies.bodies import checked_body
from ...model.scene.fine_faces import with_fine_faces
from ...model.scene.own_field_errors import gap_errors, warn_of_gaps
from ...model.scene.own_field_overlap import describe_overlap
from ...model.scene.scene import Scene
from ...model.shells.shell import Shell
from ...model.solids.solid import Solid
from ..adjoint.energy import EnergyAdjoint, Unknowns
from .single_solve import inputs_of
from .start import check_faces

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


_ELASTIC = ("membrane", "bending")  # of shells


@solve_entry
def energies(
    scene: Scene,
    positions: Numbers,
    *,
    edge_rotations: Numbers | None = None,
    body: Shell | Solid | None = None,
    by: str | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
) -> dict[str, Any]:
    """Compute the potential energies of a scene at given positions, in equilibrium or not, {name: J}.

    positions: (n_v, 3) m. edge_rotations: (n_e,) rad, as a result has them, of sheets with bending="midedge"; by default
        none, which leaves the normals across edges half-way between those of their faces.
    body: a body of the scene, to get its elastic energies alone: "membrane" and "bending" of a Shell, "solid" of a Solid.
    by: "face" or "tetrahedron", to get the elastic and magnetic energies of every element of the body, {name: (n,) J}. Their
        sums are the energies of the body. Energies of loads and contact do not belong to elements and are left out. A scene
        of one Shell or Solid needs no `body`.

    {keywords}
    values: as in ms.equilibrium.

    At the positions of an equilibrium these are its `energies`. The directions that clamps prescribe are used; other
    prescribed displacements are not. If an input is a tensor, so are the energies: see ms.energy. Single energies have the
    same derivatives as their sum; their second derivatives with respect to positions are differences of gradients. Energies
    of one body (ValueError) and of elements (NoGradient) have no derivatives.

    Raises ValueError on bad input, and where the energy is not defined: bodies in contact intersect or are nearer than
    allowed, elements are turned inside out whose material does not allow it, edges of bodies with an own field coincide, or
    it is not finite. ms.FieldSamplingWarning tells where such bodies are too near each other for their meshes.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    >>> stretched = ms.energies(scene, mesh.rest_positions * (1.01, 1, 1))
    >>> round(stretched["membrane"], 9)  # E h A/2 by the square of a strain of (1.01^2 - 1)/2
    0.000101002
    """
    arguments = given_to("energies", locals())
    number = None if checked_body(body) is None else _number(scene, body)
    chosen = None if by is None else _element_kind(scene, by, body)
    at = _point("energies", scene, positions, edge_rotations, arguments)
    leaves = at.adjoint.inputs.leaves
    if chosen is not None:
        if leaves:
            raise NoGradient(f"energies by {by} have no gradients: give tensors detached")
        found = _of_elements(at.adjoint, *chosen)
        at.check_finite(*found.values())
        return found
    if number is not None and leaves:
        raise ValueError("energies of one body have no gradients: give tensors detached, or no body")
    with at.adjoint.inputs.in_core():
        found = at.adjoint.by_name() if number is None else _of_body(scene, number, at.adjoint.of_terms())
    at.check_finite(*found.values())
    if not leaves:
        return found
    from ..adjoint.energy_autograd import energies_of

    tensors = energies_of(at.adjoint, np.array([*found.values()]), at.dtype, at.adjoint.inputs.tensors)
    return dict(zip(found, tensors.unbind(), strict=True))


@solve_entry
def energy(
    scene: Scene,
    positions: Numbers,
    *,
    edge_rotations: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
) -> Any:
    """Compute the potential energy of a scene at given positions, in equilibrium or not, J: the sum of ms.energies.

    positions: (n_v, 3) m. edge_rotations: (n_e,) rad, as in ms.energies.

    {keywords}
    values: as in ms.equilibrium.

    With tensors it is a tensor, differentiable by positions, edge rotations and everything else above. First derivatives by
    positions and edge rotations are exact. Those by values are differences of eighth order, checked against sixth, one value
    of the core after another (8 energies each): cheap for a number, slow for one number a face of a large mesh.
    Second derivatives by positions (Hessian-vector products) are exact. Those by positions and values are exact, too, where
    the gradient by positions is taken first. Those that begin with a gradient by values are differences along one
    direction, right to some 1e-9, at the cost of eight to sixteen such gradients. Third derivatives raise NoGradient.

    Raises ValueError as ms.energies does, and NoGradient where an energy is not smooth in a value.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    >>> round(ms.energy(scene, mesh.rest_positions * (1.01, 1, 1)), 9)  # J
    0.000101002
    """
    arguments = given_to("energy", locals())
    at = _point("energy", scene, positions, edge_rotations, arguments)
    inputs = at.adjoint.inputs
    with inputs.in_core():
        found = at.adjoint.by_name()
    at.check_finite(*found.values())
    if not inputs.leaves:
        return sum(found.values())
    from ..adjoint.energy_autograd import energies_of

    return energies_of(at.adjoint, np.array([*found.values()]), at.dtype, inputs.tensors).sum()


@solve_entry
def forces(
    scene: Scene,
    positions: Numbers,
    *,
    edge_rotations: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
) -> Forces:
    """Compute the forces of a scene at given positions: minus the gradient of ms.energy.

    positions: (n_v, 3) m. edge_rotations: (n_e,) rad, as in ms.energies.

    {keywords}
    values: as in ms.equilibrium.

    Returns (on_vertices (n_v, 3) N, on_edge_rotations (n_e,) N m); the latter are zero on edges that cannot rotate.
    They include no forces of supports: at an equilibrium, the remaining forces are those that the supports bear. With
    tensors they are tensors, differentiable once by positions, edge rotations and everything else above. Vertices that
    are welded together share their force.

    Raises ValueError as ms.energies does, and for scenes with rigid bodies or skeletons.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    >>> pulled = ms.forces(scene, mesh.rest_positions * (1.01, 1, 1)).on_vertices
    >>> round(float(pulled[mesh.vertices_at(x=0.0), 0].sum()), 6)  # N, E t b (1.01^2 - 1)/2 1.01
    0.20301
    """
    arguments = given_to("forces", locals())
    at = _point("forces", scene, positions, edge_rotations, arguments)
    inputs = at.adjoint.inputs
    at.check_finite(*at.adjoint.by_unknowns)
    if not inputs.leaves:
        return Forces(*(like(-each, *inputs.given) for each in at.adjoint.by_unknowns))
    from ..adjoint.energy_autograd import gradient_of

    return Forces(*(-each for each in gradient_of(at.adjoint, at.dtype, inputs.tensors)))


@solve_entry
def hessian(
    scene: Scene,
    positions: Numbers,
    *,
    edge_rotations: Numbers | None = None,
    reduced: bool = False,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
) -> Any:
    """Compute the Hessian of ms.energy at given positions, a symmetric scipy.sparse matrix.

    positions: (n_v, 3) m. edge_rotations: (n_e,) rad, as in ms.energies.
    reduced: whether to return B^T H B for the free unknowns alone, with B of ms.free_motions. By default H has 3 n_v +
        n_e rows in the order of positions.ravel(), then of the edge rotations; rows of edges that cannot rotate are zero.

    {keywords}
    values: as in ms.equilibrium.

    The Hessian is not projected: away from an equilibrium it may be indefinite. Terms that couple all vertices, such as the
    pressure of a cavity, make it dense.

    Raises ValueError as ms.forces does, and for tensors that require a gradient.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    >>> ms.hessian(scene, mesh.rest_positions, reduced=True).shape  # (33 - 3) * 3, and 70 edges that rotate
    (160, 160)
    """
    arguments = given_to("hessian", locals())
    flag("reduced", reduced)
    at = _point("hessian", scene, positions, edge_rotations, arguments)
    if at.adjoint.inputs.leaves:
        raise ValueError("a Hessian has no gradients: give tensors detached")
    order = at.adjoint.unknowns
    at.check_finite(at.adjoint.hessian.data)
    whole = scipy.sparse.csr_array(order.to_core.T @ at.adjoint.hessian @ order.to_core)
    if not reduced:
        return whole
    motions = free_motions(scene)
    return scipy.sparse.csr_array(motions.T @ whole @ motions)


def free_motions(scene: Scene) -> Any:
    """Return the sparse matrix B (3 n_v + n_e, n) of the motions that supports leave free, for ms.hessian.

    scene: without rigid bodies, skeletons, EqualDisplacement and Periodic; else a ValueError.

    Its rows have the order of positions.ravel(), then of the edge rotations; B z is a motion of them, B^T f a force on
    the free unknowns z. Its columns are orthonormal but where vertices are welded together.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, bending="hinge")
    >>> ms.free_motions(ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])).shape
    (171, 90)
    """
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
    if scene._constraints.tied:
        raise ValueError(
            "the free motions of a scene with EqualDisplacement or Periodic are not available yet"
        )
    order, model = Unknowns("free_motions", scene), scene._model
    free = np.arange(model.free_size)
    rows, columns, entries = [], [], []
    # A vertex has at most three free unknowns, numbered one after another: every third unknown at a time.
    for first in range(3):
        some = free % 3 == first
        values = model.expand(some.astype(float))
        there = np.flatnonzero(np.abs(values) > 1e-12)  # 1: a direction's component, of at most 1
        rows.append(there)
        entries.append(values[there])
        columns.append(np.rint(model.expand(np.where(some, free, 0.0))[there] / values[there]).astype(int))
    data = np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))
    of_core = scipy.sparse.csr_array(data, shape=(model.size, model.free_size))
    return scipy.sparse.csr_array(order.gathered @ of_core)


class Forces(NamedTuple):
    """The forces of a scene at given positions, the result of ms.forces.

    on_vertices: (n_v, 3) N. on_edge_rotations: (n_e,) N m.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    >>> ms.forces(scene, mesh.rest_positions).on_vertices.shape
    (33, 3)
    """

    on_vertices: Any
    on_edge_rotations: Any


class _Point(NamedTuple):
    """The energies at positions, and the dtype of tensors made of them."""

    adjoint: EnergyAdjoint
    dtype: Any

    def check_finite(self, *found: Any) -> None:
        """Raise ValueError unless all of these energies, forces or second derivatives are finite."""
        if all(np.isfinite(each).all() for each in found):
            return
        inputs = self.adjoint.inputs
        with inputs.in_core():
            state = self.adjoint.state(inputs.load_parameters)
            reason = inputs.scene._model.not_finite(state, inputs.load_parameters)
        raise ValueError(f"there is no energy at these positions: {reason or 'it is not finite'}")


def _number(scene: Scene, body: Shell | Solid) -> int:
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
    return scene._bodies.number(body)


def _point(function: str, scene: Scene, positions, edge_rotations, arguments: dict[str, Any]) -> _Point:
    """Check the arguments of one of the functions here. Raises ValueError, also where there is no energy."""
    inputs = inputs_of(scene, arguments, ignore_velocity_forces=True)
    model, bodies = scene._model, scene._bodies
    places = quantity("positions", "m", inputs.take("positions", positions), (scene.mesh.n_vertices, 3))
    bodies.check_welded("positions", "m", places)
    check_faces(scene, places, "positions")
    rotations = np.zeros(bodies.n_rotations)
    if edge_rotations is not None:
        rotations = inputs.take("edge_rotations", edge_rotations)
        rotations = quantity("edge_rotations", "rad", rotations, (bodies.n_rotations,))
    with inputs.in_core():
        state = model.state(places, rotations)
    inputs = with_fine_faces(inputs, state, inputs.load_parameters)
    with inputs.in_core():
        adjoint = EnergyAdjoint(function, inputs, state)
        if reason := model.refusal(adjoint.state(inputs.load_parameters)):
            raise ValueError(f"there is no energy at these positions: {reason}")
    if reason := describe_overlap(inputs.values, state):
        raise ValueError(f"there is no energy at these positions: {reason}")
    warn_of_gaps(gap_errors(inputs.values, state), "these positions")
    return _Point(adjoint, dtype_like(*inputs.given) if inputs.leaves else None)


_KINDS = {"face": Shell, "tetrahedron": Solid}


def _element_kind(scene: Scene, by: str, body: Shell | Solid | None) -> tuple[bool, int]:
    """Return whether elements are those of a solid, and the number of their body among the sheets or solids of a scene.

    Raises ValueError for another `by`, and if there is no such body, or none is chosen of several.
    """
    if not isinstance(by, str) or by not in _KINDS:
        raise ValueError(f'by must be "face" or "tetrahedron", got {by!r:.60}')
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
    bodies, kind = scene._bodies, _KINDS[by]
    if body is None:
        found = [each for each in (*bodies.shells, *bodies.solids) if isinstance(each, kind)]
        if len(found) != 1:
            raise ValueError(f"the scene has {len(found)} bodies with energies by {by}: choose one by body=")
        (body,) = found
    elif not isinstance(body, kind):
        raise ValueError(f"a {type(body).__name__} has no energies by {by}")
    among = bodies.shells if kind is Shell else bodies.solids
    return kind is Solid, next(k for k, each in enumerate(among) if each is body)


def _of_elements(adjoint: EnergyAdjoint, of_solid: bool, number: int) -> dict[str, np.ndarray]:
    """Return the energies of the elements of a body, {name: (n,) J}."""
    inputs, found = adjoint.inputs, {}
    model = inputs.scene._model
    with inputs.in_core():
        of_terms = _core.element_energies(
            model, adjoint.state(inputs.load_parameters), inputs.load_parameters
        )
    for name, solid, whose, elements in of_terms:
        if solid == of_solid and whose == number:
            found[name] = found.get(name, 0.0) + elements
    return found


def _of_body(scene, number: int, of_terms: list[tuple[str, float]]) -> dict[str, float]:
    """Return the elastic energies of one body; the core lists elastic terms in the order of the bodies, one each."""
    body, bodies = scene.bodies[number], scene._bodies
    kind, names = (bodies.solids, ("solid",)) if isinstance(body, Solid) else (bodies.shells, _ELASTIC)
    before = next(k for k, each in enumerate(kind) if each is body)
    return {name: [energy for each, energy in of_terms if each == name][before] for name in names}
