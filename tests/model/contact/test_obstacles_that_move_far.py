"""Obstacles that move far between two equilibria push sheets along and do not pass through them.

Load steps, relaxation and paths keep every point on its side of an obstacle, or raise an error.
"""

import warnings
from functools import cache, partial

import numpy as np
import pytest

import magshell as ms
from magshell import obstacles as ob

pytestmark = pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")

RADIUS, CELLS = 0.1, 8
TOUCHING = 1e-4  # m, above the sheet


@cache
def sheet():
    mesh = ms.meshes.disk(RADIUS, cells=CELLS)
    return ms.Shell(mesh, thickness=2e-3, young_modulus=1e6, poisson_ratio=0.45)


def over_a_sheet(obstacle, **law):
    """Return a scene of a round, clamped sheet with an obstacle above it."""
    mesh = sheet().mesh
    middle = np.flatnonzero(np.hypot(*mesh.rest_positions[:, :2].T) < 0.7 * RADIUS)
    rim = ms.Clamp(np.flatnonzero(mesh.edge_faces[:, 1] < 0))
    law = {"contact_stiffness": 1e3, "face_samples": 3, "vertices": middle, **law}
    contact = ms.Contact(obstacle, **law)
    return ms.Scene(sheet(), supports=[rim], contacts=[contact])


SPAN = np.linspace(-0.06, 0.06, 5)[:, None] * (0.0, 1.0, 0.0)
# One obstacle per shape, with its lowest point at the origin of its frame and less deep than the distance it is to move.
SHAPES = {
    "sphere": lambda **pose: ob.Sphere(0.02, **raised(pose, 0.02)),
    "box": lambda **pose: ob.Box((0.06, 0.08, 0.02), rounding=0.005, **raised(pose, 0.01)),
    "capsule": lambda **pose: ob.Capsule(0.06, radius=0.02, **raised(pose, 0.02)),
    "tube": lambda **pose: ob.Tube(SPAN, 0.02, inside=False, **raised(pose, 0.02)),
    "mesh": lambda **pose: ob.MeshObstacle(
        ms.meshes.spherical_cap(0.02, 0.0, np.pi, cells=(24, 12)), resolution=16, **raised(pose, 0.02)
    ),
    "plane": lambda **pose: ob.Plane((0.0, 0.0, -1.0), **pose),
}


def raised(pose, by):
    return {**pose, "center": np.add(pose["center"], (0.0, 0.0, by))}


def above(shape):
    return SHAPES[shape](center=(0.0, 0.0, TOUCHING))


def moved(obstacle, depth):
    return {obstacle: {"center": obstacle.center - np.array([0.0, 0.0, depth])}}


def in_small_steps(scene, obstacle, depth, steps):
    found = ms.equilibrium(scene)
    for each in np.linspace(0.0, depth, steps + 1)[1:]:
        found = ms.equilibrium(scene, values=moved(obstacle, each), start=found)
    return found


@pytest.mark.parametrize("shape", SHAPES)
def test_an_obstacle_that_moves_by_more_than_its_height_in_one_solve_pushes_the_sheet_along(shape):
    obstacle = above(shape)
    scene = over_a_sheet(obstacle)
    depth = 0.05
    at_once = ms.equilibrium(scene, values=moved(obstacle, depth), start=ms.equilibrium(scene))
    expected = in_small_steps(scene, obstacle, depth, 7)
    assert at_once.stable
    assert at_once.positions[:, 2].min() < -0.8 * depth
    assert at_once.energy == pytest.approx(expected.energy, rel=1e-4)


def test_a_ball_that_moves_by_many_diameters_pushes_the_sheet_along():
    """Move a ball of radius 0.05 m by 0.1 m, in steps and at once from rest.

    A solve that loses the sheet on the other side would find no contact force.
    """
    ball = ob.Sphere(0.05, center=(0.0, 0.0, 0.05 + TOUCHING))
    scene = over_a_sheet(ball)
    rest = ms.equilibrium(scene)
    found = rest
    for depth in (0.02, 0.05, 0.1):
        found = ms.equilibrium(scene, values=moved(ball, depth), start=found)
        assert found.stable and found.positions[:, 2].min() == pytest.approx(TOUCHING - depth, abs=5e-3)
    at_once = ms.equilibrium(scene, values=moved(ball, 0.1), start=rest)
    assert at_once.energy == pytest.approx(found.energy, rel=1e-6)


