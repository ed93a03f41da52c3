"""Energies that users write in torch: against built-in ones, in every solve, and what is refused."""

import copy
import pickle
import threading

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.02, 0.01, cells=(6, 3))
TIP = MESH.nearest_vertex((0.02, 0, 0))
EXACT = {"solver": ms.MixedNewton(tolerance=1e-13)}


def area(x, tension):
    return 0.5 * tension * torch.sqrt(torch.linalg.cross(x[1] - x[0], x[2] - x[0]).square().sum())


def spring(x, stiffness, length):
    return 0.5 * stiffness * (torch.sqrt((x[1] - x[0]).square().sum()) - length) ** 2


def pulled_strip(*loads, thickness=2e-4, softness=1.0, **options):
    """Return a scene of a strip bent by a load, so that no part of it lies in a plane."""
    sheet = ms.Shell(
        MESH, thickness=thickness, young_modulus=1e6 / softness, poisson_ratio=0.3, mass_density=1e3
    )
    force = ms.PointLoad(TIP, np.array((0, 1e-5, 2e-5)) / softness)
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=[force, *loads], **options)


def films(**options):
    """Return scenes with the built-in surface tension and with the same written in torch."""
    faces = np.arange(4, 20)
    tension = np.linspace(0.01, 0.03, len(faces))
    own = ms.CustomEnergy(area, of=MESH.faces[faces], values={"tension": tension}, is_load=True)
    return pulled_strip(ms.SurfaceTension(tension, faces=faces), **options), pulled_strip(own, **options)


def strings():
    """Return springs from the free end of the strip to its clamped one."""
    ends = np.stack([MESH.vertices_at(x=0.0), MESH.vertices_at(x=0.02)], axis=1)
    return ms.CustomEnergy(spring, of=ends, values={"stiffness": 0.5, "length": 0.019})


def apart(one, other):
    return np.abs(one - other).max() / np.abs(one).max()


def test_equilibrium_with_own_surface_tension_is_the_built_in_one():
    built_in, own = films(thickness=1e-3, softness=1e3)  # in which the films are strong
    rest, found = (ms.equilibrium(each, load_factor=0.8, **EXACT) for each in (built_in, own))
    assert apart(rest.positions, found.positions) < 1e-12
    bare = ms.equilibrium(pulled_strip(thickness=1e-3, softness=1e3), load_factor=0.8)
    assert apart(rest.positions, bare.positions) > 1e-3
    assert found.energies["area"] == pytest.approx(rest.energies["surface tension"], rel=1e-12)


def test_hessian_forces_and_energy_of_own_surface_tension_are_the_built_in_ones():
    built_in, own = films(thickness=1e-6, softness=1e3)  # almost nothing but the films
    there = MESH.rest_positions + 1e-4 * np.random.default_rng(0).normal(size=(MESH.n_vertices, 3))
    hessians = [ms.hessian(each, there, load_factor=0.7) for each in (built_in, own)]
    assert abs(hessians[0] - hessians[1]).max() < 1e-12 * abs(hessians[0]).max()
    forces = [ms.forces(each, there, load_factor=0.7).on_vertices for each in (built_in, own)]
    assert apart(*forces) < 1e-12
    energies = [ms.energy(each, there, load_factor=0.7) for each in (built_in, own)]
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)


def test_motion_with_own_surface_tension_is_the_built_in_one():
    given = {"steps": 4, "time_step": 2e-3, "progress": False, **EXACT}
    moves = [ms.simulate(each, **given) for each in films()]
    assert apart(*(each.positions for each in moves)) < 1e-12
    assert apart(moves[0].energies["surface tension"], moves[1].energies["area"]) < 1e-12


def test_path_with_own_surface_tension_is_the_built_in_one():
    paths = [ms.follow_path(each, progress=False) for each in films()]
    assert (
        apart(*(each.positions[-1] for each in paths)) < 1e-9
    )  # its steps end where the tolerance lets them


