"""Water at small Reynolds numbers: the coefficients of strips against exact ellipsoids, and motions against closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad

import magshell as ms

VISCOSITY = 1e-3  # Pa s


def drag_of_ellipsoid(axis: int, semi_axes) -> float:
    """Compute the force of an ellipsoid per speed along an axis, N s/m: 16 pi mu / (chi + a_i^2 alpha_i), [Lamb32] 339.

    lambda = s^2 - c^2 with the shortest axis c and s = 1/t takes the integrals to finite ranges.
    """
    squares = np.square(semi_axes)
    shortest = squares.min()

    def integral(weight):
        def over(t):
            s = 1.0 / t
            shifted = squares - shortest + s**2  # a_i^2 + lambda
            return weight(shifted) * 2.0 * s / np.sqrt(shifted.prod()) / t**2

        return quad(over, 0.0, 1.0 / np.sqrt(shortest), limit=500, epsabs=0, epsrel=1e-9)[0]

    chi = integral(lambda shifted: 1.0)
    alpha = integral(lambda shifted: 1.0 / shifted[axis])
    return 16.0 * np.pi * VISCOSITY / (chi + squares[axis] * alpha)


def test_integral_gives_stokes_drag_of_a_sphere():
    assert drag_of_ellipsoid(0, (0.01, 0.01, 0.01)) == pytest.approx(6 * np.pi * VISCOSITY * 0.01, rel=1e-7)


@pytest.mark.parametrize("slenderness, tolerance", [(5, 0.03), (20, 0.003)])
def test_coefficients_of_a_strip_are_those_of_a_flat_ellipsoid(slenderness, tolerance):
    width = 1e-3
    length = slenderness * width
    flat = (0.5 * length, 0.5 * width, 1e-3 * width)
    water = ms.Water.viscous(VISCOSITY, length, width)
    across = drag_of_ellipsoid(2, flat) / (length * width)
    along = drag_of_ellipsoid(0, flat) / (length * width)
    assert water.normal_viscous_drag == pytest.approx(across, rel=tolerance)
    assert water.tangential_viscous_drag == pytest.approx(along, rel=tolerance)
    sideways = 4 * np.pi * VISCOSITY / (width * (np.log(4 * slenderness) + 1))  # as the docstring has it
    assert drag_of_ellipsoid(1, flat) / (length * width) == pytest.approx(sideways, rel=tolerance)


def test_viscous_refuses_wrong_strips_and_takes_other_arguments():
    with pytest.raises(ValueError, match=r"at least twice its width, got 0\.001 and 0\.001"):
        ms.Water.viscous(VISCOSITY, 1e-3, 1e-3)
    with pytest.raises(ValueError, match=r"viscosity \[Pa s\] must not be negative"):
        ms.Water.viscous(-1.0, 1e-2, 1e-3)
    with pytest.raises(ValueError, match=r"width \[m\] must be positive"):
        ms.Water.viscous(VISCOSITY, 1e-2, 0.0)
    moving = ms.Water.viscous(VISCOSITY, 1e-2, 1e-3, velocity=(0.1, 0, 0), thrust_coefficient=0.5)
    assert moving.velocity[0] == 0.1 and moving.thrust_coefficient == 0.5 and moving.drag_coefficient == 0


@pytest.mark.parametrize("direction", [(0, 0, 1), (1, 0, 0)], ids=["across", "along"])
def test_a_plate_sinks_at_the_terminal_speed(direction):
    """Compare with v = s g / b, and with the approach to it by exp(-b t / s); s: mass per area."""
    mesh = ms.meshes.rectangle(0.02, 0.02, cells=(3, 2))
    sheet = ms.Shell(mesh, thickness=2e-3, young_modulus=1e6, mass_density=1e3)
    water = ms.Water(thrust_coefficient=0, normal_viscous_drag=400.0, tangential_viscous_drag=150.0)
    down = -np.array(direction, dtype=float)
    scene = ms.Scene(sheet, water=water, gravity=9.81 * down, allow_rigid_motions=True)
    drag, areal = (400.0 if direction[2] else 150.0), 2.0
    time = areal / drag
    move = ms.simulate(scene, steps=100, time_step=time / 25, progress=False)
    expected = areal * 9.81 / drag * (1 - np.exp(-move.times / time))
    np.testing.assert_allclose(
        move.velocities @ down, expected[:, None] * np.ones(12), atol=2e-4 * expected[-1]
    )


def test_drag_of_a_tilted_plate_is_anisotropic():
    """Check that a plate at 45 degrees under a force along z drifts sideways, as a sinking rod does."""
    x = np.array([[[0, 0, 0], [1, 0, 1.0], [0, 1, 0]]])
    water = ms.Water(thrust_coefficient=0, normal_viscous_drag=2.0, tangential_viscous_drag=1.0)
    area = np.sqrt(2.0) / 2
    force = water.force(x, np.broadcast_to([0, 0, -1.0], (1, 3, 3)))
    np.testing.assert_allclose(force, [[-0.5 * area, 0, 1.5 * area]], rtol=1e-12, atol=1e-14)
