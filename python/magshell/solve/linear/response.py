"""Small deflections: ms.linear_response."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import solve_entry
from ...model.scene.scene import Scene
from ..adjoint.mapped import is_mapped
from ..statics.equilibrium import Equilibrium
from .response_batch import LinearResponseBatch, map_responses, respond_in_batch
from .single_response import LinearResponse, respond

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


@overload
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
    batch: None = None,
    threads: int | None = None,
) -> LinearResponse: ...
@overload
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
    batch: int,
    threads: int | None = None,
) -> LinearResponseBatch: ...
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
    batch: int | None = None,
    threads: int | None = None,
) -> LinearResponse | Any:  # LinearResponseBatch of a batch
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
    batch, threads: as in ms.equilibrium, without load cases. The result is a LinearResponseBatch; a member whose stiffness
        is not positive definite is in `failed`. About an equilibrium all members share one factorization. Inside
        torch.func.vmap a response becomes such a batch.

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
    if is_mapped(arguments):
        if batch is not None:
            raise ValueError("batch and torch.func.vmap are both axes of members: take one of them")
        return map_responses(scene, equilibrium, arguments)
    if batch is not None:
        return respond_in_batch(scene, equilibrium, arguments, batch, threads)
    if threads is not None:
        raise ValueError("threads is the number of threads of a batch: give batch=k, or ms.set_num_threads")
    return respond(scene, equilibrium, arguments)
