"""Vibrations, buckling and linear responses of scenes whose bodies act on each other with their own magnetic field."""

import numpy as np
import pytest
import scipy
from current_strip import BendingStrip

import magshell as ms
from magshell.solve.adjoint.factorized import Factorized, stiffness_parts
from magshell.solve.adjoint.stress_stiffness import frozen_stress_rates
from magshell.solve.linear.stiffness import symmetric
from magshell.solve.linear.vibration import consistent_masses

torch = pytest.importorskip("torch")

THICKNESS, MODULUS, DENSITY = 2e-4, 1e5, 2e3
ACROSS = (0.0, 0.0, 6e4)  # [A/m]
LENGTH = 10e-3  # [m] of the strips that are compared with a loop of current
NARROW, WIDE = (1e-3, (16, 2)), (2e-3, (10, 2))  # width [m] and cells


def strip(width, cells, own_field=True, length=LENGTH):
    """Return a scene of a cantilever that is pressed along its length by 1 N/m per unit load factor."""
    mesh = ms.meshes.rectangle(length, width, cells=cells)
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=MODULUS, poisson_ratio=0.0, mass_density=DENSITY
    )
    press = ms.EdgeLoad(mesh.edges_at(x=length), (-1.0, 0, 0))
    kind = {"own_field": ms.OwnField()} if own_field else {"field": ms.UniformField()}
    return ms.Scene(sheet, supports=ms.Clamp(mesh.edges_at(x=0.0)), loads=[press], **kind)


def at_rest(scene, **inputs):
    """Return the equilibrium of a strip in its own field, without a load."""
    field = {"applied_flux_density": (0, 0, 0)} if scene.fields else {}
    return ms.equilibrium(
        scene, remanent_magnetization=ACROSS, load_factor=0.0, progress=False, **field, **inputs
    )


@pytest.fixture(scope="module")
def rests():
    """Return the equilibria of a narrow strip with its own field and without."""
    return [at_rest(strip(*NARROW, own_field)) for own_field in (True, False)]


def bending_strip(width):
    return BendingStrip(LENGTH, width, THICKNESS, MODULUS, DENSITY, ACROSS[2])


def test_own_field_raises_the_frequency_of_a_strip_as_a_loop_of_current(rests):
    own, without = (ms.vibration_modes(rest.scene, rest, count=1).squares[0] for rest in rests)
    loop = bending_strip(NARROW[0])
    ratio = loop.ratio(loop.mass)
    assert 1.2 < ratio < 1.0 + 0.8 * loop.magnetic[0, 0] / loop.elastic[0, 0]  # less than of an arc
    assert own / without - 1.0 == pytest.approx(ratio - 1.0, rel=0.03)


def test_own_field_raises_the_buckling_load_of_a_strip_as_a_loop_of_current(rests):
    field = [{}, {"applied_flux_density": (0, 0, 0)}]
    own, without = (
        ms.linear_buckling(rest.scene, rest, load_factor=1.0, **given).factors[0]
        for rest, given in zip(rests, field, strict=True)
    )
    loop = bending_strip(NARROW[0])
    assert own / without - 1.0 == pytest.approx(loop.ratio(loop.shortening) - 1.0, rel=0.03)


def test_a_wide_strip_whose_columns_stay_straight_is_a_loop_of_current_too():
    """Check a strip of a fifth of its length; where it may bend across, its own field makes it less stiff."""
    ratios = {}
    for straight in (True, False):
        own, without = (lowest_square(at_rest(strip(*WIDE, own)), straight) for own in (True, False))
        ratios[straight] = own / without
    loop = bending_strip(WIDE[0])
    assert ratios[True] - 1.0 == pytest.approx(loop.ratio(loop.mass) - 1.0, rel=0.02)
    assert ratios[False] < ratios[True] - 0.005


