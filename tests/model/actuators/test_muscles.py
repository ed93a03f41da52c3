"""Muscles in scenes: closed-form answers, tables, fibres along lines, results, bad input."""

import copy
import pickle

import numpy as np
import pytest
from muscle_curves import FORCE_LENGTH, PASSIVE

import magshell as ms

SIDES = [ms.SymmetryPlane(normal) for normal in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
HILL = {"peak_stress": 5e4, "force_length": FORCE_LENGTH, "passive": PASSIVE}
FORCE_VELOCITY = np.stack([np.linspace(-1, 1, 9), 1.0 + 0.5 * np.tanh(2 * np.linspace(-1, 1, 9))], axis=1)
FORCE_VELOCITY[4, 1] = 1.0

# Reference case P1a (closed form): host energy + w/2 (|F m| - r)^2, E = 1e5, nu = 0.45, w = 2e5;
# (host, r, stretch along the fibre, transverse stretch).
P1A = [
    ("NH-lnJ", 0.5, 0.7082428514, 1.164916177),
    ("NH-lnJ", 0.7, 0.8140616612, 1.096013274),
    ("NH-lnJ", 0.9, 0.9347800015, 1.030718788),
    ("NH-lnJ", 1.1, 1.067993702, 0.9707481171),
    ("NH-lnJ", 1.4, 1.285193105, 0.8921529831),
    ("corot", 0.5, 0.6666666667, 1.15),
    ("corot", 0.7, 0.8, 1.09),
    ("corot", 0.9, 0.9333333333, 1.03),
    ("corot", 1.1, 1.066666667, 0.97),
    ("corot", 1.4, 1.266666667, 0.88),
]
HOSTS = {"NH-lnJ": ms.NeoHookean, "corot": ms.Corotated}


def block(element="linear", material=ms.NeoHookean, cells=(2, 1, 1), **more):
    return ms.Solid(
        ms.meshes.box((1, 1, 1), cells=cells),
        material=material(young_modulus=1e5, poisson_ratio=0.45),
        element=element,
        **more,
    )


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("host, r, along, across", P1A)
def test_a_free_block_takes_the_stretches_of_p1a(host, r, along, across, element):
    body = block(element, HOSTS[host], mean_volume=False)
    muscle = ms.Muscle(body, (1, 0, 0), stiffness=2e5, activation=1 - r)
    rest = ms.equilibrium(ms.Scene(body, supports=SIDES, actuators=[muscle]))
    assert rest.positions.max(axis=0) == pytest.approx([along, across, across], abs=1e-8)
    assert rest[muscle].stretches == pytest.approx(along, abs=1e-8)
    assert rest[muscle].tensions == pytest.approx(2e5 * (along - r), abs=1e-2)


@pytest.mark.parametrize("activation", [0.0, 0.2, 1.0])
def test_the_tension_of_hills_muscle_balances_its_passive_host(activation):
    body = block("quadratic", ms.Corotated)
    muscle = ms.Muscle(body, (2, 0, 0), activation=activation, **HILL)
    rest = ms.equilibrium(ms.Scene(body, supports=SIDES, actuators=[muscle]))
    stretch = rest[muscle].stretches[0]
    assert rest[muscle].tensions == pytest.approx(1e5 * (1 - stretch), rel=1e-7, abs=1e-4)


# P3: Timoshenko's bilayer, (t1/t2, E1/E2, kappa h) for a mismatch of 0.01 and h = 1.
P3 = [(1.0, 1.0, 0.015), (0.5, 1.0, 0.01333333333), (1.0, 4.0, 0.01315068493), (0.2, 10.0, 0.01454545455)]


@pytest.mark.parametrize("thicknesses, moduli, curvature", P3)
def test_a_strip_with_one_layer_of_muscle_bends_as_timoshenkos_bilayer(thicknesses, moduli, curvature):
    """Compare a strip of host and muscle with Timoshenko's bilayer, nu = 0.

    A host of E1/2 with fibres of E1/2 activated by 0.02 is a layer of E1 whose natural length is shorter by 0.01.
    """
    t1 = thicknesses / (1 + thicknesses)
    counts = {1.0: 2, 0.5: 3, 0.2: 6}[thicknesses]
    mesh = ms.meshes.box((20.0, 0.5, 1.0), cells=(40, 1, counts))
    top = mesh.tetrahedron_barycenters[:, 2] > 1 - t1
    young = np.where(top, 0.5 * moduli, 1.0)
    body = ms.Solid(mesh, material=ms.Corotated(young_modulus=young, poisson_ratio=0.0))
    muscle = ms.Muscle(body, (1, 0, 0), elements=top, stiffness=0.5 * moduli, activation=0.02)
    held = [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0)), ms.Pin(_corner(body), "z")]
    rest = ms.equilibrium(ms.Scene(body, supports=held, actuators=[muscle]))
    x = body.mesh.rest_positions
    middle = (np.abs(x[:, 0] - 10) < 20 / 6) & (np.abs(x[:, 2]) < 1e-9)
    points = np.asarray(rest.positions)[middle][:, [0, 2]]
    rows = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    a, b, c = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0]
    radius = np.sqrt(c + 0.25 * (a**2 + b**2))  # of the bottom, which is on the outside
    assert 1 / (radius - 0.5) == pytest.approx(curvature, rel=0.01)


