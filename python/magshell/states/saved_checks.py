"""Whether the arrays of a file fit the scene: nothing else may reach the core."""

from __future__ import annotations

from typing import Any

from .._checks.quantity import quantity
from ..dynamics.trajectory import MotionState
from ..scene.scene import Scene


def check_fits(held: dict[Any, Any], scene: Scene) -> None:
    """Raises ValueError where an array has another shape than one of this scene, or is not finite where it must be."""
    mesh, model = scene.mesh, scene._model
    of_motion = "times" in held
    n = (len(held["times"]),) if of_motion else ()
    shapes = {
        "positions": (*n, mesh.n_vertices, 3),
        "edge_rotations": (*n, len(model.edge_rotations(model.rest_state()))),
        "applied_flux_density": (*n, 3),
    }
    own = 10 * len(scene.rigid_parts) + scene._bodies.n_on_surfaces
    if of_motion:
        shapes |= {"times": n, "velocities": shapes["positions"], "kinetic_energy": n}
        shapes |= {"_field_factors": n, "_load_factors": n, "_directions": (*n, 3 * _n_directions(scene))}
        shapes["_own_velocities"] = (*n, own, 3)
        _check_end(held["end"], model)
    else:
        shapes |= {"_state": (model.size,), "_controls": (scene._control_layout.size,)}
        _check_turns(held["_turns"])
    shapes["_own_points"] = (*n, own, 3)
    for name, shape in shapes.items():
        optional = name in ("_own_points", "_own_velocities", "applied_flux_density")
        if not (optional and held[name] is None):
            quantity(name, "SI", held[name], shape)


def _n_directions(scene: Scene) -> int:
    return len(scene._constraints.directions)


def _check_end(end, model) -> None:
    if not isinstance(end, MotionState):
        raise ValueError(f"its end is a {type(end).__name__}")
    quantity("end.state", "SI", end.state, (model.size,))
    quantity("end.velocity", "SI", end.velocity, (model.size,))
    _check_turns(end.turns)


def _check_turns(turns) -> None:
    if not isinstance(turns, list | tuple):
        raise ValueError(f"turns must be a list, got {type(turns).__name__}")
    for k, each in enumerate(turns):
        quantity(f"turns[{k}]", "SI", each, ("n",))
