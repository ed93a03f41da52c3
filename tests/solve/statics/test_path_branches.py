"""Branches that cross at a bifurcation, and the events along a path."""

import numpy as np
import pytest

import magshell as ms

LENGTH = 0.1  # m


def strip(*, floor: float | None = None, load: tuple[float, float, float] = (-0.1, 0.0, 0.0)) -> ms.Scene:
    """Return a strip clamped at x = 0 with a load [N/m] on its free end, over a floor at this height [m]."""
    mesh = ms.meshes.rectangle(LENGTH, 0.02, cells=(10, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    end = ms.EdgeLoad(mesh.edges_at(x=LENGTH), load)
    contacts = [] if floor is None else [ms.Contact(ms.obstacles.Plane(center=(0, 0, floor)))]
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[end], contacts=contacts)


@pytest.fixture(scope="module")
def straight() -> ms.EquilibriumPath:
    return ms.follow_path(strip(), progress=False)


@pytest.mark.parametrize("side", [1, -1])
def test_a_branch_of_a_bifurcation_is_the_buckled_strip(straight, side):
    (bifurcation,) = straight.critical
    branch = straight.switch_branch(bifurcation, side, progress=False)
    assert branch.parameters[0] == bifurcation.parameter and branch.parameters[-1] == 1.0
    assert branch.stable[1:].all() and not straight.stable[-1]
    np.testing.assert_array_equal(branch.positions[0], bifurcation.positions)
    assert np.all(side * bifurcation.mode[-1, 2] * branch.positions[1:, -1, 2] > 0)
    there = ms.equilibrium(strip(), start=branch.positions[-1])
    np.testing.assert_allclose(branch.positions[-1], there.positions, atol=1e-8 * LENGTH)


def test_halves_of_a_symmetric_branch_mirror_each_other(straight):
    one, other = (straight.switch_branch(straight.critical[0], side, progress=False) for side in (1, -1))
    np.testing.assert_allclose(
        one.positions[-1] * [1, 1, -1], other.positions[-1], rtol=0, atol=1e-7 * LENGTH
    )


def test_switching_is_refused_elsewhere_than_at_a_bifurcation_of_the_path(straight):
    (bifurcation,) = straight.critical
    other = ms.follow_path(strip(), progress=False)
    with pytest.raises(ValueError, match=r"critical must be one of path\.critical of this path"):
        other.switch_branch(bifurcation)
    with pytest.raises(ValueError, match="side must be 1 or -1, got 2"):
        straight.switch_branch(bifurcation, 2)
    with pytest.raises(ValueError, match="max_step must be positive"):
        straight.switch_branch(bifurcation, max_step=0.0)


def test_a_path_lists_contacts_that_are_made_and_lost(straight):
    down = strip(floor=-0.01, load=(0.0, 0.0, -0.1))
    pressed = ms.follow_path(down, progress=False)
    (made,) = pressed.events
    assert made.kind == "contact made" and made.contact is down.contacts[0]
    heights = pressed.positions[:, :, 2].min(axis=1)
    assert pressed.parameters[made.after_point] < made.parameter < pressed.parameters[made.after_point + 1]
    touching = ms.equilibrium(down, load_factor=made.parameter).positions[:, 2].min()
    assert touching == pytest.approx(-0.01, abs=1e-8 * LENGTH)
    assert heights[made.after_point] > -0.01 > heights[made.after_point + 1]
    lifted = ms.follow_path(down, start=pressed.equilibrium(-1), load_factor=0.0, progress=False)
    (lost,) = lifted.events
    assert lost.kind == "contact lost"
    assert 1.0 - lost.parameter == pytest.approx(
        made.parameter, abs=1e-5
    )  # the same load, from the other side
    assert [event.kind for event in straight.events] == ["bifurcation"]
    assert "contact made at" in repr(pressed)


def test_a_path_that_a_rotating_clamp_drives_turns_at_limit_points():
    """Check a buckled strip one end of which is rotated until it snaps: the rotation turns back at limit points."""
    mesh = ms.meshes.rectangle(LENGTH, 0.02, cells=(20, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    ends = [ms.Clamp(mesh.edges_at(x=0.0)), ms.Clamp(mesh.edges_at(x=LENGTH), displacement=(-0.01, 0, 0))]
    push = ms.AreaLoad((0.0, 0.0, 1.0))
    scene = ms.Scene(sheet, supports=ends, loads=[push])
    up = ms.equilibrium(scene, start=ms.equilibrium(scene), load_factor=0.0)
    turned = {ends[1]: {"displacement": (-0.01, 0, 0), "rotation": (0.0, -1.5, 0.0)}}
    path = ms.follow_path(
        scene,
        start=up,
        values=turned,
        load_factor=0.0,
        until=lambda parameter, positions: parameter < 0.0,
        progress=False,
    )
    (limit,) = path.critical
    assert limit.kind == "limit" and limit.after_point in (
        np.argmax(path.parameters) - 1,
        np.argmax(path.parameters),
    )
    assert limit.parameter == pytest.approx(path.parameters.max(), rel=0.01)
    with pytest.raises(ValueError, match="critical must be a bifurcation"):
        path.switch_branch(limit)