def lowest_square(rest, straight):
    """Return the lowest square of an angular frequency. straight: whether each column of vertices moves as one."""
    scene, model = rest.scene, rest.scene._model
    if not straight:
        return dense_squares(rest)[0]
    along = scene.mesh.rest_positions[:, 0]
    still = np.zeros(scene._bodies.n_rotations)
    at_rest = model.state(scene.mesh.rest_positions, still)
    columns = []
    for x in np.unique(np.round(along, 9))[1:]:
        raised = scene.mesh.rest_positions + np.where(np.abs(along - x) < 1e-6, 1.0, 0.0)[:, None] * (0, 0, 1)
        columns.append(model.reduce(model.state(raised, still) - at_rest))
    turned = model.reduce(model.state(scene.mesh.rest_positions, still + 1.0) - at_rest)
    basis = np.array([*columns, *np.eye(model.free_size)[turned != 0.0]]).T
    masses = model.free_weights(rest._values.masses)
    inverses = scipy.linalg.eigh(
        basis.T @ (masses[:, None] * basis), basis.T @ dense_stiffness(rest) @ basis, eigvals_only=True
    )
    return 1.0 / inverses[-1]


def flaps(gap=4e-3, modulus=5e8, cells=(3, 1), far=0.0, force=None):
    """Return a scene of two clamped flaps above each other, or beside each other if `far` [m] apart.

    force: N on each vertex at the tip of the first one.
    """
    mesh = ms.meshes.rectangle(0.02, 0.006, cells=cells)
    meshes = [mesh, mesh.transformed(translation=(0.0, far, gap))]
    both = [
        ms.Shell(each, thickness=4e-4, young_modulus=modulus, poisson_ratio=0.3, mass_density=DENSITY)
        for each in meshes
    ]
    held = [ms.Clamp(each.mesh.edges_at(x=0.0), body=each) for each in both]
    tips = mesh.vertices_at(x=0.02)
    loads = [] if force is None else [ms.PointLoad(tips, force, body=both[0])]
    return ms.Scene(both, supports=held, loads=loads, own_field=ms.OwnField())


def oblique(scene):
    rng = np.random.default_rng(4)
    return 4e4 * rng.uniform(0.5, 1.5, (scene.mesh.n_faces, 3)) * (1.0, 0.5, 1.0)


def dense_stiffness(rest, load_parameters=None, moved=0.0):
    """Return the whole Hessian of the free degrees of freedom, by one product for each."""
    model, c = rest.scene._model, rest._load_parameters if load_parameters is None else load_parameters
    with rest._values.in_core():
        model.held_forces(rest._state, rest._angle_branches, rest._load_parameters)
        columns = [
            model.reduce(model.hessian_product(rest._state + moved, c, model.expand(unit)))
            for unit in np.eye(model.free_size)
        ]
    matrix = np.array(columns)
    assert np.abs(matrix - matrix.T).max() < 1e-10 * np.abs(matrix).max()
    return 0.5 * (matrix + matrix.T)


def dense_squares(rest):
    """Return all squares of angular frequencies, by a decomposition of dense matrices."""
    matrix = dense_stiffness(rest)
    masses = rest.scene._model.free_weights(rest._values.masses)
    moving, still = np.flatnonzero(masses), np.flatnonzero(masses == 0.0)
    inner = matrix[np.ix_(still, still)]
    coupling = matrix[np.ix_(still, moving)]
    condensed = matrix[np.ix_(moving, moving)] - coupling.T @ np.linalg.solve(inner, coupling)
    roots = np.sqrt(masses[moving])
    return np.linalg.eigvalsh(condensed / roots[:, None] / roots)


@pytest.fixture(params=[True, False], ids=["dense", "iterative"])
def dense(request, monkeypatch):
    """Take the own field of an eigenvalue problem as a dense matrix, or as products, as in large scenes."""
    if not request.param:
        monkeypatch.setattr("magshell.solve.adjoint.factorized._MOST_DENSE", 0)


@pytest.mark.usefixtures("dense")
def test_frequencies_equal_those_of_a_dense_decomposition():
    scene = flaps()
    rest = ms.equilibrium(scene, remanent_magnetization=oblique(scene), progress=False)
    modes = ms.vibration_modes(scene, rest, count=8)
    exact = dense_squares(rest)
    np.testing.assert_allclose(modes.squares, exact[:8], rtol=1e-8)
    free = ms.vibration_modes(scene, count=8).squares  # at rest without magnetization
    assert np.abs(modes.squares / free - 1.0).max() > 1e-4
    assert modes.unstable == 0


