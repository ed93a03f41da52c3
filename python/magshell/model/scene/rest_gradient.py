"""The gradient of an equilibrium by the rest positions of a shell: that of the core, and that through its mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.selections import indices
from ...errors import NoGradient
from ...mesh.rest_shape import by_areas, by_continuations, by_edge_vectors, by_lengths, by_magnetizations
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..loads.face_energies import FaceEnergy
from ..loads.loads import AreaLoad, EdgeCouple, EdgeLoad, PointLoad
from ..loads.pressure import Pressure
from ..supports.supports import Clamp, rotation_matrix

if TYPE_CHECKING:
    from ..shells.shell import Shell
    from .scene import Scene
    from .solve_inputs import Inputs
    from .values import Gradient, Values

_LOADS = (PointLoad, EdgeLoad, AreaLoad, EdgeCouple, FaceEnergy, Pressure)


class AtNodes(NamedTuple):
    """Gradients by vertices (n_v, 3) and by the directions across edges (n_d, 3)."""

    vertices: np.ndarray
    directions: np.ndarray


def without_rest_gradient(scene: Scene, bodies: Any) -> list[str]:
    """Return words for everything in a scene that has no derivative by the rest positions of these bodies."""
    found = [f"{type(load).__name__}" for load in scene.loads if not isinstance(load, _LOADS)]
    rubbing = [contact for contact in scene.contacts if contact.friction_coefficient is not None]
    if any(
        contact.sticking_speed is None for contact in rubbing
    ):  # by default in proportion to the width of the mesh
        found.append("friction without a sticking_speed of its own")
    if any(not isinstance(body.mesh, TriangleMesh) for body in scene.bodies):
        found.append("bodies that are no shells of three-node faces")
    for body in bodies:
        found += [name for name in ("growth", "rest_curvature") if getattr(body, name) is not None]
        if scene.is_magnetic and body.magnetization_law != "stretches":
            found.append("a magnetization that rotates")
        if body.susceptibility is not None:
            found.append("a susceptibility")
        if scene._model.recut_faces and any(
            np.ptp(getattr(body, name)) > 0.0 for name in ("thickness", "young_modulus", "poisson_ratio")
        ):
            found.append("faces of different materials where obtuse ones are cut along their other diagonal")
    return list(dict.fromkeys(found))


def by_rest_positions(inputs: Inputs, body: Shell, gradient: Gradient) -> np.ndarray:
    """Return the gradient by the rest positions of one shell, (n_v, 3), from the core's gradient.

    body: as it is in the scene, whose mesh has these rest positions. Raises NoGradient if the core's gradient was
    computed without rest positions.
    """
    if gradient.rest is None:
        raise NoGradient("no gradient by rest_positions: this function has none")
    values, scene = inputs.values, inputs.scene
    elastic, prescribed = (AtNodes(*each) for each in gradient.rest)
    held = _by_rest_of_held(inputs, prescribed)
    span = scene._bodies.spans[scene._bodies.number(body)]
    found = (elastic.vertices + held.vertices)[span.vertices]
    found += _through_directions(values, span, elastic.directions + held.directions)
    found += _through_moves(values, span, gradient)
    found += _through_masses(values, values.current(body), span, gradient)
    label = next(label for each, label in scene._labels if each is body)
    if gradient.has(label, "remanent_magnetization"):
        rows = scene._value_layout.of(values.numbers, label, "remanent_magnetization")
        found += by_magnetizations(span.mesh, rows, gradient.value(label, "remanent_magnetization"))
    for load in map(values.current, scene.loads):
        part = scene._bodies.of(load)
        of_load = np.zeros((scene.mesh.n_vertices, 3))
        of_load[part.vertices] = _through_load(values, load, part, gradient)
        found += of_load[span.vertices]
    return found


def _by_rest_of_held(inputs: Inputs, prescribed: AtNodes) -> AtNodes:
    """Return the gradient by where supports hold nodes at rest, from that by where they hold them in this solve."""
    constraints, scene = inputs.values.constraints, inputs.scene
    rows = np.concatenate([prescribed.vertices, prescribed.directions])
    factor = float(scene._control_layout.of(inputs.controls, "scene", "support_factor")[0])
    turns = [rotation_matrix(factor * move.rotation) for move in constraints.moves]
    found = np.zeros_like(rows)
    nodes, counts = constraints.held_nodes[:, 0], constraints.held_nodes[:, 1]
    for axis in range(3):
        here = counts > axis
        along = constraints.held_frames[here, :, axis]
        part = along * (along * rows[nodes[here]]).sum(axis=1, keepdims=True)
        moves = constraints.held_nodes[here, 2 + axis]
        for k in np.unique(moves[moves >= 0]):
            part[moves == k] = part[moves == k] @ turns[k]
        found[nodes[here]] += part
    n_v = len(prescribed.vertices)
    return AtNodes(found[:n_v], found[n_v:])


def _through_directions(values: Values, span: Any, of_directions: np.ndarray) -> np.ndarray:
    """Return the gradient through the directions across clamped edges, and across those with a moment, (n_v, 3)."""
    scene, constraints = values.scene, values.constraints
    n_held = len(constraints.directions) - len(scene._moment_edges)
    held, owners = constraints.directed_edges, constraints.direction_owners
    clamped = np.array([isinstance(owners[row], Clamp) for row in held[:, 1].tolist()], dtype=bool)
    edges = np.concatenate([held[clamped, 0], scene._moment_edges])
    by = np.concatenate([of_directions[held[clamped, 1]], of_directions[n_held:]])
    here = (edges >= span.edges.start) & (edges < span.edges.stop)
    return by_continuations(span.mesh, edges[here] - span.first_edge, by[here])


def _through_moves(values: Values, span: Any, gradient: Gradient) -> np.ndarray:
    """Return the gradient through the centers of moves that are means of rest positions, (n_v, 3)."""
    found = np.zeros((span.mesh.n_vertices, 3))
    for k, move in enumerate(values.constraints.moves):
        support = move.support
        if values.scene._bodies.of(support) is not span or support._move.center is not None:
            continue
        vertices = np.unique(
            np.concatenate([held.vertices for held in support._held(span.mesh) if held.move is not None])
        )
        found[vertices] += gradient.value(f"move {k}", "center")[0] / len(vertices)
    return found


def _through_masses(values: Values, body: Shell, span: Any, gradient: Gradient) -> np.ndarray:
    """Return the gradient through the weights of the vertices, (n_v, 3)."""
    mesh, by_masses = span.mesh, values.by_masses(gradient)
    if by_masses is None:
        return np.zeros((mesh.n_vertices, 3))
    of_faces = by_masses[span.vertices][mesh.faces].mean(axis=1)
    return by_areas(mesh, np.arange(mesh.n_faces), of_faces * body._areal_masses)


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
        forward = np.where(mesh.edge_faces[edges, 0] >= 0, 1.0, -1.0)
        return by_edge_vectors(mesh, edges, (forward * by_moments)[:, None] * couple)
    of_solve = "vertex_loads" in values.replaced.get(values.scene, {})  # in place of all such loads
    if of_solve or not isinstance(load, EdgeLoad | AreaLoad):
        return 0.0
    vertices, _ = load._nodal_weights(mesh)
    forces = np.broadcast_to(getattr(load, load._replaceable[0]), (len(vertices), 3))
    by_forces = gradient.value("loads", "forces")[part.vertices][vertices].mean(axis=1)
    by_measure = (by_forces * forces).sum(axis=1)  # each vertex carries an equal part
    if isinstance(load, EdgeLoad):
        return by_lengths(mesh, indices("EdgeLoad edges", load.edges, mesh.n_edges), by_measure)
    faces = np.arange(mesh.n_faces) if load.faces is None else load.faces
    return by_areas(mesh, faces, by_measure)