def test_gradients_through_own_surface_tension_are_the_built_in_ones():
    by = []
    for scene, name in zip(films(), ("surface_tension", "tension"), strict=True):
        tension = torch.tensor(np.linspace(0.01, 0.03, 16), requires_grad=True)
        rest = ms.equilibrium(scene, values={scene.loads[1]: {name: tension}}, **EXACT)
        rest.positions[-1].sum().backward()
        by.append(tension.grad.numpy())
    assert apart(*by) < 1e-6  # the factorizations are those of the last iterations, not of the same states


def test_spring_acts_as_point_loads_of_its_force():
    own = strings()
    rest = ms.equilibrium(pulled_strip(own, thickness=1e-3), **EXACT)  # thin strips buckle
    start, end = rest.positions[own.of[:, 0]], rest.positions[own.of[:, 1]]
    lengths = np.linalg.norm(end - start, axis=1)
    assert rest.energies["spring"] == pytest.approx(0.25 * ((lengths - 0.019) ** 2).sum(), rel=1e-12)
    pull = 0.5 * ((lengths - 0.019) / lengths)[:, None] * (start - end)
    again = ms.equilibrium(pulled_strip(ms.PointLoad(own.of[:, 1], pull), thickness=1e-3), **EXACT)
    assert np.abs(rest.positions - again.positions).max() < 1e-10 * 0.02


def test_spring_between_two_bodies_pulls_both():
    above = MESH.transformed(translation=(0, 0, 0.01))
    sheets = [ms.Shell(each, thickness=2e-4, young_modulus=1e6) for each in (MESH, above)]
    tie = ms.CustomEnergy(spring, of=[TIP, TIP + MESH.n_vertices], values={"stiffness": 0.1, "length": 0.005})
    held = [ms.Clamp(each.mesh.edges_at(x=0.0), body=each) for each in sheets]
    rest = ms.equilibrium(ms.Scene(sheets, supports=held, loads=[tie]))
    lift, drop = rest[sheets[0]].displacements[TIP, 2], rest[sheets[1]].displacements[TIP, 2]
    assert lift > 1e-4 and lift == pytest.approx(-drop, rel=1e-9)


def test_energy_of_vertices_that_are_welded_counts_both():
    """Check a spring across a weld, which joins a vertex with its neighbour, as the other name of the vertex does."""
    right = MESH.transformed(translation=(0.02, 0, 0))
    sheets = [ms.Shell(each, thickness=2e-4, young_modulus=1e6) for each in (MESH, right)]
    seam = MESH.n_vertices + right.nearest_vertex((0.02, 0, 0))
    ends = [[TIP, 0], [seam, 0], [TIP, seam]]  # the last one has no length: the two are one vertex
    squared = ms.CustomEnergy(lambda x, k: k * (x[1] - x[0]).square().sum(), of=ends, values={"k": 0.1})
    held = [ms.Clamp(MESH.edges_at(x=0.0), body=sheets[0])]
    scene = ms.Scene(sheets, ties=[ms.Tie(*sheets)], supports=held, loads=[squared])
    rest = ms.equilibrium(scene)
    assert rest.energies["custom"] == pytest.approx(
        0.2 * ((rest.positions[TIP] - rest.positions[0]) ** 2).sum(), rel=1e-12
    )


def test_barrier_contact_and_a_pushing_spring_find_an_equilibrium():
    """Use a spring under pressure: across it the stiffness is negative, which the projected Hessian leaves out."""
    above = MESH.transformed(translation=(0, 0, 1e-3))
    sheets = [ms.Shell(each, thickness=t, young_modulus=1e6) for each, t in ((MESH, 1e-3), (above, 3e-4))]
    pushed = ms.CustomEnergy(spring, of=[0, TIP], values={"stiffness": 5.0, "length": 0.03}, body=sheets[1])
    held = [ms.Clamp(each.mesh.edges_at(x=0.0), body=each) for each in sheets]
    loads = [pushed, ms.AreaLoad((0, 0, -2.0), body=sheets[1])]
    rest = ms.equilibrium(ms.Scene(sheets, supports=held, loads=loads, contacts=[ms.Contact(*sheets)]))
    assert rest.stable
    found = ms.forces(rest.scene, rest.positions, edge_rotations=rest.edge_rotations).on_vertices
    free = MESH.rest_positions[:, 0] > 0.0
    size = np.abs(ms.hessian(rest.scene, rest.positions, edge_rotations=rest.edge_rotations)).max()
    assert np.abs(found[np.tile(free, 2)]).max() < 1e-9 * size * 0.02


