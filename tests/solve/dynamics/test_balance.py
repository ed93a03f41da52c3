"""The balance of a motion and of a path: works and losses that are known, the order of the rest, and its warning."""

import pickle
import warnings
from functools import cache

import numpy as np
import pytest

import magshell as ms

ORDERS = {ms.ImplicitEuler(): 1, ms.SDIRK2(): 2, ms.TRBDF2(): 2, ms.SDIRK3(): 3}
IDS = [type(each).__name__ for each in ORDERS]
MESH = ms.meshes.rectangle(0.03, 0.01, cells=(6, 2))
TIP = MESH.edges_at(x=0.03)
EXACT = {"solver": ms.MixedNewton(tolerance=1e-12), "progress": False}


def sheet(**options):
    return ms.Shell(
        MESH,
        **{"thickness": 5e-4, "young_modulus": 5e5, "poisson_ratio": 0.4, "mass_density": 1e3, **options},
    )


def moved(scene, integrator, steps, duration=0.04, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ms.StepErrorWarning)
        return ms.simulate(
            scene, steps=steps, time_step=duration / steps, integrator=integrator, **EXACT, **options
        ).balance()


def rests(scene, integrator, steps, **options):
    """Return the rests at the end of the energy and of the angular momentum, with so many steps and twice as many."""
    found = [moved(scene, integrator, count, **options) for count in (steps, 2 * steps)]
    for each in found:
        assert np.abs(each.momentum_rest).max() <= 1e-9 * np.abs(each.momentum).max()
    return [(abs(each.rest[-1]), np.linalg.norm(each.angular_momentum_rest[-1])) for each in found]


def swinging():
    """Build a clamped strip under gravity, whose first mode needs about 0.1 s."""
    return ms.Scene(sheet(), supports=[ms.Clamp(MESH.edges_at(x=0.0))], gravity=(0, 0, -9.81))


def spun(v):
    """Return the velocities of a slow turn about an oblique axis through the middle of the strip."""
    return np.cross((1.0, 2.0, 1.5), MESH.rest_positions - MESH.rest_positions.mean(axis=0)) + v


@cache
def everything():
    """Build a strip on a spring and a moving clamp, magnetized and loaded in every way that has no contact."""
    strip = sheet(remanent_magnetization=(3e4, 0, 1e4))
    magnet = ms.CuboidMagnet((0.02, 0.02, 0.02), remanent_magnetization=(0, 0, 8e5), center=(0.03, 0, -0.06))
    scene = ms.Scene(
        strip,
        supports=[ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 2e-3), rotation=(0, 0.1, 0))],
        loads=[ms.EdgeLoad(TIP, (0, 0.01, 0.01)), ms.Pressure(0.5)],
        field=[magnet, ms.UniformField()],
        gravity=(0, 0, -9.81),
        water=ms.Water(1e3, (0.05, 0, 0), drag_coefficient=1.1, thrust_coefficient=0.3),
    )
    return scene, magnet


def smooth(t):
    """Return a factor that rises smoothly from 0 to 1 in 0.04 s."""
    return np.sin(0.5 * np.pi * min(t / 0.04, 1.0)) ** 2


def changing(magnet):
    return {
        "applied_flux_density": lambda t: 2e-3 * np.array([0, 0, smooth(t)]),
        "support_factor": smooth,
        "load_factor": smooth,
        "values": {
            magnet: {"center": lambda t: np.array([0.03, 0.01 * smooth(t), -0.06 + 0.02 * smooth(t)])}
        },
        "damping": 1e-5,
        "stiffness_damping": 1e-4,
        "maxwell_modulus": [0.3, 0.2],
        "maxwell_time": [5e-3, 2e-2],
    }


@pytest.mark.parametrize("integrator", ORDERS, ids=IDS)
def test_rest_of_a_swinging_strip_falls_with_the_order(integrator):
    (energy, angular), (finer, finer_angular) = rests(swinging(), integrator, 100)
    assert finer < energy / (0.75 * 2 ** ORDERS[integrator])
    assert finer_angular < angular / (0.75 * 2 ** ORDERS[integrator]) + 1e-16


@pytest.mark.parametrize("integrator", ORDERS, ids=IDS)
def test_rest_with_every_kind_of_work_falls_with_the_order(integrator):
    scene, magnet = everything()
    (energy, _), (finer, _) = rests(scene, integrator, 200, **changing(magnet))
    # The stiff membrane, whose waves these steps do not resolve, leaves SDIRK3 the second order.
    assert finer < energy / (0.8 * 2 ** min(ORDERS[integrator], 2))


