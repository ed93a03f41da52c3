"""The starting state of a solve, and the load parameters at which it holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensors import to_array
from ...model.contact.contacts_to_core import check_outside
from ...model.rigid.equimomental_points import check_rigid
from ...model.scene.reshaped import renumbered_state
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ...model.solids.solid import Solid
from .equilibrium import Equilibrium

if TYPE_CHECKING:
    from ..._input.kinds import Starting


class Origin(NamedTuple):
    """An equilibrium for given inputs: its state, and the full turns of its angles (`angle_branches`)."""

    state: np.ndarray
    angle_branches: list[Any]
    inputs: Inputs


def starting_point(
    scene: Scene, start: Starting | Origin, inputs: Inputs
) -> tuple[np.ndarray, list[Any], np.ndarray, bool]:
    """Return the starting state, the full turns of its angles, its load parameters, and whether it is at rest there."""
    model = scene._model
    if start is None:
        check_outside(scene, inputs.values, scene.mesh.rest_positions, 0.0)
        return model.rest_state(), [], scene._load_parameter_layout.zeros(), True
    if isinstance(start, Origin):
        return start.state, start.angle_branches, start.inputs.load_parameters, True
    if isinstance(start, Equilibrium):
        if start.scene is not scene and start.scene._family is scene._family:
            return state_in(scene, start), start._angle_branches, start._load_parameters, False
        if start.scene is not scene:
            raise ValueError("start is an equilibrium of another scene; hand over its positions instead")
        return (
            start._state,
            start._angle_branches,
            start._load_parameters,
            start._values.same_as(inputs.values),
        )
    if hasattr(start, "scene"):
        raise TypeError(
            f"start must be an Equilibrium or positions, got {type(start).__name__}: hand over the positions of one of its "
            "states, such as motion.positions[-1] of a Trajectory"
        )
    positions = quantity("start", "m", to_array("start", start), ("n_v", 3))
    n_v = scene.mesh.n_vertices
    if len(positions) != n_v:
        raise ValueError(f"start [m] must have shape (n_v, 3) = ({n_v}, 3), got {positions.shape}")
    scene._bodies.check_welded("start", "m", positions)
    check_faces(scene, positions)
    with inputs.in_core():
        state = model.state(positions, np.zeros(scene._bodies.n_rotations))
    check_outside(scene, inputs.values, model.points(state), 0.0)
    check_rigid(scene, positions, model.positions(state), "start [m]", scene.mesh.size)
    return state, [], inputs.load_parameters, False


def state_in(scene: Scene, start: Equilibrium) -> np.ndarray:
    """Return the state of an equilibrium in a scene that is the same but for rest positions."""
    theirs = start.scene
    return start._state if theirs is scene else renumbered_state(scene, theirs, start._state)


def check_faces(scene: Scene, positions: np.ndarray, name: str = "start") -> None:
    """Raise ValueError for a face of a shell without area, which has no normal. Materials check the elements of solids."""
    for body, span in zip(scene._bodies.deformable, scene._bodies.spans, strict=True):
        if isinstance(body, Solid):
            continue
        corners = positions[span.vertices][span.mesh.faces]
        a1, a2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        with np.errstate(over="ignore", invalid="ignore"):  # the energy tells what is not finite
            area = 0.5 * np.linalg.norm(np.cross(a1, a2), axis=1)
        flat = np.flatnonzero(area <= 1e-12 * span.mesh.face_areas)
        if flat.size:
            raise ValueError(
                f"{name} [m] leaves face {span.first_face + flat[0]} without area: {area[flat[0]]:.3g} m2"
            )
