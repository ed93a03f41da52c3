"""Several shells in one scene: each as if alone, and results of each and of all."""

import copy
import pickle

import numpy as np
import pytest
from crossed_cells import crossed
from two_strips import FAR, STRONG, strip

import magshell as ms
from benchmarks.cases import magnetic_strip
from benchmarks.cases.magnetic_strip import LENGTH, WIDTH
from magshell import obstacles as ob
from magshell.output.results.state import states_of

EXACT = {"solver": ms.MixedNewton(tolerance=1e-12)}


def parts_of(sheet, body=None):
    """Return the supports and loads of one sheet."""
    mesh = sheet.mesh
    free = mesh.edges_at(x=0.1)
    return {
        "supports": [ms.Clamp(mesh.edges_at(x=0.0), rotation=(0, 0.1, 0), body=body)],
        "loads": [
            ms.PointLoad([mesh.n_vertices - 1], (0, 1e-5, 2e-5), body=body),
            ms.EdgeLoad(free, (0, 0, 1e-3), body=body),
            ms.EdgeCouple(free, 1e-6, body=body),
            ms.AreaLoad((0, 0, 1e-2), body=body),
        ],
    }


def scene_of(*sheets):
    named = [parts_of(sheet, sheet if len(sheets) > 1 else None) for sheet in sheets]
    return ms.Scene(
        list(sheets) if len(sheets) > 1 else sheets[0],
        supports=[each for part in named for each in part["supports"]],
        loads=[each for part in named for each in part["loads"]],
        field=[ms.UniformField(), ms.Dipoles([[0.05, 0.2, -0.3]], [[0.2, 0.1, 0.5]])],
        gravity=(0, 0.3, -1.0),
    )


@pytest.fixture(scope="module")
def pair():
    sheets = strip(0), strip(1, cells=(7, 3))
    return sheets, scene_of(*sheets), [scene_of(sheet) for sheet in sheets]


def symmetric(hessian):
    """Return the dense matrix of all unknowns from its lower triangle."""
    size, starts, rows, values = hessian
    lower = np.zeros((size, size))
    lower[rows, np.repeat(np.arange(size), np.diff(starts))] = values
    return lower + np.tril(lower, -1).T


def unknowns(model, vertices=slice(None), edges=slice(None)):
    """Return the indices of these vertices and edges among all unknowns of the core."""
    numbers = np.arange(1.0, model.size + 1.0)
    found = [model.positions(numbers)[vertices].ravel(), model.edge_rotations(numbers)[edges]]
    found = np.concatenate(found).astype(int)
    return found[found > 0] - 1


def test_vertices_edges_and_faces_are_those_of_one_body_after_another(pair):
    sheets, scene, _ = pair
    n_v, n_f = sheets[0].mesh.n_vertices, sheets[0].mesh.n_faces
    edges = np.concatenate([sheets[0].mesh.edges, sheets[1].mesh.edges + n_v])
    assert scene.bodies == sheets
    np.testing.assert_array_equal(scene.mesh.edges, edges)
    np.testing.assert_array_equal(scene.mesh.faces[n_f:], sheets[1].mesh.faces + n_v)
    for sheet, part in zip(sheets, scene._bodies.spans, strict=True):
        np.testing.assert_array_equal(scene.mesh.rest_positions[part.vertices], sheet.mesh.rest_positions)
        np.testing.assert_array_equal(scene.mesh.edge_lengths[part.edges], sheet.mesh.edge_lengths)
        np.testing.assert_array_equal(scene.mesh.face_normals[part.faces], sheet.mesh.face_normals)


