"""Contacts between bodies that are impossible are refused before a solve starts."""

import warnings

import numpy as np
import pytest

import magshell as ms

SHEET = {"thickness": 1e-3, "young_modulus": 1e6, "mass_density": 1e3}
PLATE = ms.meshes.rectangle(0.02, 0.02, cells=(2, 2))
TILTED = np.array([[1.0, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])


def shell(**moved) -> ms.Shell:
    return ms.Shell(PLATE.transformed(**moved), **SHEET)


def pair(height=2e-3) -> tuple[ms.Shell, ms.Shell]:
    return shell(), shell(translation=(1e-3, 5e-4, height))


def scene_of(*bodies, contacts) -> ms.Scene:
    return ms.Scene(list(bodies), contacts=contacts, gravity=(0, 0, -9.81), allow_rigid_motions=True)


def simulated(scene, **given):
    return ms.simulate(scene, steps=1, time_step=1e-3, progress=False, **given)


def two_pieces(other) -> ms.Shell:
    """Return one shell whose mesh consists of two sheets."""
    points = np.concatenate([PLATE.rest_positions, other.rest_positions])
    return ms.Shell(
        ms.TriangleMesh(points, np.concatenate([PLATE.faces, other.faces + PLATE.n_vertices])), **SHEET
    )


def test_a_mesh_that_crosses_itself_at_rest():
    crossing = two_pieces(PLATE.transformed(rotation=TILTED, translation=(1e-3, -2e-3, -3e-3)))
    with pytest.raises(
        ValueError, match=r"passes through itself at rest.* pairs of faces do, 0 and 8 the first"
    ):
        ms.SelfContact(crossing)


def test_a_minimal_distance_larger_than_that_of_two_faces():
    near = two_pieces(PLATE.transformed(translation=(1e-3, 5e-4, 5e-4)))
    with pytest.raises(
        ValueError, match=r"face 0 of body 0 and face 9 of body 0 are 0.0005 m apart, .* 0.001 m"
    ):
        simulated(scene_of(near, contacts=[ms.SelfContact(near)]))
    lower, upper = pair()
    touch = ms.Contact(lower, upper)
    scene = scene_of(lower, upper, contacts=[touch])
    with pytest.raises(ValueError, match=r"are 0.002 m apart, but must be farther than 0.003 m"):
        simulated(scene, values={touch: {"min_distance": 3e-3}})


def fine(thickness=1e-3) -> ms.Shell:
    """Return a shell whose mesh has edges of 0.5 mm."""
    mesh = ms.meshes.rectangle(4e-3, 2e-3, cells=(8, 4))
    return ms.Shell(mesh, thickness=thickness, young_modulus=1e6, mass_density=1e3)


def test_a_minimal_distance_larger_than_that_of_neighbours_at_rest():
    sheet = fine(thickness=1e-4)
    too_far = ms.SelfContact(sheet, min_distance=1e-3)
    told = r"0.001 m, is larger .* face \d+ of body 0 and face \d+ of body 0 are (0.000\d+) m apart. Give it at most \1 m"
    with pytest.raises(ValueError, match=told) as raised:
        scene_of(sheet, contacts=[too_far])
    largest = float(str(raised.value).split("at most ")[1].split(" m")[0])
    assert largest == pytest.approx(5e-4 / 2**0.5, rel=1e-5)  # from a vertex to the diagonal beside its faces
    touch = ms.SelfContact(sheet, min_distance=0.99 * largest)
    scene = scene_of(sheet, contacts=[touch])
    simulated(scene)
    with pytest.raises(ValueError, match=told):
        simulated(scene, values={touch: {"min_distance": 1e-3}})
    tied = [fine(1e-4), ms.Shell(fine().mesh.transformed(translation=(4e-3, 0.0, 0.0)), **SHEET)]
    with pytest.raises(ValueError, match=r"of a Contact, .* face \d+ of body 1 and face \d+ of body 0 are"):
        ms.Scene(
            tied,
            ties=[ms.Tie(*tied)],
            contacts=[ms.Contact(*tied, min_distance=1e-3)],
            allow_rigid_motions=True,
        )


def test_thickness_above_the_distance_of_neighbours_at_rest_is_warned_of():
    sheet = fine()
    touch = ms.SelfContact(sheet)
    with pytest.warns(
        ms.MeshQualityWarning, match=r"SelfContact, 0.001 m, is larger .* keep 0.00016\d+ m of it"
    ):
        scene = scene_of(sheet, contacts=[touch])
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # once a scene is enough
        simulated(scene)


def test_contacts_between_the_same_sides_are_refused():
    lower, upper = pair()
    touch = ms.Contact(lower, upper)
    for twice in (
        [touch, touch.replaced()],
        [touch, ms.Contact(upper, lower)],
        [ms.SelfContact(lower), ms.SelfContact(lower)],
    ):
        with pytest.raises(ValueError, match="contacts must hold what is between two sides once"):
            scene_of(lower, upper, contacts=twice)
    scene_of(lower, upper, contacts=[touch, ms.SelfContact(lower), ms.SelfContact(upper)])


@pytest.mark.parametrize(
    "name, value, message",
    [
        ("min_distance", -1.0, r"min_distance \[m\] must not be negative"),
        ("contact_stiffness", -1.0, r"contact_stiffness \[Pa\] must be positive"),
        ("activation_distance", np.nan, r"activation_distance \[m\] must be finite"),
        ("friction_coefficient", 0.3, "without friction_coefficient cannot get one in a solve"),
        ("stiffness", 1.0, "no value 'stiffness'"),
    ],
)
def test_values_of_a_solve(name, value, message):
    lower, upper = pair()
    touch = ms.Contact(lower, upper)
    with pytest.raises(ValueError, match=message):
        simulated(scene_of(lower, upper, contacts=[touch]), values={touch: {name: value}})


def test_rigid_parts_that_cannot_touch():
    lower, upper = pair()
    outside = ms.RigidBody(np.arange(PLATE.n_vertices), body=upper)
    with pytest.raises(ValueError, match="about a body that is not in the scene"):
        scene_of(lower, upper, contacts=[ms.Contact(lower, outside)])
    line = ms.RigidBody([0, 1, 5], body=upper)
    with pytest.raises(ValueError, match="rigid part 0 touches nothing"):
        scene_of(lower, upper, line, contacts=[ms.Contact(lower, line)])


def test_starts_that_lie_in_each_other():
    lower, upper = pair()
    scene = scene_of(lower, upper, contacts=[ms.Contact(lower, upper)])
    with pytest.raises(ValueError, match=r"face \d+ of body 0 and face \d+ of body 1 pass through"):
        simulated(scene, start=np.concatenate([PLATE.rest_positions] * 2))
    with pytest.raises(ValueError, match=r"must be one of scene\.contacts"):
        simulated(scene).contact_state(ms.Contact(lower, upper))


@pytest.mark.parametrize("rotation", [(0, 0, np.pi / 4), (0.3, -0.7, 0.2)])
def test_defaults_do_not_depend_on_the_orientation_of_a_body(rotation):
    turn = ms.obstacles.Plane(rotation=rotation)._frame(0.0)[0]
    meshes = [PLATE, PLATE.transformed(rotation=turn)]
    sheets = [ms.Shell(mesh, **SHEET) for mesh in meshes]
    contact = ms.Contact(ms.obstacles.Plane(), friction_coefficient=0.2)
    assert contact._law(sheets[0]) == pytest.approx(contact._law(sheets[1]), rel=1e-12)
    assert contact._law(sheets[0])[-1] == pytest.approx(1e-2 * 0.02 * np.sqrt(2))
    own = [ms.SelfContact(sheet, friction_coefficient=0.2).sticking_speed for sheet in sheets]
    assert own[0] == pytest.approx(own[1], rel=1e-12)
    boxes = [ms.meshes.box((0.03, 0.02, 0.01), cells=(3, 2, 1))]
    boxes.append(boxes[0].transformed(rotation=turn))
    solids = [ms.Solid(box, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)) for box in boxes]
    assert contact._law(solids[0]) == pytest.approx(contact._law(solids[1]), rel=1e-12)