def _corner(body):
    return body.mesh.vertices_where(lambda x: (np.abs(x[:, 0]) < 1e-9) & (np.abs(x[:, 2]) < 1e-9))


def test_segments_and_weights_are_those_along_the_line():
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(10, 2, 2))
    body = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), element="linear")
    line = np.array([(0, 0.01, 0.02), (0.04, 0.01, 0.02), (0.1, 0.01, 0.02)])
    fibres = ms.fibres_along(line, body, reach=0.003)
    middles = mesh.tetrahedron_barycenters[fibres.elements]
    distances = np.linalg.norm(middles[:, 1:] - (0.01, 0.02), axis=1)
    assert fibres.weights == pytest.approx(np.exp(-distances / 0.003))
    assert fibres.directions == pytest.approx(np.broadcast_to((1.0, 0, 0), (len(middles), 3)))
    assert fibres.coordinates == pytest.approx(middles[:, 0]) and fibres.length == pytest.approx(0.1)
    muscle = ms.Muscle(body, fibres, peak_stress=1e4, segments=5)
    assert (muscle.segments == (middles[:, 0] / 0.02).astype(int)).all()
    assert muscle.places == pytest.approx([0.01, 0.03, 0.05, 0.07, 0.09], abs=0.003)
    assert muscle.activation.shape == (5,)


def test_segment_contracts_its_own_part():
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(10, 2, 2))
    body = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), element="linear")
    fibres = ms.fibres_along([(0, 0.01, 0.01), (0.1, 0.01, 0.01)], body, reach=0.05)
    muscle = ms.Muscle(body, fibres, peak_stress=5e4, segments=2, activation=(0.0, 1.0))
    scene = ms.Scene(body, supports=[ms.Pin(mesh.vertices_at(x=0.0))], actuators=[muscle])
    rest = ms.equilibrium(scene)
    stretches = rest[muscle].stretches
    inner = np.abs(fibres.coordinates - 0.05) > 0.02
    assert stretches[inner & (muscle.segments == 1)].max() < 0.85
    assert stretches[inner & (muscle.segments == 0)] == pytest.approx(1.0, abs=0.02)
    assert rest[muscle].force() == pytest.approx(
        5e4
        * (stretches * muscle.weights * body.mesh.volumes[muscle.elements])[muscle.segments == 1].sum()
        / 0.1
    )


def test_fibres_may_be_a_function_of_position():
    body = block("linear")
    turned = ms.Muscle(body, lambda x: np.stack([-x[:, 1], x[:, 0] + 1, 0 * x[:, 0]], axis=1), stiffness=1.0)
    at = body.mesh.tetrahedron_barycenters
    assert turned.fibres == pytest.approx(np.stack([-at[:, 1], at[:, 0] + 1, 0 * at[:, 0]], axis=1))


