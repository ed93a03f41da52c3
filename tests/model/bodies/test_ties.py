"""Welded bodies against the same as one body. Their gradients: test_every_gradient.py."""

import copy

import numpy as np
import pytest

import magshell as ms
from magshell.model.contact.contacts_to_core import contact_points

LENGTH, WIDTH = 0.04, 0.01
FULL = ms.meshes.rectangle(LENGTH, WIDTH, cells=(8, 2))
PLATE = {"thickness": 5e-4, "poisson_ratio": 0.3, "mass_density": 1e3}


def halves(**options):
    """Return a strip as two bodies and their tie; the second has its seam first."""
    half = ms.meshes.rectangle(LENGTH / 2, WIDTH, cells=(4, 2))
    left = ms.Shell(half, young_modulus=1e6, **PLATE)
    right = ms.Shell(half.transformed(translation=(LENGTH / 2, 0, 0)), young_modulus=1e6, **PLATE)
    return left, right, ms.Tie(left, right, **options)


def coated(young_modulus=3e6):
    """Return two strips, one on the other, and their tie."""
    a, b = (ms.Shell(FULL, young_modulus=y, **PLATE) for y in (1e6, young_modulus - 1e6))
    return a, b, ms.Tie(a, b)


def clamped(mesh, body):
    return ms.Clamp(mesh.edges_at(x=0.0), body=body)


def test_tied_halves_stretch_as_one_strip():
    left, right, tie = halves()
    pull = ms.EdgeLoad(right.mesh.edges_at(x=LENGTH), (0.5, 0.1, 0), body=right)
    two = ms.Scene([left, right], ties=[tie], supports=[clamped(left.mesh, left)], loads=[pull])
    sheet = ms.Shell(FULL, young_modulus=1e6, **PLATE)
    one = ms.Scene(
        sheet, supports=[clamped(FULL, None)], loads=[ms.EdgeLoad(FULL.edges_at(x=LENGTH), (0.5, 0.1, 0))]
    )
    of_two, of_one = ms.equilibrium(two, require_stable=False), ms.equilibrium(one, require_stable=False)
    assert two._bodies.n_vertices == FULL.n_vertices
    for body in (left, right):
        same = [FULL.nearest_vertex(place) for place in body.mesh.rest_positions]
        assert np.allclose(of_two[body].positions, of_one.positions[same], rtol=0, atol=1e-12)
    assert of_two.energies["membrane"] == pytest.approx(of_one.energies["membrane"], rel=1e-12)


def test_a_seam_is_a_hinge():
    """Check that the second half hangs straight down from the seam."""
    left, right, tie = halves()
    held = ms.Clamp(left.mesh.edges_at(x=0.0), body=left)
    scene = ms.Scene(
        [left, right], ties=[tie], supports=[held], gravity=(0, 0, -2.0), allow_rigid_motions=True
    )
    start = scene.mesh.rest_positions.copy()
    start[right.mesh.n_vertices :, 2] -= 0.3 * (start[right.mesh.n_vertices :, 0] - LENGTH / 2)
    hanging = ms.equilibrium(scene, start=start)[right].positions
    seam = hanging[right.mesh.vertices_at(x=LENGTH / 2)].mean(axis=0)
    end = hanging[right.mesh.vertices_at(x=LENGTH)].mean(axis=0)
    assert np.allclose(end - seam, (0, 0, -LENGTH / 2), atol=1e-3 * LENGTH)


@pytest.mark.parametrize("moves", [False, True], ids=["at rest", "in motion"])
def test_a_coating_adds_its_stiffness_and_mass(moves):
    a, b, tie = coated()
    sheet = ms.Shell(FULL, young_modulus=3e6, **{**PLATE, "mass_density": 2e3})
    load = ms.PointLoad(FULL.vertices_at(x=LENGTH), (0, 1e-4, 2e-3), body=b)
    two = ms.Scene(
        [a, b], ties=[tie], supports=[clamped(FULL, a), clamped(FULL, b)], loads=[load], gravity=(0, 0, 3.0)
    )
    load = ms.PointLoad(FULL.vertices_at(x=LENGTH), (0, 1e-4, 2e-3))
    one = ms.Scene(sheet, supports=[clamped(FULL, None)], loads=[load], gravity=(0, 0, 3.0))
    of_two, of_one = (
        ms.simulate(scene, steps=4, time_step=5e-3, velocities=(0, 0, 0.2))
        if moves
        else ms.equilibrium(scene)
        for scene in (two, one)
    )
    assert np.array_equal(of_two[a].positions, of_two[b].positions)
    assert np.allclose(of_two[b].positions, of_one.positions, rtol=0, atol=1e-9 * LENGTH)


