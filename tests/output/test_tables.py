"""Results as tables of pandas and labelled arrays of xarray."""

import sys

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
SCENE = ms.Scene(SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
MAGNETIZED = {"remanent_magnetization": (4e4, 0, 0)}


@pytest.fixture(scope="module")
def results():
    rest = ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=(0, 0, 1e-3))
    cases = ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=[(0, 0, 1e-3), (0, 0, 2e-3)])
    path = ms.follow_path(SCENE, **MAGNETIZED, start=rest, applied_flux_density=(0, 0, 3e-3))
    move = ms.simulate(SCENE, **MAGNETIZED, steps=3, time_step=1e-3, applied_flux_density=(0, 0, 2e-3))
    return {"rest": rest, "cases": cases, "path": path, "move": move}


def test_tables_of_solids_have_their_own_strains():
    """Check solids alone, and beside a shell, in results of one and of several states."""
    pytest.importorskip("pandas")
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(2, 1, 1))
    law = ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.0)
    bar = ms.Solid(mesh, material=law, mass_density=1e3)
    ends = [bar.mesh.vertices_at(x=0.0), bar.mesh.vertices_at(x=0.1)]
    pulled = [ms.Pin(ends[0], body=bar), ms.Pin(ends[1], displacement=(0.01, 0, 0), body=bar)]
    scene = ms.Scene(bar, supports=pulled)
    stretched = 0.5 * (1.1**2 - 1.0)
    table = ms.to_pandas(ms.equilibrium(scene))
    assert table["largest_green_strain [1]"].to_list() == pytest.approx([stretched])
    assert not [name for name in table if "membrane" in name or "bending" in name]
    cases = ms.to_pandas(ms.equilibrium(scene, support_factor=[0.5, 1.0]))
    assert cases["largest_green_strain [1]"].iloc[1] == pytest.approx(stretched)
    path = ms.follow_path(scene)
    strains = ms.to_pandas(path)["largest_green_strain [1]"].to_numpy()
    assert len(strains) == len(path.parameters) and strains[0] < 1e-14 and (np.diff(strains) > 0).all()
    both = ms.Scene([bar, SHEET], supports=[*pulled, ms.Clamp(MESH.edges_at(x=0.0), body=SHEET)])
    table = ms.to_pandas(ms.equilibrium(both))
    assert {"largest_green_strain [1]", "largest_membrane_strain [1]"} <= set(table)


@pytest.mark.parametrize(
    "name, along", [("rest", ()), ("cases", ("case",)), ("path", ("parameter",)), ("move", ("time",))]
)
def test_xarray_has_labels_and_units(name, along, results):
    pytest.importorskip("xarray")
    result = results[name]
    table = ms.to_xarray(result)
    assert table.positions.dims == (*along, "vertex", "axis") and table.positions.attrs == {"units": "m"}
    np.testing.assert_array_equal(table.positions, result.positions)
    np.testing.assert_array_equal(table.sel(axis="z").displacements, result.displacements[..., 2])
    np.testing.assert_array_equal(table.faces, MESH.faces)
    if name == "move":
        assert table.time.attrs == {"units": "s"}
        np.testing.assert_array_equal(table.time, result.times)
        np.testing.assert_array_equal(table.velocities, result.velocities)
        np.testing.assert_array_equal(table.bending_energy, result.energies["bending"])
        assert table.bending_energy.attrs == {"units": "J"}
    if name == "cases":
        assert table.membrane_energy.values.tolist() == [case.energies["membrane"] for case in result]


def test_pandas_has_times_and_vertices(results):
    pytest.importorskip("pandas")
    move = results["move"]
    states, vertices = ms.to_pandas(move), ms.to_pandas(move, per="vertex")
    assert states.index.name == "time [s]" and states.index.tolist() == move.times.tolist()
    np.testing.assert_array_equal(states["kinetic_energy [J]"], move.kinetic_energy)
    np.testing.assert_array_equal(states["applied_flux_density z [T]"], 2e-3)
    np.testing.assert_array_equal(vertices.xs(4, level="vertex")["positions z [m]"], move.positions[:, 4, 2])
    assert ms.to_pandas(results["rest"]).shape[0] == 1 and len(ms.to_pandas(results["cases"])) == 2
    assert ms.to_pandas(results["path"]).index.name == "parameter"


def test_scenes_with_loads_have_a_column_of_the_load_factor(results):
    pytest.importorskip("pandas")
    load = ms.PointLoad(MESH.vertices_at(x=0.05), (0, 0, 1e-5))
    scene = ms.Scene(SCENE.bodies[0], supports=SCENE.supports, loads=load)
    name, factors = "load_factor [1]", [0.2, 0.5, 1.0]
    assert ms.to_pandas(ms.equilibrium(scene, load_factor=factors))[name].tolist() == factors
    move = ms.simulate(scene, steps=2, time_step=1e-3, load_factor=factors)
    assert ms.to_pandas(move)[name].tolist() == factors
    assert name not in ms.to_pandas(results["move"])


def test_tensors_become_arrays_in_tables(results):
    torch = pytest.importorskip("torch")
    pytest.importorskip("xarray")
    strength = torch.tensor([4e4, 0, 0], dtype=torch.float64, requires_grad=True)
    rest = ms.equilibrium(SCENE, remanent_magnetization=strength, applied_flux_density=(0, 0, 1e-3))
    np.testing.assert_array_equal(ms.to_xarray(rest).positions, results["rest"].positions)


def test_bad_input_is_refused(results, monkeypatch):
    with pytest.raises(
        ValueError,
        match=r"result must be an Equilibrium, EquilibriumSet, an EquilibriumPath or a Trajectory, got Scene",
    ):
        ms.to_xarray(SCENE)
    with pytest.raises(ValueError, match=r'per must be "state" or "vertex", got \'face\''):
        ms.to_pandas(results["move"], per="face")
    for package, call in (("xarray", ms.to_xarray), ("pandas", ms.to_pandas)):
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(ImportError, match=rf'needs {package}: pip install "magshell\[tables\]"'):
            call(results["rest"])
