"""Strips in contact against exact numbers: F5 and F7 of the validation set."""

import numpy as np
import pytest

import magshell as ms

# F5: (friction, angle, nodes) -> ratio of the tensions before and behind that many nodes, each turning by the same angle.
CAPSTANS = {
    (0.3, np.pi, 16): 2.574853857,
    (0.3, np.pi, 64): 2.566861977,
    (0.5, 2 * np.pi, 32): 23.43607288,
    (0.2, np.pi / 2, 8): 1.37055157,
}


def tension_ratio(friction, angle, nodes, lagged) -> float:
    """Compute the ratio of tensions of a strip drawn over a cylinder against a weight, from its stretch."""
    radius, width, thickness, modulus, weight, tail = 0.02, 4e-3, 2e-5, 1e9, 0.02, 5
    turn = angle / nodes
    piece, pieces = 2 * radius * np.sin(turn / 2), nodes - 1 + 2 * tail
    mesh = ms.meshes.rectangle(pieces * piece, width, cells=(pieces, 1))
    node = np.rint(mesh.rest_positions[:, 0] / piece).astype(int)
    on, before, behind = (
        np.clip(node - tail, 0, nodes - 1) * turn - (angle - turn) / 2,
        np.minimum(node - tail, 0),
        np.maximum(node - tail - nodes + 1, 0),
    )
    along = {s: np.array([np.cos(angle / 2), 0, -s * np.sin(angle / 2)]) for s in (-1, 1)}
    places = np.stack([radius * np.sin(on), mesh.rest_positions[:, 1], radius * np.cos(on)], axis=1)
    places += piece * (np.outer(before, along[-1]) + np.outer(behind, along[1]))
    bent = ms.TriangleMesh(
        places, mesh.faces
    )  # its reference shape is the bent one: only the stretch bends it
    strip = ms.Shell(bent, thickness=thickness, young_modulus=modulus, mass_density=1e2)
    first, last = np.flatnonzero(node == 0), np.flatnonzero(node == pieces)
    touch = ms.Contact(
        ms.obstacles.Capsule([[0, -1, 0], [0, 1, 0]], radius=radius),
        contact_stiffness=1e3,
        smoothing=1e-7,
        friction_coefficient=friction,
        sticking_speed=1e-4,
        lagged_friction=lagged,
    )
    scene = ms.Scene(
        strip,
        supports=[ms.Pin(last, displacement=along[1]), ms.Pin(np.flatnonzero(node < pieces), "y")],
        loads=[ms.PointLoad(first, -0.5 * weight * along[-1])],
        contacts=[touch],
        allow_rigid_motions=True,
    )
    move = ms.simulate(
        scene,
        steps=20,
        time_step=2e-3,
        support_factor=lambda t: 0.02 * t,
        damping=1e-6,
        integrator=ms.ImplicitEuler(),
        progress=False,
    )
    x = move.positions[-1][bent.rest_positions[:, 1] < 1e-9]
    x = x[np.argsort(node[bent.rest_positions[:, 1] < 1e-9])]
    stretch = np.linalg.norm(np.diff(x, axis=0), axis=1) / piece
    tension = 0.5 * (stretch**2 - 1) * stretch
    return tension[-1] / tension[0]


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("lagged", [False, True], ids=["exact", "lagged"])
@pytest.mark.parametrize("friction, angle, nodes", CAPSTANS)
def test_strip_over_a_cylinder_has_the_capstan_tension_ratio(friction, angle, nodes, lagged):
    """Compare with F5. Around a full circle the strip passes through itself, which nothing prevents here."""
    wanted = CAPSTANS[friction, angle, nodes]
    assert tension_ratio(friction, angle, nodes, lagged) == pytest.approx(wanted, rel=0.01)


# F7: the exact elastica of a strip folded between plates at a distance D.
FOLD_FORCE, FREE_LENGTH, FOLD_REACH = 2.871080044, 2.188439615, 0.8346268413  # F D^2 / (E I), and over D
DISTANCE, WIDTH, TAIL = 0.05, 0.01, 0.35  # m, m, fraction of the distance that lies flat
STRIP = {"thickness": 4e-4, "young_modulus": 1e7, "poisson_ratio": 0.0}
STIFFNESS = 1e7 * 4e-4**3 / 12  # N m, of the strip