def test_vibrations_of_a_coated_strip():
    a, b, tie = coated()
    two = ms.Scene([a, b], ties=[tie], supports=[clamped(FULL, a), clamped(FULL, b)])
    one = ms.Scene(
        ms.Shell(FULL, young_modulus=3e6, **{**PLATE, "mass_density": 2e3}), supports=[clamped(FULL, None)]
    )
    frequencies = [ms.vibration_modes(scene, count=3).frequencies for scene in (two, one)]
    assert np.allclose(*frequencies, rtol=1e-8)


def test_support_of_one_tied_body_holds_the_other():
    left, right, tie = halves()
    right_only = [ms.Clamp(right.mesh.edges_at(x=LENGTH), body=right)]
    with pytest.raises(ValueError, match="leave the sheets free: rotation about"):
        ms.Scene(
            [left, right], supports=[*right_only, ms.Pin(left.mesh.vertices_at(x=LENGTH / 2), body=left)]
        )
    pinned = ms.Pin(left.mesh.vertices_at(x=0.0), body=left)
    assert ms.Scene([left, right], ties=[tie], supports=[*right_only, pinned]).n_dofs > 0


def test_coinciding_vertices_of_tied_bodies_are_counted_once():
    left, right, tie = halves()
    floor = ms.Contact(ms.obstacles.Plane((0, 0, 1.0), center=(0, 0, -1e-3)), contact_stiffness=5.0)
    scene = ms.Scene(
        [left, right], ties=[tie], contacts=[floor], gravity=(0, 0, -1.0), allow_rigid_motions=True
    )
    vertices = contact_points(scene._bodies, floor)[0]
    assert len(np.unique(scene._bodies.original[vertices[:, 0]])) == len(vertices) == scene._bodies.n_vertices
    only = ms.Contact(ms.obstacles.Plane((0, 0, 1.0)), contact_stiffness=5.0, body=right)
    assert len(contact_points(scene._bodies, only)[0]) == right.mesh.n_vertices


def test_copies_and_scenes_of_three():
    a, b, tie = coated()
    c = ms.Shell(FULL, young_modulus=1e6, **PLATE)
    scene = ms.Scene([c, a, b], ties=[tie, ms.Tie(b, c)], supports=[clamped(FULL, a)])
    assert scene._bodies.n_vertices == FULL.n_vertices
    again = copy.deepcopy(scene)
    assert again._bodies.n_vertices == FULL.n_vertices
    assert "welded by Tie(27 vertices)" in repr(again)


def test_a_tied_scene_does_not_pass_through_itself():
    left, right, tie = halves()
    scene = ms.Scene(
        [left, right],
        ties=[tie],
        supports=[clamped(left.mesh, left)],
        gravity=(0, 0, -0.5),
        allow_rigid_motions=True,
    )
    assert len(ms.equilibrium(scene, require_stable=False).self_intersections()) == 0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda a, b: ms.Tie(a, a), "a and b are the same body: to join meshes into one body use ms.weld"),
        (lambda a, b: ms.Tie(a, b.mesh), "Tie b must be a Shell or a Solid of the scene"),
        (lambda a, b: ms.Tie(a, b, tolerance=0.0), "tolerance .m. must be positive, got 0"),
        (lambda a, b: ms.Tie(a, b, vertices=[0]), "vertex 0 of a to one of b within .* the nearest is 0.02 m away"),
        (lambda a, b: ms.Tie(a, b, vertices=[99]), "Tie vertices must be in"),
        (lambda a, b: ms.Tie(a, b, tolerance=6e-3), "its tolerance of 0.006 m is too wide"),
        (lambda a, b: ms.Tie(a, ms.Shell(FULL, thickness=1e-3, young_modulus=1.0)), "a Shell that is not in it"),
        (lambda a, b: "weld", "ties"),
    ],
)  # fmt: skip
def test_ties_that_do_not_fit_are_refused(make, message):
    left, right, _ = halves()
    with pytest.raises(ValueError, match=message):
        ms.Scene([left, right], ties=[make(left, right)], supports=[clamped(left.mesh, left)])


