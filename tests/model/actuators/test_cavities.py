"""Cavities in scenes: laws, results, inertia, collapse. Derivatives: test_actuator_kernels.py, test_every_gradient.py."""

import numpy as np
import pytest
import torch
from actuated import SOFT, box_sheet, gauge_pressure_of, held, hollow_block

import magshell as ms
from magshell import shapes

LAWS = {
    "pressure": {"pressure": 4e3},
    "suction": {"pressure": -2e3},
    "gas": {"gas_pressure": 1.3e5},
    "less gas": {"gas_pressure": 0.9e5},
    "liquid": {"volume": 1.2e-6, "bulk_modulus": 1e6},
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_results_have_volume_and_pressure_by_the_law(law, element):
    body = hollow_block(element)
    cavity = ms.Cavity(body, **LAWS[law])
    scene = held(body, actuators=[cavity])
    rest = cavity.rest_volume(scene)
    assert rest == pytest.approx(1e-6, rel=1e-12)
    found = ms.equilibrium(scene)
    inside = found[cavity]
    assert found.stable and found.load_steps == 1
    assert float(inside.pressure) == pytest.approx(gauge_pressure_of(cavity, inside.volume, rest), rel=1e-12)
    assert (inside.volume > rest) == (float(inside.pressure) > 0)
    # The same pressure, prescribed, leads to the same state.
    again = ms.Cavity(body, pressure=float(inside.pressure))
    same = ms.equilibrium(held(body, actuators=[again]))
    assert np.abs(same.positions - found.positions).max() < 1e-9 * 0.03


def test_water_keeps_its_volume_and_takes_few_iterations():
    """Check a cavity whose bulk modulus is 22,000 times the solid's modulus, close to a volume constraint."""
    body = hollow_block("quadratic")
    water = ms.Cavity(body, volume=1.5e-6)
    found = ms.equilibrium(held(body, actuators=[water]))
    assert float(found[water].volume) == pytest.approx(1.5e-6, rel=1e-4)
    assert found.load_steps == 1 and found.iterations <= 12
    softer = ms.Cavity(body, volume=1.5e-6, bulk_modulus=2.2e7)
    near = ms.equilibrium(held(body, actuators=[softer]))
    assert near.iterations <= found.iterations + 2  # a stiffer fluid needs no more iterations


def test_several_cavities_share_a_wall():
    """Check a block with two hollows, one under pressure and the other full of liquid."""
    box = ms.meshes.box((0.05, 0.03, 0.03), cells=(5, 3, 3))
    at = box.tetrahedron_barycenters
    hollow = (np.abs(at[:, 1:] - 0.015).max(axis=1) < 0.005) & (
        (np.abs(at[:, 0] - 0.015) < 0.005) | (np.abs(at[:, 0] - 0.035) < 0.005)
    )
    kept, numbered = np.unique(box.tetrahedra[~hollow], return_inverse=True)
    mesh = ms.TetMesh(box.rest_positions[kept], numbered.reshape(-1, 4))
    body = ms.Solid(mesh, material=ms.NeoHookean(**SOFT), element="linear")
    with pytest.raises(ValueError, match=r"2 hollows: say which of its faces"):
        held(body, actuators=[ms.Cavity(body, pressure=1.0)])
    x = mesh.rest_positions[mesh.faces].mean(axis=1)
    inside = np.abs(x[:, 1:] - 0.015).max(axis=1) < 0.0051
    left, right = (np.flatnonzero(inside & (np.abs(x[:, 0] - c) < 0.0051)) for c in (0.015, 0.035))
    blown, filled = ms.Cavity(body, left, pressure=1e4), ms.Cavity(body, right, volume=1e-6)
    found = ms.equilibrium(held(body, actuators=[blown, filled]))
    assert float(found[filled].volume) == pytest.approx(1e-6, rel=1e-4)
    # The wall between them is pushed over, and the block is pulled along; the liquid resists both.
    assert abs(float(found[filled].pressure)) > 10.0 and float(found[blown].volume) > 1.001e-6
    alone = ms.equilibrium(held(body, actuators=[blown]))
    assert float(found[blown].volume) != pytest.approx(float(alone[blown].volume), rel=1e-5)


def hollow_ball(cells=2) -> ms.Solid:
    """Return a nearly incompressible hollow ball of radii 0.5 and 1, to be held at its center by planes of symmetry."""
    ball = ms.meshes.ball(1.0, cells=cells)
    inner = np.linalg.norm(ball.rest_positions[ball.tetrahedra], axis=2).min(axis=1) < 0.49
    kept, numbered = np.unique(ball.tetrahedra[~inner], return_inverse=True)
    mesh = ms.TetMesh(ball.rest_positions[kept], numbered.reshape(-1, 4))
    round_one = mesh.second_order(surface=shapes.difference(shapes.ball(1.0), shapes.ball(0.5)))
    return ms.Solid(round_one, material=ms.NeoHookean("isochoric", young_modulus=3.0, poisson_ratio=0.4999))


def ball_scene(body, *actuators) -> ms.Scene:
    on = [np.flatnonzero(np.abs(body.mesh.rest_positions[:, k]) < 1e-9) for k in range(3)]
    pins = [ms.Pin(vertices, components="xyz"[k]) for k, vertices in enumerate(on)]
    return ms.Scene(body, supports=pins, actuators=actuators)


def pressure_of_thick_ball(volume_ratio):
    """Compute the pressure of an incompressible neo-Hookean thick ball, mu = 1.

    p is the difference of 2/l + 1/(2 l^4) between the outer and the inner stretch l.
    """
    inner = np.cbrt(volume_ratio)
    outer = np.cbrt(1.0 + (inner**3 - 1.0) / 8.0)

    def part(stretch):
        return 2.0 / stretch + 0.5 / stretch**4

    return part(outer) - part(inner)


def test_a_balloon_blown_to_a_hundred_times_its_volume_passes_its_largest_pressure():
    """Follow a balloon by its volume, with one layer of elements.

    All states are stable under a prescribed volume. Under a prescribed pressure those beyond the largest one would not be.
    """
    body = hollow_ball()
    rest = ms.Cavity(body, pressure=0.0).rest_volume(ball_scene(body))
    liquid = ms.Cavity(body, volume=rest, bulk_modulus=1e3)
    scene = ball_scene(body, liquid)
    path = ms.follow_path(
        scene,
        start=ms.equilibrium(scene),
        values={liquid: {"volume": 100.0 * rest}},
        max_step=0.6,
        progress=False,
    )
    inside = path[liquid]
    assert inside.volume[-1] == pytest.approx(100.0 * rest, rel=1e-3)
    assert (path.n_negative_eigenvalues == 0).all() and not path.critical
    # The polyhedron has the pressure of a ball up to its discretization.
    expected = pressure_of_thick_ball(inside.volume / rest)
    assert np.abs(inside.pressure - expected).max() < 0.06 * expected.max()
    top = np.argmax(inside.pressure)
    assert 0 < top < len(path) - 1 and inside.pressure[-1] < 0.8 * inside.pressure[top]


@pytest.mark.parametrize("times", [0.8, 5.0, 100.0])
def test_a_balloon_is_filled_in_one_call(times):
    """Fill a balloon far beyond its largest pressure, or empty it; load steps change the volume from that at rest."""
    body = hollow_ball()
    rest = ms.Cavity(body, pressure=0.0).rest_volume(ball_scene(body))
    liquid = ms.Cavity(body, volume=times * rest, bulk_modulus=1e5)
    found = ms.equilibrium(ball_scene(body, liquid))
    assert found.stable
    assert float(found[liquid].volume) == pytest.approx(times * rest, rel=1e-4)
    expected = pressure_of_thick_ball(times)
    assert float(found[liquid].pressure) == pytest.approx(expected, abs=0.06)
    # Half of the added volume under half of the load.
    half = ms.equilibrium(ball_scene(body, liquid), load_factor=0.5)
    assert float(half[liquid].volume) == pytest.approx((0.5 + 0.5 * times) * rest, rel=1e-4)
    assert float(half[liquid].pressure) == pytest.approx(pressure_of_thick_ball(0.5 + 0.5 * times), abs=0.06)


def test_a_path_by_pressure_turns_round_at_the_largest():
    body = hollow_ball()
    air = ms.Cavity(body, pressure=2.0)
    scene = ball_scene(body, air)
    rest = air.rest_volume(scene)
    path = ms.follow_path(
        scene,
        max_step=0.1,
        progress=False,
        until=lambda _, x: np.abs(x).max() > 2.0,
    )
    limits = [each for each in path.critical if each.kind == "limit"]
    assert len(limits) == 1 and path.n_negative_eigenvalues[-1] == 1
    largest = pressure_of_thick_ball(np.linspace(1, 100, 10_000)).max()
    assert 2.0 * limits[0].parameter == pytest.approx(largest, rel=0.06)
    inside = path[air]
    assert inside.pressure == pytest.approx(2.0 * path.parameters) and inside.volume[-1] > 5.0 * rest
    # At one of these unstable states a liquid under the same forces has no negative eigenvalue.
    unstable = path.equilibrium(-1)
    liquid = ms.Cavity(
        body, volume=float(inside.volume[-1]) + 1e-3 * float(inside.pressure[-1]) * rest, bulk_modulus=1e3
    )
    same = ms.equilibrium(ball_scene(body, liquid), start=unstable.positions)
    assert not unstable.stable and same.stable
    assert np.abs(same.positions - unstable.positions).max() < 1e-6


def test_a_path_by_a_pressure_that_is_a_value():
    """Check that the path by a pressure in `values` finds the limit point at the balloon's largest pressure."""
    body = hollow_ball()
    air = ms.Cavity(body, pressure=0.0)
    scene = ball_scene(body, air)
    path = ms.follow_path(
        scene,
        start=ms.equilibrium(scene),
        values={air: {"pressure": 2.0}},
        max_step=0.1,
        progress=False,
        until=lambda _, x: np.abs(x).max() > 2.0,
    )
    assert [each.kind for each in path.critical] == ["limit"] and path.n_negative_eigenvalues[-1] == 1
    largest = pressure_of_thick_ball(np.linspace(1, 100, 10_000)).max()
    assert 2.0 * path.critical[0].parameter == pytest.approx(largest, rel=0.06)
    assert path[air].pressure == pytest.approx(2.0 * path.parameters, abs=1e-12)


@pytest.mark.parametrize("times", [0.3, 100.0])
def test_a_balloon_is_filled_from_one_at_rest(times):
    """Start at an equilibrium under the full load: load steps or a descent then take the volume to its new value."""
    body = hollow_ball()
    rest = ms.Cavity(body, pressure=0.0).rest_volume(ball_scene(body))
    liquid = ms.Cavity(body, volume=rest, bulk_modulus=1e5)
    scene = ball_scene(body, liquid)
    start = ms.equilibrium(scene)
    filled = {liquid: {"volume": times * rest}}
    found = ms.equilibrium(scene, start=start, values=filled)
    assert found.stable and found.load_steps + found.relaxation_steps > 1
    assert np.abs(found.positions - ms.equilibrium(scene, values=filled).positions).max() < 1e-6
    if times < 1.0:
        return
    # A solve that fails midway returns the state that it reached, with its volume.
    with pytest.raises(ms.NotConverged) as caught:
        ms.equilibrium(scene, start=start, values=filled, solver=ms.MixedNewton(max_iterations=3))
    left = caught.value.last_good
    assert 0.0 <= left.load_fraction < 1.0
    assert float(left[liquid].volume) == pytest.approx(
        (1.0 + left.load_fraction * (times - 1.0)) * rest, rel=1e-3
    )


def test_a_path_by_the_amount_of_gas():
    body = hollow_ball()
    gas = ms.Cavity(body, gas_pressure=1.0, outside_pressure=1.0)
    scene = ball_scene(body, gas)
    rest = gas.rest_volume(scene)
    path = ms.follow_path(
        scene,
        start=ms.equilibrium(scene),
        values={gas: {"gas_pressure": 60.0}},
        max_step=0.2,
        progress=False,
    )
    inside, amount = path[gas], 1.0 + 59.0 * path.parameters
    assert np.allclose((inside.pressure + 1.0) * inside.volume, amount * rest, rtol=1e-9)
    assert inside.volume[-1] > 20.0 * rest


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()], ids=repr)
def test_gas_in_motion(integrator):
    """Check a body released from a smaller volume: it swings about equilibrium, each pressure by its own volume."""
    body = box_sheet(size=0.03, thickness=1e-3)
    gas = ms.Cavity(body, gas_pressure=101325.0)
    scene = held(body, actuators=[gas])
    amount = np.linspace(1.0, 1.02, 11) * 101325.0
    move = ms.simulate(
        scene,
        steps=10,
        time_step=2e-4,
        integrator=integrator,
        values={gas: {"gas_pressure": amount}},
        progress=False,
    )
    inside = move[gas]
    assert inside.volume.shape == inside.pressure.shape == (11,)
    expected = amount * gas.rest_volume(scene) / inside.volume - 101325.0
    assert np.allclose(inside.pressure, expected, rtol=1e-12, atol=1e-9)
    assert inside.volume[-1] > inside.volume[0] * 1.001


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_a_motion_with_gas_conserves_energy():
    body = box_sheet(size=0.03, thickness=1e-3)
    gas = ms.Cavity(body, gas_pressure=1.2e5)
    scene = held(body, actuators=[gas])
    move = ms.simulate(scene, steps=100, time_step=5e-5, progress=False)
    assert abs(move.energy[-1] - move.energy[0]) < 0.05 * move.kinetic_energy.max()
    assert move.kinetic_energy.max() > 0