def test_vibrations_at_rest_know_springs_and_refuse_those_that_pull():
    ends = np.stack([MESH.vertices_at(x=0.0), MESH.vertices_at(x=0.02)], axis=1)
    relaxed = ms.CustomEnergy(spring, of=ends, values={"stiffness": 0.5, "length": 0.02})
    lateral = ms.CustomEnergy(lambda x: 0.5 * (x[:, 2] ** 2).sum(), of=[TIP], name="soft foundation")
    sheet = ms.Shell(MESH, thickness=2e-4, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    held = {"supports": [ms.Clamp(MESH.edges_at(x=0.0))]}
    bare, stiff = (
        ms.vibration_modes(ms.Scene(sheet, **held, loads=each), count=1).frequencies[0]
        for each in ([], [relaxed, lateral])
    )
    assert stiff > 1.1 * bare
    scene = ms.Scene(sheet, **held, loads=[strings()])
    with pytest.raises(ValueError, match=r"CustomEnergy\(spring, .* pulls at the rest shape"):
        ms.vibration_modes(scene)
    assert ms.vibration_modes(scene, ms.equilibrium(scene), count=1).frequencies[0] > 0.0


def test_values_change_in_time():
    own = strings()
    given = {"steps": 3, "time_step": 2e-3, "progress": False}
    scene = pulled_strip(own)
    always = ms.simulate(scene, values={own: {"stiffness": 0.0}}, **given)
    later = ms.simulate(scene, values={own: {"stiffness": np.array([0.0, 0.0, 0.5, 0.5])}}, **given)
    assert np.array_equal(always.positions[1], later.positions[1])
    assert apart(always.positions[3], later.positions[3]) > 1e-6
    with pytest.raises(ValueError, match="stiffness"):
        ms.simulate(scene, values={own: {"stiffness": np.zeros((4, 2))}}, **given)


def test_transforms_of_torch_go_through():
    own = strings()
    scene = pulled_strip(own)

    def lift(stiffness):
        return ms.equilibrium(scene, values={own: {"stiffness": stiffness}}, **EXACT).positions[TIP, 2]

    stiffness = torch.tensor(0.4, dtype=torch.float64)
    forward = torch.func.jvp(lift, (stiffness,), (torch.ones_like(stiffness),))[1]
    backward = torch.func.grad(lift)(stiffness)
    slope = (float(lift(stiffness + 1e-3)) - float(lift(stiffness - 1e-3))) / 2e-3
    assert float(forward) == pytest.approx(float(backward), rel=1e-8)
    assert float(backward) == pytest.approx(slope, rel=1e-4)
    with torch.inference_mode():
        assert float(lift(stiffness)) == pytest.approx(float(lift(stiffness.clone())), rel=1e-12)


def test_derivatives_of_energies_at_positions_know_it():
    own = strings()
    scene = pulled_strip(own)
    x = torch.tensor(MESH.rest_positions * (1.01, 1, 1), requires_grad=True)
    stiffness = torch.tensor(0.5, dtype=torch.float64, requires_grad=True)
    energy = ms.energy(scene, x, values={own: {"stiffness": stiffness}})
    by_x, by_stiffness = torch.autograd.grad(energy, (x, stiffness), create_graph=True)
    start, end = (x.detach().numpy()[own.of[:, k]] for k in (0, 1))
    stretch = np.linalg.norm(end - start, axis=1) - 0.019
    assert by_stiffness.item() == pytest.approx(0.5 * (stretch**2).sum(), rel=1e-8)
    (mixed,) = torch.autograd.grad(by_x[own.of[0, 1], 0], stiffness)
    assert float(mixed) == pytest.approx(stretch[0], rel=1e-6)


def test_solves_in_several_threads_give_what_each_gives_alone():
    scenes = [pulled_strip(strings()) for _ in range(3)]
    loads = np.linspace(0.5, 1.5, 6)
    alone = [ms.equilibrium(scenes[0], load_factor=each).positions for each in loads]
    found = {}

    def run(k):
        found[k] = ms.equilibrium(scenes[k % 3], load_factor=loads[k]).positions

    threads = [threading.Thread(target=run, args=(k,)) for k in range(len(loads))]
    for each in threads:
        each.start()
    for each in threads:
        each.join(timeout=60)
    assert all(np.array_equal(found[k], alone[k]) for k in range(len(loads)))


def test_copies_and_pickles_act_as_the_original():
    scene = pulled_strip(strings())
    rest = ms.equilibrium(scene)
    for twin in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert np.array_equal(ms.equilibrium(twin).positions, rest.positions)


def test_saved_result_is_recognized_by_its_function_and_refused_without_a_digest(tmp_path):
    scene = pulled_strip(strings())
    rest = ms.equilibrium(scene)
    ms.save(tmp_path / "rest.npz", rest)
    assert np.array_equal(ms.load(tmp_path / "rest.npz", pulled_strip(strings())).positions, rest.positions)
    other = ms.CustomEnergy(area, of=MESH.faces, values={"tension": 0.0})
    with pytest.raises(ValueError, match=r"another scene: loads\[1\] differ"):
        ms.load(tmp_path / "rest.npz", pulled_strip(other))
    lock = threading.Lock()

    def locked(x):
        with lock:
            return x.square().sum()

    rest = ms.equilibrium(pulled_strip(ms.CustomEnergy(locked, of=[TIP])))
    with pytest.raises(ValueError, match=r"but loads\[1\], CustomEnergy\(locked, .* has no digest"):
        ms.save(tmp_path / "locked.npz", rest)


def test_energy_without_a_value_away_from_rest_is_named():
    """Use a logarithm that has no value beyond a height, and starts beyond it."""

    def ceiling(x):
        return -1e-12 * torch.log(1e-4 - x[0, 2])

    scene = pulled_strip(ms.CustomEnergy(ceiling, of=[TIP]))
    lifted = np.array(MESH.rest_positions)
    lifted[:, 2] = 0.5 * lifted[:, 0] ** 2
    with pytest.raises(ValueError, match=rf"'ceiling' is not finite in group 0 \(vertices {TIP}\)"):
        ms.energies(scene, lifted)
    with pytest.raises(ms.NotConverged, match="energy 'ceiling' is not finite in group 0"):
        ms.equilibrium(scene, start=lifted)
    with pytest.raises(ms.NotConverged, match="energy 'ceiling' is not finite in group 0"):
        ms.simulate(scene, start=lifted, steps=1, time_step=1e-3, progress=False)


def test_exception_of_the_function_reaches_the_caller():
    calls = []

    def broken(x):
        calls.append(0)
        if len(calls) > stop_at:
            raise ZeroDivisionError("the spring is off")
        return x.square().sum()

    stop_at = 10**9
    scene = pulled_strip(ms.CustomEnergy(broken, of=[TIP]))
    for more in range(6):
        stop_at = len(calls) + more
        with pytest.raises(ZeroDivisionError, match="the spring is off"):
            ms.equilibrium(scene)
    stop_at = 10**9
    assert ms.equilibrium(scene).stable


def test_interrupt_in_the_function_ends_the_solve():
    calls = []

    def slow(x):
        calls.append(0)
        if len(calls) == stop_at:
            raise KeyboardInterrupt
        return x.square().sum()

    stop_at = 0
    scene = pulled_strip(ms.CustomEnergy(slow, of=[TIP]))
    for more in (1, 3, 5):
        stop_at = len(calls) + more
        with pytest.raises(ms.Interrupted):
            ms.equilibrium(scene)
    assert ms.equilibrium(scene).stable


def test_a_function_that_changes_its_answer_is_refused():
    calls = []

    def drifting(x):
        calls.append(0)
        return (1.0 + 1e-6 * (len(calls) > first) * len(calls)) * x.square().sum()

    first = 0
    with pytest.raises(ValueError, match="'drifting' changes its answer for the same input"):
        pulled_strip(ms.CustomEnergy(drifting, of=[TIP]))
    first = 10**9
    scene = pulled_strip(ms.CustomEnergy(drifting, of=[TIP]))
    first = 0
    with pytest.raises(ValueError, match="'drifting' changes its answer for the same input"):
        ms.equilibrium(scene)


def detached(x, k):
    return k * (x[0, 0].detach() * x[0, 1] + x[0, 0] ** 2)


def deaf(x, k):
    return k.detach() * x.square().sum()


@pytest.mark.parametrize(("function", "by"), [(detached, "positions"), (deaf, "values")])
def test_a_derivative_that_torch_does_not_see_is_refused(function, by):
    with pytest.raises(ValueError, match=f"has a derivative by its {by} that torch does not see"):
        pulled_strip(ms.CustomEnergy(function, of=[TIP], values={"k": 2.0}))


REFUSED = {
    "no function": ({"function": 3.0}, "function must be a function of positions"),
    "no number": ({"function": lambda x: x.sum().item() * 0.0}, "item"),
    "an array": (
        {"function": lambda x: x},
        r"must return one float64 number, .* got torch.float64 of shape \(1, 3\)",
    ),
    "a float": ({"function": lambda x: 1.0}, "must return a torch tensor, .* got float"),
    "single precision": ({"function": lambda x: x.sum().float()}, "one float64 number, .* got torch.float32"),
    "not finite": (
        {"function": lambda x: x.sum() * torch.nan},
        "energy 'custom' is not finite at rest in group 0",
    ),
    "singular": (
        {"function": lambda x: torch.sqrt(x[0, 2])},
        "gradient of the energy 'custom' is not finite at rest",
    ),
    "no vertices": ({"of": []}, "of are empty|of must be"),
    "floats": ({"of": [0.5, 1.0]}, "of must be vertices .* integers, got float64"),
    "a vertex too many": ({"of": [0, 28]}, r"vertices of the scene, numbers in \[0, 28\), got 28"),
    "a negative vertex": ({"of": [0, -1]}, r"numbers in \[0, 28\), got -1"),
    "a vertex twice": (
        {"of": [[0, 1], [2, 2]]},
        "must not repeat a vertex in a group, but group 1 has 2 twice",
    ),
    "edges": ({"of": MESH.edges_at(x=0.0)}, "of were given as edges"),
    "too large": ({"of": np.arange(10**4)}, "use smaller groups"),
    "other body": ({"body": "sheet"}, "body must be a Shell"),
    "no dict": ({"values": [1.0]}, "values must be a dict"),
    "wrong rows": ({"values": {"k": [1.0, 2.0, 3.0]}}, r"k must be a number, have shape \(1, ...\)"),
    "infinite value": ({"values": {"k": np.inf}}, "k must be finite"),
    "no identifier": ({"values": {"a b": 1.0}}, "names that are identifiers"),
    "keyword": ({"values": {"lambda": 1.0}}, "names that are identifiers"),
    "taken": ({"values": {"body": 1.0}}, "a value cannot be called 'body'"),
    "empty name": ({"name": " "}, "name must be the name of the energy"),
    "name of another": ({"name": "bending"}, "another energy of the scene is called 'bending'"),
    "no flag": ({"is_load": 1}, "is_load must be True or False"),
}


@pytest.mark.parametrize(("given", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_custom_energy_is_refused(given, message):
    arguments = {"function": lambda x: x.square().sum(), "of": [TIP], **given}
    with pytest.raises((ValueError, RuntimeError), match=message):
        pulled_strip(ms.CustomEnergy(arguments.pop("function"), **arguments))


def test_repeated_name_of_an_energy_is_refused():
    with pytest.raises(ValueError, match="another CustomEnergy is called 'spring' as well"):
        pulled_strip(strings(), strings())


def test_replaced_value_keeps_its_shape():
    own = strings()
    with pytest.raises(ValueError, match=r"stiffness of CustomEnergy.* must keep its shape \(\), got \(4,\)"):
        ms.equilibrium(pulled_strip(own), values={own: {"stiffness": np.ones(4)}})
    with pytest.raises(ValueError, match="CustomEnergy has no value 'modulus'"):
        ms.equilibrium(pulled_strip(own), values={own: {"modulus": 1.0}})
