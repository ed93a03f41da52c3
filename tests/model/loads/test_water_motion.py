"""Motions in water (G1): plates that fall, drift and glide as the closed forms predict."""

import numpy as np
import pytest
from blocks import block_sheet, simulated

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

GRAVITY = 9.81  # m/s2
# On [Chen22]'s drag and thrust: head on C = 2 of each.
PAPER = {"drag_coefficient": 1.0, "thrust_coefficient": 1.0}
INTEGRATORS = [ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()]
SECOND_ORDER = INTEGRATORS[1:]
TILT = rotation_matrix(np.array([0.4, -0.7, 0.2]))
# Factors of drag and thrust. C = 2 sin^2 is 2 head on; reference.json: "drag rho A v^2 + thrust rho A v^2 = 2 rho A v^2".
COEFFICIENTS = [(1.0, 1.0), (0.6, 0.0), (0.3, 1.7)]


def plate(water, gravity=(0, 0, 0), rotation=None, cells=(3, 2)) -> ms.Scene:
    sheet = block_sheet(cells, young_modulus=1e6)
    if rotation is not None:
        mesh = ms.TriangleMesh(sheet.mesh.rest_positions @ rotation.T, sheet.mesh.faces)
        sheet = ms.Shell(mesh, thickness=2e-3, young_modulus=1e6, mass_density=1e3)
    return ms.Scene(sheet, water=water, gravity=gravity, allow_rigid_motions=True)


def closed_form(scene, fall=GRAVITY) -> tuple[float, float]:
    """Return v_T and T of a plate that falls face-on, as in the docstring of ms.Water."""
    water, areal = scene.water, float(scene.shell.mass_density[0] * scene.shell.thickness[0])
    head_on = 2 * (water.drag_coefficient + water.thrust_coefficient)
    terminal = np.sqrt(2 * areal * fall / (water.fluid_density * head_on))
    return terminal, terminal * (areal + water.added_mass) / (areal * fall)


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=repr)
@pytest.mark.parametrize("drag, thrust", COEFFICIENTS)
def test_falling_plate_reaches_the_terminal_speed(integrator, drag, thrust):
    scene = plate(ms.Water(drag_coefficient=drag, thrust_coefficient=thrust), (0, 0, -GRAVITY))
    terminal, time = closed_form(scene)
    motion = simulated(scene, 80, time / 4, integrator=integrator)
    np.testing.assert_allclose(
        -motion.velocities[-1, :, 2], terminal, rtol=1e-9
    )  # the validation set requires 1e-3
    assert np.abs(motion.velocities[-1, :, :2]).max() < 1e-9 * terminal


@pytest.mark.parametrize("integrator", SECOND_ORDER, ids=repr)
@pytest.mark.parametrize("added_mass", [0.0, 5.0])
@pytest.mark.parametrize("rotation", [None, TILT], ids=["level", "askew"])
def test_plate_falls_by_a_hyperbolic_tangent(integrator, added_mass, rotation):
    """Compare the fall with v_T tanh(t / T), with and without added mass.

    Added mass slows the start and not the end. In the oblique case gravity is along the plate's normal, too.
    """
    down = np.array([0.0, 0.0, -1.0]) if rotation is None else -TILT[:, 2]
    scene = plate(ms.Water(added_mass=added_mass, **PAPER), GRAVITY * down, rotation)
    terminal, time = closed_form(scene)
    motion = simulated(scene, 150, time / 50, integrator=integrator)
    expected = terminal * np.tanh(motion.times / time)
    speeds = motion.velocities @ down
    np.testing.assert_allclose(
        speeds, expected[:, None] * np.ones(speeds.shape[1]), rtol=0, atol=2e-4 * terminal
    )

    across = motion.velocities - speeds[:, :, None] * down
    # Added mass grows with the area, so that the water stretches the plate a little.
    np.testing.assert_allclose(across, 0, rtol=0, atol=(1e-4 if added_mass else 1e-9) * terminal)
    fallen = terminal * time * np.log(np.cosh(motion.times[-1] / time))
    np.testing.assert_allclose((motion.positions[-1] - motion.positions[0]) @ down, fallen, rtol=2e-4)


