"""Translates the contacts of a scene to the input of the core, and checks them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.selections import indices
from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshQualityWarning
from ..bodies.bodies import called
from ..rigid.rigid import RigidBody
from ..solids.solid import Solid
from .attached_obstacles import positioned
from .body_contact import BodyContact, has_contact_shape, side_of
from .obstacles.attached import Attached
from .round_shapes import gap

if TYPE_CHECKING:
    from ..bodies.bodies import Bodies
    from ..rigid.equimomental_points import RigidBodyPoints
    from ..scene.scene import Scene
    from ..shells.shell import Shell
    from .contact import Contact
    from .obstacles.obstacle import Obstacle


def obstacles_of(contacts: Sequence[Contact | BodyContact]) -> tuple[Any, ...]:
    """Return every obstacle and shape once, in the order in which the contacts name them."""
    every = [each for contact in contacts for each in (*contact.obstacles, *contact.shapes)]
    return tuple({id(each): each for each in every}.values())


def split_contacts(contacts: Sequence[Contact | BodyContact]) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Return the contacts with obstacles, and those between bodies."""
    of_bodies = tuple(each for each in contacts if isinstance(each, BodyContact))
    return tuple(each for each in contacts if not isinstance(each, BodyContact)), of_bodies


def body_contact_inputs(
    contacts: Sequence[Contact | BodyContact], bodies: Bodies
) -> tuple[list[dict[Any, Any]], list[dict[Any, Any]]]:
    """Return the constant part of the input of contacts between bodies, which no solve can change: surfaces and contacts."""
    _check_each_pair_once(contacts)
    sides = list({id(side): side for contact in contacts for side in contact._sides}.values())
    numbers = {id(side): k for k, side in enumerate(sides)}
    return [_surface(side, bodies) for side in sides], [
        {
            "a": numbers[id(contact.a)],
            "b": numbers[id(contact.b)],
            "penalty": contact.law == "penalty",
            "rubs": contact.friction_coefficient is not None,
            "lagged": contact.lagged_friction,
        }
        for contact in contacts
    ]


def _check_each_pair_once(contacts) -> None:
    """Raise ValueError if two contacts have the same sides: their forces would count twice."""
    sides = [frozenset(map(id, contact._sides)) for contact in contacts]
    for k, contact in enumerate(contacts):
        if sides[k] in sides[:k]:
            raise ValueError(
                f"contacts must hold what is between two sides once, got {contact!r} after one of the same sides"
            )


