"""Hard cases of contact between bodies, none of which may pass through another."""

import itertools

import numpy as np
import pytest
from contact_scenes import Watch

import magshell as ms

DENSITY, GRAVITY = 1e3, 9.81
DOWN = (0.0, 0.0, -GRAVITY)


def shell(mesh, thickness=1e-3, young_modulus=1e6) -> ms.Shell:
    return ms.Shell(
        mesh, thickness=thickness, young_modulus=young_modulus, poisson_ratio=0.3, mass_density=DENSITY
    )


def solid(mesh, young_modulus=2e5, element="linear") -> ms.Solid:
    material = ms.NeoHookean(young_modulus=young_modulus, poisson_ratio=0.3)
    return ms.Solid(mesh, material=material, mass_density=DENSITY, element=element)


def sheet(side, cells, at=(0.0, 0.0, 0.0), **given) -> ms.Shell:
    """Return a square sheet around `at`."""
    flat = ms.meshes.rectangle(side, side, cells=(cells, cells))
    return shell(flat.transformed(translation=np.asarray(at) - (side / 2, side / 2, 0.0)), **given)


def everywhere(body) -> np.ndarray:
    return np.arange(body.mesh.n_vertices)


def of_body(scene, body, value) -> np.ndarray:
    """Return a vector on the vertices of one body, zero on the others, (n_v, 3)."""
    all_of = np.zeros((scene.mesh.n_vertices, 3))
    all_of[scene._bodies.spans[scene.bodies.index(body)].vertices] = value
    return all_of


def moved(scene, steps, time_step, **options) -> ms.Trajectory:
    motion = ms.simulate(scene, steps=steps, time_step=time_step, **{"progress": False, **options})
    assert motion.steps_done == steps
    assert_nothing_passes(scene, motion)
    return motion


def assert_nothing_passes(scene, motion) -> None:
    watch = Watch(scene)
    assert [told for positions in motion.positions if (told := watch.complaint(positions))] == []


def between(*bodies, **law) -> list:
    """Return the contacts of each body with the next."""
    return [ms.Contact(a, b, **law) for a, b in itertools.pairwise(bodies)]


def test_a_sheet_folded_to_zero_gap():
    """Turn half a strip over onto the other half until a thousandth of its thickness is left between them."""
    mesh = ms.meshes.rectangle(0.06, 0.01, cells=(20, 2))
    strip = shell(mesh, thickness=5e-4)
    gap = 5e-7
    touch = ms.SelfContact(strip, min_distance=1e-7, activation_distance=1e-6)
    over = ms.Clamp(mesh.edges_at(x=0.06), rotation=(0, -np.pi, 0), center=(0.03, 0.005, gap / 2))
    scene = ms.Scene(strip, supports=[ms.Clamp(mesh.edges_at(x=0.0)), over], contacts=[touch])
    motion = moved(scene, 40, 1e-2, support_factor=np.linspace(0, 1, 41), damping=1e-4)
    assert 1e-7 < motion.contact_state(touch).smallest_distance < 1e-6


def test_twenty_layers_stacked():
    """Check that layers that fall on each other come to rest, each carrying those above it."""
    layers = [sheet(0.02, 2, (3e-4 * (k % 3), 2e-4 * (k % 2), 1.12e-3 * k)) for k in range(20)]
    contacts = between(*layers)
    scene = ms.Scene(
        layers,
        supports=[ms.Pin(everywhere(layers[0]), body=layers[0])],
        contacts=contacts,
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    motion = moved(scene, 30, 5e-3, integrator=ms.ImplicitEuler())
    weight = DENSITY * 1e-3 * 0.02**2 * GRAVITY
    borne = [motion.contact_state(touch).normal_force for touch in contacts]
    np.testing.assert_allclose(borne, weight * np.arange(19, 0, -1), rtol=1e-3)


def needle(radius, length, sides=6) -> ms.TetMesh:
    """Return a cone that stands on its tip at the origin."""
    angle = 2 * np.pi * np.arange(sides) / sides
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(sides, length)], axis=1)
    points = np.concatenate([[(0.0, 0.0, 0.0), (0.0, 0.0, length)], rim])
    return ms.TetMesh(points, [(0, 2 + k, 2 + (k + 1) % sides, 1) for k in range(sides)])