@pytest.mark.usefixtures("dense")
def test_modes_that_grow_are_counted_with_the_own_field():
    """Check a straight strip under twelve times its buckling load, and ask for fewer modes than grow."""
    scene = strip(4e-3, (8, 2), length=20e-3)
    factor = ms.linear_buckling(scene, at_rest(scene), load_factor=1.0).factors[0]
    pressed = ms.equilibrium(
        scene,
        remanent_magnetization=ACROSS,
        load_factor=12.0 * factor,
        require_stable=False,
        progress=False,
    )
    exact = dense_squares(pressed)
    growing = int(np.count_nonzero(exact < 0.0))
    assert growing >= 2 and not pressed.stable
    modes = ms.vibration_modes(scene, pressed, count=1)
    assert modes.unstable == growing
    assert modes.squares[0] == pytest.approx(exact[0], rel=1e-8)


@pytest.mark.usefixtures("dense")
def test_equal_frequencies_are_all_found():
    """Check two flaps 10 m apart, which hardly feel each other, so that all frequencies are double."""
    scene = flaps(far=10.0, gap=0.0)
    rest = ms.equilibrium(scene, remanent_magnetization=(2e4, 0, 4e4), progress=False)
    squares = ms.vibration_modes(scene, rest, count=7).squares
    np.testing.assert_allclose(squares, dense_squares(rest)[:7], rtol=1e-8)
    assert squares[1] == pytest.approx(squares[0], rel=1e-9) and squares[2] > 1.1 * squares[1]


@pytest.mark.usefixtures("dense")
def test_consistent_masses_with_the_own_field():
    scene = flaps(far=10.0, gap=0.0)
    rest = ms.equilibrium(scene, remanent_magnetization=(2e4, 0, 4e4), progress=False)
    squares = ms.vibration_modes(scene, rest, count=5, mass="consistent").squares
    masses = consistent_masses(rest._values).toarray()
    inverses = scipy.linalg.eigh(masses, dense_stiffness(rest), eigvals_only=True)[::-1]
    np.testing.assert_allclose(squares, 1.0 / inverses[:5], rtol=1e-8)
    assert squares[1] == pytest.approx(squares[0], rel=1e-9)


@pytest.mark.usefixtures("dense")
def test_buckling_factors_equal_those_of_a_dense_decomposition():
    scene = flaps(force=(-0.02, 0, 0))
    rest = ms.equilibrium(scene, remanent_magnetization=oblique(scene), load_factor=0.0, progress=False)
    found = ms.linear_buckling(scene, rest, load_factor=1.0, modes=3)
    np.testing.assert_allclose(found.factors, dense_factors(rest, 1.0)[:3], rtol=1e-5)


def dense_factors(rest, load_factor):
    """Return all positive factors of the way to a load factor, ascending, by a decomposition of dense matrices."""
    scene, model = rest.scene, rest.scene._model
    response = ms.linear_response(scene, rest, load_factor=load_factor)
    along = model.state(
        scene.mesh.rest_positions + response.displacements, np.asarray(response.edge_rotations)
    ) - model.state(scene.mesh.rest_positions, np.zeros(scene._bodies.n_rotations))
    with frozen_stress_rates(model, rest._state, rest._load_parameters, along):
        after = dense_stiffness(rest, response._load_parameters)
    with frozen_stress_rates(model, rest._state, rest._load_parameters, None):
        before = dense_stiffness(rest)
    inverses = scipy.linalg.eigh(before - after, dense_stiffness(rest), eigvals_only=True)
    return 1.0 / inverses[inverses > 0.0][::-1]


