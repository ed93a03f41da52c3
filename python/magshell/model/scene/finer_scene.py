"""A scene on finer meshes of its bodies: materials, supports, loads and fields go over from the coarse ones."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.selections import indices
from ...errors import MeshQualityWarning
from ...mesh.face_shapes import sides
from ...mesh.finer import FinerMesh, children
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ..loads.loads import AreaLoad, EdgeCouple, EdgeLoad, PointLoad
from ..loads.pressure import Pressure
from ..shells.shell import Shell
from ..solids.solid import Solid
from ..supports.displacement_ties import DisplacementTie
from ..supports.supports import Clamp, Pin, SymmetryPlane
from .scene import Scene

if TYPE_CHECKING:
    from .values import Values

Finer = Mapping[int, FinerMesh]  # by the id of the body
_SAME = 1e-9  # [-] of the largest entry: differences of values within a six-node element that are round-off
_OF_ELEMENTS = ("thickness", "young_modulus", "poisson_ratio", "mass_density", "growth", "rest_curvature")


def refuse_what_stays(scene: Scene) -> None:
    """Raise ValueError, with its name, for anything in a scene that does not go over to a finer mesh."""
    has = {
        "a Skin": [solid for solid in scene._bodies.solids if solid.skin is not None],
        "rigid bodies": scene.rigid_parts,
        "ties": scene.ties,
        "EqualDisplacement or Periodic": [s for s in scene.supports if isinstance(s, DisplacementTie)],
        "actuators": scene.actuators,
        "contacts": scene.contacts,
        "an OwnField": scene.own_field,
        "water": scene.water,
        **{f"a {type(load).__name__}": [load] for load in scene.loads if type(load) not in _LOADS},
    }
    found = [name for name, some in has.items() if some]
    if found:
        raise ValueError(
            f"{', '.join(found)} cannot go over to a finer mesh yet: only Shells, Solids, Pins, Clamps, SymmetryPlanes, "
            f"applied fields, gravity and the loads {', '.join(kind.__name__ for kind in _LOADS)} can"
        )


def finer_scene(scene: Scene, values: Values, finer: Finer) -> Scene:
    """Return the scene on finer meshes of all its bodies, with these values of its objects.

    A Pin holds a new vertex if it holds the vertices of the coarse edge or face in which the vertex lies (`held_vertices`).

    Raises ValueError for what cannot go over, with its name.
    """
    refuse_what_stays(scene)
    bodies = {id(body): _finer_body(scene, values, k, finer[id(body)]) for k, body in enumerate(scene.bodies)}

    def finer_item(item: Any) -> Any:
        of_body = scene.bodies[0] if item.body is None else item.body
        now = values.current(item)
        return _CARRIERS[type(item)](now, finer[id(of_body)], bodies.get(id(item.body)))

    loads = [finer_item(load) for load in scene.loads]
    if scene.loads and len(scene.bodies) > 1:
        loads = [part for load in scene.loads for part in _for_each_body(scene, load, finer_item)]
    supports = [
        finer_item(each) if type(each) is not SymmetryPlane else _finer_plane(each, bodies)
        for each in scene.supports
    ]
    loads += _vertex_loads(scene, values, bodies)
    made = Scene(
        list(bodies.values()),
        supports=supports,
        loads=loads,
        field=[values.current(each) for each in scene.fields] or None,
        gravity=values.gravity,
        allow_rigid_motions=scene._allow_rigid_motions,
    )
    _check_planes(scene, supports, finer)
    return made


def held_vertices(finer: FinerMesh, vertices: np.ndarray) -> np.ndarray:
    """Return the vertices of the finer mesh that a Pin of vertices of the coarse mesh holds, ascending.

    A new vertex on a boundary edge is held if all nodes of that edge are; inside a six-node element, if all its nodes
    are. On an interior edge of three-node faces it is held as well if both of its faces are held by all their corners,
    or neither of them: an edge across the corner of a sheet whose border is held has one such face, and stays free.
    """
    mesh = finer.coarse
    held = np.zeros(mesh.n_vertices, dtype=bool)
    held[vertices] = True
    if isinstance(mesh, TetMesh):
        return np.flatnonzero(np.concatenate([held, _held_in_solid(finer, held)]))
    of_edges = held[mesh.nodes_of_edges].all(axis=1)
    of_elements = held[mesh.elements].all(axis=1)
    if mesh.order == 1:
        sides = mesh.edge_faces
        inside = (sides >= 0).all(axis=1)
        of_edges &= ~inside | (of_elements[sides[:, 0]] == of_elements[sides[:, 1]])
    new = np.where(finer.new_edges >= 0, of_edges[finer.new_edges], False)
    if mesh.order == 2:
        new |= (finer.new_elements >= 0) & of_elements[finer.new_elements]
    return np.flatnonzero(np.concatenate([held, new]))


def _held_in_solid(finer: FinerMesh, held: np.ndarray) -> np.ndarray:
    """Return whether a Pin of the coarse vertices marked in `held` holds each new vertex of a solid, (n_new,) bool.

    A new vertex is held if all nodes of the edge, the outer side or the tetrahedron are that it lies inside. On an edge
    within four-node tetrahedra all corners of one of these must be held, too: else an edge across the corner between two
    held sides would be.
    """
    mesh = finer.coarse
    of_elements = held[mesh.tetrahedra].all(axis=1)
    of_edges = held[mesh.edges].all(axis=1)
    if mesh.order == 2:
        of_edges &= held[mesh.edge_nodes]
    else:
        around = np.zeros(mesh.n_edges, dtype=bool)
        around[mesh.boundary_edges] = True
        around[mesh.tetrahedron_edges[of_elements]] = True
        of_edges &= around
    of_sides = held[mesh.nodes_of_sides].all(axis=1)
    new = np.zeros(len(finer.new_edges), dtype=bool)
    for places, of in (
        (finer.new_edges, of_edges),
        (finer.new_sides, of_sides),
        (finer.new_elements, of_elements),
    ):
        new |= (places >= 0) & of[places]
    return new


def _finer_body(scene: Scene, values: Values, k: int, finer: FinerMesh) -> Shell | Solid:
    solid = isinstance(scene.bodies[k], Solid)
    return (_finer_solid if solid else _finer_shell)(scene, values, k, finer)


def _finer_solid(scene: Scene, values: Values, k: int, finer: FinerMesh) -> Solid:
    solid, parents = values.current(scene.bodies[k]), finer.element_parents
    rows = {name: solid.material.rows(name, solid.mesh.n_tetrahedra) for name in solid.material.names}
    differ = {name: each[parents] for name, each in rows.items() if (each != each[:1]).any()}
    of_elements = {
        name: None if (given := getattr(solid, name)) is None else given[parents]
        for name in ("mass_density", "remanent_magnetization")
    }
    with warnings.catch_warnings():  # the solid itself has warned of its free modes
        warnings.simplefilter("ignore", MeshQualityWarning)
        return Solid(
            finer.mesh,
            material=solid.material.replaced(**differ) if differ else solid.material,
            element="linear" if finer.mesh.order == 1 else "quadratic",
            mean_volume=None if solid.element == "linear" else solid.mean_volume,
            magnetization_law=solid.magnetization_law,
            **of_elements,
        )


def _finer_shell(scene: Scene, values: Values, k: int, finer: FinerMesh) -> Shell:
    shell, mesh = values.current(scene.bodies[k]), finer.mesh
    scale = np.unique(shell.curvature_scale)
    second = mesh.order == 2
    if len(scale) > 1 or (second and scale[0] != 1.0):
        raise ValueError(
            f"the curvature_scale of body {k} cannot go over to a finer mesh: give the thickness or the modulus in its place"
        )
    properties = {"curvature_scale": scale[0]}
    for name in _OF_ELEMENTS:
        given = getattr(shell, name)
        per_element = (
            given is not None and given.shape[:1] == (shell.mesh.n_elements,) and given.shape != (3, 3)
        )
        properties[name] = given[finer.element_parents] if per_element else given
    if scene.is_magnetic:
        label = next(label for each, label in scene._labels if each is scene.bodies[k])
        rows = scene._value_layout.of(values.numbers, label, "remanent_magnetization").reshape(-1, 3)
        properties["remanent_magnetization"] = rows[finer.element_parents]
    bending = None if second else shell.bending
    return Shell(mesh, bending=bending, magnetization_law=shell.magnetization_law, **properties)


def _for_each_body(scene: Scene, load: Any, finer_item: Callable[[Any], Any]) -> list[Any]:
    if load.body is None:
        raise ValueError(
            f"a {type(load).__name__} without body= cannot go over to finer meshes of several bodies"
        )
    return [finer_item(load)]


def _finer_plane(plane: SymmetryPlane, bodies: dict[int, Shell | Solid]) -> SymmetryPlane:
    body = bodies.get(id(plane.body))
    return SymmetryPlane(plane.normal, plane.point, tolerance=plane.tolerance, body=body)


def _check_planes(scene: Scene, supports: list[Any], finer: Finer) -> None:
    """Raise ValueError if a boundary edge leaves a symmetry plane in which its coarse edge lies."""
    for old, new in zip(scene.supports, supports, strict=True):
        if not isinstance(old, SymmetryPlane):
            continue
        for body in scene.bodies if old.body is None else [old.body]:
            fine = finer[id(body)]
            if isinstance(fine.mesh, TetMesh):  # new vertices lie on the coarse sides
                continue
            before, after = (
                np.isin(mesh.nodes_of_edges, each._vertices(mesh)).all(axis=1)
                for each, mesh in ((old, fine.coarse), (new, fine.mesh))
            )
            edges = np.intersect1d(np.flatnonzero(before), fine.coarse.boundary_edges)
            rows, parts = children(fine.edge_parents, edges)
            if not after[parts].all():
                edge = edges[rows[np.argmin(after[parts])]]
                raise ValueError(
                    f"a new vertex on edge {edge} does not lie in {old!r} as the edge does: project= must keep points in "
                    "it, to 1e-9 of the size of the mesh"
                )


def _vertex_loads(scene: Scene, values: Values, bodies: dict[int, Shell | Solid]) -> list[PointLoad]:
    """Return the vertex_loads of a solve, which replace all dead loads, as PointLoads."""
    given = values.replaced.get(scene, {})
    if "vertex_loads" in given:
        raise ValueError(
            "vertex_loads cannot go over to a finer mesh, as they do not say on which lengths or areas they act: give an "
            "EdgeLoad, an AreaLoad or a PointLoad"
        )
    return []


def _pin(pin: Pin, finer: FinerMesh, body: Shell | Solid | None) -> Pin:
    vertices = indices("Pin vertices", pin.vertices, finer.coarse.n_vertices)
    return Pin(
        held_vertices(finer, vertices), pin.components, body=body, **_move(pin, finer.coarse, vertices)
    )


def _clamp(clamp: Clamp, finer: FinerMesh, body: Shell | Solid | None) -> Clamp:
    edges = clamp._checked(finer.coarse)
    _, parts = children(finer.edge_parents, edges)
    nodes = np.unique(finer.coarse.nodes_of_edges[edges])
    return Clamp(parts, body=body, **_move(clamp, finer.coarse, nodes))


def _move(support: Pin | Clamp, mesh: Any, vertices: np.ndarray) -> dict[str, Any]:
    """Return the prescribed move; a rotation about the mean of the coarse vertices stays about it."""
    move = support._move.as_arguments()
    if move["rotation"] is not None and move["center"] is None:
        move["center"] = mesh.rest_positions[vertices].mean(axis=0)
    return move


def _point_load(load: PointLoad, finer: FinerMesh, body: Shell | Solid | None) -> PointLoad:
    return PointLoad(load.vertices, load.force, body)


def _edge_load(load: EdgeLoad, finer: FinerMesh, body: Shell | Solid | None) -> EdgeLoad:
    rows, parts = children(finer.edge_parents, indices("EdgeLoad edges", load.edges, finer.coarse.n_edges))
    force = load.force_per_length
    return EdgeLoad(parts, force if force.ndim == 1 else force[rows], body)


def _finer_moment(load: EdgeCouple, finer: FinerMesh, body: Shell | Solid | None) -> EdgeCouple:
    _, parts = children(finer.edge_parents, indices("EdgeCouple edges", load.edges, finer.coarse.n_edges))
    return EdgeCouple(parts, load.couple_per_length, body)


def _area_load(load: AreaLoad, finer: FinerMesh, body: Shell | Solid | None) -> AreaLoad:
    faces, force = _finer_faces("AreaLoad", load.faces, load.force_per_area, 2, finer)
    return AreaLoad(force, faces, body)


def _pressure(load: Pressure, finer: FinerMesh, body: Shell | Solid | None) -> Pressure:
    faces, pressure = _finer_faces("Pressure", load.faces, load.pressure, 1, finer)
    return Pressure(pressure, faces=faces, body=body)


def _finer_faces(
    kind: str, faces: np.ndarray | None, given: np.ndarray, ndim: int, finer: FinerMesh
) -> tuple[np.ndarray | None, np.ndarray]:
    """Return the faces of the finer mesh that lie in faces of the coarse one, None for all, and their values.

    given: the value of each face if it has `ndim` dimensions, else that of all.
    """
    if faces is None and given.ndim < ndim:
        return None, given
    mesh = finer.coarse
    chosen = np.arange(mesh.n_faces) if faces is None else indices(f"{kind} faces", faces, mesh.n_faces)
    values = np.broadcast_to(given, (len(chosen), *given.shape[1:])) if given.ndim == ndim else None
    parts_before, parts_after = sides(mesh)[1], sides(finer.mesh)[1]
    if parts_before > 1:
        order = np.argsort(chosen, kind="stable")
        chosen, values = chosen[order], None if values is None else values[order]
        whole = (
            len(chosen) % parts_before == 0
            and (
                chosen.reshape(-1, parts_before)
                == chosen[::parts_before, None] // parts_before * parts_before + np.arange(parts_before)
            ).all()
        )
        alike = values is None or (
            whole
            and np.ptp(values.reshape(-1, parts_before, *values.shape[1:]), axis=1).max()
            <= _SAME * np.abs(values).max()
        )
        if not (whole and alike):
            raise ValueError(
                f"a {kind} on parts of the sides of elements cannot go over to a finer mesh: load whole sides"
            )
        chosen, values = (
            chosen[::parts_before] // parts_before,
            None if values is None else values[::parts_before],
        )
    rows, parts = children(finer.of_sides, chosen)
    rows = np.repeat(rows, parts_after)
    parts = (parts_after * parts[:, None] + np.arange(parts_after)).ravel()
    return parts, given if values is None else values[rows]


_CARRIERS: dict[type, Callable[..., Any]] = {
    Pin: _pin,
    Clamp: _clamp,
    PointLoad: _point_load,
    EdgeLoad: _edge_load,
    AreaLoad: _area_load,
    EdgeCouple: _finer_moment,
    Pressure: _pressure,
}
_LOADS = (PointLoad, EdgeLoad, AreaLoad, EdgeCouple, Pressure)
