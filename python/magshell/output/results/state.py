"""The states of a scene that can be drawn or written, collected from meshes, bodies, scenes and results.

The fields and obstacles around the bodies are at their positions in each state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensors import detached
from ...mesh.face_shapes import sides
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ...model.bodies.body_ranges import magnetized_rows
from ...model.bodies.joined_mesh import JoinedMesh
from ...model.contact.attached_obstacles import positioned
from ...model.contact.obstacles import Obstacle
from ...model.contact.round_shapes import shapes_in
from ...model.fields.field import AppliedField, UniformField
from ...model.results.result_lookup import result_of
from ...model.scene.scene import Scene
from ...model.shells.deformed_magnetization import deformed_magnetization
from ...model.shells.shell import Shell
from ...model.shells.shell_stresses import ShellStresses
from ...model.solids.solid import Solid
from ...model.solids.solid_stresses import SolidStates
from ...solve.dynamics.trajectory import Trajectory
from ...solve.statics.equilibria import EquilibriumSet
from ...solve.statics.path import EquilibriumPath
from .forces import ContactLoads, contact_loads, nodal_forces
from .link_surfaces import (
    joined,
    link_surfaces_at_rest,
    link_surfaces_of,
    mesh_of,
    shapes_at_rest,
    shapes_of,
    tendons_at_rest,
    tendons_of,
)
from .magnets import surfaces_of
from .spring_surfaces import creases_of, springs_at_rest, springs_of
from .units import clock

if TYPE_CHECKING:
    from ..._input.kinds import Fielded, Numbers, Shown, SolveResult
    from ...model.scene.scene import Scene


@dataclass(frozen=True)
class State:
    """The bodies of a scene and their surroundings at one moment.

    positions: (n_v, 3), m. remanent_magnetization: (n_f, 3), A/m, in the reference configuration, or None.
    flux_density: (3,), T, the uniform field, or None without one.
    fields: the fields that vary in space, with their sources at their positions; strength: the factor on them.
    title: what the result calls it. time: s, of a motion, or None. obstacles: those around the bodies.
    links, tendons, shapes: surfaces of links, of tendons and of free rigid bodies, (vertices (n, 3) m, faces (m, 3)) each.
    springs: surfaces of springs and foundations likewise. creases: (k, 2), the ends of their edges, vertices of the mesh.
    elements: () -> [(first face, mesh, SolidStates or ShellStresses)] of the bodies of a result, or None.
    loads: () -> ContactLoads of a result of a scene with contacts, or None.
    forces: () -> {name: (n_v, 3) N} of a result, the forces of its supports and loads on the vertices, or None.
    rotates: whether the magnetization of each face only rotates with it, (n_f,), or of all faces.
    thickness: () -> (n_f,) m, of the faces of shells, 0 on those of solids; None of a mesh.
    """

    mesh: TriangleMesh | QuadraticTriangleMesh | TetMesh | JoinedMesh
    positions: np.ndarray
    remanent_magnetization: np.ndarray | None = None
    flux_density: np.ndarray | None = None
    fields: tuple[AppliedField, ...] = ()
    strength: float = 1.0
    title: str = ""
    time: float | None = None
    obstacles: tuple[Obstacle, ...] = ()
    elements: Callable[[], list[tuple[int, TriangleMesh | TetMesh, SolidStates | ShellStresses]]] | None = (
        None
    )
    links: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    tendons: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    loads: Callable[[], ContactLoads] | None = None
    forces: Callable[[], dict[str, np.ndarray]] | None = None
    shapes: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    springs: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    creases: np.ndarray | tuple[()] = ()
    rotates: np.ndarray | bool = False
    thickness: Callable[[], np.ndarray] | None = None

    @property
    def contact_pressures(self) -> np.ndarray | None:
        """The contact pressure at the vertices, (n_v,) Pa, or None without contacts."""
        return None if self.loads is None else self.loads().pressures(self.positions, self.mesh.faces)

    @property
    def magnetization(self) -> np.ndarray:
        """The magnetization in the deformed configuration, F_0 M_r [Chen22] (20) or R M_r, (n_f, 3) A/m."""
        faces = self.mesh.faces
        if self.remanent_magnetization is None:
            return np.zeros((self.mesh.n_faces, 3))
        return deformed_magnetization(
            self.mesh.rest_positions[faces], self.positions[faces], self.remanent_magnetization, self.rotates
        )

    @property
    def is_magnetized(self) -> bool:
        return self.remanent_magnetization is not None and bool(self.remanent_magnetization.any())

    @property
    def displacements(self) -> np.ndarray:
        """The displacements from the reference configuration, (n_v, 3) m."""
        return self.positions - self.mesh.rest_positions

    @property
    def barycenters(self) -> np.ndarray:
        """The barycenters of the faces, (n_f, 3) m."""
        return self.positions[self.mesh.faces].mean(axis=1)

    @property
    def has_sources(self) -> bool:
        """Return whether there is a field that varies in space."""
        return bool(self.fields) and self.strength != 0.0

    @property
    def magnets(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The surfaces of the fields' magnets and wires, (vertices (n, 3) m, faces (m, 3)) each."""
        return (
            [surface for field in self.fields for surface in surfaces_of(field)] if self.has_sources else []
        )

    def sources(self, points: np.ndarray) -> np.ndarray:
        """Return the flux density of the fields that vary in space at points (n, 3) m, (n, 3) T."""
        return self.strength * np.sum([field.flux_density(points) for field in self.fields], axis=0)

    def flux_density_at(self, points: np.ndarray) -> np.ndarray:
        """Return the total flux density at points (n, 3) m, (n, 3) T."""
        total = np.zeros_like(points)
        if self.flux_density is not None:
            total = total + self.flux_density
        if self.has_sources:
            total = total + self.sources(points)
        return total


