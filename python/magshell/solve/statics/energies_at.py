"""Energies of a scene at given positions, which need not be an equilibrium: ms.energies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensors import requires_gradient, to_array
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import solve_entry
from ...model.bodies.bodies import checked_body
from ...model.shells.shell import Shell
from ...model.solids.solid import Solid
from .single_solve import inputs_of
from .start import check_faces

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ...model.scene.scene import Scene


_ELASTIC = ("membrane", "bending")  # of shells


@solve_entry
def energies(
    scene: Scene,
    positions: Numbers,
    *,
    edge_rotations: Numbers | None = None,
    body: Shell | Solid | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: Any = 1.0,
    gravity_factor: Any = 1.0,
    field_factor: Any = 1.0,
    support_factor: Any = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
) -> dict[str, float]:
    """Compute the potential energies of a scene at given positions, in equilibrium or not, {name: J}.

    positions: (n_v, 3) m. edge_rotations: (n_e,) rad, as a result has them, of sheets with bending="midedge"; by default
        none, which leaves the normals across edges half-way between those of their faces.
    body: of the scene: its elastic energies alone, "membrane" and "bending" of a Shell, "solid" of a Solid.

    {keywords}
    values: as in ms.equilibrium.

    At the positions of an equilibrium these are its `energies`. The directions that clamps prescribe are used; other
    prescribed displacements are not. Energies have no gradients here: those of an equilibrium do.

    Raises ValueError on bad input, and where there is no energy: bodies in contact intersect or are nearer than
    they may be, or elements are inside out whose material does not bear it.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    >>> stretched = ms.energies(scene, mesh.rest_positions * (1.01, 1, 1))
    >>> round(stretched["membrane"], 9)  # E h A/2 by the square of a strain of (1.01^2 - 1)/2
    0.000101002
    """
    arguments = given_to("energies", locals())
    given = {"positions": positions, "edge_rotations": edge_rotations}
    inputs = inputs_of(scene, arguments, ignore_velocity_forces=True)
    if inputs.leaves or any(map(requires_gradient, given.values())):
        raise ValueError("energies have no gradients: give tensors detached")
    mesh, model = scene.mesh, scene._model
    number = None if checked_body(body) is None else scene._bodies.number(body)
    places = quantity("positions", "m", to_array("positions", positions), (mesh.n_vertices, 3))
    scene._bodies.check_welded("positions", "m", places)
    check_faces(scene, places)
    rotations = np.zeros(scene._bodies.n_rotations)
    if edge_rotations is not None:
        rotations = to_array("edge_rotations", edge_rotations)
        rotations = quantity("edge_rotations", "rad", rotations, (scene._bodies.n_rotations,))
    with inputs.in_core():
        state = model.state(places, rotations)
        # Positions do not determine the directions that clamps hold: the clamps prescribe these degrees of freedom.
        first = 3 * scene._bodies.n_points
        directions = slice(first, first + 3 * len(scene._constraints.directions))
        state[directions] += model.driven_increment(state, inputs.controls)[directions]
        if reason := model.refusal(state):
            raise ValueError(f"there is no energy at these positions: {reason}")
        of_terms = model.term_energies(state, [], inputs.controls)
    if number is not None:
        return _of_body(scene, number, of_terms)
    found: dict[str, float] = {}
    for name, energy in of_terms:
        found[name] = found.get(name, 0.0) + energy
    return found


def _of_body(scene, number: int, of_terms: list[tuple[str, float]]) -> dict[str, float]:
    """Return the elastic energies of one body; the core lists elastic terms in the order of the bodies, one each."""
    body, bodies = scene.bodies[number], scene._bodies
    kind, names = (bodies.solids, ("solid",)) if isinstance(body, Solid) else (bodies.sheets, _ELASTIC)
    before = next(k for k, each in enumerate(kind) if each is body)
    return {name: [energy for each, energy in of_terms if each == name][before] for name in names}
