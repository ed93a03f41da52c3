"""Probes: named quantities in tables of results, and curves of them."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
SCENE = ms.Scene(SHEET, supports=[CLAMP], field=ms.UniformField(), gravity=(0, 0, -9.81))
GIVEN = {"remanent_magnetization": (4e4, 0, 0)}
TIP = MESH.vertices_at(x=0.05)
ENDS = [MESH.nearest_vertex((0, 0, 0)), MESH.nearest_vertex((0.05, 0, 0))]
pandas = pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def results():
    rest = ms.equilibrium(SCENE, **GIVEN, applied_flux_density=(0, 0, 1e-3))
    return {
        "rest": rest,
        "cases": ms.equilibrium(SCENE, **GIVEN, applied_flux_density=[(0, 0, 1e-3), (0, 0, 2e-3)]),
        "path": ms.follow_path(SCENE, **GIVEN, start=rest, applied_flux_density=(0, 0, 3e-3)),
        "move": ms.simulate(SCENE, **GIVEN, steps=3, time_step=1e-3, applied_flux_density=(0, 0, 2e-3)),
    }


PROBES = [
    ms.Probe("tip", TIP),
    ms.Probe("place", TIP, "position", body=SHEET),
    ms.Probe("hold", CLAMP, "reaction"),
    ms.Probe("span", ENDS, "distance"),
    ms.Probe("bending", "bending", "energy"),
]


@pytest.mark.parametrize("name", ["rest", "cases", "path", "move"])
def test_probes_are_columns_of_every_kind_of_result(name, results):
    result = results[name]
    probes = PROBES[:4] if name == "path" else PROBES
    table = ms.to_pandas(result, probes=probes)
    x = np.reshape(result.positions, (-1, MESH.n_vertices, 3))
    np.testing.assert_array_equal(table["place.y [m]"], x[:, TIP, 1].mean(axis=1))
    moved = (x - MESH.rest_positions)[:, TIP].mean(axis=1)
    np.testing.assert_allclose(table[["tip.x [m]", "tip.y [m]", "tip.z [m]"]], moved, rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        table["span [m]"], np.linalg.norm(x[:, ENDS[1]] - x[:, ENDS[0]], axis=1), rtol=1e-14
    )
    if name != "path":
        np.testing.assert_array_equal(table["bending [J]"], table["bending_energy [J]"])
    if name in ("rest", "path"):  # the weight of 0.5 g: a uniform field exerts no force
        np.testing.assert_allclose(table["hold.z [N]"], 0.05 * 0.01 * 9.81, rtol=1e-6)


def test_reactions_of_a_motion_are_those_of_its_states(results):
    table = ms.to_pandas(results["move"], probes=PROBES[2])
    for k in range(1, 4):
        assert table["hold.z [N]"].iloc[k] == results["move"].reaction(CLAMP, k).force[2]
    data = pytest.importorskip("xarray") and ms.to_xarray(results["move"], probes=PROBES[:1])
    assert data["tip.z"].dims == ("time",) and data["tip.z"].attrs == {"units": "m"}


def test_velocities_and_angles_of_a_swing(results):
    move = results["move"]
    middle = MESH.nearest_vertex((0.025, 0, 0))
    probes = [ms.Probe("speed", TIP, "velocity"), ms.Probe("bend", [ENDS[0], middle, ENDS[1]], "angle")]
    table = ms.to_pandas(move, probes=probes)
    np.testing.assert_array_equal(table["speed.z [m/s]"], move.velocities[:, TIP, 2].mean(axis=1))
    assert table["bend [rad]"].iloc[0] == pytest.approx(np.pi, abs=1e-7)
    a, b = (move.positions[-1, end] - move.positions[-1, middle] for end in ENDS)
    cosine = a @ b / np.linalg.norm(a) / np.linalg.norm(b)
    assert np.cos(table["bend [rad]"].iloc[-1]) == pytest.approx(cosine, rel=1e-12)


def test_contact_force_on_a_floor_is_the_weight():
    floor = ms.Contact(ms.obstacles.Plane())
    sheet = ms.Shell(
        MESH.transformed(translation=(0, 0, 1e-5)), thickness=1e-3, young_modulus=1e6, mass_density=1e3
    )
    scene = ms.Scene(sheet, contacts=[floor], gravity=(0, 0, -9.81), allow_rigid_motions=True)
    start = ms.simulate(scene, steps=100, time_step=5e-3, integrator=ms.ImplicitEuler(), progress=False)
    table = ms.to_pandas(start, probes=ms.Probe("floor", floor, "contact_force"))
    assert table["floor.z [N]"].iloc[-1] == pytest.approx(0.05 * 0.01 * 9.81, rel=1e-3)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: ms.Probe("", TIP), "name must be"),
        (lambda: ms.Probe("tip", TIP, "speed"), "what must be one of position"),
        (lambda: ms.Probe("tip", []), "empty"),
        (lambda: ms.Probe("tip", TIP, "distance"), "distance needs of = 2 vertices, got 3"),
        (lambda: ms.Probe("hold", TIP, "reaction"), "reaction needs of = a Pin"),
        (lambda: ms.Probe("hold", CLAMP, "reaction", body=SHEET), "body is for vertices"),
        (lambda: ms.Probe("all", 3.0, "energy"), "needs of = the name of an energy"),
    ],
)
def test_probes_of_nothing_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize(
    "name, probes, words",
    [
        ("rest", ms.Probe("tip", [10**6]), r"of of probe 'tip' must be in \[0,"),
        ("rest", ms.Probe("tip", TIP, "velocity"), "only motions have velocities"),
        ("rest", ms.Probe("e", "bendin", "energy"), "no energy 'bendin'; the nearest names are 'bending'"),
        ("rest", ms.Probe("hold", ms.Clamp(MESH.edges_at(x=0.0)), "reaction"), "one of scene.supports"),
        ("rest", [PROBES[0], PROBES[0]], "two are called 'tip'"),
        ("rest", ms.Probe("bending_energy", "bending", "energy"), "name of another column"),
        ("rest", TIP, "probes must be an ms.Probe"),
    ],
)
def test_probes_that_a_result_has_not_are_refused(name, probes, words, results):
    with pytest.raises(ValueError, match=words):
        ms.to_pandas(results[name], probes=probes)


def test_curves_against_time_and_each_other(results):
    probes = PROBES[:3]
    lines = {}
    for against in (None, "tip.z", "tip.z [m]"):
        picture = ms.plot_history(
            results["move"], ["tip.z", "hold.z [N]", "tip.x"], against=against, probes=probes
        )
        upper, lower = picture.figure.axes
        assert lower.get_xlabel() == ("time [s]" if against is None else "tip.z [m]")
        assert lower.get_ylabel() == "hold.z [N]" and len(upper.lines) == 2
        lines[against] = lower.lines[0].get_xdata()
    np.testing.assert_array_equal(lines[None], results["move"].times)
    times = ms.plot_history(results["move"], "time", against="tip.z", probes=probes).figure.axes[0].lines[0]
    np.testing.assert_array_equal(times.get_ydata(), results["move"].times)
    with pytest.raises(ValueError, match=r"'name\.z' is a column of an ms\.Probe"):
        ms.plot_history(results["move"], "tip.z")
    with pytest.raises(ValueError, match=r"no column 'tip\.w'; the nearest names are"):
        ms.plot_history(results["move"], "tip.w", probes=probes)
    with pytest.raises(ValueError, match="several states"):
        ms.plot_history(results["rest"], "tip.z", probes=probes)


@pytest.mark.parametrize("name", ["cases", "path", "move"])
def test_results_with_several_states_have_plot_history_as_a_method(name, results):
    picture = results[name].plot_history("tip.z", probes=PROBES[0])
    wanted = ms.plot_history(results[name], "tip.z", probes=PROBES[0])
    assert picture._repr_png_(60) == wanted._repr_png_(60)


@pytest.mark.parametrize("name", ["cases", "path"])
def test_field_along_the_horizontal_axis_is_what_changes_of_it(name, results):
    axes = results[name].plot_history("tip.z", against="field", probes=PROBES[0]).figure.axes[0]
    assert axes.get_xlabel() == "applied_flux_density z [T]"
    ends = {"cases": [1e-3, 2e-3], "path": [1e-3, 3e-3]}[name]
    np.testing.assert_allclose(axes.lines[0].get_xdata()[[0, -1]], ends, rtol=1e-12)


def test_plot_history_of_one_equilibrium_names_the_table(results):
    with pytest.raises(
        ValueError, match=r"several states.*ms\.to_pandas\(result, probes=\.\.\.\) has the numbers"
    ):
        results["rest"].plot_history("tip.z", probes=PROBES[0])


def test_name_of_a_group_as_a_selection_is_told_how_to_be_given():
    with pytest.raises(ValueError, match=r"of must be .*mesh\.vertices_in\('LOADED'\)"):
        ms.Probe("tip", "LOADED")
    with pytest.raises(ValueError, match=r"a group of the mesh is mesh\.edges_in\('FIXED'\)"):
        ms.Clamp("FIXED")


def cases_in(fields, **more) -> ms.EquilibriumSet:
    solved = [ms.equilibrium(SCENE, **GIVEN, applied_flux_density=each, **more) for each in fields]
    return ms.EquilibriumSet(solved)


def test_field_on_a_line_has_a_sign_and_others_their_magnitude() -> None:
    line = cases_in([(-1e-3, 0, -1e-3), (0, 0, 0), (2e-3, 0, 2e-3)])
    axes = line.plot_history("bending_energy", against="field").figure.axes[0]
    assert "along its line" in axes.get_xlabel()
    np.testing.assert_allclose(
        axes.lines[0].get_xdata(), np.sqrt(2) * 1e-3 * np.array([-1, 0, 2]), atol=1e-15
    )
    curve = cases_in([(1e-3, 0, 0), (1e-3, 0, 1e-3), (0, 0, 3e-3)])
    axes = curve.plot_history("bending_energy", against="field").figure.axes[0]
    np.testing.assert_allclose(axes.lines[0].get_xdata(), [1e-3, np.sqrt(2) * 1e-3, 3e-3], rtol=1e-12)
    with pytest.raises(ValueError, match="the field turns and keeps its magnitude"):
        cases_in([(1e-3, 0, 0), (0, 0, 1e-3)]).plot_history("bending_energy", against="field")
    with pytest.raises(ValueError, match="needs a field that changes"):
        cases_in([(1e-3, 0, 0), (1e-3, 0, 0)]).plot_history("bending_energy", against="field")


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_factor_on_a_magnet_is_what_changes_of_its_field() -> None:
    magnet = ms.Dipoles([[0.05, 0.005, -0.05]], [[0.0, 0.0, 1.0]])
    scene = ms.Scene(SHEET, supports=[CLAMP], field=magnet, gravity=(0, 0, -9.81))
    path = ms.follow_path(scene, **GIVEN, start=ms.equilibrium(scene, **GIVEN, field_factor=0.0))
    axes = path.plot_history("tip.z", against="field", probes=PROBES[0]).figure.axes[0]
    assert axes.get_xlabel() == "field_factor [1]"
    np.testing.assert_allclose(axes.lines[0].get_xdata(), path.parameters, atol=1e-12)


@pytest.mark.parametrize("name", ["rest", "cases", "path", "move"])
def test_probes_are_field_data_of_a_series(name, results, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    pytest.importorskip("meshio")
    table = ms.to_pandas(results[name], probes=PROBES[:4])
    ms.write_series(tmp_path / "a.pvd", results[name], probes=PROBES[:4])
    files = sorted((tmp_path / "a").iterdir())
    assert len(files) == len(table)
    for file, (_, row) in zip(files, table.iterrows(), strict=True):
        found = pyvista.read(file).field_data
        for column in ("tip.z [m]", "hold.z [N]", "span [m]"):
            np.testing.assert_array_equal(found[column], [row[column]])
    again = ms.read_mesh(files[-1])
    assert again.n_faces == MESH.n_faces


def test_probes_of_a_series_need_a_result_and_its_own_states(results, tmp_path):
    with pytest.raises(ValueError, match="probes are of one result, got a TriangleMesh"):
        ms.write_series(tmp_path / "a.pvd", MESH, probes=PROBES[0])
    with pytest.raises(ValueError, match="leave out positions="):
        ms.write_series(
            tmp_path / "a.pvd", results["move"], positions=results["move"].positions, probes=PROBES[0]
        )
    with pytest.raises(ValueError, match="probes must be"):
        ms.write_series(tmp_path / "a.pvd", results["move"], probes="tip")
    assert list(tmp_path.iterdir()) == []


def test_points_between_vertices_are_interpolated_in_their_element() -> None:
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    rest = ms.equilibrium(ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81)))
    corners = mesh.faces[7]
    point = np.array([0.5, 0.3, 0.2]) @ mesh.rest_positions[corners]
    table = ms.to_pandas(
        rest, probes=[ms.Probe("p", points=point), ms.Probe("c", points=point, what="position")]
    )
    moved = np.array([0.5, 0.3, 0.2]) @ rest.displacements[corners]
    np.testing.assert_allclose([table[f"p.{a} [m]"][0] for a in "xyz"], moved, atol=1e-15)
    np.testing.assert_allclose([table[f"c.{a} [m]"][0] for a in "xyz"], point + moved, atol=1e-15)
    with pytest.raises(ValueError, match="lies outside every element"):
        ms.to_pandas(rest, probes=ms.Probe("off", points=(0.06, 0.0, 0.0)))
    with pytest.raises(ValueError, match="needs `of` or `points`, one of them"):
        ms.Probe("both", [0], points=point)


def test_stresses_of_a_pulled_strip_and_block_are_the_applied_ones() -> None:
    """Pull a shell and a solid without contraction: the stress is E times a small strain, along x alone."""
    pull = 1e-7
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    block = ms.Solid(
        ms.meshes.box((0.02, 0.01, 0.01), cells=(2, 1, 1)),
        material=ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=0.0),
    )
    for body in (sheet, block):
        ends = [body.mesh.vertices_at(x=x) for x in (0.0, 0.02)]
        held = [ms.Pin(ends[0]), ms.Pin(ends[1], displacement=(pull, 0, 0))]
        rest = ms.equilibrium(ms.Scene(body, supports=held), solver=ms.MixedNewton(tolerance=1e-12))
        inside = (0.012, 0.004, 0.0)
        probes = [
            ms.Probe("s", ends[1], "stress"),
            ms.Probe("v", points=inside, what="von_mises_stress", body=body),
        ]
        table = ms.to_pandas(rest, probes=probes)
        stress = 1e6 * pull / 0.02
        np.testing.assert_allclose(table["s.xx [Pa]"][0], stress, rtol=1e-4)
        np.testing.assert_allclose(table["v [Pa]"][0], stress, rtol=1e-4)
        assert abs(table["s.xy [Pa]"][0]) < 1e-6 * stress