def states_of(
    what: Shown,
    *,
    positions: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    field: Fielded | None = None,
    obstacles: Obstacle | Sequence[Obstacle] | None = None,
) -> list[State]:
    """Collect the states of a mesh, a Shell, a Solid, a Scene, a result, or a list of those.

    A result is any object with a `scene` and `positions`, (n_v, 3) for one state or (k, n_v, 3) for k states. The keywords
    take precedence over the values of `what`.
    """
    given = {
        "positions": positions,
        "remanent_magnetization": remanent_magnetization,
        "applied_flux_density": applied_flux_density,
        "field": field,
        "obstacles": obstacles,
    }
    if isinstance(what, TriangleMesh | QuadraticTriangleMesh | TetMesh):
        return _states(what, given)
    if isinstance(what, Shell | Solid):
        return _with_thickness(_states(what.mesh, _magnetized(given, [what])), lambda k: [what])
    if isinstance(what, Scene):
        links, shapes = link_surfaces_at_rest(what), shapes_at_rest(what)
        if (links or shapes) and not what.bodies:
            return _states(mesh_of([*links, *shapes]), _with_own(given, what), [what.fields])
        states = _states(what.mesh, _with_own(given, what), [what.fields])
        tendons = tuple(tendons_at_rest(what))
        states = _with_thickness(states, lambda k: what.bodies)
        inside = {"links": tuple(links), "shapes": tuple(shapes), "tendons": tendons}
        inside |= {"springs": springs_at_rest(what), "creases": creases_of(what)}
        return [replace(state, **inside) for state in states]
    is_result = isinstance(getattr(what, "scene", None), Scene) and hasattr(what, "positions")
    if is_result and not isinstance(what, EquilibriumSet):
        own = _held_by(what)
        merged = {name: own.get(name) if value is None else value for name, value in given.items()}
        around = surroundings_of(what)
        merged = _with_own(merged, what.scene, around.obstacles[0])
        mesh = what.scene.mesh
        if not what.scene.bodies and positions is None:
            mesh, merged["positions"] = _skeletons_alone(what)
        states = _states(mesh, merged, around.fields, own["strengths"], own["titles"])
        if obstacles is None and len(around.obstacles) == len(states):
            pairs = zip(states, around.obstacles, strict=True)
            states = [replace(state, obstacles=each) for state, each in pairs]
        states = _with_tendons(what, _with_links(what, states, positions), positions)
        states = _with_springs(what, states, positions)
        states = _with_elements(what, states, positions)
        if what.scene.bodies and hasattr(what, "_values_at"):
            states = _with_thickness(states, lambda k: what._values_at(k).deformable)
        own_times = isinstance(what, Trajectory) and len(states) == len(what)
        return timed(states, what.times) if own_times else states
    if isinstance(what, Iterable) and not isinstance(what, str | bytes | np.ndarray):
        try:
            states = [state for item in what for state in states_of(item, **given)]
        except RecursionError:
            raise ValueError("cannot draw a list that contains itself") from None
        if states:
            return states
        raise ValueError("there is nothing to draw: the list is empty")
    kinds = "a mesh, a Shell, a Solid, a Scene, a result, or a list of them"
    raise ValueError(f"cannot draw a {type(what).__name__}: give {kinds}")