@pytest.mark.usefixtures("dense")
def test_modes_where_the_own_field_alone_holds_a_strip():
    """Check a strip under a load at which it would buckle without its own field, so that the sparse matrix is indefinite."""
    scene = strip(4e-3, (8, 2), length=20e-3)
    factor = ms.linear_buckling(scene, at_rest(scene), load_factor=1.0).factors[0]
    given = {"remanent_magnetization": ACROSS, "progress": False}
    pressed = ms.equilibrium(scene, load_factor=0.8 * factor, **given)
    parts = stiffness_parts(scene._model, pressed._state, pressed._load_parameters)
    assert np.linalg.eigvalsh(symmetric(*parts.triangle).toarray())[0] < 0.0
    np.testing.assert_allclose(
        ms.vibration_modes(scene, pressed, count=3).squares, dense_squares(pressed)[:3], rtol=1e-8
    )
    found = ms.linear_buckling(scene, pressed, load_factor=factor, modes=2).factors
    # Linear theory leaves out how the displacement before buckling changes the stiffness of the own field: 0.8 %.
    assert found[0] == pytest.approx(1.0, rel=1e-2)
    np.testing.assert_allclose(found, dense_factors(pressed, factor)[:2], rtol=1e-5)


def test_large_scenes_have_the_gradients_of_small_ones(monkeypatch):
    """Check the gradients of modes found by products against those of a dense decomposition, which the net checks."""
    scene = flaps(force=(-0.02, 0, 0))
    gradients = []
    for most_dense in (10**6, 0):
        monkeypatch.setattr("magshell.solve.adjoint.factorized._MOST_DENSE", most_dense)
        magnetization = torch.tensor(oblique(scene), requires_grad=True)
        rest = ms.equilibrium(
            scene,
            remanent_magnetization=magnetization,
            load_factor=0.0,
            solver=ms.MixedNewton(tolerance=1e-13),
            progress=False,
        )
        squares = ms.vibration_modes(scene, rest, count=2).squares
        factors = ms.linear_buckling(scene, rest, load_factor=1.0, modes=2).factors
        gradients.append(
            [torch.autograd.grad(each[1], magnetization, retain_graph=True)[0] for each in (squares, factors)]
        )
    for ours, exact in zip(*reversed(gradients), strict=True):
        assert float(exact.abs().max()) > 0.0
        np.testing.assert_allclose(ours, exact, rtol=0, atol=1e-8 * float(exact.abs().max()))


@pytest.mark.usefixtures("dense")
def test_a_pulled_strip_with_its_own_field_does_not_buckle():
    scene = strip(4e-3, (4, 1), length=20e-3)
    with pytest.raises(ValueError, match="nothing buckles"):
        ms.linear_buckling(scene, at_rest(scene), load_factor=-1.0)


@pytest.mark.parametrize("at_rest", [True, False])
def test_buckling_factors_have_gradients_with_the_own_field(at_rest):
    """Check an aligned pair, of which many distances lie where near pairs of sources become far ones."""
    scene = flaps(force=(-0.02, 0, 0))

    def factor(magnetization, load_factor):
        about = None
        if not at_rest:
            about = ms.equilibrium(
                scene,
                remanent_magnetization=magnetization,
                load_factor=0.0,
                solver=ms.MixedNewton(tolerance=1e-13),
                progress=False,
            )
        values = {"remanent_magnetization": magnetization} if at_rest else {}
        return ms.linear_buckling(scene, about, load_factor=load_factor, **values).factors[0]

    given = oblique(scene), np.array(1.0)
    tensors = [torch.tensor(each, requires_grad=True) for each in given]
    gradients = torch.autograd.grad(factor(*tensors), tensors)
    for k, gradient in enumerate(gradients):
        steepest = np.asarray(gradient)
        along = steepest * np.abs(given[k]).max() / np.abs(steepest).max()
        slopes = [
            np.dot((1, -1), [float(factor(*moved(given, k, sign * step * along))) for sign in (1, -1)])
            / (2 * step)
            for step in (2e-3, 4e-3)
        ]
        assert (steepest * along).sum() == pytest.approx((4 * slopes[0] - slopes[1]) / 3, rel=1e-5)


def moved(given, number, change):
    """Return arrays of which one has changed."""
    return [each + change if n == number else each for n, each in enumerate(given)]