def test_an_obstacle_that_moves_while_a_modulus_changes_pushes_the_sheet_along():
    ball = above("sphere")
    scene = over_a_sheet(ball)
    stiffer = {sheet(): {"young_modulus": 2e6}}
    found = ms.equilibrium(scene, values={**moved(ball, 0.05), **stiffer}, start=ms.equilibrium(scene))
    expected = in_small_steps(scene, ball, 0.05, 7)
    assert found.positions[:, 2].min() < -0.04
    again = ms.equilibrium(scene, values={**moved(ball, 0.05), **stiffer}, start=expected)
    assert found.energy == pytest.approx(again.energy, rel=1e-6)


def test_a_warm_start_takes_a_sheet_along_with_an_obstacle_that_moves_far():
    ball = above("sphere")
    warm = ms.WarmStart(over_a_sheet(ball))
    warm(values=moved(ball, 0.0))
    with warm.accept_jumps():
        found = warm(values=moved(ball, 0.05))
    assert found.positions[:, 2].min() < -0.04


def test_a_path_with_an_obstacle_that_moves_far_keeps_the_sheet_on_its_side():
    """Check that path steps of half the distance are shortened so that no point passes through the ball."""
    ball = above("sphere")
    scene = over_a_sheet(ball, contact_stiffness=100.0, smoothing=2e-3)
    start = ms.equilibrium(scene, values=moved(ball, 5e-3), start=ms.equilibrium(scene))
    try:
        path = ms.follow_path(
            scene, values=moved(ball, 0.05), start=start, first_step=0.5, max_step=1.0, max_points=6
        )
    except ms.NotConverged as error:
        path = error.last_good
    depths = 5e-3 + path.parameters * 0.045
    assert len(path) > 3
    assert (path.positions[:, :, 2].min(axis=1) < -0.5 * depths).all()


def arm_under_a_strip():
    """Return a strip held at one end, and under it a flat arm that turns about an axis beyond the other end."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))
    strip = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3)
    arm = ob.Box((0.2, 0.06, 4e-3), rounding=1e-3, center=(0.15, 0.01, -2e-3 - TOUCHING))
    contact = ms.Contact(arm, contact_stiffness=1e3)
    return ms.Scene(strip, supports=[ms.Clamp(mesh.edges_at(x=0.0))], contacts=[contact]), arm


def test_an_arm_that_turns_far_in_one_solve_lifts_the_strip():
    scene, arm = arm_under_a_strip()
    found = rest = ms.equilibrium(scene)
    for angle in np.linspace(0.0, 0.6, 13)[1:]:
        found = ms.equilibrium(scene, values={arm: {"rotation": (0.0, angle, 0.0)}}, start=found)
    at_once = ms.equilibrium(scene, values={arm: {"rotation": (0.0, 0.6, 0.0)}}, start=rest)
    assert found.positions[:, 2].max() > 0.02
    assert at_once.energy == pytest.approx(found.energy, rel=1e-6)


def test_a_full_turn_of_an_obstacle_is_gone_through_in_load_steps():
    scene, _ = arm_under_a_strip()
    ball = ob.Box((0.02, 0.02, 0.02), center=(0.3, 0.0, 0.0))  # touches nothing anywhere
    far = ms.Scene(scene.bodies, supports=scene.supports, contacts=[ms.Contact(ball)])
    found = ms.equilibrium(far, values={ball: {"rotation": (0.0, 2 * np.pi, 0.0)}}, start=ms.equilibrium(far))
    assert found.load_steps >= 12


def test_loaded_strip_does_not_pass_through_a_thin_plate():
    """Load a strip above a plate of 2 mm with a load that would bend it by many times that."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))
    strip = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3)
    plate = ob.Box((0.3, 0.1, 2e-3), center=(0.0, 0.0, -2e-3))
    scene = ms.Scene(
        strip,
        supports=[ms.Clamp(mesh.edges_at(x=0.0))],
        contacts=[ms.Contact(plate, contact_stiffness=1e3)],
        loads=[ms.AreaLoad((0.0, 0.0, -20.0))],
    )
    found = ms.equilibrium(scene)
    assert found.positions[:, 2].min() > -2e-3