def _with_links(result, states: list[State], positions) -> list[State]:
    """Add the surfaces of links and free rigid bodies to the states of a result, unless other positions were given."""
    if positions is not None or not result.scene.bodies:
        return states
    none = [[] for _ in states]
    pairs = zip(states, link_surfaces_of(result) or none, shapes_of(result) or none, strict=True)
    return [replace(state, links=tuple(links), shapes=tuple(shapes)) for state, links, shapes in pairs]


def _with_tendons(result, states: list[State], positions) -> list[State]:
    """Add the surfaces of tendons to the states of a result, unless other positions were given."""
    tendons = [] if positions is not None else tendons_of(result)
    if not tendons:
        return states
    return [replace(state, tendons=tuple(each)) for state, each in zip(states, tendons, strict=True)]


def _with_springs(result, states: list[State], positions) -> list[State]:
    """Add creases to the states of a result, and springs unless other positions were given."""
    if not result.scene.bodies:
        return states
    states = [replace(state, creases=creases_of(result.scene)) for state in states]
    springs = [] if positions is not None else springs_of(result)
    if not springs:
        return states
    return [replace(state, springs=each) for state, each in zip(states, springs, strict=True)]


def _with_thickness(states: list[State], bodies_of: Callable[[int], Any]) -> list[State]:
    """Add the thickness of faces to states. bodies_of: returns the bodies with their values in state k."""
    return [
        replace(state, thickness=lambda k=k: thickness_of(bodies_of(k))) for k, state in enumerate(states)
    ]


def thickness_of(bodies: Iterable[Shell | Solid]) -> np.ndarray:
    """Return the thickness of the faces of bodies, one after another, (n_f,) m; 0 on the faces of solids."""
    each = [np.zeros(b.mesh.n_faces) if isinstance(b, Solid) else b._face_thickness for b in bodies]
    return np.concatenate([np.zeros(0), *each])


def _skeletons_alone(result) -> tuple[TriangleMesh, np.ndarray]:
    """Return a mesh of the links and rigid bodies of a result without deformable bodies, and its positions, (k, n, 3) m."""
    links, shapes = link_surfaces_of(result), shapes_of(result)
    if not links and not shapes:
        raise ValueError("cannot draw a scene of free rigid bodies without a shape")
    count = len(links or shapes)
    pairs = zip(links or [[]] * count, shapes or [[]] * count, strict=True)
    frames = [joined([*each, *others])[0] for each, others in pairs]
    at_rest = [*link_surfaces_at_rest(result.scene), *shapes_at_rest(result.scene)]
    return mesh_of(at_rest), np.stack(frames)


def _with_elements(result, states: list[State], positions) -> list[State]:
    """Add the stresses of elements and the forces on vertices to states, unless other positions were given."""
    if positions is not None or not hasattr(result, "_values_at"):
        return states
    bodies = result.scene._bodies

    def elements_of(k: int):
        return lambda: [
            (span.first_face, body.mesh, result_of(result, body)._stresses(k))
            for body, span in zip(bodies.deformable, bodies.spans, strict=True)
        ]

    def loads_of(k: int):
        return (lambda: contact_loads(result, k)) if result.scene.contacts else None

    def forces_of(k: int):
        return (lambda: nodal_forces(result, k)) if result.scene.bodies else None

    return [
        replace(state, elements=elements_of(k), loads=loads_of(k), forces=forces_of(k))
        for k, state in enumerate(states)
    ]


