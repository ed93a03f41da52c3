"""Small deflections: ms.linear_response."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached, dtype_like, is_tensor, like, plain_arrays
from ..._runtime.frozen import immutable
from ..._runtime.mixins import PlotMixin
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import solve_entry
from ...model.scene.reshaped import reshaped
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ...model.scene.values import Values
from ..adjoint.response import ResponseAdjoint
from ..statics.equilibrium import Equilibrium
from .base_state import StiffnessAbout, asked_inputs, leaves_of, residual_of
from .rest import RestStiffness, forces_at_rest

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers


@immutable
@dataclass(frozen=True, repr=False)
class LinearResponse(PlotMixin):
    """The deflection of a scene by linear theory, proportional to the load parameters. It is not an equilibrium.

    displacements: (n_v, 3) m, from the rest shape, or from the equilibrium that was given; edge_rotations: (n_e,) rad, zero
        where an edge has none. Tensors if inputs are tensors.
    equilibrium: that one, or None. factorizations: one.
    """

    scene: Scene
    displacements: Any
    edge_rotations: Any
    factorizations: int
    wall_time: float
    equilibrium: Equilibrium | None = None
    _values: Any = field(repr=False, default=None)
    _load_parameters: Any = field(repr=False, default=None)
    _rest: Any = field(repr=False, default=None)  # (n_v, 3) m, the rest positions, if a tensor was given

    def __getstate__(self) -> dict[Any, Any]:
        """Return the data of a copy or another process: tensors as arrays, without their gradients."""
        values = None if self._values is None else self._values.to_state()
        return {**plain_arrays(vars(self)), "_values": values}

    def __setstate__(self, state: dict[Any, Any]) -> None:
        stored = state["_values"]
        values = None if stored is None else Values.from_state(state["scene"], stored)
        PlotMixin.__setstate__(self, {**state, "_values": values})

    @property
    def positions(self) -> Computed:
        """The positions, (n_v, 3) m; accurate for small displacements only."""
        from_, of = self._rest, self.displacements
        if self.equilibrium is not None:
            from_ = self.equilibrium.positions
        elif from_ is None:
            from_ = self.scene.mesh.rest_positions
        if is_tensor(of):
            return of + (from_ if is_tensor(from_) else of.new_tensor(np.array(from_)))
        return from_ + of

    def __repr__(self) -> str:
        moved = float(np.linalg.norm(detached(self.displacements), axis=1).max(initial=0.0))
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

    Displacements and edge rotations are differentiable, backwards and forwards (torch.func.jvp): by values and load
    parameters that are tensors, and by the inputs of an equilibrium that was found with tensors, with the change of the
    equilibrium itself. A gradient costs ten to twenty evaluations of the stiffness for all inputs, a tangent as many for
    each, and at rest the first of them a factorization. There is none with rigid bodies or skeletons, where supports leave
    any motion without stiffness, by rest_positions where supports rotate, and no second one: NoGradient says so.

    Raises ValueError on bad input, about an equilibrium that is not stable, with its own load parameters, or under a
    pressure without a potential; and where the supports leave a motion without stiffness to what is loaded; Interrupted.

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
    scene, arguments["values"] = reshaped(scene, arguments["values"], no_gradient_with=())
    inputs = asked_inputs(scene, equilibrium, arguments)
    at_rest = forces_at_rest(inputs) if equilibrium is None else None
    with inputs.in_core():
        if equilibrium is None:
            stiffness: RestStiffness | StiffnessAbout = RestStiffness(inputs)
            change = stiffness.response(inputs, at_rest)
        else:
            stiffness = StiffnessAbout(equilibrium)
            change = stiffness.response(inputs)
    displacements, edge_rotations = _results(inputs, equilibrium, stiffness, change)
    return LinearResponse(
        scene=scene,
        displacements=displacements,
        edge_rotations=edge_rotations,
        factorizations=1,
        wall_time=time.perf_counter() - began,
        equilibrium=equilibrium,
        _values=inputs.values,
        _load_parameters=inputs.load_parameters,
        _rest=inputs.given_rest,
    )


def _results(
    inputs: Inputs,
    equilibrium: Equilibrium | None,
    stiffness: RestStiffness | StiffnessAbout,
    change: np.ndarray,
) -> tuple[Any, Any]:
    """Return the displacements and the edge rotations of a response, connected to the inputs that require a gradient."""
    model, leaves = inputs.scene._model, leaves_of(inputs, equilibrium)
    arrays = (np.array(model.positions(change)), np.array(model.edge_rotations(change)))
    given = inputs.given if equilibrium is None else [*inputs.given, equilibrium.positions]
    if not leaves:
        return like(arrays[0], *given), like(arrays[1], *given)
    from ..adjoint.autograd import solved

    refusal = ""
    if equilibrium is not None and equilibrium.load_fraction < 1.0:
        refusal = (
            f"no derivative here: the equilibrium got {equilibrium.load_fraction:.3g} of the way to its loads"
        )
    adjoint = ResponseAdjoint(
        residual_of(inputs, equilibrium),
        inputs,
        change,
        stiffness.solve,
        leaves,
        at_rest=equilibrium is None,
        quadratic=equilibrium is not None and inputs.scene.has_susceptible_shells,
        refusal=refusal,
    )
    displacements, edge_rotations = solved(adjoint, arrays, dtype_like(*given), adjoint.tensors)
    return displacements, edge_rotations
