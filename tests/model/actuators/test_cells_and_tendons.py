"""Cells and tendons in scenes: results, groups, sliding, slack, motions, pictures and files."""

import numpy as np
import pytest
from actuated import SOFT, held, hollow_block

import magshell as ms

AREA, LENGTH = 1e-4, 0.1


def bar(element="linear", cells=(8, 2, 2)) -> ms.Solid:
    mesh = ms.meshes.box((LENGTH, 0.01, 0.01), cells=cells)
    return ms.Solid(
        mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.0), element=element, mass_density=1e3
    )


def fixed(body, **options) -> ms.Scene:
    return ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(x=0.0))], **options)


def along(height=0.005, count=5, body=None):
    return np.stack([np.linspace(0, LENGTH, count), np.full(count, 0.005), np.full(count, height)], axis=1)


def test_low_rank_and_coupled_groups_give_the_same_result():
    """Compare groups of 33 and 45 nodes, of which only the smaller is coupled within the sparse matrix."""
    body = bar()
    groups = [
        np.flatnonzero(np.abs(body.mesh.tetrahedron_barycenters[:, 0] - c) < 0.025) for c in (0.025, 0.075)
    ]
    targets = [1.2, 0.9]
    whole = ms.PneumaticCells(body, groups, stiffness=1e6, volume_ratio=targets)
    apart = [
        ms.PneumaticCells(body, [g], stiffness=1e6, volume_ratio=t)
        for g, t in zip(groups, targets, strict=True)
    ]
    found = [ms.equilibrium(fixed(body, actuators=each)) for each in ([whole], apart)]
    assert np.abs(found[0].positions - found[1].positions).max() < 1e-10
    ratios = found[0][whole].volume_ratios
    assert np.allclose(ratios, targets, rtol=0.03)
    assert np.allclose(found[0][whole].pressures, 1e6 * (np.array(targets) - ratios), rtol=1e-12)


def test_groups_as_numbers_and_as_lists_are_the_same():
    body = bar()
    number = np.where(body.mesh.tetrahedron_barycenters[:, 0] < 0.03, 0, -1)
    number[body.mesh.tetrahedron_barycenters[:, 0] > 0.08] = 1
    as_list = [np.flatnonzero(number == k) for k in (0, 1)]
    cells = [ms.PneumaticCells(body, groups, stiffness=1e5, volume_ratio=1.1) for groups in (number, as_list)]
    for each in cells:
        assert all(np.array_equal(a, b) for a, b in zip(each.groups, as_list, strict=True))
    assert cells[0].count == 2 and ms.PneumaticCells(body, stiffness=1.0).count == body.mesh.n_tetrahedra


def test_cells_of_a_gripper_in_motion():
    """Simulate 56 groups, each with a volume ratio of its own over time."""
    body = bar(cells=(14, 2, 2))
    at = body.mesh.tetrahedron_barycenters
    number = (at[:, 0] * 140).astype(int) * 4 + (at[:, 1] > 0.005) * 2 + (at[:, 2] > 0.005)
    cells = ms.PneumaticCells(body, number, stiffness=2e5)
    assert cells.count == 56
    course = np.ones((11, 56))
    course[:, 1::2] += 0.3 * np.linspace(0, 1, 11)[:, None]
    move = ms.simulate(
        fixed(body, actuators=[cells]),
        steps=10,
        time_step=5e-3,
        values={cells: {"volume_ratio": course}},
        progress=False,
    )
    assert move[cells].volume_ratios.shape == move[cells].pressures.shape == (11, 56)
    assert np.allclose(
        move[cells].pressures, 2e5 * (course - move[cells].volume_ratios), rtol=1e-10, atol=1e-7
    )
    tip = body.mesh.vertices_at(x=LENGTH)
    assert move.positions[-1, tip, 2].mean() < 0.005 - 1e-3  # bends away from those that grow


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_a_tendon_along_the_axis_shortens_a_bar_by_its_pull(element):
    body = bar(element)
    pull = ms.Tendon(along(), body, tension=0.5)
    found = ms.equilibrium(fixed(body, actuators=[pull]))
    # mu/2 (I1 - 3) - mu ln J + ... with nu = 0: E/2 (l - 1/l) = -T/A in the mean of the cross-section
    stress = 0.5 / AREA / 1e5
    stretch = -stress + np.sqrt(stress**2 + 1.0)
    middle = np.abs(body.mesh.rest_positions[:, 0] - 0.05) < 0.026
    slope = np.polyfit(body.mesh.rest_positions[middle, 0], found.positions[middle, 0], 1)[0]
    assert slope == pytest.approx(stretch, rel=3e-3)
    assert float(found[pull].tension) == 0.5
    assert float(found[pull].length) == pytest.approx(np.ptp(found[pull].positions[:, 0]), rel=1e-6)