def test_a_response_with_the_own_field_is_the_slope_of_equilibria():
    scene = flaps(force=(1e-4, 2e-4, -3e-4))
    given = {"remanent_magnetization": oblique(scene), "solver": ms.MixedNewton(tolerance=1e-13)}
    rest = ms.equilibrium(scene, load_factor=0.5, progress=False, **given)
    found = ms.linear_response(scene, rest, load_factor=1.5)
    step = 1e-3
    ends = [
        ms.equilibrium(scene, load_factor=0.5 + sign * step, start=rest, progress=False, **given)
        for sign in (1, -1)
    ]
    slope = (ends[0].positions - ends[1].positions) / (2 * step)
    np.testing.assert_allclose(found.displacements, slope, rtol=0, atol=1e-6 * np.abs(slope).max())


def test_a_response_about_an_equilibrium_has_gradients_by_the_magnetization():
    scene = flaps(force=(1e-4, 2e-4, -3e-4))
    exact = {"solver": ms.MixedNewton(tolerance=1e-13), "progress": False}
    rng = np.random.default_rng(7)
    base, along = oblique(scene), 4e4 * rng.standard_normal((scene.mesh.n_faces, 3))
    weights = torch.as_tensor(rng.standard_normal((scene.mesh.n_vertices, 3)))
    start = ms.equilibrium(scene, remanent_magnetization=base, load_factor=0.5, **exact)

    def loss(magnetization):
        rest = ms.equilibrium(
            scene, remanent_magnetization=magnetization, load_factor=0.5, start=start, **exact
        )
        moved = torch.as_tensor(ms.linear_response(scene, rest, load_factor=1.5).displacements)
        return (weights * moved).sum()

    given = torch.tensor(base, requires_grad=True)
    loss(given).backward()
    step = 1e-2
    pairs = [(3 / 4, 1), (-3 / 20, 2), (1 / 60, 3)]
    slope = sum(
        c * (loss(base + n * step * along).item() - loss(base - n * step * along).item()) for c, n in pairs
    )
    by = given.grad.numpy() * along
    assert by.sum() == pytest.approx(slope / step, abs=1e-6 * np.abs(by).sum())


def test_at_rest_the_own_field_is_a_load_like_others():
    """Check that the response at rest is the limit of equilibria whose forces by the own field are small."""
    scene = flaps()
    magnetization = 0.02 * oblique(scene)  # forces grow with its square
    found = ms.linear_response(scene, remanent_magnetization=magnetization)
    exact = ms.equilibrium(
        scene,
        remanent_magnetization=magnetization,
        progress=False,
        solver=ms.MixedNewton(tolerance=1e-13),
    )
    size = np.abs(exact.displacements).max()
    assert size > 0.0
    np.testing.assert_allclose(found.displacements, exact.displacements, rtol=0, atol=1e-5 * size)


def test_support_motions_pull_with_the_own_field_too():
    mesh = ms.meshes.rectangle(0.02, 0.006, cells=(3, 1))
    meshes = [mesh, mesh.transformed(translation=(1e-3, 5e-4, 3e-3))]
    both = [
        ms.Shell(each, thickness=4e-4, young_modulus=5e8, poisson_ratio=0.3, mass_density=DENSITY)
        for each in meshes
    ]
    held = [
        ms.Clamp(mesh.edges_at(x=0.0), body=both[0]),
        ms.Clamp(meshes[1].edges_at(x=1e-3), body=both[1], displacement=(0, 0, -1e-3)),
    ]
    scene = ms.Scene(both, supports=held, own_field=ms.OwnField())
    given = {"remanent_magnetization": oblique(scene), "solver": ms.MixedNewton(tolerance=1e-13)}
    rest = ms.equilibrium(scene, support_factor=0.0, progress=False, **given)
    found = ms.linear_response(scene, rest, support_factor=1.0)
    step = 1e-3
    ends = [
        ms.equilibrium(scene, support_factor=sign * step, start=rest, progress=False, **given)
        for sign in (1, -1)
    ]
    slope = (ends[0].positions - ends[1].positions) / (2 * step)
    np.testing.assert_allclose(found.displacements, slope, rtol=0, atol=1e-5 * np.abs(slope).max())
    lower = slope[: mesh.n_vertices]
    assert np.abs(lower).max() > 1e-3 * np.abs(slope).max()  # the other flap follows