def test_forces_of_muscles_in_the_same_elements_add_up():
    body = block("quadratic")
    whole = ms.Muscle(body, (1, 0, 0), peak_stress=4e4, activation=0.5)
    halves = [ms.Muscle(body, (3, 0, 0), peak_stress=2e4, activation=0.5) for _ in range(2)]
    one, two = (
        ms.equilibrium(ms.Scene(body, supports=SIDES, actuators=each)).positions for each in ([whole], halves)
    )
    assert one == pytest.approx(two, abs=1e-12)


def test_a_scene_with_muscles_is_copied_and_pickled():
    body = block()
    muscle = ms.Muscle(body, (1, 0, 0), peak_stress=4e4, activation=0.5)
    scene = ms.Scene(body, supports=SIDES, actuators=[muscle])
    for other in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert (ms.equilibrium(other).positions == ms.equilibrium(scene).positions).all()
        assert "Muscle(in 12 tetrahedra" in repr(other)


def test_inverted_elements_under_full_activation_recover():
    """Start from inverted elements, with a host that allows it."""
    body = ms.Solid(
        ms.meshes.box((1, 1, 1), cells=(2, 2, 2)),
        material=ms.StableNeoHookean(young_modulus=1e5, poisson_ratio=0.3),
        element="linear",
    )
    held = ms.Pin(body.mesh.vertices_at(x=0.0))
    for law in ({"stiffness": 2e5}, {"peak_stress": 5e4}, HILL):
        muscle = ms.Muscle(body, (1, 0, 0), activation=1.0, **law)
        scene = ms.Scene(body, supports=[held], actuators=[muscle])
        direct = ms.equilibrium(scene)
        start = body.mesh.rest_positions.copy()
        start[:, 0] *= np.where(start[:, 0] > 0, -0.3, 1.0)
        found = ms.equilibrium(scene, start=start)
        assert found.stable and direct.stable
        assert (found[body].strains().volume_ratios > 0).all()
        assert found.positions == pytest.approx(direct.positions, abs=1e-6)


@pytest.mark.parametrize(
    "law, ends",
    [({"stiffness": 2e5}, (-1.0, 1.0)), ({"peak_stress": 1e5}, (0.0, 1.0)), (HILL, (0.0, 1.0))],
)
def test_activations_at_the_ends_of_their_range(law, ends):
    body = block("linear", cells=(3, 2, 2))
    muscle = ms.Muscle(body, (1, 0, 0), **law)
    scene = ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(x=0.0))], actuators=[muscle])
    for end in ends:
        rest = ms.equilibrium(scene, values={muscle: {"activation": end}})
        assert rest.stable and np.isfinite(rest.positions).all()
        with pytest.raises(ValueError, match=r"activation of a Muscle with a .* must be from"):
            ms.equilibrium(scene, values={muscle: {"activation": end + np.sign(end - 0.5) * 1e-6}})


def loaded_arch(force):
    """Return a shallow arch of muscle, pinned at both ends, under a downward force [N] in its middle."""
    mesh = ms.meshes.box((1.0, 0.1, 0.02), cells=(16, 1, 1))
    points = mesh.rest_positions.copy()
    points[:, 2] += 0.03 * np.sin(np.pi * points[:, 0])
    arch = ms.Solid(
        ms.TetMesh(points, mesh.tetrahedra),
        material=ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.0),
    )
    first, middle, last = (
        arch.mesh.vertices_where(lambda x, at=at: np.abs(x[:, 0] - at) < 1e-9) for at in (0.0, 0.5, 1.0)
    )
    muscle = ms.Muscle(arch, (1, 0, 0), stiffness=1e5)
    load = ms.PointLoad(middle, force=(0, 0, -force))
    scene = ms.Scene(arch, supports=[ms.Pin(first), ms.Pin(last)], loads=[load], actuators=[muscle])
    return scene, muscle, int(middle[0])


