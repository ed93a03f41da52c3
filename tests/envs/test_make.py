"""ms.envs.make: environments of scenes and of their files."""

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("gymnasium")
MESH = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
SHEET = ms.Shell(
    MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3, remanent_magnetization=(3e4, 0, 0)
)
SCENE = ms.Scene(SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())


def lifted(scene) -> dict:
    tip = scene.mesh.vertices_at(x=0.05)
    return {
        "actuators": [ms.envs.Action(scene, "applied_flux_density", lower=-5e-3, upper=5e-3)],
        "observation": lambda now: 1e3 * now.positions[tip].ravel(),
        "reward": lambda now: float(now.positions[tip, 2].mean()),
        "time_step": 2e-3,
        "actions_per_episode": 4,
    }


def test_an_environment_of_a_file_steps_as_one_of_its_scene(tmp_path) -> None:
    ms.save_scene(tmp_path / "strip.scene", SCENE)
    found = []
    for source in (SCENE, tmp_path / "strip.scene", str(tmp_path / "strip.scene")):
        environment = ms.envs.make(source, lifted, steps_per_action=2)
        environment.reset(seed=1)
        found.append(environment.step(np.ones(environment.action_space.shape))[:2])
    for observation, reward in found[1:]:
        np.testing.assert_array_equal(observation, found[0][0])
        assert reward == found[0][1] > 0.0


@pytest.mark.parametrize(
    ("source", "describe", "message"),
    [
        (3, lifted, "source must be a Scene or the path of its file, got int"),
        (SCENE, 3, "describe must be a function of the scene, got int"),
        (SCENE, lambda scene: None, "describe must return keywords of Environment, a dict, got NoneType"),
    ],
)
def test_bad_arguments_of_make_are_named(source, describe, message) -> None:
    with pytest.raises(ValueError, match=message):
        ms.envs.make(source, describe)
