"""Results, scenes and meshes draw and save themselves, as the functions do."""

import numpy as np
import pytest

import magshell as ms

PLAIN = ms.Style(backend="matplotlib")
MESH = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
LOAD = ms.EdgeLoad(MESH.edges_at(x=0.1), (0, 0, 0.02))
SCENE = ms.Scene(SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=[LOAD])
REST = ms.equilibrium(SCENE)
MOTION = ms.simulate(SCENE, steps=3, time_step=1e-2, progress=False)


@pytest.mark.parametrize(
    "what",
    [
        MESH,
        ms.meshes.box((1, 1, 1), cells=(1, 1, 1)),
        SCENE,
        REST,
        ms.EquilibriumSet([REST, REST]),
        ms.follow_path(SCENE, until=lambda way, _: way > 0.05, progress=False),
        MOTION,
        ms.linear_response(SCENE),
    ],
    ids=lambda what: type(what).__name__,
)
def test_plot_method_equals_the_function(what) -> None:
    found, wanted = (each._repr_png_(60) for each in (what.plot(style=PLAIN), ms.plot(what, style=PLAIN)))
    assert found == wanted and len(found) > 2000


def test_a_wrong_keyword_is_told() -> None:
    with pytest.raises(
        TypeError, match=r"plot\(\) has no keyword 'backend'; use style=ms.Style\(backend=...\)"
    ):
        REST.plot(backend="matplotlib")


def test_save_and_animate(tmp_path) -> None:
    for name, result in (("rest", REST), ("cases", ms.EquilibriumSet([REST])), ("motion", MOTION)):
        result.save(tmp_path / f"{name}.npz")
        again = ms.load(tmp_path / f"{name}.npz", SCENE)
        assert type(again) is type(result)
        np.testing.assert_array_equal(again.positions, result.positions)
    path = ms.follow_path(SCENE, until=lambda way, _: way > 0.05, progress=False)
    with pytest.raises(ValueError, match=r"save its points, ms.EquilibriumSet"):
        path.save(tmp_path / "path.npz")
    for k, each in enumerate((MOTION, path)):
        assert each.animate(tmp_path / f"{k}.gif", width=400, style=PLAIN, fps=5).stat().st_size > 1000