def contact_points(bodies: Bodies, contact: Contact) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (k, 3) of the points of a contact and their weights (k, 3).

    Vertices are numbered as in the scene; points of fewer than three vertices are padded with -1. Points of welded
    vertices are returned once.
    """
    span = bodies.of(contact)
    vertices, weights = contact.points(span.mesh)
    numbers = np.where(vertices < 0, vertices, vertices + np.int32(span.first_vertex))
    if not bodies.ties:
        return numbers, weights
    repeated = (vertices[:, 1] < 0) & np.isin(
        bodies.original[numbers[:, 0]], numbers[~bodies.copies[numbers[:, 0]], 0]
    )
    chosen = ~(repeated & bodies.copies[numbers[:, 0]])
    return numbers[chosen], weights[chosen]


def rigid_bodies_in_contact(contacts: Sequence[Contact | BodyContact]) -> tuple[RigidBody, ...]:
    """Return the rigid bodies whose shapes are in contacts, each once."""
    sides = [side for contact in contacts for side in contact._sides if has_contact_shape(side)]
    return tuple({id(side): side for side in sides}.values())


def _surface(side, bodies) -> dict[Any, Any]:
    """Return the contact surface of a body, of a rigid body's shape, or the faces between a rigid body's vertices.

    Faces are (k, 3), with the scene's numbers of vertices.
    """
    body = side_of(side)
    try:
        rigid = bodies.rigid_number(side) if isinstance(side, RigidBody) else -1
        number = -1 if has_contact_shape(side) else bodies.number(body)
    except ValueError:
        raise ValueError(f"a Contact is about a body that is not in the scene: {side!r}") from None
    faces, chosen = body.mesh.faces, np.arange(body.mesh.n_faces)
    if number < 0:
        rows = (faces + bodies.first_on_surface(side)).astype(np.int32)
        return {"name": f"rigid part {rigid}", "faces": rows, "numbers": chosen.astype(np.int32)}
    span = bodies.spans[number]
    if rigid >= 0:
        own = indices("RigidBody vertices", side.vertices, body.mesh.n_vertices)
        chosen = np.flatnonzero(np.isin(faces, own).all(axis=1))
        if not chosen.size:
            raise ValueError(
                f"rigid part {rigid} touches nothing, as no face of its body has all corners among its vertices"
            )
    return {
        "name": f"body {number}",
        "faces": bodies.original[faces[chosen] + span.first_vertex].astype(np.int32),
        "numbers": chosen.astype(np.int32),
    }


def check_neighbours(scene: Scene, warns: bool = False) -> None:
    """Raise ValueError or warn if a minimal distance is larger than the rest distance of neighbours along a surface.

    Neighbours cannot keep a larger distance. It is an error if the minimal distance was given; if it comes from a
    thickness, this warns if `warns` is true.
    """
    for k, contact in enumerate(scene._body_contacts):
        wanted = scene._in_core.current(contact).min_distance
        nearest, faces = _core.nearest_neighbours(scene._model, k)
        if wanted <= nearest:
            continue
        kind = type(contact).__name__.removeprefix("Body")
        reason = (
            f"the min_distance of a {kind}, {wanted:g} m, is larger than what neighbours along a surface have at rest: "
            f"{faces} are {nearest:g} m apart"
        )
        if contact._distance_given or wanted != contact.min_distance:
            raise ValueError(f"{reason}. Give it at most {nearest:g} m, or a mesh with longer edges")
        if warns:
            left = 0.5 * nearest * wanted / (wanted + contact.activation_distance)
            warnings.warn(
                f"{reason}, and keep {left:g} m of it. All that are not neighbours keep it. A mesh with edges longer than "
                "the thickness needs no such exception, nor does a smaller min_distance=",
                MeshQualityWarning,
                stacklevel=callers_level(),
            )


def check_apart(scene: Scene, state: np.ndarray) -> None:
    """Raise ValueError if bodies in contact intersect in the start of a solve, or are nearer than their minimal
    distance.
    """
    check_neighbours(scene)
    if scene._body_contacts and (reason := scene._model.refusal(state)):
        raise ValueError(f"the start cannot be: {reason}")


def check_shapes(
    contacts: Sequence[Contact | BodyContact], parts: Sequence[RigidBody], points: list[RigidBodyPoints]
) -> None:
    """Raise ValueError for a contact with obstacles that seems to act on the shape of a rigid body.

    Obstacles keep out vertices of sheets and solids only. If there is a rigid body with a shape but without vertices, a
    contact must name its body or vertices.
    """
    bare = [
        k
        for k, (part, own) in enumerate(zip(parts, points, strict=True))
        if part.shape is not None and not len(own.vertices)
    ]
    for contact in contacts:
        if bare and contact.body is None and contact.vertices is None and not contact.shapes:
            raise ValueError(
                f"{contact!r} would let the shape of rigid part {bare[0]} through, as obstacles keep out vertices of sheets "
                "and solids only: say which body it is about, Contact(..., body=...), and have a held Shell in the "
                "obstacle's place for the rigid part, ms.Contact(rigid, shell)"
            )


def contact_inputs(contacts: Sequence[Contact | BodyContact], bodies: Bodies) -> list[dict[Any, Any]]:
    """Return the constant part of the input of contacts with obstacles, which no solve can change."""
    numbers = {id(each): k for k, each in enumerate(obstacles_of(contacts))}
    inputs = []
    for contact in contacts:
        vertices, weights = contact_points(bodies, contact)
        if not len(vertices) and not contact.shapes:
            raise ValueError(
                f"{contact!r} is about nothing: the scene has no vertices that obstacles could keep out"
            )
        _check_attached(contact, vertices, bodies)
        inputs.append(
            {
                "obstacles": [numbers[id(each)] for each in contact.obstacles],
                "vertices": vertices,
                "weights": weights,
                "rubs": contact.friction_coefficient is not None,
                "lagged": contact.lagged_friction,
                "rounds": [
                    {
                        "shape": numbers[id(pair.shape)],
                        "obstacle": numbers[id(pair.obstacle)],
                        "core": pair.core,
                    }
                    for pair in contact._rounds
                ],
            }
        )
    return inputs


def _check_attached(contact: Contact, vertices: np.ndarray, bodies: Bodies) -> None:
    """Raise ValueError if an attached obstacle acts on vertices of its own rigid body."""
    for obstacle in contact.obstacles:
        if not isinstance(obstacle, Attached) or contact.shapes:
            continue
        if obstacle.to.vertices is None:
            continue
        own = bodies.of(obstacle.to).first_vertex + np.asarray(obstacle.to.vertices)
        if np.isin(vertices, own).any():
            raise ValueError(
                f"the Contact with {obstacle!r:.80} acts on vertices of the rigid body that carries it: give the Contact "
                "vertices= of other bodies, or body="
            )


def poses(obstacle: Obstacle, times: np.ndarray) -> np.ndarray:
    """Return an obstacle's displacements, rotation vectors, velocities and angular velocities at times, (n_times, 4,
    3).
    """
    return np.array([(*obstacle.pose(time), *obstacle.rates(time)) for time in times]).reshape(-1, 4, 3)


DEEPEST_START = (
    0.1  # [-] of half the smallest width of a shape: the depth in an obstacle at which it may start
)
# [rad] Largest rotation of the normal of a smooth surface within the smoothing of a contact; a larger one is a kink.
LARGEST_SMOOTH_TURN = 0.3


def near_kinks(
    contact: Contact,
    obstacles: Sequence[Obstacle],
    sheets: Sequence[Shell | Solid],
    bodies: Bodies,
    positions: np.ndarray,
    time: float,
) -> np.ndarray:
    """Return the vertices (k,) of contact points that are closer than the smoothing to a kink of an obstacle's
    distance.

    sheets: the bodies in contact, as they are in this solve.
    """
    vertices, weights = contact_points(bodies, contact)
    points = np.einsum("pk,pkc->pc", weights, positions[vertices])
    offsets = contact._law(*sheets)[1] * np.concatenate([np.eye(3), -np.eye(3)])
    found = [np.zeros(0, dtype=vertices.dtype)]
    for obstacle in obstacles:
        active = obstacle.signed_distance(points, time) < contact.offset
        here = points[active]
        around = obstacle.normals(here[:, None, :] + offsets, time)
        cosines = np.einsum("pc,pkc->pk", obstacle.normals(here, time), around).min(axis=1, initial=1.0)
        found.append(vertices[active][cosines < np.cos(LARGEST_SMOOTH_TURN)].ravel())
    every = np.unique(np.concatenate(found))
    return every[every >= 0]


def check_outside(scene: Scene, values: Any, points: np.ndarray, time: float) -> None:
    """Raise ValueError if a body starts too deep in an obstacle, whose force would then shoot it out.

    The limit is half the thickness for a sheet, and a hundredth of its size for a solid.

    points: positions of the vertices, (n_v, 3) m, or also of the points of rigid bodies, which are else at rest.
    """
    if not scene._obstacle_contacts:
        return
    positions, own = points[: scene.mesh.n_vertices], points[scene.mesh.n_vertices :]
    allowed = np.empty(scene.mesh.n_vertices)
    for span, sheet in zip(scene._bodies.spans, values.deformable, strict=True):
        solid = isinstance(sheet, Solid)
        allowed[span.vertices] = 0.01 * sheet.mesh.size if solid else 0.5 * np.max(sheet.thickness)
    for contact in scene._obstacle_contacts:
        _check_shapes_outside(scene, values, contact, own, time)
        vertices, weights = contact_points(scene._bodies, contact)
        where = np.einsum("pk,pkc->pc", weights, positions[vertices])
        offset = values.current(contact).offset
        for obstacle in contact.obstacles:
            now = positioned(scene, values.current(obstacle), own if len(own) else None)
            depth = offset - now.signed_distance(where, time)
            inside = np.flatnonzero(depth > allowed[vertices[:, 0]])
            if inside.size:
                worst = inside[np.argmax(depth[inside])]
                touched = np.unique(vertices[inside][vertices[inside] >= 0])
                raise ValueError(
                    f"{_owner(scene, vertices[worst, 0])} starts inside {obstacle!r}: {_list(touched)}, the deepest "
                    f"{depth[worst]:.3g} m deep at vertex {vertices[worst, 0]}"
                )


def _check_shapes_outside(scene: Scene, values: Any, contact: Contact, own: np.ndarray, time: float) -> None:
    """Raise ValueError if a shape of a contact starts deeper in an obstacle than a tenth of half its width.

    own: the points of rigid bodies, (n, 3) m, or none if they are at rest.
    """
    for pair in contact._rounds:
        shape, obstacle = (
            positioned(scene, values.current(each), own if len(own) else None)
            for each in (pair.shape, pair.obstacle)
        )
        depth = values.current(contact).offset - gap(pair, shape, obstacle, time).distance
        if depth > DEEPEST_START * pair.least:
            raise ValueError(f"{pair.shape!r:.80} starts inside {pair.obstacle!r:.80}, {depth:.3g} m deep")


def _owner(scene: Scene, vertex: int) -> str:
    """Name the body that a vertex of the scene belongs to, by number where there are several."""
    number = next(k for k, span in enumerate(scene._bodies.spans) if vertex < span.vertices.stop)
    return called([scene.bodies[number]]) if len(scene.bodies) == 1 else f"body {number}"


def _list(vertices: np.ndarray) -> str:
    shown = ", ".join(map(str, vertices[:5]))
    return f"vertices {shown}" + (f" and {len(vertices) - 5} more" if len(vertices) > 5 else "")
