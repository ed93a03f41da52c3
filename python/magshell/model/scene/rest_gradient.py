"""The gradient by the rest positions of a body: that of the core, and that through numbers computed from its mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._input.selections import indices
from ...errors import NoGradient
from ...mesh.mesh_base import width_of
from ...mesh.rest_shape import (
    by_continuations,
    by_edge_vectors,
    by_lengths,
    by_nodal_areas,
    by_nodal_lengths,
    by_width,
)
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ..actuators.tendon import Tendon
from ..loads.foundation import ElasticFoundation
from ..loads.loads import AreaLoad, EdgeCouple, EdgeLoad
from ..loads.spring import Spring
from ..supports.displacement_ties import DisplacementTie
from ..supports.supports import Clamp

if TYPE_CHECKING:
    from ..shells.shell import Shell
    from ..solids.solid import Solid
    from .scene import Scene
    from .solve_inputs import Inputs
    from .values import Gradient, Values


class AtNodes(NamedTuple):
    """Gradients by vertices (n_v, 3) and by the directions across edges (n_d, 3)."""

    vertices: np.ndarray
    directions: np.ndarray


def without_rest_gradient(scene: Scene) -> list[str]:
    """Return words for everything in a scene that has no derivative by rest positions."""
    return list(dict.fromkeys(_core.without_rest_gradient(scene._model)))


def by_rest_positions(inputs: Inputs, body: Shell | Solid, gradient: Gradient) -> np.ndarray:
    """Return the gradient by the rest positions of one body, (n_v, 3), from the core's gradient.

    body: as it is in the scene, whose mesh has these rest positions. Raises NoGradient if the core's gradient was
    computed without rest positions.
    """
    if gradient.rest is None:
        raise NoGradient("no gradient by rest_positions: this function has none")
    values, scene = inputs.values, inputs.scene
    span = scene._bodies.spans[scene._bodies.number(body)]
    shape = AtNodes(*gradient.rest)
    found = shape.vertices[span.vertices].copy()  # adjoints keep their gradients
    found += _through_directions(values, span, shape.directions)
    found += _through_moves(values, span, gradient)
    found += _through_contacts(values, body, gradient)
    found += _through_masses(values, values.current(body), span, gradient)
    found += _through_rigid_centers(values, body, gradient)
    for own, label in scene._labels:
        if isinstance(own, Spring | Tendon):
            found += values.current(own)._by_rest_positions(body, label, gradient)
        elif isinstance(own, ElasticFoundation) and scene._bodies.of(own) is span:
            found += values.current(own)._by_rest_positions(span.mesh, label, gradient)
    for load in map(values.current, scene.loads):
        part = scene._bodies.of(load)
        of_load = np.zeros((scene.mesh.n_vertices, 3))
        of_load[part.vertices] = _through_load(values, load, part, gradient)
        found += of_load[span.vertices]
    return found


def _through_rigid_centers(values: Values, body: Shell | Solid, gradient: Gradient) -> np.ndarray:
    """Return the gradient through the centers of rigid bodies that are the means of their vertices, (n_v, 3)."""
    scene = values.scene
    found = np.zeros((body.mesh.n_vertices, 3))
    for own, part in zip(scene.rigid_parts, values.rigid, strict=True):
        of = scene.bodies[0] if own.body is None else own.body
        if not own._center_follows or of is not body or "center" in values.replaced.get(own, {}):
            continue
        label = next(label for owner, label in scene._labels if owner is own)
        by_center = part._gradients(label, values, gradient)["center"]
        np.add.at(found, own.vertices, by_center / len(own.vertices))
    return found


def _through_directions(values: Values, span: Any, of_directions: np.ndarray) -> np.ndarray:
    """Return the gradient through the directions across clamped edges, and across those with a moment, (n_v, 3)."""
    scene, constraints = values.scene, values.constraints
    n_held = len(constraints.directions) - len(scene._moment_edges)
    held, owners = constraints.directed_edges, constraints.direction_owners
    clamped = np.array([isinstance(owners[row], Clamp) for row in held[:, 1].tolist()], dtype=bool)
    edges = np.concatenate([held[clamped, 0], scene._moment_edges])
    by = np.concatenate([of_directions[held[clamped, 1]], of_directions[n_held:]])
    here = (edges >= span.edges.start) & (edges < span.edges.stop)
    if not here.any():
        return np.zeros((span.mesh.n_vertices, 3))
    return by_continuations(span.mesh, edges[here] - span.first_edge, by[here])


def _through_moves(values: Values, span: Any, gradient: Gradient) -> np.ndarray:
    """Return the gradient through the centers of moves that are means of rest positions, (n_v, 3)."""
    found = np.zeros((span.mesh.n_vertices, 3))
    for k, move in enumerate(values.constraints.moves):
        support = move.support
        if isinstance(support, DisplacementTie):
            continue
        if values.scene._bodies.of(support) is not span or support._move.center is not None:
            continue
        vertices = np.unique(
            np.concatenate([held.vertices for held in support._held(span.mesh) if held.move is not None])
        )
        found[vertices] += gradient.value(f"move {k}", "center")[0] / len(vertices)
    return found


def _through_contacts(values: Values, body: Shell | Solid, gradient: Gradient) -> np.ndarray:
    """Return the gradient through the width from which contacts take their defaults, (n_v, 3)."""
    found = np.zeros((body.mesh.n_vertices, 3))
    for contact, label, bodies in values.contacts:
        widest = max(bodies, key=lambda each: width_of(each.mesh))
        if widest is values.current(body):
            found += by_width(body.mesh, contact._by_width(label, bodies, gradient))
    return found


def _through_masses(values: Values, body: Shell | Solid, span: Any, gradient: Gradient) -> np.ndarray:
    """Return the gradient through the masses of the vertices, for inertia and for weight, (n_v, 3)."""
    found = np.zeros((span.mesh.n_vertices, 3))
    of_inertia, of_weight = values.by_inertia_and_weight(gradient)
    if of_inertia is not None:
        found += body._by_rest_masses(of_inertia[span.vertices], weighed=False)
    if of_weight is not None:
        found += body._by_rest_masses(of_weight[span.vertices], weighed=True)
    return found


def _through_load(values: Values, load: Any, part: Any, gradient: Gradient) -> np.ndarray | float:
    """Return the gradient through the lengths or areas that a load acts on, (n_v of the part, 3)."""
    mesh = part.mesh
    if isinstance(load, EdgeCouple):
        edges, _ = load._along(mesh)
        of_edges = np.searchsorted(values.scene._moment_edges, part.first_edge + edges)
        by_moments = gradient.value("couples", "couples")[of_edges]
        couple = load.couple_per_length
        if couple.ndim == 0:
            return by_lengths(mesh, edges, by_moments * couple)
        faces = mesh.corners.edge_faces if isinstance(mesh, QuadraticTriangleMesh) else mesh.edge_faces
        forward = np.where(faces[edges, 0] >= 0, 1.0, -1.0)
        return by_edge_vectors(mesh, edges, (forward * by_moments)[:, None] * couple)
    of_solve = "vertex_loads" in values.replaced.get(values.scene, {})  # in place of all such loads
    if of_solve or not isinstance(load, EdgeLoad | AreaLoad):
        return 0.0
    vertices, _ = load._nodal_weights(mesh)
    forces = np.broadcast_to(getattr(load, load._replaceable[0]), (len(vertices), 3))
    by_forces = gradient.value("loads", "forces")[part.vertices][vertices]
    by_weights = (by_forces * forces[:, None]).sum(axis=2)
    if isinstance(load, EdgeLoad):
        return by_nodal_lengths(mesh, indices("EdgeLoad edges", load.edges, mesh.n_edges), by_weights)
    faces = np.arange(mesh.n_faces) if load.faces is None else load.faces
    return by_nodal_areas(mesh, faces, by_weights)