def test_a_state_has_the_bits_of_two_scenes(pair, rng):
    """Compare energy by term, gradient and Hessian: neither sheet affects the other."""
    sheets, scene, alone = pair
    moved = [s.mesh.rest_positions + 1e-4 * rng.standard_normal((s.mesh.n_vertices, 3)) for s in sheets]
    turned = [1e-2 * rng.standard_normal(s.mesh.n_edges) for s in sheets]
    given = {"field_factor": 0.7, "load_factor": 0.6, "gravity_factor": 0.8, "applied_flux_density": STRONG}
    layout = scene._load_parameter_layout
    load_parameters = layout.packed({("scene", name): each for name, each in given.items()}, layout.zeros())
    state = scene._model.state(np.concatenate(moved), np.concatenate(turned))
    gradient = scene._model.gradient(state, load_parameters)
    hessian = symmetric(scene._model.hessian(state, load_parameters, reduced=False))
    energies = dict.fromkeys(scene._model.term_names, 0.0)
    places = []
    for one, part, x, phi in zip(alone, scene._bodies.spans, moved, turned, strict=True):
        own = one._model.state(x, phi)
        here, there = unknowns(scene._model, part.vertices, part.edges), unknowns(one._model)
        np.testing.assert_array_equal(gradient[here], one._model.gradient(own, load_parameters)[there])
        matrix = symmetric(one._model.hessian(own, load_parameters, reduced=False))
        np.testing.assert_array_equal(hessian[np.ix_(here, here)], matrix[np.ix_(there, there)])
        for name, value in one._model.energies(own, load_parameters).items():
            energies[name] += value
        places.append(here)
    assert not hessian[np.ix_(*places)].any()
    elastic = {name: energies[name] for name in ("membrane", "bending", "magnetic")}
    found = scene._model.energies(state, load_parameters)
    assert {name: found[name] for name in elastic} == elastic
    assert found == pytest.approx(energies, rel=1e-12)  # dead loads are summed over all vertices


def test_equilibria_are_those_of_two_scenes(pair):
    sheets, scene, alone = pair
    both = ms.equilibrium(scene, applied_flux_density=STRONG, **EXACT)
    assert both.stable and both.positions.shape == (scene.mesh.n_vertices, 3)
    for sheet, one in zip(sheets, alone, strict=True):
        single = ms.equilibrium(one, applied_flux_density=STRONG, **EXACT)
        moved = np.abs(single.displacements).max()
        assert moved > 1e-3
        part = both[sheet]
        np.testing.assert_allclose(part.positions, single.positions, rtol=0, atol=1e-8 * moved)
        np.testing.assert_allclose(part.edge_rotations, single.edge_rotations, rtol=0, atol=1e-7)
        np.testing.assert_array_equal(part.displacements, part.positions - sheet.mesh.rest_positions)
        np.testing.assert_array_equal(part.remanent_magnetization, single.remanent_magnetization)
        assert part.mesh is sheet.mesh and part.body is sheet


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.ImplicitEuler()], ids=["tr_bdf2", "euler"])
def test_motions_are_those_of_two_scenes(pair, integrator):
    sheets, scene, alone = pair
    how = {"steps": 12, "time_step": 4e-3, "integrator": integrator, "stiffness_damping": 1e-3, **EXACT}
    how |= {"applied_flux_density": STRONG, "maxwell_modulus": 0.3, "maxwell_time": 0.01, "progress": False}
    both = ms.simulate(scene, **how)
    singles = [ms.simulate(one, **how) for one in alone]
    for sheet, single in zip(sheets, singles, strict=True):
        moved = np.abs(single.displacements).max()
        assert moved > 1e-3
        np.testing.assert_allclose(both[sheet].positions, single.positions, rtol=0, atol=1e-8 * moved)
        fastest = np.abs(single.velocities).max()
        np.testing.assert_allclose(both[sheet].velocities, single.velocities, rtol=0, atol=1e-7 * fastest)
    for name, energy in both.energies.items():
        assert energy.shape == (len(both),)
        np.testing.assert_allclose(
            energy, sum(single.energies[name] for single in singles), rtol=0, atol=1e-12
        )
    np.testing.assert_allclose(
        both.kinetic_energy, sum(s.kinetic_energy for s in singles), rtol=1e-6, atol=1e-15
    )