def test_a_sheet_pressed_through_an_obstacle_that_is_too_soft_is_an_error():
    ball = above("sphere")
    scene = over_a_sheet(ball, contact_stiffness=1e-2)
    with pytest.raises(ms.NotConverged, match=r"through an obstacle.*contact_stiffness \[N/m\]") as caught:
        ms.equilibrium(scene, values=moved(ball, 0.05), start=ms.equilibrium(scene))
    assert 0.0 < caught.value.last_good.load_fraction < 1.0


def test_gradients_by_the_center_of_an_obstacle_that_moved_far_are_those_of_the_final_state():
    torch = pytest.importorskip("torch")
    ball = above("sphere")
    scene = over_a_sheet(ball)
    solver = ms.MixedNewton(tolerance=1e-12)

    def height(center, start):
        values = {ball: {"center": center}}
        return ms.equilibrium(scene, values=values, start=start, solver=solver).positions[0, 2]

    rest = ms.equilibrium(scene)
    center = torch.tensor(ball.center - (0.0, 0.0, 0.05), requires_grad=True)
    height(center, rest).backward()
    there = ms.equilibrium(scene, values=moved(ball, 0.05), start=rest, solver=solver)
    step = np.array([0.0, 0.0, 1e-5])
    ends = [height(center.detach().numpy() + sign * step, there) for sign in (1, -1)]
    assert center.grad[2].item() == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-4)


def pressed(scene, ball, depth):
    """Move a ball down in one solve; return the equilibrium, or None if an error says that the ball passed through."""
    try:
        return ms.equilibrium(scene, values=moved(ball, depth), start=ms.equilibrium(scene))
    except ms.NotConverged as error:
        assert "passes" in str(error) and "contact_stiffness" in str(error)
        return None


@pytest.mark.parametrize("radius", [0.01, 0.02])
@pytest.mark.parametrize("face_samples", [0, 3])
@pytest.mark.parametrize("stiffness", [1e3, 1e4])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.006, 0.003)], ids=["vertex", "face"])
def test_a_small_ball_that_would_slip_between_contact_points_is_an_error(
    radius, face_samples, stiffness, offset
):
    """Check edges of 12.5 mm: balls of 10 and 20 mm came out on the other side, without a force and without an error."""
    ball = ob.Sphere(radius, center=(*offset, radius + TOUCHING))
    scene = over_a_sheet(ball, contact_stiffness=stiffness, face_samples=face_samples)
    found = pressed(scene, ball, 0.05)
    if found is not None:
        assert found.stable and found.positions[:, 2].min() < -0.03


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize(
    "make",
    [
        lambda **pose: ob.Capsule(
            ends=((-0.03, 0.0, 0.0), (0.03, 0.0, 0.0)), radius=0.006, **raised(pose, 0.006)
        ),
        lambda **pose: ob.Tube(SPAN, 0.006, inside=False, **raised(pose, 0.006)),
    ],
    ids=["capsule", "tube"],
)
def test_no_thin_obstacle_comes_out_on_the_other_side_without_an_error(make):
    obstacle = make(center=(0.006, 0.003, TOUCHING))
    scene = over_a_sheet(obstacle, contact_stiffness=1e4, face_samples=0)
    found = pressed(scene, obstacle, 0.05)
    if found is not None:
        assert found.stable and found.positions[:, 2].min() < -0.03


def test_a_ball_that_slips_between_contact_points_slowly_is_an_error():
    ball = ob.Sphere(0.01, center=(0.006, 0.003, 0.01 + TOUCHING))
    scene = over_a_sheet(ball, contact_stiffness=1e4, face_samples=0)
    with pytest.raises(ms.NotConverged, match=r"passes between the points in contact.*face_samples=3"):
        in_small_steps(scene, ball, 0.05, 25)


def test_a_path_does_not_pass_through_a_small_ball_between_contact_points():
    """Check that the path ends where its steps vanish, and names the cause."""
    ball = ob.Sphere(0.01, center=(0.006, 0.003, 0.01 + TOUCHING))
    scene = over_a_sheet(ball, contact_stiffness=1e4, face_samples=0)
    with pytest.raises(
        ms.NotConverged, match=r"short\. Where contact begins or ends a path turns sharply"
    ) as caught:
        ms.follow_path(scene, values=moved(ball, 0.05), start=ms.equilibrium(scene), progress=False)
    path = caught.value.last_good
    assert 1 < len(path) < 200 and path.parameters[-1] < 1.0