def test_a_path_by_activation_ends_where_equilibria_are():
    """Check that the muscle straightens the arch under a small load, and that the path ends in an equilibrium."""
    scene, muscle, _ = loaded_arch(6e-4)
    lengthened = {muscle: {"activation": -0.002}}
    start = ms.equilibrium(scene, values=lengthened)
    path = ms.follow_path(scene, start=start, values={muscle: {"activation": 0.02}}, progress=False)
    end = ms.equilibrium(scene, values={muscle: {"activation": 0.02}}, start=path.positions[-1])
    assert path.parameters[-1] >= 1.0 - 1e-9 and not path.critical
    assert path.equilibrium(len(path) - 1)[muscle].activation() == pytest.approx(
        -0.002 + 0.022 * path.parameters[-1]
    )
    assert end.positions == pytest.approx(path.equilibrium(len(path) - 1).positions, abs=2e-3)


def test_a_path_by_activation_turns_round_where_the_arch_snaps():
    """Shorten the arch under a large load until it no longer carries it.

    The path passes this limit point. Equilibria before it stay next to the path; those behind it hang far below.
    """
    scene, muscle, middle = loaded_arch(8e-3)

    def activated(parameter):
        return {muscle: {"activation": -0.002 + 0.022 * parameter}}

    start = ms.equilibrium(scene, values=activated(0.0))
    path = ms.follow_path(
        scene, start=start, values=activated(1.0), progress=False, until=lambda at, _: at < 0.0
    )
    assert [each.kind for each in path.critical] == ["limit"]
    limit, turned = path.critical[0].parameter, int(np.argmax(path.parameters))
    assert 0.0 < limit < 1.0 and limit >= path.parameters.max() and path.parameters[-1] < 0.0
    before, after = path.n_negative_eigenvalues[: turned + 1], path.n_negative_eigenvalues[turned + 1 :]
    assert before[0] == 0 and (after == 1).all() and len(after) > 0
    at_limit = path.critical[0].positions[middle, 2] - scene.mesh.rest_positions[middle, 2]
    held, snapped = (
        ms.equilibrium(scene, values=activated(limit + by), start=start).displacements[middle, 2]
        for by in (-1e-3, 1e-3)
    )
    assert held > at_limit > -0.03 + 0.01 > snapped


def test_vibrations_are_those_of_the_active_state():
    """Compare a bar with fibres of a target stretch with sqrt((E + w)/rho)/4L.

    With a pull along the bar the fibres' tension cancels the host's pressure, so bending does not stiffen.
    """
    mesh = ms.meshes.box((1.0, 0.1, 0.1), cells=(10, 1, 1))
    body = ms.Solid(
        mesh, material=ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.0), mass_density=1e3
    )
    muscle = ms.Muscle(body, (1, 0, 0), stiffness=3e5)
    left = body.mesh.vertices_at(x=0.0)
    slides = [ms.Pin(left), ms.SymmetryPlane((0, 1, 0)), ms.SymmetryPlane((0, 0, 1))]
    scene = ms.Scene(body, supports=slides, actuators=[muscle])
    modes = ms.vibration_modes(scene, ms.equilibrium(scene), count=1)
    assert modes.frequencies[0] == pytest.approx(np.sqrt(4e5 / 1e3) / 4, rel=3e-3)