@pytest.mark.usefixtures("dense")
def test_free_magnets_vibrate_in_the_field_of_a_sheet():
    """Check a magnet above a sheet, held by a spring joint, against a dense decomposition of the same matrices."""
    mesh = ms.meshes.rectangle(0.02, 0.006, cells=(4, 2))
    sheet = ms.Shell(
        mesh,
        thickness=4e-4,
        young_modulus=3e6,
        poisson_ratio=0.3,
        mass_density=DENSITY,
        remanent_magnetization=(3e4, 0, 4e4),
    )
    carried = np.flatnonzero(mesh.rest_positions[:, 0] > 0.012)
    magnet = ms.RigidBody(
        carried,
        body=sheet,
        mass=1e-5,
        inertia=(1e-10, 2e-10, 2.5e-10),
        center=(0.02, 0.003, 1e-3),
        magnetic_moment=(1e-4, 0, 2e-4),
    )
    scene = ms.Scene([sheet, magnet], supports=ms.Clamp(mesh.edges_at(x=0.0)), own_field=ms.OwnField())
    rest = ms.equilibrium(scene, progress=False)
    squares = ms.vibration_modes(scene, rest, count=4).squares
    model = scene._model
    with rest._values.in_core():
        parts = stiffness_parts(model, rest._state, rest._load_parameters)
        size, starts, rows, values = parts.triangle
        weights = model.free_weight_values(rest._values.masses)
        matrices = [symmetric(size, starts, rows, numbers).toarray() for numbers in (values, weights)]
        matrices[0] += np.array([parts.times_others(unit) for unit in np.eye(size)])
    # Edge rotations have no mass: the pencil is turned round.
    inverses = scipy.linalg.eigh(matrices[1], matrices[0], eigvals_only=True)[::-1]
    np.testing.assert_allclose(squares, 1.0 / inverses[:4], rtol=1e-8)


def test_the_inertia_counts_parts_of_low_rank_beside_the_own_field():
    """Check matrices whose sparse part is indefinite, with columns beside it, against dense ones."""
    scene = flaps()
    rest = ms.equilibrium(scene, remanent_magnetization=oblique(scene), progress=False)
    model, rng = scene._model, np.random.default_rng(0)
    with rest._values.in_core():
        parts = stiffness_parts(model, rest._state, rest._load_parameters)
        size, starts, rows, values = parts.triangle
        eigenvalues, vectors = scipy.linalg.eigh(symmetric(size, starts, rows, values).toarray())
        between = 0.5 * (eigenvalues[1] + eigenvalues[2])  # the lowest two nearly equal each other
        cases = [  # shift of the sparse part, columns and their stiffnesses, and the negative eigenvalues of all
            (between, [0, 1], (2 * between, 3 * between), 0),
            (between, [5], (-2 * eigenvalues[5],), 3),
            (0.0, [4], (-2 * eigenvalues[4],), 1),
        ]
        for shift, places, stiffness, negative in cases:
            moved = values.copy()
            moved[starts[:-1]] -= shift
            given = parts._replace(
                triangle=(size, starts, rows, moved), low_rank=(vectors[:, places], np.array(stiffness))
            )
            dense = symmetric(size, starts, rows, moved).toarray()
            dense += np.array([given.times_others(unit) for unit in np.eye(size)])
            factorized = Factorized(given, model.free_points)
            assert np.count_nonzero(np.linalg.eigvalsh(dense) < 0.0) == negative
            found = factorized.report.negative_pivots  # nearly equal ones count once
            assert min(1, negative) <= found <= negative and not factorized.report.perturbed_pivots
            forces = rng.standard_normal(size)
            left = dense @ factorized.solve(forces) - forces
            assert np.linalg.norm(left) < 1e-9 * np.linalg.norm(forces)
