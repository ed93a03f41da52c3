"""The linear response of one scene to one set of load parameters."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.tensors import detached, dtype_like, is_tensor, like, plain_arrays
from ..._runtime.frozen import immutable
from ..._runtime.mixins import PlotMixin
from ...model.scene.reshaped import reshaped
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ...model.scene.values import Values
from ..adjoint.response import ResponseAdjoint
from ..statics.equilibrium import Equilibrium
from .base_state import StiffnessAbout, leaves_of, linear_inputs, residual_of
from .rest import RestStiffness, forces_at_rest

if TYPE_CHECKING:
    from ..._input.kinds import Computed


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
        return positions_of_response(self)

    def __repr__(self) -> str:
        moved = float(np.linalg.norm(detached(self.displacements), axis=1).max(initial=0.0))
        return f"LinearResponse: largest displacement {moved:.4g} m, {self.wall_time:.3g} s"


def positions_of_response(response: Any) -> Any:
    """Return the positions of a response, or of a batch of them, from its displacements."""
    from_, of = response._rest, response.displacements
    if response.equilibrium is not None:
        from_ = response.equilibrium.positions
    elif from_ is None:
        from_ = response.scene.mesh.rest_positions
    if is_tensor(of):
        return of + (from_ if is_tensor(from_) else of.new_tensor(np.array(from_)))
    return from_ + of


class Responded(NamedTuple):
    """A response in the core: its inputs, the stiffness, the change of all degrees of freedom, and seconds."""

    inputs: Inputs
    stiffness: RestStiffness | StiffnessAbout
    change: np.ndarray
    seconds: float

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """The displacements and the edge rotations."""
        model = self.inputs.scene._model
        return np.array(model.positions(self.change)), np.array(model.edge_rotations(self.change))


def responded(
    scene: Scene,
    equilibrium: Equilibrium | None,
    arguments: dict[str, Any],
    about: StiffnessAbout | None = None,
) -> Responded:
    """Compute the response with the arguments of ms.linear_response. about: the stiffness at the equilibrium, if known."""
    began = time.perf_counter()
    scene, values = reshaped(scene, arguments["values"], no_gradient_with=())
    inputs = linear_inputs(scene, equilibrium, {**arguments, "values": values})
    at_rest = forces_at_rest(inputs) if equilibrium is None else None
    with inputs.in_core():
        if equilibrium is None:
            stiffness: RestStiffness | StiffnessAbout = RestStiffness(inputs)
            change = stiffness.response(inputs, at_rest)
        else:
            stiffness = StiffnessAbout(equilibrium) if about is None else about
            change = stiffness.response(inputs)
    return Responded(inputs, stiffness, change, time.perf_counter() - began)


def adjoint_of(found: Responded, equilibrium: Equilibrium | None) -> ResponseAdjoint:
    """Return what computes derivatives of a response by all tensors among its inputs and those of the equilibrium."""
    refusal = ""
    if equilibrium is not None and equilibrium.load_fraction < 1.0:
        refusal = (
            f"no derivative here: the equilibrium got {equilibrium.load_fraction:.3g} of the way to its loads"
        )
    return ResponseAdjoint(
        residual_of(found.inputs, equilibrium),
        found.inputs,
        found.change,
        found.stiffness.solve,
        leaves_of(found.inputs, equilibrium),
        at_rest=equilibrium is None,
        quadratic=equilibrium is not None and found.inputs.scene.has_susceptible_shells,
        refusal=refusal,
    )


def result_of_response(
    found: Responded, equilibrium: Equilibrium | None, displacements: Any, edge_rotations: Any, rest: Any
) -> LinearResponse:
    """Return the response with these arrays or tensors. rest: the rest positions, if a tensor was given."""
    return LinearResponse(
        scene=found.inputs.scene,
        displacements=displacements,
        edge_rotations=edge_rotations,
        factorizations=1,
        wall_time=found.seconds,
        equilibrium=equilibrium,
        _values=found.inputs.values,
        _load_parameters=found.inputs.load_parameters,
        _rest=rest,
    )


def respond(scene: Scene, equilibrium: Equilibrium | None, arguments: dict[str, Any]) -> LinearResponse:
    """Compute the response, connected to the inputs that require a gradient."""
    found = responded(scene, equilibrium, arguments)
    inputs, arrays = found.inputs, found.arrays
    given = inputs.given if equilibrium is None else [*inputs.given, equilibrium.positions]
    if leaves_of(inputs, equilibrium):
        from ..adjoint.autograd import solved

        adjoint = adjoint_of(found, equilibrium)
        displacements, edge_rotations = solved(adjoint, arrays, dtype_like(*given), adjoint.tensors)
    else:
        displacements, edge_rotations = (like(each, *given) for each in arrays)
    return result_of_response(found, equilibrium, displacements, edge_rotations, inputs.given_rest)