def test_volumes_are_differentiable():
    body = hollow_block()
    gas = ms.Cavity(body, gas_pressure=1.3e5)
    scene = held(body, actuators=[gas])
    amount = torch.tensor(1.3e5, requires_grad=True, dtype=torch.float64)

    def volume(value):
        found = ms.equilibrium(
            scene, values={gas: {"gas_pressure": value}}, solver=ms.MixedNewton(tolerance=1e-13)
        )
        return found[gas].volume

    volume(amount).backward()
    above, below = (float(volume(1.3e5 + way * 100.0)) for way in (1, -1))
    assert float(amount.grad) == pytest.approx((above - below) / 200.0, rel=1e-5)


def test_gas_stiffens_the_vibration_that_changes_its_volume():
    """Check a box full of gas: the mode that changes its volume is stiffer, and no mode is softer."""
    body = box_sheet(size=0.03, thickness=1e-3, cells=(4, 4, 1))
    empty = ms.vibration_modes(held(body), count=4)
    gas = ms.Cavity(body, gas_pressure=101325.0)
    scene = held(body, actuators=[gas])
    modes = ms.vibration_modes(scene, ms.equilibrium(scene), count=4)
    assert modes.unstable == 0
    assert (modes.squares >= empty.squares * (1 - 1e-9)).all()
    assert modes.squares[0] > 1.2 * empty.squares[0]


def test_vacuum_is_crushed_to_a_stable_rest_or_refused():
    body = hollow_block("quadratic")
    vacuum = ms.Cavity(body, gas_pressure=0.0, outside_pressure=2e3)
    found = ms.equilibrium(held(body, actuators=[vacuum]))
    assert found.stable and np.isfinite(found.positions).all()
    assert float(found[vacuum].pressure) == -2e3 and float(found[vacuum].volume) < 1e-6


def test_collapse_raises_an_error_that_names_it():
    sheet = box_sheet(size=0.03, thickness=2e-4, modulus=1e4)
    vacuum = ms.Cavity(sheet, gas_pressure=0.0)
    with pytest.raises(ms.NotConverged) as caught:
        ms.equilibrium(held(sheet, actuators=[vacuum]))
    assert np.isfinite(caught.value.last_good.positions).all()