def test_rows_of_a_scene_with_every_kind_of_work():
    scene, magnet = everything()
    found = moved(scene, ms.SDIRK3(), 100, **changing(magnet))
    assert set(found.energies) == {"kinetic", "elastic", "magnetic", "gravity", "Maxwell branches"}
    assert set(found.work) == {"loads", "pressures", "supports", "moving fields"}
    assert set(found.dissipation) == {"damping", "stiffness damping", "Maxwell branches", "water"}
    assert {"supports", "gravity", "magnetic", "loads", "pressures", "water", "damping"} == set(
        found.impulses
    )
    for name in ("damping", "stiffness damping", "Maxwell branches"):
        assert (np.diff(found.dissipation[name]) >= 0.0).all()
    assert found.rest_fraction < 1e-3


@pytest.mark.parametrize("integrator", ORDERS, ids=IDS)
def test_free_fall_has_the_impulse_and_the_work_of_gravity(integrator):
    scene = ms.Scene(sheet(), gravity=(0, 0, -9.81), allow_rigid_motions=True)
    found = moved(scene, integrator, 20, velocities=(0.1, 0.2, 0.5))
    mass = 1e3 * 5e-4 * 0.03 * 0.01
    np.testing.assert_allclose(
        found.impulses["gravity"][:, 2], -9.81 * mass * found.times, rtol=1e-9, atol=1e-18
    )
    np.testing.assert_allclose(found.momentum[0], mass * np.array([0.1, 0.2, 0.5]), rtol=1e-12)
    fallen = 0.5 * found.times - 0.5 * 9.81 * found.times**2
    if ORDERS[integrator] > 1:  # exact for a constant force
        np.testing.assert_allclose(
            found.energies["gravity"] - found.energies["gravity"][0], 9.81 * mass * fallen, atol=1e-12
        )
        assert found.rest_fraction < 1e-9


def test_fixed_supports_have_impulses_and_no_work():
    found = moved(swinging(), ms.TRBDF2(), 10)
    assert set(found.impulses) == {"supports", "gravity"}
    assert found.work == {}


def test_free_spinning_sheet_keeps_its_momenta():
    scene = ms.Scene(sheet(), allow_rigid_motions=True)
    found = moved(scene, ms.TRBDF2(), 100, velocities=spun((0.1, 0, 0.2)))
    assert found.impulses == {} == found.work == found.dissipation
    assert np.abs(found.momentum_rest).max() < 1e-9 * np.abs(found.momentum).max()
    assert np.abs(found.angular_momentum_rest).max() < 1e-3 * np.abs(found.angular_momentum).max()


@pytest.mark.parametrize("integrator", ORDERS, ids=IDS)
def test_support_that_starts_at_once_works_what_its_masses_have(integrator):
    clamp = ms.Pin(np.arange(MESH.n_vertices), displacement=(0.01, 0, 0))
    scene = ms.Scene(sheet(), supports=[clamp])
    found = moved(scene, integrator, 10, support_factor=lambda t: t / 0.04)
    mass = 1e3 * 5e-4 * 0.03 * 0.01
    np.testing.assert_allclose(found.work["supports"][-1], 0.5 * mass * 0.25**2, rtol=1e-9)
    assert found.rest_fraction < 1e-9


@pytest.mark.parametrize("implicit", [False, True])
def test_block_that_slides_loses_its_energy_to_friction(implicit):
    strip = sheet(young_modulus=1e7)
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, -1e-4)), friction_coefficient=0.3, offset=1e-4)
    scene = ms.Scene(strip, contacts=[floor], gravity=(0, 0, -9.81), allow_rigid_motions=True)
    found = moved(scene, ms.TRBDF2(implicit_contact=implicit), 200, 0.06, velocities=(0.1, 0, 0))
    mass = 1e3 * 5e-4 * 0.03 * 0.01
    kinetic = 0.5 * mass * 0.1**2
    assert found.energies["kinetic"][-1] < 1e-3 * kinetic
    assert found.dissipation["friction"][-1] == pytest.approx(kinetic, rel=0.02)
    assert found.impulses["friction"][-1, 0] == pytest.approx(-mass * 0.1, rel=0.02)
    assert np.abs(found.momentum_rest).max() < 1e-7 * mass * 0.1


def test_impulses_of_two_sheets_that_meet_cancel():
    lower, upper = (
        sheet(),
        ms.Shell(
            MESH.transformed(translation=(1e-3, 1e-3, 1e-3)),
            thickness=5e-4,
            young_modulus=5e5,
            mass_density=1e3,
        ),
    )
    scene = ms.Scene([lower, upper], contacts=[ms.Contact(lower, upper)], allow_rigid_motions=True)
    velocities = np.repeat([(0, 0, 0.1), (0, 0, -0.1)], MESH.n_vertices, axis=0)
    found = moved(scene, ms.TRBDF2(), 100, 0.02, velocities=velocities)
    assert np.ptp(found.energies["contact"]) > 0.0
    assert found.impulses == {}
    assert np.abs(found.momentum_rest).max() < 1e-9 * 1e3 * 5e-4 * 0.03 * 0.01 * 0.1
    assert {"elastic, body 0", "elastic, body 1"} < set(found.energies)