def test_a_sliding_tendon_has_one_tension_and_a_fixed_one_many():
    body = bar()
    path = [(0, 0.005, 0.009), (0.03, 0.005, 0.009), (0.06, 0.005, 0.002), (0.1, 0.005, 0.009)]
    values = {"stiffness": 20.0, "rest_length": 0.09}
    slides, holds = ms.Tendon(path, body, **values), ms.Tendon(path, body, sliding=False, **values)
    found = {each: ms.equilibrium(fixed(body, actuators=[each])) for each in (slides, holds)}
    assert np.ndim(found[slides][slides].tension) == 0
    tensions = found[holds][holds].tension
    assert tensions.shape == (3,) and np.ptp(tensions) > 0.01 * tensions.mean()
    # In the held body only the tendon exerts forces.
    length = float(found[slides][slides].length)
    beyond = length - 0.09 - 0.5 * float(slides.smoothing)
    assert float(found[slides][slides].tension) == pytest.approx(20.0 * beyond, rel=1e-12)


def test_slack_tendon_has_no_force_until_it_is_shortened():
    body = bar()
    tendon = ms.Tendon(along(), body, stiffness=20.0, rest_length=0.12)
    scene = fixed(body, actuators=[tendon])
    slack = ms.equilibrium(scene)
    assert np.abs(slack.displacements).max() < 1e-15 and float(slack[tendon].tension) == 0.0
    lengths = np.linspace(0.12, 0.09, 21)
    move = ms.simulate(
        scene, steps=20, time_step=2e-3, values={tendon: {"rest_length": lengths}}, progress=False
    )
    tensions = move[tendon].tension
    assert (tensions[lengths > 0.102] == 0).all() and tensions[-1] > 0.05


def test_a_tendon_from_body_to_body_and_to_a_link():
    block = hollow_block()
    link = ms.Link(mass=0.01, center=(0.015, 0.015, 0.06), inertia=1e-6 * np.eye(3))
    hinge = ms.Revolute(link, origin=(0.015, 0.015, 0.05), axis=(0, 1, 0), spring_stiffness=1e-3)
    skeleton = ms.Skeleton([link], [hinge])
    tendon = ms.Tendon([(block, (0.028, 0.015, 0.03)), (link, (0.025, 0.015, 0.06))], tension=0.05)
    scene = ms.Scene(
        [block, skeleton], supports=[ms.Pin(block.mesh.vertices_at(z=0.0), body=block)], actuators=[tendon]
    )
    found = ms.equilibrium(scene)
    assert found.stable
    at_link = found[tendon].positions[1]
    arm = at_link - np.array([0.015, 0.015, 0.05])
    pull = 0.05 * (found[tendon].positions[0] - at_link) / float(found[tendon].length)
    turning = np.cross(arm, pull)[1]
    assert 1e-3 * float(found[hinge].angle) == pytest.approx(turning, rel=1e-6)


def test_pictures_and_files(tmp_path):
    body = bar()
    tendon = ms.Tendon(along(0.009), body, tension=0.2)
    scene = fixed(body, actuators=[tendon])
    found = ms.equilibrium(scene)
    from magshell.output.results.state import states_of

    (state,) = states_of(found)
    ((points, faces),) = state.tendons
    assert np.ptp(points[:, 0]) > 0.09 and len(faces)
    assert len(states_of(scene)[0].tendons) == 1 and not states_of(body)[0].tendons
    ms.plot(found, width=500).save(tmp_path / "arm.png")
    assert (tmp_path / "arm.png").stat().st_size > 3000


def test_linear_theory_refuses_springs():
    body = bar()
    scene = fixed(body, actuators=[ms.PneumaticCells(body, stiffness=1e5)])
    with pytest.raises(ValueError, match=r"Cells\(192.*is a spring"):
        ms.linear_response(scene)
    with pytest.raises(ValueError, match="is a spring"):
        ms.linear_buckling(scene)