@pytest.mark.parametrize("at", [(0.001, 0.002), (0.0, 0.0)], ids=["on a face", "on a vertex"])
def test_a_needle_on_a_sheet(at):
    """Drop a cone with an opening of 2 degrees at 5 m/s."""
    floor = sheet(0.06, 4)
    cone = solid(needle(3.5e-4, 0.02).transformed(translation=(*at, 1e-3)), young_modulus=1e8)
    scene = ms.Scene(
        [floor, cone],
        supports=[ms.Pin(floor.mesh.boundary_vertices, body=floor)],
        contacts=between(floor, cone),
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    motion = moved(scene, 25, 2e-4, velocities=of_body(scene, cone, (0.0, 0.0, -5.0)))
    assert motion[floor].positions[..., 2].min() < -1e-4


@pytest.mark.parametrize("friction", [None, 0.5])
def test_an_edge_slides_over_an_edge(friction):
    """Check the edges of two sheets that stand across each other."""
    upright = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    across = np.array([[0, -1.0, 0], [1.0, 0, 0], [0, 0, 1.0]])
    flat = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1)).transformed(translation=(-0.02, -0.01, 0))
    lower = shell(flat.transformed(rotation=upright), young_modulus=1e8)
    above = flat.transformed(translation=(0.003, 0.0112, 0)).transformed(rotation=across @ upright)
    upper = shell(above, young_modulus=1e8)
    touch = ms.Contact(lower, upper, friction_coefficient=friction)
    scene = ms.Scene(
        [lower, upper],
        supports=[
            ms.Pin(everywhere(lower), body=lower),
            ms.Pin(everywhere(upper), "y", body=upper),
        ],
        contacts=[touch],
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    motion = moved(scene, 30, 1e-3, velocities=of_body(scene, upper, (0.3, 0.0, 0.0)))
    touched = [motion.contact_state(touch, k) for k in range(len(motion))]
    assert sum(len(each.pairs) > 0 for each in touched) > 5
    assert all(each.smallest_distance > touch.min_distance for each in touched)


@pytest.mark.parametrize(
    "ball_cells, sheet_cells", [(6, 3), (1, 24)], ids=["ball ten times finer", "sheet ten times finer"]
)
def test_a_ball_on_a_sheet_of_another_fineness(ball_cells, sheet_cells):
    side = 0.06 if sheet_cells < 10 else 0.03
    floor = sheet(side, sheet_cells)
    ball = solid(ms.meshes.ball(0.01, cells=ball_cells).transformed(translation=(0.001, 0.002, 0.0108)))
    touch = ms.Contact(floor, ball)
    scene = ms.Scene(
        [floor, ball],
        supports=[ms.Pin(floor.mesh.boundary_vertices, body=floor)],
        contacts=[touch],
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    motion = moved(scene, 6, 1e-3, velocities=of_body(scene, ball, (0.0, 0.0, -1.0)))
    # The coarse sheet runs ahead of the ball after the impact.
    touched = sum(len(motion.contact_state(touch, k).pairs) > 0 for k in range(len(motion)))
    assert touched >= 3 and motion[floor].positions[-1][:, 2].min() < -1e-3


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
@pytest.mark.parametrize("law", ["barrier", "penalty"])
def test_sheets_pressed_together_by_a_thousand_times_their_weight(law):
    lower, upper = sheet(0.02, 4), sheet(0.02, 4, (1e-3, 5e-4, 1.11e-3))
    touch = ms.Contact(lower, upper, law=law)
    scene = ms.Scene(
        [lower, upper],
        supports=[
            ms.Pin(everywhere(lower), body=lower),
            ms.Pin(upper.mesh.vertices_at(x=-0.009), "xy", body=upper),
        ],
        contacts=[touch],
        gravity=(0.0, 0.0, -1e3 * GRAVITY),
        allow_rigid_motions=True,
    )
    pressed = ms.equilibrium(scene)
    assert Watch(scene).complaint(pressed.positions) is None
    weight = 1e3 * DENSITY * 1e-3 * 0.02**2 * GRAVITY
    assert pressed.contact_state(touch).forces[lower.mesh.n_vertices :, 2].sum() == pytest.approx(
        weight, rel=1e-6
    )
    motion = moved(scene, 10, 1e-3)
    assert motion.contact_state(touch).smallest_distance > 0.5 * touch.min_distance


def knotted(width, cells) -> ms.TetMesh:
    """Return a cord of square cross-section along an open overhand knot, in m."""
    t = np.linspace(-2.15, 2.15, 2001)
    path = 0.02 * np.stack([t**3 - 3 * t, t**4 - 4 * t**2, 0.2 * (t**5 - 10 * t)], axis=1)
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    even = np.linspace(0.0, length[-1], cells + 1)
    path = np.stack([np.interp(even, length, each) for each in path.T], axis=1)
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = [np.cross(tangent[0], (0.0, 0.0, 1.0))]
    for each in tangent[1:]:  # parallel transport along the path
        across.append(across[-1] - (across[-1] @ each) * each)
    across = np.array([v / np.linalg.norm(v) for v in across])
    up = np.cross(tangent, across)
    straight = ms.meshes.box((cells, 1.0, 1.0), cells=(cells, 1, 1))
    x = straight.rest_positions
    k = np.rint(x[:, 0]).astype(int)
    points = path[k] + width * ((x[:, 1:2] - 0.5) * across[k] + (x[:, 2:] - 0.5) * up[k])
    return ms.TetMesh(points, straight.tetrahedra)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_a_knot_pulled_tight():
    """Draw the ends of a knotted cord apart to nearly three times their distance."""
    mesh = knotted(0.003, 80)
    cord = solid(mesh, young_modulus=1e5)
    touch = ms.SelfContact(cord)
    x = mesh.rest_positions
    ends = [np.flatnonzero(np.linalg.norm(x - x[k], axis=1) < 0.006) for k in (0, -1)]
    way = x[ends[0]].mean(0) - x[ends[1]].mean(0)
    pulls = [
        ms.Pin(end, displacement=tuple(s * 0.9 * way), body=cord)
        for end, s in zip(ends, (1, -1), strict=True)
    ]
    scene = ms.Scene(cord, supports=pulls, contacts=[touch])
    motion = moved(
        scene, 40, 1e-2, support_factor=np.linspace(0, 1, 41), damping=1e-4, integrator=ms.ImplicitEuler()
    )
    assert len(motion.contact_state(touch).pairs) > 10


def squeezed(advance, axes=range(3)) -> ms.Scene:
    """Return a scene of a soft block among plates, two per axis, that approach it by `advance`."""
    block = solid(ms.meshes.box((0.01, 0.01, 0.01), cells=(2, 2, 2)).transformed(translation=(-5e-3,) * 3))
    plates, supports = [], []
    for axis, sign in itertools.product(axes, (-1.0, 1.0)):
        normal = np.zeros(3)
        normal[axis] = sign
        turn = np.roll(np.eye(3), axis + 1, axis=0)
        flat = ms.meshes.rectangle(8e-3, 8e-3, cells=(1, 1)).transformed(translation=(-4e-3, -4e-3, 0))
        plate = shell(flat.transformed(rotation=turn, translation=5.3e-3 * normal), thickness=1e-4)
        plates.append(plate)
        supports.append(ms.Pin(everywhere(plate), displacement=tuple(-advance * normal), body=plate))
    contacts = [ms.Contact(block, plate) for plate in plates] + between(*plates)
    return ms.Scene([block, *plates], supports=supports, contacts=contacts, allow_rigid_motions=True)


PRESSING = {"support_factor": np.linspace(0, 1, 11), "integrator": ms.ImplicitEuler()}


def test_a_body_squeezed_until_it_cannot_move():
    """Check a block squeezed on all six sides to four fifths of its size."""
    scene = squeezed(1.2e-3)
    motion = moved(scene, 10, 1e-3, **PRESSING)
    block = motion[scene.bodies[0]].positions[-1]
    assert all(len(motion.contact_state(touch).pairs) for touch in scene.contacts[:6])
    np.testing.assert_allclose(np.ptp(block, axis=0), 8.1e-3, rtol=1e-3)


def test_blocked_contact_names_the_faces_in_the_way():
    """Check two plates that are moved through each other and a block between them."""
    scene = squeezed(5.5e-3, axes=(2,))
    way = r"face \d+ of body \d and face \d+ of body \d are in each other's way"
    with pytest.raises(ms.NotConverged, match=way) as told:
        moved(scene, 10, 1e-3, **PRESSING)
    assert told.value.last_good.steps_done > 5
    assert_nothing_passes(scene, told.value.last_good)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=repr)
def test_contact_that_opens_and_closes_in_every_step(integrator):
    """Check a plate that hammers on a block: down in one step, up in the next."""
    block = solid(
        ms.meshes.box((6e-3, 6e-3, 4e-3), cells=(1, 1, 1)).transformed(translation=(-3e-3, -3e-3, 0))
    )
    plate = sheet(0.02, 1, (1e-4, 2e-4, 4.1e-3), thickness=1e-4)
    touch = ms.Contact(plate, block)
    scene = ms.Scene(
        [plate, block],
        supports=[
            ms.Pin(everywhere(plate), displacement=(0.0, 0.0, -4e-4), body=plate),
            ms.Pin(block.mesh.vertices_at(z=0.0), body=block),
        ],
        contacts=[touch],
    )
    down = np.arange(21) % 2
    motion = moved(scene, 20, 1e-3, support_factor=down, stiffness_damping=2e-3, integrator=integrator)
    touched = np.array([len(motion.contact_state(touch, k).pairs) > 0 for k in range(21)])
    np.testing.assert_array_equal(touched, down == 1)