def timed(states: list[State], times: Numbers) -> list[State]:
    """Return the states with times (n,) s, which also become their titles.

    Raises ValueError unless there is one time per state, and they do not decrease.
    """
    array = quantity("times", "s", detached(times), ("n",))
    if len(array) != len(states):
        raise ValueError(f"times [s] must be {len(states)} numbers, one a state, got {len(array)}")
    if (np.diff(array) < 0).any():
        first = int(np.argmax(np.diff(array) < 0))
        raise ValueError(f"times [s] must not fall, but {array[first]:g} is followed by {array[first + 1]:g}")
    written = clock(float(np.abs(array).max()))
    return [
        replace(state, time=time, title=written(time))
        for state, time in zip(states, array.tolist(), strict=True)
    ]


def with_times(states: list[State], times: Numbers) -> list[State]:
    """Return the states with the given times, or with their own.

    Raises ValueError if the times decrease, such as where one motion follows another.
    """
    own = [state.time for state in states]
    if times is None and None in own:
        return [replace(state, time=None) for state in states]
    return timed(states, own if times is None else times)


def _held_by(result) -> dict[str, Any]:
    """Return the positions, magnetization, fields and titles of a result's states.

    `strengths` are the factors on the fields that vary in space.
    """
    held = {name: getattr(result, name, None) for name in ("positions", "remanent_magnetization", "field")}
    if isinstance(result, EquilibriumPath):
        flux_densities = result.applied_flux_densities
        titles = [f"parameter {parameter:.4g}" for parameter in result.parameters]
    elif isinstance(result, Trajectory):
        flux_densities = result.applied_flux_density
        titles = [""]
    else:
        flux_densities = getattr(result, "applied_flux_density", None)
        titles = [""]
    if not result.scene.has_uniform_field:
        flux_densities = None
    strengths = np.atleast_1d(field_factors(result)).tolist()
    return held | {"applied_flux_density": flux_densities, "strengths": strengths, "titles": titles}


def field_factors(result: Any) -> np.ndarray:
    """Return the factor on the fields that vary in space in each state of a result, (n,), or () of a single state."""
    if isinstance(result, Trajectory):
        return result._field_factors
    load_parameters = getattr(result, "_load_parameters", None)
    if load_parameters is None:
        return np.ones(())
    return result.scene._load_parameter_layout.of(load_parameters, "scene", "field_factor")[..., 0]


def _states(
    mesh: TriangleMesh, given: dict[str, Any], fields=((),), strengths=(1.0,), titles=("",)
) -> list[State]:
    """Build the states of a mesh from the given values. fields, strengths, titles: one per state, or one for all."""
    frames = _positions(mesh, given["positions"])
    count = len(frames)
    magnetization = _magnetization(mesh, given["remanent_magnetization"])
    flux_densities = _flux_densities(given["applied_flux_density"], count)
    obstacles = _obstacles(given["obstacles"])
    if own := _listed(given["field"]):
        fields = [own]
    fields, strengths, titles = (
        list(each) if len(each) == count else [each[0]] * count for each in (fields, strengths, titles)
    )
    return [
        State(
            mesh,
            frame,
            magnetization,
            flux,
            tuple(each for each in sources if not isinstance(each, UniformField)),
            strength,
            title,
            obstacles=obstacles,
            rotates=given.get("rotates", False),
        )
        for frame, flux, sources, strength, title in zip(
            frames, flux_densities, fields, strengths, titles, strict=True
        )
    ]


def _positions(mesh: TriangleMesh, values) -> np.ndarray:
    if values is None:
        return mesh.rest_positions[None]
    array = quantity("positions", "m", detached(values), ("...", "n_v", 3))
    if array.shape[-2] != mesh.n_vertices or array.ndim not in (2, 3) or not array.size:
        wanted = f"(n_v, 3) = ({mesh.n_vertices}, 3), or (k, n_v, 3) for k states"
        raise ValueError(f"positions [m] must have shape {wanted}, got {array.shape}")
    return array.reshape(-1, mesh.n_vertices, 3)


def _magnetization(mesh: TriangleMesh, values) -> np.ndarray | None:
    if values is None:
        return None
    array = quantity("remanent_magnetization", "A/m", detached(values), ("...", 3))
    meshes = getattr(mesh, "meshes", [mesh])
    parts = [sides(each)[1] if isinstance(each, QuadraticTriangleMesh) else 1 for each in meshes]
    rows = [magnetized_rows(each) for each in meshes]
    if max(parts, default=1) > 1 and array.shape == (sum(rows), 3):
        return np.repeat(array, np.repeat(parts, rows), axis=0)
    if array.shape not in ((3,), (mesh.n_faces, 3)):
        wanted = f"(n_f, 3) = ({mesh.n_faces}, 3) or (3,)"
        raise ValueError(f"remanent_magnetization [A/m] must have shape {wanted}, got {array.shape}")
    return np.broadcast_to(array, (mesh.n_faces, 3))


