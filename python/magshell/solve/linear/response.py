"""Small deflections: ms.linear_response."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached, like
from ..._runtime.frozen import immutable
from ..._runtime.mixins import PlotMixin
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import solve_entry
from ...model.scene.reshaped import reshaped
from ...model.scene.scene import Scene
from ...model.scene.values import Values
from ..statics.equilibrium import Equilibrium
from .base_state import StiffnessAbout, asked_inputs
from .rest import RestStiffness, forces_at_rest

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers


@immutable
@dataclass(frozen=True, repr=False)
class LinearResponse(PlotMixin):
    """The deflection of a scene by linear theory, proportional to the load parameters. It is not an equilibrium.

    displacements: (n_v, 3) m, from the rest shape, or from the equilibrium that was given; edge_rotations: (n_e,) rad, zero
        where an edge has none.
    equilibrium: that one, or None. factorizations: one.
    """

    scene: Scene
    displacements: Any
    edge_rotations: Any
    factorizations: int
    wall_time: float
    equilibrium: Equilibrium | None = None
    _values: Any = field(repr=False, default=None)
    _controls: Any = field(repr=False, default=None)

    def __getstate__(self) -> dict[Any, Any]:
        """Return the data of a copy or another process."""
        values = None if self._values is None else self._values.to_state()
        return {**vars(self), "_values": values}

    def __setstate__(self, state: dict[Any, Any]) -> None:
        stored = state["_values"]
        values = None if stored is None else Values.from_state(state["scene"], stored)
        PlotMixin.__setstate__(self, {**state, "_values": values})

    @property
    def positions(self) -> Computed:
        """The positions, (n_v, 3) m; accurate for small displacements only."""
        from_, of = self.scene.mesh.rest_positions, self.displacements
        if self.equilibrium is not None:
            from_ = detached(self.equilibrium.positions)
        return from_ + of if isinstance(of, np.ndarray) else of + of.new_tensor(np.array(from_))

    def __repr__(self) -> str:
        moved = float(np.linalg.norm(np.asarray(self.displacements), axis=1).max(initial=0.0))
        return f"LinearResponse: largest displacement {moved:.4g} m, {self.wall_time:.3g} s"


@solve_entry
def linear_response(
    scene: Scene,
    equilibrium: Equilibrium | None = None,
    *,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: float = 1.0,
    gravity_factor: float = 1.0,
    field_factor: float = 1.0,
    support_factor: float = 1.0,
    values: dict[Any, Any] | None = None,
) -> LinearResponse:
    """Compute the deflection to first order in the loads, by one factorization of the stiffness at the rest shape.

    The stiffness is that of the unloaded scene. Loads and fields act as the forces they are at rest, without the stiffness
    that they add; supports that move do so at their initial rate. Torques, springs, servos and limits of joints that pull at
    rest are loads too, and motors move.

    equilibrium: a stable one of this scene, such as a grown or loaded sheet, or one in a field. The deflection then starts
        from there, and is of first order in the change from its load parameters to those given here: the tangent of
        ms.follow_path(..., start=) at its start. The stiffness is that of the equilibrium and includes what loads,
        fields and actuators add; magnetization and values are those of the equilibrium. Contacts stay as they are.

    Unknowns that no stiffness couples with a load are left out: a flat sheet in a coordinate plane only bends under loads
    across it, and only stretches under loads in its plane.

    Raises ValueError on bad input, about an equilibrium that is not stable, with its own load parameters, under a pressure
    without a potential, or one that requires a gradient, as there is none here; and where the supports leave a motion
    without stiffness to what is loaded; Interrupted.

    {keywords}
    values: as in ms.equilibrium.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.01))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    >>> tip = ms.linear_response(scene).displacements[mesh.vertices_at(x=0.1), 2].mean()
    >>> round(float(tip), 3)  # p L^3 / (3 E I) = 0.04
    0.04
    """
    arguments = given_to("linear_response", locals())
    began = time.perf_counter()
    scene, arguments["values"] = reshaped(scene, arguments["values"], no_gradient_with=None)
    inputs = asked_inputs("linear_response", scene, equilibrium, arguments)
    given = inputs.given if equilibrium is None else [*inputs.given, equilibrium.positions]
    at_rest = forces_at_rest(inputs) if equilibrium is None else None
    with inputs.in_core():
        if equilibrium is None:
            change = RestStiffness(inputs).response(inputs, at_rest)
        else:
            change = StiffnessAbout(equilibrium).response(inputs)
    model = scene._model
    return LinearResponse(
        scene=scene,
        displacements=like(model.positions(change), *given),
        edge_rotations=like(model.edge_rotations(change), *given),
        factorizations=1,
        wall_time=time.perf_counter() - began,
        equilibrium=equilibrium,
        _values=inputs.values,
        _controls=inputs.controls,
    )