def test_scenes_copy_and_print_their_actuators():
    import copy
    import pickle

    body = hollow_block()
    scene = held(body, actuators=[ms.Cavity(body, pressure=1e3), ms.PneumaticCells(body, stiffness=1e3)])
    for other in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert len(other.actuators) == 2 and other.actuators[0].body is other.bodies[0]
        assert np.array_equal(ms.equilibrium(other).positions, ms.equilibrium(scene).positions)
    assert "driven by Cavity(pressure=1000" in repr(scene)
    assert SOFT["young_modulus"] == 1e5


def test_tendon_points_are_embedded_in_curved_elements():
    """Attach a tendon to points of curved six-node elements, which flat faces do not contain.

    Points beside the surface are refused.
    """
    mesh = ms.meshes.cylinder(1.0, 2.0, angle=1.0, cells=(3, 4), order=2)
    sheet = ms.Shell(mesh, thickness=1e-2, young_modulus=1e6)
    s, t = 0.3, 0.25
    corner = np.array([1 - s - t, s, t])
    shares = np.concatenate([corner * (2 * corner - 1), 4 * corner * np.roll(corner, -1)])
    points = np.array([shares @ mesh.rest_positions[mesh.elements[k]] for k in (0, 7, 20)])
    off_faces = np.linalg.norm(mesh.surface.rest_positions[:, None] - points, axis=2).min()
    assert off_faces > 1e-3
    tendon = ms.Tendon(points, sheet, tension=1.0)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(y=0.0))], actuators=[tendon])
    assert tendon._embedded(scene._bodies, ()) is not None
    for (vertices, weights), k in zip(tendon._embedded(scene._bodies, ()), (0, 7, 20), strict=True):
        assert dict(zip(vertices, weights, strict=True)) == pytest.approx(
            dict(zip(mesh.elements[k], shares, strict=True)), abs=1e-9
        )
    moved = ms.equilibrium(scene)
    assert float(moved[tendon].length) < np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    for away in (1e-4 * points[0] * [1, 0, 1], [0.0, -3.0, 0.0]):
        with pytest.raises(ValueError, match=r"point 0 of the Tendon, .* lies outside every element"):
            beside = ms.Tendon([points[0] + away, points[1]], sheet, tension=1.0)
            ms.equilibrium(ms.Scene(sheet, supports=scene.supports, actuators=[beside]))


def test_a_path_by_the_rest_length_of_a_tendon_passes_limit_points():
    """Pull a shallow arch through with a soft tendon to the ground.

    The path passes two limit points and ends at the new length in an equilibrium on the other side.
    """
    mesh = ms.meshes.box((1.0, 0.1, 0.02), cells=(16, 1, 1))
    points = mesh.rest_positions.copy()
    points[:, 2] += 0.06 * np.sin(np.pi * points[:, 0])
    arch = ms.Solid(
        ms.TetMesh(points, mesh.tetrahedra),
        material=ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.0),
    )
    first, middle, last = (
        arch.mesh.vertices_where(lambda x, at=at: np.abs(x[:, 0] - at) < 1e-9) for at in (0.0, 0.5, 1.0)
    )
    low = (0.5, 0.05, float(arch.mesh.rest_positions[middle, 2].min()))
    ground = ms.Link(mass=1.0, inertia=1.0, center=(0.5, 0.05, -1.0))
    tendon = ms.Tendon([(ground, (0.5, 0.05, -1.0)), (arch, low)], stiffness=0.5)
    scene = ms.Scene(
        [arch, ms.Skeleton([ground], [ms.Fixed(ground)])],
        supports=[ms.Pin(first), ms.Pin(last)],
        actuators=[tendon],
    )
    shorter = {tendon: {"rest_length": float(tendon.rest_length) - 0.5}}
    path = ms.follow_path(scene, start=ms.equilibrium(scene), values=shorter, progress=False)
    limits = [each.parameter for each in path.critical if each.kind == "limit"]
    assert len(limits) == 2 and limits[0] > limits[1] > 0.0
    assert path.parameters[-1] == 1.0 and path.n_negative_eigenvalues[-1] == 0
    end = ms.equilibrium(scene, values=shorter, start=path.positions[-1])
    assert np.abs(end.positions - path.positions[-1]).max() < 1e-9
    assert end.displacements[middle, 2].max() < -0.06
    expected = 0.5 * (end[tendon].length - (float(tendon.rest_length) - 0.5))
    assert float(end[tendon].tension) == pytest.approx(float(expected), rel=5e-3)
