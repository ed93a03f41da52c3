"""Describes why a search for an equilibrium failed, and gives advice."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...model.actuators.cavity import Cavity
from ...model.bodies.bodies import called
from ...model.fields.magnets import describe_magnet_overlap
from ...model.results.crossings import describe_attraction
from ...model.scene.own_field_errors import describe_coincident_points
from ...model.shells.obtuse_faces import describe_faces
from ...model.supports.constraints import free_rigid_motions
from .solve_log import SolveLog, SolveStep, steps_of

if TYPE_CHECKING:
    from ... import _core
    from ...model.scene.solve_inputs import Inputs
    from ...model.scene.values import Values

# [-] Height of a face over the median edge length, below which round-off of its stiffness hides softer parts.
SHORTEST_HEIGHT = 1e-4
NEARLY_FLAT = np.radians(150.0)  # [rad] faces with a larger angle count as almost flat
_MOST_NAMED = 4  # vertices in a message
LARGEST_STRAIN = 1.0  # [-] by what acts at rest: beyond, a unit is likely to be wrong
_SMALLEST_MOVE = (
    1e-6  # [-] of the scene's size, in one relaxation step: below, relaxation came to a standstill
)


_STRETCH = 1e-3  # of all lengths
_OTHER_TERMS = frozenset(
    (
        "contact",
        "body contact",
        "couple",
        "joints",
        "loads",
        "gravity",
        "magnetic",
        "moments",
        "pressure",
        "volume",
        "wrenches",
    )
)


def why_not(inputs: Inputs, found: _core.StaticsResult, at_rest: bool) -> str:
    """Return the message of a NotConverged. at_rest: whether the solve started from an equilibrium."""
    scene, failed = inputs.scene, found.failed
    whole = found.load_fraction >= 1.0
    head = (
        f"no stable equilibrium was found at the new load parameters, in {found.iterations} iterations"
        if whole
        else f"the solve stopped at {found.load_fraction:.3g} of the way to the new load parameters, "
        f"after {found.iterations} iterations"
    )
    kept = (
        "The unstable one is in `error.last_good`; require_stable=False accepts it."
        if whole
        else "The last converged state is in `error.last_good`."
    )
    sentences = [f"{head}: {found.reason}."]
    if tried := SolveLog(tuple(SolveStep(*step) for step in steps_of(found))).summary():
        sentences.append(f"Steps taken: {tried}; `error.last_good.log` lists them.")
    near = np.zeros(0, dtype=int)  # vertices that have to do with it
    if found.effort_spent:
        sentences += _seen(inputs, found)
    elif failed.state.size:
        sentences += _attempts(found, at_rest and not whole, scene._bodies)
        told, near = _unbalanced_vertices(inputs, found)
        sentences += told
    if failed.state.size:
        positions = scene._model.positions(failed.state)
        fields = map(inputs.values.current, scene.fields)
        if inside := describe_magnet_overlap(fields, positions, scene.mesh.edge_lengths):
            return " ".join([*sentences, inside, kept])
        if lid := _describe_lids(inputs):
            sentences.append(lid)
        if touching := describe_coincident_points(inputs.values, failed.state):
            return " ".join([*sentences, touching, kept])
    advice = _advice(inputs, found, at_rest, near)
    return " ".join(filter(None, [*sentences, advice, describe_attraction(scene), kept]))


def has_given_pressure(values: Values) -> bool:
    """Return whether a cavity of the scene has a given pressure p: its energy -p V has no lower bound."""
    return any(isinstance(each, Cavity) and each.law == "pressure" for each in values.scene.actuators)


def _describe_lids(inputs: Inputs) -> str:
    """Return a sentence on lids of cavities that hang on edges of solids that move; "" if there are none."""
    scene = inputs.scene
    cavities = [each for each in scene.actuators if isinstance(each, Cavity)]
    rims = [each.rim_on_solids(scene._bodies) for each in cavities]
    rim = np.unique(np.concatenate([np.zeros(0, dtype=int), *rims]))
    held = scene._model.positions(scene._model.expand(np.ones(scene._model.free_size)))[rim] == 0.0
    free = rim[~held.all(axis=1)]
    if not len(free):
        return ""
    more = ", ..." if len(free) > _MOST_NAMED else ""
    return (
        f"The lid of a cavity (close_rims) hangs on edges of a solid, at vertices {_listed(free[:_MOST_NAMED])}{more}: its "
        "pressure is a load on a line there, under which strains grow without limit where the mesh is refined. Hold the rim "
        "by a support, or close the cavity by a body."
    )


def _seen(inputs, found) -> list[str]:
    """Describe the last state of a search that took too many factorizations."""
    scene, failed = inputs.scene, found.failed
    state = failed.state if failed.state.size else found.state
    load_parameters = failed.load_parameters if failed.state.size else found.load_parameters
    with inputs.in_core():
        energy = sum(
            energy for _, energy in scene._model.term_energies(state, found.angle_branches, load_parameters)
        )
    moved = np.linalg.norm(scene._model.positions(state) - scene.mesh.rest_positions, axis=1).max(initial=0.0)
    return [
        f"Then the energy was {energy:.3g} J, and the largest displacement {moved:.3g} m, "
        f"{moved / scene._bodies.extent:.2g} of the extent."
    ]


def _attempts(found, in_steps: bool, bodies) -> list[str]:
    told = []
    if in_steps and found.failed.shortest_step < 1.0:
        told.append(f"Load steps were shortened to {found.failed.shortest_step:.2g} of the way.")
    steps = found.relaxation_steps
    if steps == 0:
        told.append("Relaxation found no step to take.")
    else:
        taken, last = ("1 step", "it") if steps == 1 else (f"{steps} steps", "its last one")
        moved = f"; {last} still moved {called(bodies.listed)} by {found.failed.last_move:.2g} m"
        stood = " and came to a standstill"
        told.append(
            f"Relaxation took {taken}{moved if _still_moves(found.failed, bodies.extent) else stood}."
        )
    return told


def _still_moves(failed, size: float) -> bool:
    return failed.last_move > _SMALLEST_MOVE * size


def _unbalanced_vertices(inputs, found) -> tuple[list[str], np.ndarray]:
    """Find where forces are out of balance and where the energy still falls; return sentences and the vertices."""
    if found.relaxation_steps == 0:  # the forces are still those that the new load parameters began with
        return [], np.zeros(0, dtype=int)
    model, failed = inputs.scene._model, found.failed
    with inputs.in_core():
        gradient = model.gradient(failed.state, failed.load_parameters)
    told, near = [], []
    for vector, text in (
        (model.expand(model.reduce(gradient)), "The forces are out of balance most"),
        (failed.falling, "The energy still falls along a motion"),
    ):
        sizes = np.linalg.norm(model.positions(vector), axis=1) if vector.size else np.zeros(0)
        if not (np.isfinite(sizes).all() and sizes.any()):
            continue
        vertices = np.argsort(-sizes, kind="stable")[:_MOST_NAMED]
        vertices = vertices[sizes[vertices] > 0.1 * sizes.max()]
        share = np.linalg.norm(sizes[vertices]) / np.linalg.norm(sizes)
        many = "vertices" if len(vertices) > 1 else "vertex"
        told.append(f"{text} at {many} {_listed(vertices)} ({share:.0%} of it).")
        near.append(vertices)
    return told, np.concatenate(near) if near else np.zeros(0, dtype=int)


def _advice(inputs, found, at_rest: bool, near: np.ndarray) -> str:
    scene, shell = inputs.scene, inputs.values.all_shells
    free = [f"rigid part {k}" for k, part in enumerate(scene.rigid_parts) if part.vertices is None]
    if free and "singular" in found.reason:
        return (
            f"The scene has free bodies ({', '.join(free)}), and what acts on them holds them nowhere: an equilibrium of a "
            "free body needs a field or a contact that does, or look at its motion by ms.simulate."
        )
    if not scene.bodies:
        return "Start from a nearby equilibrium."
    if "inside out" in found.reason:
        return (
            "Start from positions where no element is so, take smaller steps there, or a material that has an energy "
            "there (StableNeoHookean)."
        )
    if not scene._bodies.has_only_three_node_shells:
        return _general_advice(inputs, found, at_rest)
    mesh, quality = scene.mesh, shell.quality
    tiny = np.flatnonzero(quality.heights < SHORTEST_HEIGHT * np.median(mesh.edge_lengths))
    if tiny.size:
        return (
            f"{describe_faces(shell, tiny[np.argsort(quality.heights[tiny], kind='stable')])} nearly degenerate: "
            "beside their stiffness, that of the rest is lost in round-off. Merge their vertices, or leave such faces "
            "out of the mesh; `mesh.quality` has the shapes of all."
        )
    if free := _free(inputs, found):
        return free
    beside = np.flatnonzero(np.isin(mesh.faces, near).any(axis=1))
    flat = beside[quality.largest_angles[beside] > NEARLY_FLAT]
    if flat.size:
        return (
            f"{describe_faces(shell, flat[np.argsort(-quality.largest_angles[flat], kind='stable')])} beside that, and "
            "almost flat: mend the mesh there first."
        )
    return _general_advice(inputs, found, at_rest)


def _free(inputs, found) -> str:
    scene = inputs.scene
    free = free_rigid_motions(scene._bodies, scene._constraints) if "singular" in found.reason else []
    if not free:
        return ""
    return (
        f"The supports leave {called(scene._bodies.listed)} free ({'; '.join(free)}): add supports, unless a field or "
        "gravity holds there."
    )


def _general_advice(inputs, found, at_rest: bool) -> str:
    """Return advice that holds for bodies of all kinds."""
    scene = inputs.scene
    if free := _free(inputs, found):
        return free
    if (strain := strain_of_loads(inputs)) > LARGEST_STRAIN:
        return (
            f"What acts on the bodies at rest would strain them by about {strain:.2g}: is a modulus [Pa], a thickness [m] "
            "or a load in another unit?"
        )
    if "between the points in contact" in found.reason:
        return (
            "No force keeps an obstacle out there, and the mesh is too coarse for it: take shorter edges, face_samples=3 or "
            "a larger contact_stiffness [N/m] of the Contact, or move the obstacle less in a solve."
        )
    if "through an obstacle" in found.reason:
        return (
            "What presses a body onto an obstacle presses it through: take a larger contact_stiffness [N/m] of the Contact, "
            "move the obstacle less in a solve, or a thicker obstacle."
        )
    steps = [step for step in steps_of(found) if step[1] == "load step"]
    if at_rest and any(failure for *_, failure in steps) and has_given_pressure(inputs.values):
        return (
            "The stable equilibria on the way end, probably at a limit point, beyond which nothing near holds the pressure: "
            "ms.follow_path, with the same arguments, follows them to it and past it."
        )
    if found.effort_spent and at_rest:
        return "Start from a nearby equilibrium, or allow it more (max_factorizations of the solver)."
    if _still_moves(found.failed, scene._bodies.extent):
        return "Allow it more steps (max_relaxation_steps of the solver), or start from a nearby equilibrium."
    if not at_rest:
        return "Start from positions closer to an equilibrium."
    return "Start from a nearby equilibrium, or let load steps get shorter (min_load_step of the solver)."


def _listed(numbers: np.ndarray) -> str:
    return ", ".join(map(str, numbers.tolist()))


def strain_of_loads(inputs: Inputs) -> float:
    """Return the even strain at which the elastic energy 1/2 C e^2 balances the work W e of what acts at the rest shape,
    W / C: W = sum |f| |x - mean x| over the vertices. Zero where that says nothing, as of scenes with rigid parts.
    """
    scene = inputs.scene
    if scene.rigid_parts or not scene.bodies:
        return 0.0
    model, x = scene._model, scene.mesh.rest_positions
    arms = x - x.mean(axis=0)
    rest, nothing = model.rest_state(), scene._load_parameter_layout.zeros()
    with inputs.in_core():
        force = model.positions(model.gradient(rest, inputs.load_parameters))
        stretched = model.state(x + _STRETCH * arms, np.zeros(scene._bodies.n_rotations))
        energies = [_elastic_energy(model.term_energies(each, [], nothing)) for each in (stretched, rest)]
    stiffness = 2.0 * (energies[0] - energies[1]) / _STRETCH**2
    with np.errstate(over="ignore"):  # infinite work is no strain, below
        work = float((np.linalg.norm(force, axis=1) * np.linalg.norm(arms, axis=1)).sum())
    return work / stiffness if stiffness > 0.0 and np.isfinite(work) else 0.0


def _elastic_energy(energies: list[tuple[str, float]]) -> float:
    return sum(energy for name, energy in energies if name not in _OTHER_TERMS)