def test_magnetization_may_be_given_three_ways(pair):
    """Check values for all at once, body by body, and of the bodies; tensors stay in their graph."""
    torch = pytest.importorskip("torch")
    sheets, scene, _ = pair
    own = ms.equilibrium(scene, applied_flux_density=STRONG, **EXACT)
    rows = [np.broadcast_to(s.remanent_magnetization, (s.mesh.n_faces, 3)) for s in sheets]
    at_once = ms.equilibrium(
        scene, applied_flux_density=STRONG, remanent_magnetization=np.concatenate(rows), **EXACT
    )
    np.testing.assert_array_equal(at_once.positions, own.positions)
    tensors = [torch.tensor(np.array(each), requires_grad=True) for each in ((2e4, 1e3, 0.0), rows[1])]
    values = {s: {"remanent_magnetization": m} for s, m in zip(sheets, tensors, strict=True)}
    by_body = ms.equilibrium(scene, applied_flux_density=STRONG, values=values, **EXACT)
    np.testing.assert_array_equal(by_body.positions.detach(), own.positions)
    np.testing.assert_array_equal(by_body.remanent_magnetization.detach(), np.concatenate(rows))
    by_body[sheets[0]].remanent_magnetization.sum().backward()
    np.testing.assert_array_equal(tensors[0].grad, np.full(3, sheets[0].mesh.n_faces))
    one_for_all = ms.equilibrium(scene, applied_flux_density=STRONG, remanent_magnetization=(1e4, 0, 0))
    assert np.shape(one_for_all[sheets[1]].remanent_magnetization) == (3,)


def test_a_gradient_of_one_body_is_by_its_own_values(pair):
    torch = pytest.importorskip("torch")
    sheets, scene, _ = pair
    by = [torch.tensor(np.array(s.thickness), requires_grad=True) for s in sheets]
    values = {s: {"thickness": h} for s, h in zip(sheets, by, strict=True)}
    rest = ms.equilibrium(scene, applied_flux_density=STRONG, values=values, **EXACT)
    rest[sheets[1]].positions[:, 2].sum().backward()
    assert by[0].grad.abs().max() < 1e-10 * by[1].grad.abs().max()


def test_solves_of_every_kind_take_several_sheets(pair, tmp_path):
    torch = pytest.importorskip("torch")
    sheets, scene, alone = pair
    n_v = scene.mesh.n_vertices
    cases = ms.equilibrium(scene, applied_flux_density=[STRONG, -STRONG])
    assert cases[sheets[1]].positions.shape == (2, sheets[1].mesh.n_vertices, 3)
    warm = ms.WarmStart(scene)
    for strength in (1.0, 1.02):
        magnetized = torch.tensor((2e4 * strength, 0, 0), dtype=torch.float64)
        values = {sheets[0]: {"remanent_magnetization": magnetized}}
        rest = warm(applied_flux_density=STRONG, values=values)
    again = ms.WarmStart(scene)
    again.load_state_dict(warm.state_dict())
    np.testing.assert_array_equal(again.equilibria.positions, rest.positions)
    modes = ms.vibration_modes(scene, count=6)
    single = np.concatenate([ms.vibration_modes(one, count=6).frequencies for one in alone])
    np.testing.assert_allclose(modes.frequencies, np.sort(single)[:6], rtol=1e-8)
    linear = ms.linear_response(scene, applied_flux_density=1e-3 * STRONG)
    assert linear.displacements.shape == (n_v, 3)
    path = ms.follow_path(scene, applied_flux_density=STRONG, max_step=0.1, progress=False)
    assert path.positions.shape == (len(path), n_v, 3) and path.parameters[-1] >= 1.0
    assert ms.linear_buckling(compressed_strips(), modes=2).factors == pytest.approx(
        sorted([*(ms.linear_buckling(compressed_strips(k)).factors[0] for k in (0, 1))]), rel=1e-6
    )