def lifted(factor, solve):
    """Return the solve of a sheet whose rim is lifted by 0.05 m times this factor, under a small ball that stands still."""
    mesh = sheet().mesh
    rim = ms.Clamp(np.flatnonzero(mesh.edge_faces[:, 1] < 0), displacement=(0.0, 0.0, 0.05))
    ball = ob.Sphere(0.01, center=(0.006, 0.003, 0.01 + TOUCHING))
    middle = np.flatnonzero(np.hypot(*mesh.rest_positions[:, :2].T) < 0.7 * RADIUS)
    contact = ms.Contact(ball, contact_stiffness=1e4, face_samples=0, vertices=middle)
    scene = ms.Scene(sheet(), supports=[rim], contacts=[contact])
    start = ms.equilibrium(scene, support_factor=0.0)
    return solve(scene, support_factor=factor, start=start)


def test_supports_that_pull_a_sheet_over_a_small_ball_are_an_error():
    """Check that the ball, which stands still, does not come out on the other side of the sheet."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ms.MeshQualityWarning)
        with pytest.raises(ms.NotConverged, match="passes between the points in contact"):
            lifted(1.0, ms.equilibrium)
        with pytest.raises(ms.NotConverged, match="the path ended after"):
            lifted(1.0, partial(ms.follow_path, max_points=100, progress=False))


def test_a_motion_in_which_a_small_ball_slips_between_contact_points_is_an_error():
    mesh = sheet().mesh
    heavy = ms.Shell(mesh, thickness=2e-3, young_modulus=1e6, poisson_ratio=0.45, mass_density=1e3)
    ball = ob.Sphere(0.002, center=(0.006, 0.003, -0.004))
    contact = ms.Contact(ball, contact_stiffness=1e4, face_samples=0)
    scene = ms.Scene(heavy, contacts=[contact], gravity=(0.0, 0.0, -9.81), allow_rigid_motions=True)
    with pytest.warns(ms.MeshQualityWarning, match="may enter the faces of the mesh between the points"):
        with pytest.raises(ms.NotConverged, match="passes between the points in contact") as caught:
            ms.simulate(scene, steps=60, time_step=1e-3, progress=False)
    fallen = 0.5 * 9.81 * caught.value.last_good.times[-1] ** 2
    assert fallen == pytest.approx(0.004, rel=0.1)  # where its flat middle meets that of the ball


@pytest.mark.parametrize(
    "radius, face_samples, small", [(6e-3, 0, True), (6e-3, 3, False), (3e-3, 3, True), (8e-3, 0, False)]
)
def test_a_ball_that_fits_between_the_contact_points_is_warned_of(radius, face_samples, small):
    """Check that the size of a ball is compared with the gaps between contact points.

    Between vertices that are 12 mm apart fits a ball of 7 mm radius; between three points on each face, one of 3.5 mm.
    """
    ball = ob.Sphere(radius, center=(0.0, 0.0, radius + TOUCHING))
    scene = over_a_sheet(ball, face_samples=face_samples)
    rest = ms.equilibrium(scene)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", ms.ResolutionWarning)  # of this coarse sheet
        ms.equilibrium(scene, values=moved(ball, 1e-3), start=rest)
        told = [each for each in caught if "between the points in contact" in str(each.message)]
        ms.equilibrium(scene, values=moved(ball, 0.0), start=rest)  # where nothing moves, nothing is said
    assert len(told) == len(caught) == small
    assert all(each.category is ms.MeshQualityWarning and each.filename == __file__ for each in told)


def test_obstacles_that_stand_still_are_not_watched(monkeypatch):
    """Check that a scene without moving obstacles pays nothing for faces between the points in contact."""
    made = []
    watched = ms._core.WatchedObstacle
    monkeypatch.setattr(ms._core, "WatchedObstacle", lambda *each: made.append(each) or watched(*each))
    ball = above("sphere")
    scene = over_a_sheet(ball)
    rest = ms.equilibrium(scene)
    ms.equilibrium(scene, values={sheet(): {"young_modulus": 2e6}}, start=rest)
    assert not made
    ms.equilibrium(scene, values=moved(ball, 1e-3), start=rest)
    assert len(made) == 1
