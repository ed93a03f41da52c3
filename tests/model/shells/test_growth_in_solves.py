"""Growth of shells as a value of solves: over time, in files, and where it is refused."""

import pickle

import numpy as np
import pytest

import magshell as ms

LENGTH, WIDTH = 0.06, 0.03
MESH = ms.meshes.rectangle(LENGTH, WIDTH, cells=(4, 2))
N = MESH.n_faces
SIX = ms.meshes.rectangle(LENGTH, WIDTH, cells=(2, 1), order=2)


def shell(mesh=MESH, **more):
    return ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3, **more)


def held(sheet, **more):
    """Return a scene whose supports leave growth in the plane free."""
    at = sheet.mesh.rest_positions[:, :2] / sheet.mesh.rest_positions[:, :2].max(axis=0)
    corner, end, side = ([int(np.argmin(np.abs(at - c).sum(axis=1)))] for c in ((0, 0), (1, 0), (0, 1)))
    return ms.Scene(sheet, supports=[ms.Pin(corner), ms.Pin(end, "yz"), ms.Pin(side, "z")], **more)


@pytest.mark.parametrize("mesh", (MESH, SIX))
@pytest.mark.parametrize("as_function", (False, True))
def test_growth_over_time(mesh, as_function):
    """Check slow growth: the sheet follows, and its strains are relative to the growth at their time."""
    sheet = shell(mesh, growth=1.0)
    steps, time_step = 20, 0.05
    ends = 1.0 + 0.2 * np.linspace(0, 1, steps + 1)
    growth = (lambda t: 1.0 + 0.2 * t / (steps * time_step)) if as_function else ends
    motion = ms.simulate(
        held(sheet),
        steps=steps,
        time_step=time_step,
        values={sheet: {"growth": growth}},
        damping=1e-3,
        progress=False,
    )
    np.testing.assert_allclose(motion.positions[-1], 1.2 * mesh.rest_positions, atol=1e-4)
    assert motion.largest_membrane_strain.max() < 0.01
    for k in (0, 10, 20):
        assert np.abs(motion.strains(k).membrane).max() == pytest.approx(
            motion.largest_membrane_strain[k], abs=1e-12
        )
        areas = motion[sheet].stresses(k).areas
        assert areas.sum() == pytest.approx(ends[k] ** 2 * LENGTH * WIDTH, rel=1e-9)
    assert motion.energies["membrane"].max() < 1e-3 * 1e6 * 1e-3 * 0.04 * LENGTH * WIDTH


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_viscosity_uses_strains_relative_to_growth():
    """Check that a jump of growth is no strain rate: viscous terms use strains relative to the growth at their time."""
    ends = {}
    for growth in (1.1, 1.0 + 0.1 * (np.arange(6) > 2)):
        sheet = shell(growth=1.0)
        ends[np.ndim(growth)] = ms.simulate(
            held(sheet),
            steps=5,
            time_step=1e-2,
            start=1.1 * MESH.rest_positions,
            stiffness_damping=0.1,
            maxwell_modulus=1.0,
            maxwell_time=0.1,
            values={sheet: {"growth": growth}},
            progress=False,
        )
    np.testing.assert_allclose(ends[0].positions[-1], 1.1 * MESH.rest_positions, atol=1e-12)
    assert np.abs(ends[1].positions[-1] - 1.1 * MESH.rest_positions).max() > 1e-7


def test_results_keep_the_growth_of_their_solve(tmp_path):
    sheet = shell(growth=np.ones(N))
    scene = held(sheet)
    grown = ms.equilibrium(scene, values={sheet: {"growth": 1.1}})
    ms.equilibrium(scene)  # leaves another growth in the core
    assert np.abs(grown.strains().membrane).max() < 1e-9
    for again in (pickle.loads(pickle.dumps(grown)), _saved(grown, tmp_path)):
        np.testing.assert_array_equal(again.positions, grown.positions)
        assert np.abs(again.strains().membrane).max() < 1e-9
        assert np.abs(again[again.scene.bodies[0]].stresses().membrane_strains).max() < 1e-9


def _saved(result, tmp_path):
    ms.save(tmp_path / "grown.npz", result)
    return ms.load(tmp_path / "grown.npz", result.scene)


def test_magnetization_of_a_solve_stays_constant_during_growth(tmp_path):
    """Check that growth is the only value that differs between the states of a motion."""
    sheet = shell(growth=1.0)
    scene = held(sheet, field=ms.UniformField())
    motion = ms.simulate(
        scene,
        steps=2,
        time_step=1e-3,
        remanent_magnetization=(0, 0, 3e4),
        applied_flux_density=(0, 0, 1e-2),
        values={sheet: {"growth": np.array([1.0, 1.01, 1.02])}},
        progress=False,
    )
    again = _saved(motion, tmp_path)
    np.testing.assert_array_equal(again.strains(1), motion.strains(1))
    numbers = motion._values_at(1).numbers
    layout = scene._value_layout
    np.testing.assert_array_equal(layout.of(numbers, "body 0", "remanent_magnetization")[0], (0, 0, 3e4))
    assert layout.of(numbers, "body 0", "growth") == pytest.approx(1.01)