def compressed_strips(*which):
    """Return a scene of strips compressed along their length, one buckling at about half the load of the other."""
    sheets = [strip(0, bending="midedge"), strip(1, bending="midedge")]
    chosen = [sheets[k] for k in which or (0, 1)]
    body = {id(s): s if len(chosen) > 1 else None for s in chosen}
    return ms.Scene(
        chosen,
        supports=[ms.Clamp(s.mesh.edges_at(x=0.0), body=body[id(s)]) for s in chosen],
        loads=[ms.EdgeLoad(s.mesh.edges_at(x=0.1), (-1, 0, 0), body=body[id(s)]) for s in chosen],
    )


def test_pictures_films_pages_and_files_contain_all_sheets(pair, tmp_path):
    _, scene, _ = pair
    rest = ms.equilibrium(scene, applied_flux_density=STRONG)
    state = states_of(rest)[0]
    np.testing.assert_array_equal(state.remanent_magnetization, rest.remanent_magnetization)
    np.testing.assert_array_equal(states_of(scene)[0].remanent_magnetization, rest.remanent_magnetization)
    ms.plot(rest).save(tmp_path / "rest.png")
    ms.write_page(rest, tmp_path / "rest.html")
    move = ms.simulate(
        scene, steps=3, time_step=5e-3, applied_flux_density=STRONG, record_every=1, progress=False
    )
    ms.animate(move, tmp_path / "move.gif", width=400, fps=10, speed=0.05, progress=False)
    pytest.importorskip("meshio")
    ms.write_series(tmp_path / "move.pvd", move, progress=False)
    mesh = ms.read_mesh(tmp_path / "move" / "move_3.vtu")
    assert mesh.n_components == 2 and mesh.n_faces == scene.mesh.n_faces


def test_contacts_and_symmetry_planes_hold_all_bodies_or_one():
    sheets = [strip(k, remanent_magnetization=None) for k in (0, 1)]
    floor = ob.Plane(center=(0, 0, -1e-3))

    def dropped(bodies, **contact):
        scene = ms.Scene(
            bodies,
            contacts=[ms.Contact(floor, **contact)],
            gravity=(0, 0, -9.81),
            allow_rigid_motions=True,
        )
        return ms.simulate(scene, steps=40, time_step=1e-3, progress=False)

    both = dropped(sheets, friction_coefficient=0.5)
    for sheet in sheets:
        assert abs(both[sheet].positions[-1, :, 2] + 1e-3).max() < 1e-4
    one = dropped(sheets, body=sheets[1])
    assert one[sheets[0]].positions[-1, :, 2].max() < -5e-3
    assert abs(one[sheets[1]].positions[-1, :, 2] + 1e-3).max() < 1e-4
    some = dropped(sheets, vertices=np.arange(sheets[1].mesh.n_vertices), body=sheets[1])
    np.testing.assert_allclose(some.positions, one.positions, atol=1e-9)
    held = [ms.SymmetryPlane((1, 0, 0))]
    assert len(ms.Scene(sheets, supports=held, allow_rigid_motions=True)._constraints.held_nodes) > len(
        ms.Scene(
            sheets, supports=[ms.SymmetryPlane((1, 0, 0), body=sheets[0])], allow_rigid_motions=True
        )._constraints.held_nodes
    )


def test_thin_sheet_inside_an_obstacle_is_named_beside_a_thick_one():
    thick, thin = strip(0, thickness=8e-3), strip(1, thickness=1e-3)
    floor = ms.Contact(ob.Plane(center=(0, 0, 1e-3)))
    scene = ms.Scene([thick, thin], contacts=[floor], gravity=(0, 0, -1), allow_rigid_motions=True)
    with pytest.raises(ValueError, match="starts inside"):
        ms.equilibrium(scene, remanent_magnetization=None)


