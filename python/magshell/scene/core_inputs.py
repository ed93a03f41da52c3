"""A scene's bodies, and what acts on their faces, as the core takes them."""

from __future__ import annotations

import numpy as np

from ..bodies.muscle import Muscle
from ..bodies.shell import Shell
from ..bodies.solid import Solid
from ..surroundings.cavity import Cavity
from ..surroundings.cells import Cells
from ..surroundings.face_energies import FaceEnergy
from ..surroundings.pressure import Pressure
from ..surroundings.tendon import Tendon


def body_inputs(scene, directed_edges: np.ndarray) -> dict[str, list[dict]]:
    """Sheets, solids, skins, rigid parts. directed_edges: (k, 2), the scene's edges and the rows of their directions."""
    return {
        "sheets": _sheets(scene, directed_edges),
        "six_node_sheets": [],
        "solids": _solids(scene),
        "skins": _skins(scene),
        "rigid": [
            place.as_input(f"rigid {k}", bool(scene.fields) and part.magnetic_moment is not None)
            for k, (part, place) in enumerate(zip(scene.rigid_parts, scene._rigid, strict=True))
        ],
    }


def muscle_inputs(scene) -> list[dict]:
    bodies = scene._bodies
    first = len(bodies.shells) - len(bodies.solids)
    return [
        muscle._core_input(label, bodies.core_number(bodies.of(muscle)) - first)
        for muscle, label in scene._labels
        if isinstance(muscle, Muscle)
    ]


def face_inputs(scene) -> dict[str, list[dict]]:
    """Energies of faces, and pressures."""
    bodies = scene._bodies
    return {
        "face_energies": [
            {"owner": label, "body": bodies.core_number(bodies.of(load)), "energy": load._core}
            for load, label in scene._labels
            if isinstance(load, FaceEnergy)
        ],
        "pressures": [
            load._core_input(label, bodies) for load, label in scene._labels if isinstance(load, Pressure)
        ],
    }


def actuator_inputs(scene) -> dict[str, list[dict]]:
    """Volumes and tendons."""
    bodies = scene._bodies
    volumes = [
        each._core_input(label, bodies) for each, label in scene._labels if isinstance(each, Cavity | Cells)
    ]
    tendons = [
        each._core_input(label, bodies, scene._rigid)
        for each, label in scene._labels
        if isinstance(each, Tendon)
    ]
    return {"volumes": volumes, "tendons": tendons}


def _sheets(scene, directed_edges: np.ndarray) -> list[dict]:
    of, edges = scene._bodies.split(directed_edges[:, 0])
    pairs = np.stack([edges, directed_edges[:, 1]], axis=1).astype(np.int32)
    return [
        {
            "owner": f"body {k}",
            "mesh": span.mesh._core,
            "vertices": scene._bodies.original[span.vertices],
            "curvature_scale": shell.curvature_scale,
            "directors": shell.bending == "midedge",
            "magnetic": bool(scene.fields),
            "directed_edges": pairs[of == k],
        }
        for k, (shell, span) in enumerate(zip(scene.bodies, scene._bodies.spans, strict=True))
        if isinstance(shell, Shell)
    ]


def _solids(scene) -> list[dict]:
    bodies = scene._bodies
    loaded = [bodies.of(load).bodies.start for load in scene.loads if isinstance(load, FaceEnergy)]
    return [
        {
            **body._core_input(f"body {k}", bodies.original[span.vertices]),
            "surface_acts": scene.water is not None or k in loaded,
        }
        for k, (body, span) in enumerate(zip(scene.bodies, bodies.spans, strict=True))
        if isinstance(body, Solid)
    ]


def _skins(scene) -> list[dict]:
    """Those that feel a field; what they weigh their solids know."""
    if not scene.fields:
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