class TestInput:
    body = block("linear")

    @pytest.mark.parametrize(
        "arguments, message",
        [
            ({"stiffness": 1.0, "peak_stress": 1.0}, "one of them"),
            ({}, "one of them"),
            ({"peak_stress": -1.0}, "peak_stress .Pa. must be positive"),
            ({"peak_stress": 1.0, "activation": 1.5}, "must be from 0 to 1, got 1.5"),
            ({"peak_stress": 1.0, "activation": -0.1}, "must be from 0 to 1"),
            ({"stiffness": 1.0, "activation": -1.1}, "must be from -1 to 1"),
            ({"peak_stress": 1.0, "activation": (0.1, 0.2)}, "activation must be a number"),
            ({"peak_stress": 1.0, "segments": 3}, "coordinates"),
            ({"peak_stress": 1.0, "segments": 0.5}, "segments must be"),
            ({"peak_stress": 1.0, "segments": np.zeros(5, int)}, "segments must be"),
            ({"peak_stress": 1.0, "weights": np.ones(3)}, "weights .1. must have shape"),
            ({"peak_stress": 1.0, "weights": -1.0}, "must not be negative"),
            ({"peak_stress": 1.0, "weights": 0.0}, "must not all be zero"),
            ({"stiffness": 1.0, "force_length": FORCE_LENGTH}, "with a peak_stress"),
            ({"peak_stress": 1.0, "passive": PASSIVE}, "needs a force_length"),
            ({**HILL, "force_velocity": FORCE_VELOCITY}, "belong together"),
            ({**HILL, "shortening_rate": 1.0}, "belong together"),
            ({**HILL, "force_velocity": FORCE_VELOCITY + 0.1, "shortening_rate": 1.0}, "row .0, 1."),
            (
                {**HILL, "force_velocity": [(-1, 1.2), (0, 1), (1, 1.5)], "shortening_rate": 1.0},
                "must not fall",
            ),
            ({**HILL, "force_length": [(0, 1), (1, 1), (3, 1)]}, "equal steps"),
            ({**HILL, "force_length": [(0, 1), (1, -1), (2, 1)]}, "negative"),
            ({**HILL, "force_length": [(0, 1), (1, 1)]}, "three rows"),
            ({"peak_stress": 1.0, "elements": [99]}, "elements must be in"),
        ],
    )
    def test_muscle_refuses_bad_arguments(self, arguments, message):
        with pytest.raises(ValueError, match=message):
            ms.Muscle(self.body, (1, 0, 0), **arguments)

    @pytest.mark.parametrize(
        "fibres, message",
        [
            ((0, 0, 0), "must not be zero"),
            (np.zeros((12, 3)), "row 0"),
            (np.ones((5, 3)), "one a tetrahedron"),
            ((1, 0), "must be Fibres, a vector"),
            (lambda x: x[:3], "function of the place"),
            ((np.nan, 0, 0), "finite"),
        ],
    )
    def test_muscle_refuses_bad_fibres(self, fibres, message):
        with pytest.raises(ValueError, match=message):
            ms.Muscle(self.body, fibres, peak_stress=1.0)

    @pytest.mark.parametrize(
        "line, reach, message",
        [
            ([(5, 5, 5), (6, 5, 5)], 0.1, "the line misses the solid: the nearest of its tetrahedra is"),
            ([(0, 0, 0)], 0.1, "two corners"),
            ([(0, 0, 0), (0, 0, 0)], 0.1, "corner 0 is there twice"),
            ([(0, 0, 0), (1, 0, 0)], 0.0, "reach .m. must be positive"),
            ([(0, 0, 0), (1, 0, 0)], 1e-5, "within reach"),
            ([(0, 0.5, 0.5), (1, 0.5, 0.5), (0, 0.5, 0.5)], 0.5, "turns back on itself"),
            ([(0, 0), (1, 0)], 0.1, "shape"),
        ],
    )
    def test_fibres_along_refuses_a_bad_line(self, line, reach, message):
        with pytest.raises(ValueError, match=message):
            ms.fibres_along(line, self.body, reach=reach)

    def test_scene_refuses_muscles_that_do_not_fit(self):
        muscle = ms.Muscle(self.body, (1, 0, 0), peak_stress=1.0)
        other = block("linear")
        with pytest.raises(ValueError, match="a Muscle is about a body that is not in the scene"):
            ms.Scene(other, supports=SIDES, actuators=[muscle])
        with pytest.raises(ValueError, match=r"actuators\[0\] and actuators\[1\] are one Muscle"):
            ms.Scene(self.body, supports=SIDES, actuators=[muscle, muscle])
        scene = ms.Scene(self.body, supports=SIDES, actuators=[muscle])
        with pytest.raises(ValueError, match="no value 'stiffness'"):
            ms.equilibrium(scene, values={muscle: {"stiffness": 1.0}})
        with pytest.raises(ValueError, match=r"one of scene\.actuators"):
            ms.equilibrium(scene)[ms.Muscle(self.body, (1, 0, 0), peak_stress=1.0)]