@pytest.mark.parametrize(
    "duplicate",
    [copy.copy, copy.deepcopy, lambda scene: pickle.loads(pickle.dumps(scene))],
    ids=["copy", "deepcopy", "pickle"],
)
def test_copies_keep_the_body_of_supports_and_loads(pair, duplicate):
    _, scene, _ = pair
    twin = duplicate(scene)
    assert repr(twin) == repr(scene)
    assert [each.body for each in (*twin.supports, *twin.loads)].count(twin.bodies[1]) == 5
    first, second = (ms.equilibrium(each, applied_flux_density=STRONG).positions for each in (scene, twin))
    np.testing.assert_array_equal(first, second)


def test_replaced_values_stay_with_their_body(pair):
    sheets, scene, alone = pair
    clamp, load = scene.supports[1], scene.loads[4]
    assert clamp.body is sheets[1] and load.body is sheets[1]
    values = {clamp: {"rotation": (0, 0.2, 0)}, load: {"force": (0, 0, 5e-5)}}
    both = ms.equilibrium(scene, applied_flux_density=STRONG, values=values, **EXACT)
    own = {alone[1].supports[0]: {"rotation": (0, 0.2, 0)}, alone[1].loads[0]: {"force": (0, 0, 5e-5)}}
    single = ms.equilibrium(alone[1], applied_flux_density=STRONG, values=own, **EXACT)
    np.testing.assert_allclose(both[sheets[1]].positions, single.positions, rtol=0, atol=1e-10)


def test_free_motions_of_each_body_are_named():
    sheets = [strip(k, remanent_magnetization=None) for k in (0, 1)]
    with pytest.raises(ValueError, match="of part 1"):
        ms.Scene(sheets, supports=[ms.Clamp(sheets[0].mesh.edges_at(x=0.0), body=sheets[0])])


def test_strains_are_those_of_each_sheet(pair):
    _, scene, alone = pair
    both = ms.equilibrium(scene, applied_flux_density=STRONG, **EXACT)
    move = ms.simulate(scene, steps=2, time_step=4e-3, applied_flux_density=STRONG, progress=False)
    for one, part in zip(alone, scene._bodies.spans, strict=True):
        single = ms.equilibrium(one, applied_flux_density=STRONG, **EXACT)
        np.testing.assert_allclose(
            both.strains().bending[part.faces], single.strains().bending, rtol=0, atol=1e-8
        )
        own = ms.simulate(one, steps=2, time_step=4e-3, applied_flux_density=STRONG, progress=False)
        np.testing.assert_allclose(
            move.strains().bending[part.faces], own.strains().bending, rtol=0, atol=1e-8
        )
    assert len(both.self_intersections()) == 0


def test_obtuse_faces_of_the_second_sheet_are_named_by_their_number_in_the_scene():
    good = magnetic_strip.scene(ms.meshes.rectangle(LENGTH, WIDTH, cells=(40, 4)), "midedge").shell
    capped = crossed(LENGTH, WIDTH, (40, 4), [0.01, 0.5, 0.5, 0.5]).transformed(translation=(0, FAR, 0))
    bad = magnetic_strip.scene(capped, "midedge").shell
    held = [ms.Clamp(each.mesh.edges_at(x=0.0), body=each) for each in (good, bad)]
    scene = ms.Scene([good, bad], supports=held, field=ms.UniformField())
    with pytest.warns(ms.MeshQualityWarning, match="this equilibrium cannot be trusted") as told:
        ms.equilibrium(scene, **magnetic_strip.load_parameters(1.0, (0.0, 0.0, 1.0)))
    named = int(str(told[0].message).split("among them ")[1].split()[0])
    assert np.degrees(scene.mesh.quality.largest_angles[named]) > 177


def test_failure_messages_consider_all_sheets(pair):
    _, scene, _ = pair
    solver = ms.MixedNewton(max_iterations=1, max_relaxation_steps=1)
    with pytest.raises(ms.NotConverged, match="out of balance most at") as told:
        ms.equilibrium(scene, applied_flux_density=50 * STRONG, solver=solver)
    assert told.value.last_good.positions.shape == (scene.mesh.n_vertices, 3)
