"""Translates a scene to the input of the core."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..actuators.cavity import Cavity
from ..actuators.cells import PneumaticCells
from ..actuators.muscle import Muscle
from ..actuators.tendon import Tendon
from ..loads.custom_energy import CustomEnergy
from ..loads.face_energies import FaceEnergy
from ..loads.foundation import ElasticFoundation
from ..loads.loads import EdgeCouple
from ..loads.pressure import Pressure
from ..loads.spring import Spring
from ..shells.shell import Shell, core_form
from ..solids.solid import Solid
from ..supports.supports import continuations

if TYPE_CHECKING:
    from ..._input.kinds import Load
    from ..bodies.bodies import Bodies
    from .scene import Scene


def moment_edges(bodies: Bodies, loads: Iterable[Load]) -> np.ndarray:
    """Return the edges of the scene on which an EdgeCouple acts, ascending, (k,)."""
    loaded = [(load, bodies.of(load)) for load in loads if isinstance(load, EdgeCouple)]
    edges = [span.first_edge + load._edge_moments(span.mesh)[0] for load, span in loaded]
    return np.unique(np.concatenate(edges)) if edges else np.zeros(0, dtype=np.int64)


def moment_directions(bodies: Bodies, edges: np.ndarray) -> np.ndarray:
    """Return the directions from which the angles of such edges are measured, (k, 3).

    They point outwards in the plane of the edge's face in the rest shape.
    """
    of, own = bodies.split(edges)
    directions = np.zeros((len(edges), 3))
    for k in np.unique(of):
        directions[of == k] = continuations(bodies.meshes[k], own[of == k])
    return directions


def body_inputs(scene: Scene, directed_edges: np.ndarray) -> dict[str, list[dict[Any, Any]]]:
    """Return the input of sheets, solids, skins and rigid bodies.

    directed_edges: (k, 2), edges of the scene and the rows of their fixed directions.
    """
    return {
        "sheets": _sheets(scene, directed_edges),
        "six_node_sheets": _six_node_sheets(scene, directed_edges),
        "solids": _solids(scene),
        "skins": _skins(scene),
        "rigid": [
            points.as_input(f"rigid {k}", part, scene.is_magnetic and part.magnetic_moment is not None)
            for k, (part, points) in enumerate(zip(scene.rigid_parts, scene._rigid, strict=True))
        ],
    }


def muscle_inputs(scene: Scene) -> list[dict[Any, Any]]:
    bodies = scene._bodies
    first = len(bodies.three_node_shells)
    return [
        muscle._core_input(label, bodies.core_number(bodies.of(muscle)) - first)
        for muscle, label in scene._labels
        if isinstance(muscle, Muscle)
    ]


def face_inputs(scene: Scene) -> dict[str, list[dict[Any, Any]]]:
    """Return the input of face energies, of pressures and of energies of groups of vertices."""
    bodies, n_skins = scene._bodies, len(_skins(scene))
    return {
        "face_energies": [
            {"owner": label, "body": bodies.core_number(bodies.of(load), n_skins), "energy": load._core}
            for load, label in scene._labels
            if isinstance(load, FaceEnergy)
        ],
        "pressures": [
            load._core_input(label, bodies) for load, label in scene._labels if isinstance(load, Pressure)
        ],
        "group_energies": [
            load._core_input(label, bodies) for load, label in scene._labels if isinstance(load, CustomEnergy)
        ],
    }


def actuator_inputs(scene: Scene) -> dict[str, list[dict[Any, Any]]]:
    """Return the input of enclosed volumes and of tendons."""
    bodies = scene._bodies
    volumes = [
        each._core_input(label, bodies)
        for each, label in scene._labels
        if isinstance(each, Cavity | PneumaticCells)
    ]
    tendons = [
        each._core_input(label, bodies, scene._rigid)
        for each, label in scene._labels
        if isinstance(each, Tendon)
    ]
    return {"volumes": volumes, "tendons": tendons}


def spring_inputs(scene: Scene) -> list[dict[Any, Any]]:
    bodies, found = scene._bodies, []
    for each, label in scene._labels:
        if isinstance(each, Spring):
            found.append(each._core_input(label, bodies, scene._rigid, scene._follows_rest_positions))
        elif isinstance(each, ElasticFoundation):
            found.append(each._core_input(label, bodies, scene._follows_rest_positions))
    return found


def crease_inputs(scene: Scene) -> list[dict[Any, Any]]:
    """Return the input of the creases of all shells."""
    labels, bodies = {id(each): label for each, label in scene._labels}, scene._bodies
    return [
        crease._core_input(labels[id(crease)], span.mesh, bodies.original[span.vertices])
        for body, span in zip(bodies.deformable, bodies.spans, strict=True)
        if isinstance(body, Shell)
        for crease in body.creases
    ]


def _directed_by_body(scene, directed_edges: np.ndarray) -> list[np.ndarray]:
    """Return for each body its edges with a fixed direction and the rows of these directions, (k, 2)."""
    of, edges = scene._bodies.split(directed_edges[:, 0])
    pairs = np.stack([edges, directed_edges[:, 1]], axis=1).astype(np.int32)
    return [pairs[of == k] for k in range(len(scene.bodies))]


def _sheets(scene, directed_edges: np.ndarray) -> list[dict[Any, Any]]:
    directed = _directed_by_body(scene, directed_edges)
    return [
        {
            "owner": f"body {k}",
            "mesh": span.mesh._core,
            "vertices": scene._bodies.original[span.vertices],
            "curvature_scale": shell.curvature_scale,
            **_growth(shell),
            "directors": shell.bending == "midedge",
            "magnetic": bool(scene.fields),
            "magnetization_rotates": shell.magnetization_law == "rotates",
            "susceptible": shell.susceptibility is not None,
            "directed_edges": directed[k],
        }
        for k, (shell, span) in enumerate(zip(scene.bodies, scene._bodies.spans, strict=True))
        if isinstance(shell.mesh, TriangleMesh)
    ]


def _six_node_sheets(scene, directed_edges: np.ndarray) -> list[dict[Any, Any]]:
    directed = _directed_by_body(scene, directed_edges)
    return [
        {
            "owner": f"body {k}",
            "rest_positions": span.mesh.rest_positions,
            "faces": span.mesh.elements,
            "corners": span.mesh.corners._core,
            "vertices": scene._bodies.original[span.vertices],
            "surface": span.mesh.surface._core,
            "surface_vertices": scene._bodies.original[span.vertices],
            "surface_acts": _surface_acts(scene, k),
            **_growth(shell),
            "magnetic": bool(scene.fields),
            "magnetization_rotates": shell.magnetization_law == "rotates",
            "directed_edges": directed[k],
        }
        for k, (shell, span) in enumerate(zip(scene.bodies, scene._bodies.spans, strict=True))
        if isinstance(shell.mesh, QuadraticTriangleMesh)
    ]


def _growth(shell: Shell) -> dict[Any, Any]:
    return {name: core_form(getattr(shell, name)) for name in ("growth", "rest_curvature")}


def _surface_acts(scene, body: int) -> bool:
    """Return whether water or a face energy acts on the surface of a body."""
    return scene.water is not None or any(
        scene._bodies.of(load).bodies.start == body for load in scene.loads if isinstance(load, FaceEnergy)
    )


def _solids(scene) -> list[dict[Any, Any]]:
    bodies = scene._bodies
    return [
        {
            **body._core_input(f"body {k}", bodies.original[span.vertices]),
            "surface_acts": _surface_acts(scene, k),
        }
        for k, (body, span) in enumerate(zip(scene.bodies, bodies.spans, strict=True))
        if isinstance(body, Solid)
    ]


def _skins(scene) -> list[dict[Any, Any]]:
    """Return the input of skins in a field; the mass of a skin is in the input of its solid."""
    if not scene.is_magnetic:
        return []
    bodies = scene._bodies
    skinned = [
        (body, span)
        for body, span in zip(scene.bodies, bodies.spans, strict=True)
        if isinstance(body, Solid) and body.skin is not None
    ]
    return [
        body.skin._core_input(f"skin {k}", body.mesh, bodies.original[span.vertices])
        for k, (body, span) in enumerate(skinned)
    ]