def half_loop(reach, bottom=0.0, direction=1.0, aside=0.0):
    """Return half of a folded strip from its middle on: its straight reference mesh and a start bent towards -x."""
    length = DISTANCE * (FREE_LENGTH / 2 + TAIL)
    mesh = ms.meshes.rectangle(length, WIDTH, cells=(16, 3))
    s, y = mesh.rest_positions[:, 0], mesh.rest_positions[:, 1]
    radius = DISTANCE / 2 - 1.2 * reach
    arc = np.minimum(s, np.pi / 2 * radius)
    bent = [
        -radius * (1 - np.cos(arc / radius)) - (s - arc),
        y,
        bottom + direction * radius * np.sin(arc / radius),
    ]
    straight = np.stack([0 * s + aside, y, bottom + direction * s], axis=1)
    return ms.TriangleMesh(straight, mesh.faces), np.stack(bent, axis=1)


def plate_above() -> ms.Shell:
    mesh = ms.meshes.rectangle(4 * DISTANCE, 4 * DISTANCE, cells=(1, 1))
    mesh = mesh.transformed(translation=(0.003 - 2 * DISTANCE, 0.004 - 2 * DISTANCE, DISTANCE / 2))
    return ms.Shell(mesh, thickness=1e-3, young_modulus=1e9)


def between_plates(reach):
    mesh, start = half_loop(reach)
    sheet, plate = ms.Shell(mesh, **STRIP), plate_above()
    touch = ms.Contact(sheet, plate, min_distance=0.0, activation_distance=reach)
    scene = ms.Scene(
        [sheet, plate],
        supports=[ms.Clamp(mesh.edges_at(z=0.0), body=sheet), ms.Pin(np.arange(4), body=plate)],
        contacts=[touch],
    )
    return scene, touch, np.concatenate([start, plate.mesh.rest_positions]), mesh.n_vertices


def against_its_mirror(reach):
    """Return a scene of one mesh with two pieces, the second mirrored above the first."""
    aside = 3 * DISTANCE
    halves = [half_loop(reach), half_loop(reach, DISTANCE, -1.0, aside)]
    count = halves[0][0].n_vertices
    points = np.concatenate([mesh.rest_positions for mesh, _ in halves])
    mesh = ms.TriangleMesh(points, np.concatenate([halves[0][0].faces, halves[1][0].faces + count]))
    sheet = ms.Shell(mesh, **STRIP)
    touch = ms.SelfContact(sheet, min_distance=0.0, activation_distance=reach)
    clamps = [
        ms.Clamp(mesh.edges_at(x=0.0, z=0.0)),
        ms.Clamp(mesh.edges_at(x=aside, z=DISTANCE), displacement=(-aside, 0, 0)),
    ]
    scene = ms.Scene(sheet, supports=clamps, contacts=[touch])
    return scene, touch, np.concatenate([start for _, start in halves]), count


@pytest.mark.parametrize("setting", [between_plates, against_its_mirror])
def test_folded_strip_has_the_force_and_reach_of_the_elastica(setting):
    reach = 2e-4
    scene, touch, start, count = setting(reach)
    found = ms.equilibrium(scene, start=start)
    near = found.contact_state(touch)
    gap = np.average(near.distances, weights=np.abs(near.normal_forces))
    distance = DISTANCE - (2 if setting is between_plates else 1) * gap
    force = -near.forces[:count, 2].sum() / WIDTH
    assert force * distance**2 / STIFFNESS == pytest.approx(FOLD_FORCE, rel=0.01)
    reached = -found.positions[:count, 0].min() - TAIL * DISTANCE - 0.5 * FREE_LENGTH * (DISTANCE - distance)
    assert reached / distance == pytest.approx(FOLD_REACH, rel=0.01)