def test_substeps_and_chosen_steps_are_balanced():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ms.StepErrorWarning)
        move = ms.simulate(
            swinging(), steps=8, time_step=ms.Adaptive(5e-3, tolerance=1e-6), record_every=2, **EXACT
        )
    found = move.balance()
    assert len(move.time_steps) > 8
    np.testing.assert_array_equal(found.times, move.times)
    np.testing.assert_array_equal(found.energies["kinetic"], move.kinetic_energy)
    assert found.rest_fraction < 1e-2


def test_balance_is_that_of_a_motion_with_gradients():
    torch = pytest.importorskip("torch")
    gravity = torch.tensor(1.0, dtype=torch.float64, requires_grad=True)
    plain = moved(swinging(), ms.TRBDF2(), 20)
    found = moved(swinging(), ms.TRBDF2(), 20, gravity_factor=gravity)
    np.testing.assert_array_equal(found.rest, plain.rest)


def test_motion_that_goes_on_is_balanced_from_there():
    scene = swinging()
    options = {"time_step": 1e-3, "integrator": ms.TRBDF2(), **EXACT}
    whole = ms.simulate(scene, steps=40, **options).balance()
    first = ms.simulate(scene, steps=20, **options)
    second = ms.simulate(scene, steps=20, start=first.end, **options).balance()
    np.testing.assert_allclose(second.rest, whole.rest[20:] - whole.rest[20], atol=1e-9 * whole.moved)


def test_rest_of_a_coarse_motion_is_warned_of():
    scene = ms.Scene(sheet(), allow_rigid_motions=True)
    bent = MESH.rest_positions + [(0, 0, 1.0)] * (2e-3 * np.cos(np.pi * MESH.rest_positions[:, :1] / 0.03))
    options = {"start": bent, "integrator": ms.ImplicitEuler(), "progress": False}
    lost = "the steps of the motion lost 100 % of the largest energy"
    move = ms.simulate(scene, steps=20, time_step=1e-3, **options)
    assert "100 % of the" in repr(move)
    with pytest.warns(ms.StepErrorWarning, match=lost):
        found = move.balance()
    assert found.rest[-1] == pytest.approx(move.energy[-1] - move.energy[0], rel=1e-9)
    assert found.rest_fraction > 0.05
    assert move.balance() is found


def test_rest_of_a_damped_motion_is_warned_of_by_its_balance():
    scene = ms.Scene(sheet(), allow_rigid_motions=True)
    bent = MESH.rest_positions + [(0, 0, 1.0)] * (2e-3 * np.cos(np.pi * MESH.rest_positions[:, :1] / 0.03))
    options = {"start": bent, "integrator": ms.ImplicitEuler(), "damping": 1e-7, "progress": False}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        move = ms.simulate(scene, steps=20, time_step=1e-3, **options)
    assert "balance() says where it came from" in repr(move)
    with pytest.warns(ms.StepErrorWarning, match="the steps of the motion lost"):
        move.balance()


def test_copy_of_a_motion_has_no_inputs_to_repeat():
    move = ms.simulate(swinging(), steps=2, time_step=1e-3, progress=False)
    with pytest.raises(ValueError, match="copies and files do not have"):
        pickle.loads(pickle.dumps(move)).balance()


def test_table_and_picture_of_a_balance():
    pandas = pytest.importorskip("pandas")
    found = moved(swinging(), ms.TRBDF2(), 10)
    table = found.to_pandas()
    assert isinstance(table, pandas.DataFrame)
    assert table.index.name == "time [s]"
    np.testing.assert_array_equal(table["rest [J]"], found.rest)
    np.testing.assert_array_equal(table["momentum by gravity z [N s]"], found.impulses["gravity"][:, 2])
    assert "change of the angular momentum [N m s]" in repr(found)
    pytest.importorskip("matplotlib")
    assert isinstance(found.plot(), ms.Picture)


def path_balance(**options):
    strip = sheet(remanent_magnetization=(3e4, 0, 1e4))
    scene = ms.Scene(
        strip,
        supports=[ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 2e-3), rotation=(0, 0.3, 0))],
        loads=[ms.EdgeLoad(TIP, (0, 0.01, 0.01)), ms.Pressure(0.5)],
        field=ms.UniformField(),
        gravity=(0, 0, -9.81),
    )
    return ms.follow_path(scene, applied_flux_density=(0, 0, 3e-3), progress=False, **options).balance()


def test_rest_of_a_path_falls_with_the_square_of_its_steps():
    coarse, fine = path_balance(max_step=0.02), path_balance(max_step=0.01, first_step=0.025)
    assert set(fine.work) == {"loads", "pressures", "supports", "moving fields", "changing gravity"}
    assert fine.rest_fraction < 1e-3
    assert abs(fine.rest[-1]) < 0.4 * abs(coarse.rest[-1])