def test_scene_without_growth_stores_no_growth():
    layout = held(shell())._value_layout
    assert not any(name in ("growth", "rest_curvature") for _, name in layout)


SKEW = np.eye(3) + 0.1 * np.eye(3, k=1)


@pytest.mark.parametrize(
    "values, message",
    [
        ({"growth": 0.0}, r"growth \[1\] must be positive, but it is 0"),
        (
            {"growth": np.r_[np.ones(N - 1), -1.0]},
            rf"growth \[1\] must be positive, but that of face {N - 1} is -1",
        ),
        ({"growth": np.diag([1.0, -1.0, 1.0])}, r"growth \[1\] must be positive along the faces"),
        ({"growth": SKEW}, r"growth \[1\] must be symmetric, but it differs from its transpose by 0.1"),
        (
            {"rest_curvature": np.stack([np.eye(3)] * (N - 1) + [SKEW])},
            rf"rest_curvature .* that of face {N - 1} differs",
        ),
        (
            {"growth": np.ones(N + 1)},
            rf"growth \[1\] must be a number or have shape \(n_f,\) = \({N},\), or .* got \({N + 1},\)",
        ),
        ({"rest_curvature": np.eye(2)}, r"rest_curvature \[1/m\] must be a number .* got \(2, 2\)"),
        (
            {"rest_curvature": [np.nan] * N},
            r"rest_curvature \[1/m\] must be finite, but rest_curvature\[0\] is nan",
        ),
        ({"growth": "much"}, r"growth \[1\] must be an array of real numbers"),
    ],
)
def test_bad_growth_is_refused(values, message):
    with pytest.raises(ValueError, match=message):
        shell(**values)


def test_bad_growth_in_a_solve_is_refused():
    sheet, other = shell(growth=1.0), shell()
    scene = held(sheet)
    for value, message in (
        (np.ones(N), r"growth \[1\] was made with shape \(\) and keeps it"),
        (
            np.ones((3, 3)),
            r"\(steps \+ 1\), got \(3, 3\): where faces are to have their own later, or directions, give",
        ),
        (-1.0, r"growth \[1\] must be positive, but it is -1"),
    ):
        with pytest.raises(ValueError, match=message):
            ms.equilibrium(scene, values={sheet: {"growth": value}})
    with pytest.raises(ValueError, match=r"growth \[1\] must be positive, but it is -1|must be positive"):
        ms.simulate(scene, steps=2, time_step=1e-3, values={sheet: {"growth": np.array([1.0, 0.5, -1.0])}})
    with pytest.raises(
        ValueError,
        match=r"was made with shape \(\) and keeps it, over the time of a motion \(steps \+ 1\), got",
    ):
        ms.simulate(scene, steps=2, time_step=1e-3, values={sheet: {"growth": np.ones((3, N))}})
    with pytest.raises(ValueError, match="Shell has no value 'growth' to be replaced"):
        ms.equilibrium(held(other), values={other: {"growth": 1.1}})


@pytest.mark.parametrize("what", (ms.linear_response, ms.linear_buckling))
def test_linear_theory_refuses_a_rest_shape_that_is_none(what):
    for values in ({"growth": 1.1}, {"rest_curvature": 2.0}):
        sheet = shell(**values)
        load = ms.EdgeLoad(MESH.edges_at(x=LENGTH), (-0.1, 0, 0))
        scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=[load])
        with pytest.raises(
            ValueError, match="has grown or bent at rest, and its rest shape is no equilibrium"
        ):
            what(scene)
        neutral = {"growth": 1.0} if "growth" in values else {"rest_curvature": 0.0}
        what(scene, values={sheet: neutral})


def test_vibrations_about_a_grown_shape_are_those_of_a_larger_sheet():
    """Compare a grown sheet with a larger one of the same mass, both held against rigid motions only."""
    grown, large = held(shell(growth=1.2)), held(shell(MESH.scaled(1.2)).replaced(mass_density=1e3 / 1.2**2))
    wanted = ms.vibration_modes(large, count=3).frequencies
    with pytest.raises(ValueError, match="has grown or bent at rest"):
        ms.vibration_modes(grown)
    found = ms.vibration_modes(grown, ms.equilibrium(grown), count=3).frequencies
    np.testing.assert_allclose(found, wanted, rtol=1e-6)
