"""Muscles and tendons in linear theory: vibrations about an active state, and cases that linear theory refuses."""

import numpy as np
import pytest

import magshell as ms

SOFT = ms.NeoHookean(young_modulus=1e4, poisson_ratio=0.3)


EULER = np.pi**2 * 1e4 * 0.01**4 / 12 / 0.1**2  # N


def strip(force=(1e-5, 0, 2e-7), **law):
    """Return (scene, body, muscle) of a bar of 10 x 1 x 1 cm, clamped at one end, with fibres along it."""
    mesh = ms.meshes.box((0.1, 0.01, 0.01), cells=(6, 2, 2))
    body = ms.Solid(mesh, material=SOFT, mass_density=1e3)
    mesh = body.mesh
    muscle = ms.Muscle(body, (1, 0, 0), **law)
    pull = ms.PointLoad(mesh.vertices_at(x=0.1), force, body=body)
    scene = ms.Scene(body, supports=[ms.Pin(mesh.vertices_at(x=0.0))], loads=[pull], actuators=[muscle])
    return scene, body, muscle


@pytest.mark.parametrize("law", [{"stiffness": 2e4}, {"peak_stress": 2e4}], ids=["stretch", "stress"])
@pytest.mark.parametrize("activation", [0.15, 0.4])
def test_vibrations_about_an_active_state_are_those_of_small_motions(law, activation):
    """Compare the energy of a small displacement along a mode with its kinetic energy."""
    scene, body, muscle = strip(**law)
    rest = ms.equilibrium(scene, values={muscle: {"activation": activation}}, load_factor=0.0)
    modes = ms.vibration_modes(scene, rest, count=3)
    idle = ms.vibration_modes(scene, count=3)
    assert np.abs(modes.frequencies / idle.frequencies - 1).max() > 0.03
    size = 3e-6 * modes.modes[2]

    def energy(shift):
        found = ms.energies(
            scene, rest.positions + shift, values={muscle: {"activation": activation}}, load_factor=0.0
        )
        return sum(found.values())

    energies = [energy(sign * size) for sign in (1, 0, -1)]
    curvature = energies[0] - 2 * energies[1] + energies[2]
    inertia = (body.vertex_masses[:, None] * size**2).sum()
    assert curvature / inertia == pytest.approx(modes.squares[2], rel=1e-3)


def test_the_stiffness_of_an_idle_muscle_counts():
    """Check that fibres of modulus w along a bar of modulus E make it as stiff as E + w along itself."""
    scene, _, muscle = strip(stiffness=2e4)
    tip = scene.mesh.rest_positions[:, 0] > 0.099
    linear = ms.linear_response(scene, load_factor=1e-3)
    solved = ms.equilibrium(scene, load_factor=1e-3)
    assert linear.displacements[tip].mean(axis=0) == pytest.approx(
        solved.displacements[tip].mean(axis=0), rel=1e-4, abs=1e-12
    )
    without = ms.linear_response(scene, load_factor=1e-3, values={muscle: {"stiffness": 1e-3}})
    ratio = without.displacements[tip, 0].mean() / linear.displacements[tip, 0].mean()
    assert 2.5 < ratio < 3.0


def test_fibres_along_a_column_hold_it_against_buckling():
    scene, _, muscle = strip(force=(-1e-5, 0, 0), stiffness=2e4)
    with_muscle = ms.linear_buckling(scene).factors[0]
    alone = ms.linear_buckling(scene, values={muscle: {"stiffness": 1e-3}}).factors[0]
    assert with_muscle / alone == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize("law", [{"stiffness": 2e4}, {"peak_stress": 2e4}], ids=["stretch", "stress"])
@pytest.mark.parametrize("ask", [ms.linear_response, ms.linear_buckling, ms.vibration_modes])
def test_a_muscle_that_pulls_at_rest_is_refused(law, ask):
    scene, _, muscle = strip(**law)
    with pytest.raises(ValueError, match=r"Muscle.*pulls at the rest shape"):
        ask(scene, values={muscle: {"activation": 0.2}})
    ask(scene, **({"load_factor": -1.0} if ask is ms.linear_buckling else {}))


def test_a_passive_curve_that_pulls_at_rest_is_refused():
    lengths = np.linspace(0.5, 1.5, 5)
    curve = np.stack([lengths, np.full(5, 0.5)], axis=1)
    scene, *_ = strip(peak_stress=1e4, force_length=curve, passive=curve)
    with pytest.raises(ValueError, match="pulls at the rest shape"):
        ms.vibration_modes(scene)


def test_a_tendon_of_constant_tension_is_a_load_and_a_spring_is_none():
    mesh = ms.meshes.box((0.1, 0.01, 0.01), cells=(6, 2, 2))
    body = ms.Solid(mesh, material=SOFT)
    mesh = body.mesh
    below = [(x, 0.005, 0.002) for x in (0.0, 0.03, 0.07, 0.1)]
    tendon = ms.Tendon(below, body, tension=1e-5)
    scene = ms.Scene(body, supports=[ms.Pin(mesh.vertices_at(x=0.0))], actuators=[tendon])
    tip = mesh.rest_positions[:, 0] > 0.099
    linear = ms.linear_response(scene).displacements[tip].mean(axis=0)
    solved = ms.equilibrium(scene).displacements[tip].mean(axis=0)
    assert linear == pytest.approx(solved, rel=1e-2)
    assert linear[2] < 0
    # Under a force that always points to its foot a column carries four times the load of one under a fixed direction.
    axis = ms.Tendon([(0.0, 0.005, 0.005), (0.1, 0.005, 0.005)], body, tension=1.0)
    scene = ms.Scene(body, supports=scene.supports, actuators=[axis])
    assert ms.linear_buckling(scene).factors[0] == pytest.approx(EULER, rel=0.05)
    tendon = axis
    with pytest.raises(ValueError, match="is a spring"):
        ms.linear_response(scene, values={tendon: {"stiffness": 1.0}})
