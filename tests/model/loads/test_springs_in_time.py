"""Springs, beds, creases and joints whose values vary in time: their results have those of the time, and ranges hold."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 1))
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
STEPS = 4
GROWING = np.linspace(1.0, 2.0, STEPS + 1)


def sheet(**more) -> ms.Shell:
    return ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3, **more)


def moved(scene, **values) -> ms.Trajectory:
    return ms.simulate(scene, steps=STEPS, time_step=1e-3, **values)


def test_results_of_springs_have_the_values_of_their_time() -> None:
    body = sheet()
    spring = ms.Spring((body, (0.05, 0.01, 0)), (0.05, 0.01, 0.05), stiffness=2.0, rest_length=0.02)
    scene = ms.Scene(body, supports=CLAMP, loads=spring, gravity=(0, 0, -9.81))
    stiffness, rest_length = 2.0 * GROWING, 0.02 * GROWING
    ground = np.array([0.05, 0.01, 0.05]) + 0.01 * GROWING[:, None] * (0, 0, 1)
    values = {"stiffness": stiffness, "rest_length": rest_length, "ground": ground}
    move = moved(scene, values={spring: values})
    arms = move.positions[:, MESH.nearest_vertex((0.05, 0.01, 0))] - ground
    lengths = np.linalg.norm(arms, axis=1)
    tensions = stiffness * (lengths - rest_length)
    assert move[spring].length == pytest.approx(lengths, rel=1e-9)
    assert move[spring].tension == pytest.approx(tensions, rel=1e-9)
    assert move[spring].force == pytest.approx(-(tensions / lengths)[:, None] * arms, rel=1e-9, abs=1e-9)
    assert move.energies["springs"] == pytest.approx(0.5 * tensions**2 / stiffness, rel=1e-9)


def test_forces_of_a_bed_have_the_stiffness_of_their_time() -> None:
    body = sheet()
    bed = ms.ElasticFoundation(10.0, direction=(0, 0, 1))
    scene = ms.Scene(body, supports=CLAMP, loads=bed, gravity=(0, 0, -9.81))
    move = moved(scene, values={bed: {"stiffness": 10.0 * GROWING}})
    for k in range(1, STEPS + 1):
        one = ms.ElasticFoundation(10.0 * GROWING[k], direction=(0, 0, 1))
        other = ms.Scene(body, supports=CLAMP, loads=one, gravity=(0, 0, -9.81))
        energy = ms.energies(other, move.positions[k], edge_rotations=move.edge_rotations[k])["springs"]
        work = -0.5 * (move[bed].forces[k] * move.displacements[k, move[bed].vertices]).sum()
        assert work == pytest.approx(energy, rel=1e-9)


def sprung():
    body = sheet()
    spring = ms.Spring((body, (0.05, 0.01, 0)), (0.05, 0.01, 0.05), stiffness=2.0, rest_length=0.02)
    return ms.Scene(body, supports=CLAMP, loads=spring), spring


def creased():
    crease = ms.Crease(MESH.edges_at(x=0.025), stiffness=1e-5, angle=0.0)
    return ms.Scene(sheet(creases=crease), supports=CLAMP), crease


def hinged():
    arm = ms.Link(mass=1.0, inertia=0.1, center=(0.5, 0, 0))
    hinge = ms.Revolute(arm, origin=(0, 0, 0), axis=(0, 1, 0), spring_stiffness=1.0, damping=0.1)
    return ms.Scene(ms.Skeleton(arm, hinge)), hinge


NAMES = [
    (sprung, "stiffness"),
    (sprung, "rest_length"),
    (creased, "stiffness"),
    (hinged, "spring_stiffness"),
    (hinged, "damping"),
]


@pytest.mark.parametrize("made, name", NAMES)
@pytest.mark.parametrize("as_function", [False, True])
def test_values_over_time_that_are_refused_at_one_time(made, name, as_function) -> None:
    scene, owner = made()
    falling = float(np.max(getattr(owner, name))) * np.linspace(1.0, -1.0, STEPS + 1)
    value = (lambda time: np.interp(time, 1e-3 * np.arange(STEPS + 1), falling)) if as_function else falling
    with pytest.raises(ValueError, match=name):
        moved(scene, values={owner: {name: value}})