def _flux_densities(values, count: int) -> list[np.ndarray | None]:
    if values is None:
        return [None] * count
    array = quantity("applied_flux_density", "T", detached(values), ("...", 3))
    if array.shape not in ((3,), (count, 3)):
        raise ValueError(f"applied_flux_density [T] must have shape (3,) or ({count}, 3), got {array.shape}")
    return list(np.broadcast_to(array, (count, 3)))


def _with_own(given: dict[str, Any], scene: Scene, obstacles=None) -> dict[str, Any]:
    """Add the obstacles of a scene, or of a solve, and the magnetization of its bodies, unless others are given."""
    given = _magnetized(given, scene.bodies)
    own = obstacles_in(scene) if obstacles is None else obstacles
    return {**given, "obstacles": own} if given["obstacles"] is None else given


def _magnetized(given: dict[str, Any], bodies) -> dict[str, Any]:
    """Add the magnetization of the bodies, unless another is given, and on which faces it only rotates."""
    given = {**given, "rotates": _rotating_faces(bodies)}
    own = [body._face_magnetization for body in bodies]
    if given["remanent_magnetization"] is not None or all(each is None for each in own):
        return given
    pairs = zip(own, bodies, strict=True)
    rows = [
        np.broadcast_to(np.zeros(3) if each is None else each, (body.mesh.n_faces, 3)) for each, body in pairs
    ]
    return {**given, "remanent_magnetization": np.concatenate(rows)}


def _rotating_faces(bodies) -> np.ndarray | bool:
    """Return for each face of the bodies whether its magnetization only rotates with it, (n_f,); False if none does."""
    laws = [body if isinstance(body, Shell) else body.skin for body in bodies]
    rotates = [law is not None and law.magnetization_law == "rotates" for law in laws]
    return any(rotates) and np.repeat(rotates, [body.mesh.n_faces for body in bodies])


def _obstacles(values) -> tuple[Obstacle, ...]:
    listed = (values,) if isinstance(values, Obstacle) else tuple(values or ())
    for each in listed:
        if not isinstance(each, Obstacle):
            raise ValueError(f"obstacles must be obstacles of ms.obstacles, got a {type(each).__name__}")
    return listed


def _listed(value) -> tuple[Any, ...]:
    if value is None:
        return ()
    return tuple(value) if isinstance(value, list | tuple) else (value,)


class Surroundings(NamedTuple):
    """The fields and obstacles of each state; a single entry for a result that has no values per state.

    The shapes of contacts are not among the obstacles, as they are drawn with the rigid bodies.
    Obstacles with a `motion` are not moved here: their position follows from the time of the state.
    """

    fields: list[tuple[AppliedField, ...]]
    obstacles: list[tuple[Obstacle, ...]]


def obstacles_in(scene: Scene) -> tuple[Obstacle, ...]:
    """Return the obstacles of a scene that are not shapes of contacts."""
    shapes = {id(each) for each in shapes_in(scene.contacts)}
    return tuple(each for each in scene.obstacles if id(each) not in shapes)


def surroundings_of(result: SolveResult) -> Surroundings:
    """Return the fields and obstacles in each state of a result, or of any object with a scene."""
    scene = result.scene
    if not hasattr(result, "_values_at"):
        return Surroundings([scene.fields], [obstacles_in(scene)])
    count = len(result) if isinstance(result, Trajectory | EquilibriumPath) else 1
    values = [result._values_at(k) for k in range(count)]
    fields = [tuple(map(each.current, scene.fields)) for each in values]
    own = getattr(result, "_own_points", None)
    rows = [None] * count if own is None else np.reshape(detached(own), (count, -1, 3))
    obstacles = [
        tuple(positioned(scene, each.current(obstacle), row) for obstacle in obstacles_in(scene))
        for each, row in zip(values, rows, strict=True)
    ]
    return Surroundings(fields, obstacles)