def test_added_mass_slows_the_start():
    """Check the start without drag: acceleration g s / (s + m), with the plate's own mass per area s."""
    scene = plate(ms.Water(added_mass=5.0), (0, 0, -GRAVITY))
    motion = simulated(scene, 1, 1e-6)
    np.testing.assert_allclose(-motion.velocities[-1, :, 2], 1e-6 * GRAVITY * 2.0 / 7.0, rtol=1e-6)
    still = plate(ms.Water(added_mass=5.0), (0, GRAVITY, 0))
    motion = simulated(still, 1, 1e-6)
    np.testing.assert_allclose(
        motion.velocities[-1, :, 1], 1e-6 * GRAVITY, rtol=1e-7
    )  # edge-on there is no added mass


def test_in_a_flow_the_relative_motion_counts():
    """Check a plate that falls through rising water: its speed relative to the water is the terminal one."""
    flow = np.array([0.0, 0.0, 0.3])
    scene = plate(ms.Water(velocity=flow, **PAPER), (0, 0, -GRAVITY))
    terminal, time = closed_form(scene)
    motion = simulated(scene, 80, time / 4)
    np.testing.assert_allclose(motion.velocities[-1, :, 2], flow[2] - terminal, rtol=1e-9)


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=repr)
@pytest.mark.parametrize("added_mass", [0.0, 5.0])
def test_plate_moving_with_the_water_has_no_force(integrator, added_mass):
    flow = np.array([0.31, -0.22, 0.17])
    scene = plate(ms.Water(velocity=flow, added_mass=added_mass), rotation=TILT)
    motion = simulated(scene, 40, 0.01, velocities=flow, integrator=integrator)
    expected = motion.positions[0] + motion.times[:, None, None] * flow
    np.testing.assert_allclose(motion.positions, expected, rtol=0, atol=1e-13)
    np.testing.assert_allclose(motion.velocities - flow, 0, rtol=0, atol=1e-11)


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=repr)
def test_edge_on_plate_keeps_its_speed(integrator):
    """Check that an edge-on plate keeps its speed, as C(0) = 0 and faces have no friction along them."""
    scene = plate(ms.Water(added_mass=5.0))
    speed = np.array([0.4, -0.3, 0.0])
    motion = simulated(scene, 40, 0.01, velocities=speed, integrator=integrator)
    np.testing.assert_allclose(motion.velocities - speed, 0, rtol=0, atol=1e-11)


def test_face_on_a_plate_coasts_to_a_halt():
    """Compare with v = v0 / (1 + v0 t / l), from dv/dt = -v^2 / l with l = 2 (s + m) / (rho (C_d + C_t))."""
    scene = plate(ms.Water(added_mass=1.0, **PAPER))
    start, length = 0.5, 2 * (2.0 + 1.0) / (1000.0 * 4.0)
    motion = simulated(scene, 200, 2e-5, velocities=(0, 0, start), integrator=ms.SDIRK2())
    expected = start / (1 + start * motion.times / length)
    assert expected[-1] < 0.5 * start
    np.testing.assert_allclose(motion.velocities[:, :, 2], expected[:, None] * np.ones(12), rtol=2e-4)


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=repr)
def test_still_water_only_dissipates_energy(integrator):
    """Check that a soft sheet thrown obliquely with a spin never gains energy."""
    scene = plate(ms.Water(drag_coefficient=1.0, thrust_coefficient=0.5), rotation=TILT, cells=(4, 4))
    x = scene.mesh.rest_positions
    thrown = np.array([0.3, 0.1, -0.2]) + np.cross([5.0, -3.0, 8.0], x - x.mean(axis=0))
    motion = simulated(scene, 60, 2e-3, velocities=thrown, integrator=integrator)
    assert np.diff(motion.energy).max() <= 1e-9 * motion.energy[0]
    assert motion.energy[-1] < 0.5 * motion.energy[0]