def test_bodies_without_common_points_are_refused_as_tied():
    left, right, _ = halves()
    far = ms.Shell(FULL.transformed(translation=(0, 0, 1.0)), young_modulus=1e6, **PLATE)
    with pytest.raises(
        ValueError, match=r"no vertices of a and b within 4\.12e-08 m of each other: the nearest are 1 m"
    ):
        ms.Scene([left, right, far], ties=[ms.Tie(left, far)])


@pytest.mark.parametrize("name", ["start", "velocities"])
def test_welded_vertices_have_one_position_and_velocity(name):
    a, b, tie = coated()
    scene = ms.Scene([a, b], ties=[tie], supports=[clamped(FULL, a)])
    rows = scene.mesh.rest_positions.copy() if name == "start" else np.zeros((scene.mesh.n_vertices, 3))
    rows[30, 2] += 1e-3
    message = rf"{name} \[.*\] must be the same where bodies are tied, but those of vertices 3 and 30 differ by 0.001"
    with pytest.raises(ValueError, match=message):
        ms.simulate(scene, steps=1, time_step=1e-3, **{name: rows})


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_coat_of_a_solid_has_the_same_strain(element):
    """Stretch a bar and its coat, both St. Venant-Kirchhoff with one Poisson ratio.

    Lateral strains agree, and second Piola-Kirchhoff forces add up.
    """
    length, side, nu, strain = 0.02, 0.01, 0.3, 0.05  # strain: Green's, along the bar
    bar = ms.Solid(
        ms.meshes.box((length, side, side), cells=(3, 2, 2)),
        material=ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=nu),
        element=element,
    )
    top = bar.mesh.surface.faces_at(z=side)
    faces = bar.mesh.surface.faces[top]
    used = np.unique(faces)
    mesh = ms.TriangleMesh(bar.mesh.surface.rest_positions[used], np.searchsorted(used, faces))
    sheet = ms.Shell(mesh, thickness=1e-4, young_modulus=1e8, poisson_ratio=nu)
    stretch = np.sqrt(1 + 2 * strain)
    x = bar.mesh.rest_positions
    ends = [
        ms.Pin(bar.mesh.vertices_at(x=0.0), components="x", body=bar),
        ms.Pin(
            bar.mesh.vertices_at(x=length),
            components="x",
            displacement=((stretch - 1) * length, 0, 0),
            body=bar,
        ),
        ms.Pin(bar.mesh.vertices_at(y=0.0), components="y", body=bar),
        ms.Pin(bar.mesh.vertices_at(z=0.0), components="z", body=bar),
    ]
    scene = ms.Scene([sheet, bar], ties=[ms.Tie(bar, sheet)], supports=ends)
    rest = ms.equilibrium(scene)
    thinner = np.sqrt(1 - 2 * nu * strain)
    assert np.allclose(rest[bar].positions, x * (stretch, thinner, thinner), rtol=0, atol=1e-9 * length)
    energy = 0.5 * strain**2 * length * (1e6 * side**2 + 1e8 * 1e-4 * side)
    assert sum(rest.energies.values()) == pytest.approx(energy, rel=1e-8)


def test_corners_of_quadratic_solids_alone_are_refused_by_ties_and_rigid_bodies():
    """Check vertices that were selected on the mesh of four-node tetrahedra, which leave the nodes between them free."""
    meshes = [
        ms.meshes.box((0.2, 0.1, 0.1), cells=(2, 1, 1)).transformed(translation=(x, 0, 0)) for x in (0, 0.2)
    ]
    rubber = ms.StableNeoHookean(young_modulus=1e6, poisson_ratio=0.3)
    solids = [ms.Solid(mesh, material=rubber) for mesh in meshes]
    held = ms.Pin(solids[0].mesh.vertices_at(x=0.0), body=solids[0])
    for mesh, is_right in ((meshes[0], False), (solids[0].mesh, True)):
        tie = ms.Tie(*solids, vertices=mesh.vertices_at(x=0.2))
        plate = ms.RigidBody(mesh.vertices_at(x=0.2), body=solids[0])
        for name, build in (
            ("Tie", lambda tie=tie: ms.Scene(solids, supports=held, ties=tie)),
            ("RigidBody", lambda plate=plate: ms.Scene([solids[0], plate], supports=held)),
        ):
            if is_right:
                build()
            else:
                with pytest.raises(ValueError, match=f"{name} vertices hold the corners of 2 faces"):
                    build()
