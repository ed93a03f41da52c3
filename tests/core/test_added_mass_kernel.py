"""The momentum and the energy of the water that single faces push: against a second formula, differences, and [Lamb32]."""

import numpy as np
import pytest

import magshell as ms
from magshell import _core

torch = pytest.importorskip("torch")
FLOW, ADDED_MASS = (0.3, -0.2, 0.4), 2.5  # m/s, kg/m2


def water(**changes):
    nothing = {"drag_coefficient": 0.0, "thrust_coefficient": 0.0}
    return ms.Water(**{"velocity": FLOW, "added_mass": ADDED_MASS, **nothing, **changes})


def random_faces(rng, count=20):
    """Return corners of centimetres and velocities of order one, each (n, 3, 3)."""
    return 0.01 * rng.standard_normal((count, 3, 3)), rng.standard_normal((count, 3, 3))


def kinetic_energy(x, v, flow=FLOW):
    """Compute T = 1/2 m A (n . (v - U))^2 of one face, in torch; x, v (3, 3)."""
    across = torch.linalg.cross(x[1] - x[0], x[2] - x[0])
    area = 0.5 * torch.linalg.norm(across)
    speed = (across / (2 * area)) @ (v.mean(dim=0) - torch.tensor(flow, dtype=torch.float64))
    return 0.5 * ADDED_MASS * area * speed**2


def test_momentum_and_forces_follow_from_the_kinetic_energy(rng):
    """Differentiate T twice by positions and velocities, and compare: p, dT/dx, dp/dx, dp/dv, d2T/dx2 and v . p - T."""
    x, v = random_faces(rng)
    found = _core.added_mass_faces(water()._core, x, v)
    for f in range(len(x)):
        at = torch.tensor(np.stack([x[f], v[f]]), requires_grad=True)
        energy = kinetic_energy(*at)
        by_x, by_v = torch.autograd.grad(energy, at)[0].numpy()
        second = torch.autograd.functional.hessian(lambda z: kinetic_energy(*z), at.detach()).numpy()
        compared = {
            "corner_momentum": by_v[0],
            "by_position": by_x,
            "hessian": second[0, :, :, 0].reshape(9, 9),
            "momentum_by_position": second[1, 0, :, 0].transpose(1, 0, 2),
            "momentum_by_velocity": 3 * second[1, 0, :, 1, 0],
            "energy": (v[f] * by_v).sum() - energy.item(),
        }
        assert set(compared) == set(found)
        for name, expected in compared.items():
            scale = np.abs(expected).max()
            np.testing.assert_allclose(found[name][f], expected, rtol=0, atol=1e-12 * scale, err_msg=name)


def test_force_is_the_rate_of_the_momentum(rng):
    """Compare -dP/dt along x + v t + w t^2/2 with differences: the momentum turns with the face."""
    x, v = random_faces(rng)
    w = rng.standard_normal(x.shape)

    def momentum(t):
        return water().momentum(x + v * t + 0.5 * w * t**2, v + w * t)

    step = 1e-7
    expected = -(momentum(step) - momentum(-step)) / (2 * step)
    np.testing.assert_allclose(water().force(x, v, w), expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_a_steadily_moving_face_feels_no_force():
    """Check d'Alembert's paradox: only a rotation or an acceleration changes the momentum."""
    x = np.array([[[0.1, 0, 0], [0.5, 0.1, 0], [0.2, 0.3, 0.1]]])
    v = np.broadcast_to([0.5, -0.2, 0.9], x.shape)
    assert np.abs(water().force(x, v)).max() < 1e-15
    turning = v + np.cross([0, 5.0, 0], x)
    assert np.abs(water().force(x, turning)).max() > 0.01


def test_added_mass_resists_along_the_normal():
    """Check 5 kg/m2 on 0.055 m2 for both orientations: a force along the normal and none within the face."""
    face, area = np.array([[0.1, 0, 0], [0.5, 0.1, 0], [0.2, 0.3, 0]]), 0.055
    w = np.broadcast_to([3.0, -1.0, 2.0], (1, 3, 3))
    for corners in (face, face[::-1]):
        force = water(added_mass=5.0, velocity=(0, 0, 0)).force(corners[None], np.zeros((1, 3, 3)), w)
        np.testing.assert_allclose(force, [[0, 0, -5.0 * area * 2.0]], rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("size", [0.0, 1e-200, 1e-100, 1e-20])
@pytest.mark.parametrize("speed", [0.0, 1e-200, 1.0])
def test_no_nan_at_rest_or_without_area(size, speed, rng):
    x, v = random_faces(rng)
    for values in _core.added_mass_faces(water()._core, size * x, speed * v).values():
        assert np.isfinite(values).all()
