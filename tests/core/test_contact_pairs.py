"""Energies of contact pairs: distances, gradients and Hessians against ipctk, differences and exact properties."""

import numpy as np
import pytest
from contact_pairs import ALL_KINDS, KINDS, LAW, differences, hard_pairs, random_pairs, relative

from magshell import _core

AREA, PARALLEL = 0.3, 0.05  # m2; m4: a twentieth makes many pairs of edges nearly parallel


def barrier(gap, activation):
    """Return b(gap) and its first two derivatives by the formula of contact/barrier.h, in m, 1 and 1/m."""
    y = gap / activation
    value = -activation * (1 - y) ** 2 * np.log(y)
    slope = 2 * (1 - y) * np.log(y) - (1 - y) ** 2 / y
    return value, slope, (-2 * np.log(y) + 4 * (1 - y) / y + ((1 - y) / y) ** 2) / activation


def by_ipctk(kind, x, law, parallel):
    """Compute energy, gradient (12,) and Hessian (12, 12) of one pair from ipctk's distances and mollifier."""
    ipctk = pytest.importorskip("ipctk", reason="the oracle of contact is not installed")
    squared = getattr(ipctk, f"{kind}_distance")(*x)
    by_squared = getattr(ipctk, f"{kind}_distance_gradient")(*x)
    twice = getattr(ipctk, f"{kind}_distance_hessian")(*x)
    d = np.sqrt(squared)
    slope = by_squared / (2 * d)
    hessian = twice / (2 * d) - np.outer(slope, slope) / d
    b, b1, b2 = barrier(d - law["min_distance"], law["activation_distance"])
    value, gradient, second = b, b1 * slope, b2 * np.outer(slope, slope) + b1 * hessian
    if kind == "edge_edge" and parallel > 0:
        m = ipctk.edge_edge_mollifier(*x, parallel)
        m1 = ipctk.edge_edge_mollifier_gradient(*x, parallel)
        m2 = ipctk.edge_edge_mollifier_hessian(*x, parallel)
        second = m * second + np.outer(m1, gradient) + np.outer(gradient, m1) + m2 * value
        gradient = m * gradient + m1 * value
        value = m * value
    scale = AREA * law["stiffness"]
    return scale * value, scale * gradient, scale * second


def near_ones(kind, x, law):
    distances = _core.pair_proximities(kind, x)[0] - law["min_distance"]
    return x[(distances > 1e-9) & (distances < 0.999 * law["activation_distance"])]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("gap", [0.3, 1e-2, 1e-5])
def test_distances_are_those_of_ipctk(kind, gap) -> None:
    ipctk = pytest.importorskip("ipctk", reason="the oracle of contact is not installed")
    x = np.concatenate([random_pairs(kind, 2000), random_pairs(kind, 500, gap=gap), hard_pairs(kind, gap)[0]])
    distances, weights, normals, _ = _core.pair_proximities(kind, x)
    theirs = np.sqrt([getattr(ipctk, f"{kind}_distance")(*each) for each in x])
    told = np.isfinite(theirs)  # ipctk has no distance from a triangle degenerate to a point
    assert np.abs(distances - theirs)[told].max() < 1e-8 * gap and told.sum() >= len(x) - 1
    assert np.allclose(distances[~told], gap)
    # The weights name the closest points, and the normal joins them.
    apart = np.einsum("ni,nik->nk", weights, x)
    assert np.abs(apart - distances[:, None] * normals).max() < 1e-12
    assert np.abs(weights.sum(1)).max() < 1e-14


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("min_distance", [0.0, 0.05])
@pytest.mark.parametrize("gap", [0.2, 1e-2])
def test_energies_are_those_of_ipctk(kind, min_distance, gap) -> None:
    law = LAW | {"min_distance": min_distance}
    x = near_ones(kind, random_pairs(kind, 1000, gap=gap + min_distance), law)
    assert len(x) > 600
    parallel = PARALLEL if kind == "edge_edge" else 0.0
    ours = _core.pair_energies(kind, x, AREA, parallel, law)
    energy, gradient, hessian = (
        np.array(each) for each in zip(*(by_ipctk(kind, p, law, parallel) for p in x), strict=True)
    )
    assert relative(ours["energy"], energy) < 1e-8
    assert relative(ours["gradient"].reshape(-1, 12), gradient) < 1e-8
    assert relative(ours["hessian"], hessian) < 1e-8


@pytest.mark.parametrize("kind", KINDS)
def test_degenerate_pairs_have_the_gradients_of_ipctk(kind) -> None:
    # With a mollifier, as the gradient of parallel edges is not unique: any pair of closest points is correct.
    x, _ = hard_pairs(kind, 0.05)
    parallel = 1e-3 if kind == "edge_edge" else 0.0
    ours = _core.pair_energies(kind, x, AREA, parallel, LAW)
    for got, each in zip(ours["gradient"].reshape(-1, 12), x, strict=True):
        expected = by_ipctk(kind, each, LAW, parallel)[1]
        if kind == "point_triangle" and not each[1:].any():
            continue  # ipctk has no distance from a triangle degenerate to a point
        assert np.abs(got - expected).max() <= 1e-8 * AREA * LAW["stiffness"]


@pytest.mark.parametrize("kind", [*KINDS, "point_edge", "point_point"])
@pytest.mark.parametrize("penalty", [False, True])
def test_derivatives_are_those_of_differences(kind, penalty) -> None:
    law = LAW | {"min_distance": 0.05, "penalty": penalty}
    as_kind = kind if kind in KINDS else "point_triangle"
    x = near_ones(kind, random_pairs(as_kind, 300, gap=0.25), law)
    parallel = PARALLEL if kind == "edge_edge" else 0.0

    def part(name):
        return lambda positions: _core.pair_energies(kind, positions, AREA, parallel, law)[name].reshape(
            len(x), -1
        )

    def median(
        got, expected
    ):  # where a closest point changes its kind within the step, there is no derivative
        error = np.abs(got - expected).reshape(len(x), -1).max(1) / np.abs(expected).reshape(len(x), -1).max(
            1
        )
        return np.quantile(error, 0.97)

    at = _core.pair_energies(kind, x, AREA, parallel, law)
    assert median(at["gradient"].reshape(-1, 1, 12), differences(part("energy"), x)) < 1e-6
    assert median(at["hessian"], differences(part("gradient"), x)) < 1e-5
    by_place = differences(part("normal_force"), x)
    assert median(at["normal_force_by_place"].reshape(-1, 1, 12), by_place) < 1e-6


@pytest.mark.parametrize("kind", [*KINDS, "point_edge", "point_point"])
def test_cautious_hessians_are_positive_and_never_below(kind) -> None:
    as_kind = kind if kind in KINDS else "point_triangle"
    x = random_pairs(as_kind, 2000, gap=0.1)
    for area in (AREA, -AREA) if kind != "edge_edge" else (AREA,):
        exact, cautious = (
            _core.pair_energies(kind, x, area, 1.0 if kind == "edge_edge" else 0.0, LAW, each)["hessian"]
            for each in (False, True)
        )
        size = np.abs(cautious).max((1, 2)) + np.abs(exact).max((1, 2)) + 1e-300
        assert (np.linalg.eigvalsh(cautious)[:, 0] / size).min() > -1e-13
        assert (np.linalg.eigvalsh(cautious - exact)[:, 0] / size).min() > -1e-13
        assert (np.abs(exact - exact.transpose(0, 2, 1)).max((1, 2)) / size).max() < 1e-14


@pytest.mark.parametrize("kind", KINDS)
def test_hard_pairs_have_finite_numbers_and_push_apart(kind) -> None:
    x, names = hard_pairs(kind, 1e-3)
    at = _core.pair_energies(kind, x, AREA, 1e-3 if kind == "edge_edge" else 0.0, LAW)
    for each in at.values():
        assert np.isfinite(each).all()
    assert np.abs(at["gradient"].sum(1)).max() <= 1e-9 * np.abs(at["gradient"]).max()  # no net force
    torque = np.cross(x, at["gradient"]).sum(1)
    assert np.abs(torque).max() <= 1e-9 * np.abs(at["gradient"]).max()
    pushed = x - 1e-9 * at["gradient"] / (np.abs(at["gradient"]).max((1, 2), keepdims=True) + 1e-300)
    farther = _core.pair_proximities(kind, pushed)[0] - _core.pair_proximities(kind, x)[0]
    for k, name in enumerate(names):
        if np.abs(at["gradient"][k]).max() > 0.0 and "parallel" not in name:
            assert farther[k] > 0.0, name


@pytest.mark.parametrize("kind", KINDS)
def test_the_barrier_grows_without_bound_and_ends_smoothly(kind) -> None:
    x, names = hard_pairs(kind, 1.0)
    base = x[names.index("above the inside" if kind == "point_triangle" else "crossed")]
    gaps = np.concatenate([np.geomspace(1e-12, 0.3, 40), [0.4 - 1e-6, 0.4 - 1e-9, 0.4, 0.5]])
    pairs = np.repeat(base[None], len(gaps), 0)
    top = slice(0, 1) if kind == "point_triangle" else slice(2, 4)
    pairs[:, top, 2] = gaps[:, None]
    at = _core.pair_energies(kind, pairs, AREA, 0.0, LAW)
    assert (np.diff(at["energy"][:40]) < 0).all() and (np.diff(at["normal_force"][:40]) < 0).all()
    assert at["energy"][0] > 10 * AREA * LAW["stiffness"] * LAW["activation_distance"]
    assert np.allclose(
        at["normal_force"][:40], -AREA * LAW["stiffness"] * barrier(gaps[:40], 0.4)[1], rtol=1e-9
    )
    assert (
        at["energy"][-1] == at["energy"][-2] == 0.0
        and np.abs(at["hessian"][-3]).max() < 1e-5 * LAW["stiffness"]
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("penalty", [False, True])
def test_derivatives_by_the_law(kind, penalty) -> None:
    law = LAW | {"min_distance": 0.03, "penalty": penalty}
    x = near_ones(kind, random_pairs(kind, 200, gap=0.2), law)
    parallel = PARALLEL if kind == "edge_edge" else 0.0
    rng = np.random.default_rng(1)
    along, by_force = rng.standard_normal((len(x), 4, 3)), rng.standard_normal(len(x))
    got = _core.pair_energies_by_law(kind, x, AREA, parallel, law, along, by_force)

    def value(changed):
        at = _core.pair_energies(kind, x, AREA, parallel, changed)
        return (along * at["gradient"]).sum((1, 2)) + by_force * at["normal_force"]

    for column, name in enumerate(("stiffness", "activation_distance", "min_distance", "smoothing")):
        step = 1e-6 * max(law[name], 0.1)
        high, low = value(law | {name: law[name] + step}), value(law | {name: law[name] - step})
        assert relative(got[:, column : column + 1], ((high - low) / (2 * step))[:, None]) < 1e-5, name


def with_corners(kind, pairs):
    """Return pairs (n, 4, 3) with the further corners of the triangle of their second part, (n, 5, 3).

    Nodes that a pair does not have are such corners already.
    """
    last = np.zeros((len(pairs), 1, 3))
    if kind == "edge_edge":
        last = pairs[:, 3:] + np.random.default_rng(5).standard_normal(last.shape)
    return np.concatenate([pairs, last], axis=1)


@pytest.mark.parametrize("kind", ALL_KINDS)
@pytest.mark.parametrize("gap", [0.15, 1e-3])
def test_rigid_motions_are_no_slip_and_friction_has_no_moment(kind, gap) -> None:
    x = with_corners(kind, near_ones(kind, random_pairs(kind, 300, gap=gap), LAW))
    rng = np.random.default_rng(4)
    nodes = 5 if kind == "edge_edge" else 4
    spin, shift, v = rng.standard_normal((3, len(x), 1, 3))
    rigid = np.cross(spin, x) + shift
    numbers = (0.5, 0.7, 0.1)
    at = _core.pair_frictions(kind, x, AREA, 0.0, LAW, rigid, numbers, rigid)
    assert np.abs(at["slip"]).max() < 1e-12
    v = rng.standard_normal(x.shape)
    v[:, nodes:] = 0.0
    force = _core.pair_frictions(kind, x, AREA, 0.0, LAW, v, numbers, v)["force"]
    size = np.abs(force).max(axis=(1, 2))
    assert np.abs(force.sum(axis=1)).max(axis=1) == pytest.approx(0.0 * size, abs=1e-12 * size.max())
    moment = np.cross(x, force).sum(axis=1)
    assert np.abs(moment).max(axis=1) == pytest.approx(0.0 * size, abs=1e-11 * size.max())
    # The first part takes the friction of Coulomb's law whole.
    parts = 2 if kind == "edge_edge" else 1
    law = _core.pair_energies(kind, x[:, :4], AREA, 0.0, LAW)["normal_force"]
    slip = _core.pair_frictions(kind, x, AREA, 0.0, LAW, v, numbers, v)["slip"]
    fast = np.linalg.norm(slip, axis=1) > 1.0  # ten times the sticking speed: kinetic friction
    assert np.linalg.norm(force[:, :parts].sum(axis=1), axis=1)[fast] == pytest.approx(0.5 * law[fast])


@pytest.mark.parametrize("kind", ALL_KINDS)
def test_derivatives_of_friction(kind) -> None:
    law = LAW | {"min_distance": 0.03}
    x = with_corners(kind, near_ones(kind, random_pairs(kind, 300, gap=0.15), law))
    parallel = PARALLEL if kind == "edge_edge" else 0.0
    rng = np.random.default_rng(2)
    v = rng.standard_normal((len(x), 5, 3)) * rng.choice([1e-2, 0.3, 3.0], len(x))[:, None, None]
    along = rng.standard_normal((len(x), 5, 3))
    if kind != "edge_edge":
        v[:, 4], along[:, 4] = 0.0, 0.0
    numbers = np.array([0.4, 0.7, 0.2])  # kinetic, static, m/s

    def friction_of(positions=x, velocities=v, friction=numbers, of=law):
        return _core.pair_frictions(kind, positions, AREA, parallel, of, velocities, tuple(friction), along)

    def force(positions=x, velocities=v):
        return friction_of(positions, velocities)["force"].reshape(len(x), 15)

    def most(got, expected):
        error = np.abs(got - expected).reshape(len(x), -1).max(1) / np.abs(expected).reshape(len(x), -1).max(
            1
        )
        return np.quantile(error, 0.97)

    at = friction_of()
    assert most(at["by_velocity"], differences(lambda each: force(velocities=each), v)) < 1e-6
    by_place = differences(force, x, 1e-7)
    assert most(at["by_place"], by_place) < 1e-5
    flat = along.reshape(len(x), 15)
    assert np.allclose(
        at["along_place"].reshape(-1, 15), np.einsum("ni,nij->nj", flat, at["by_place"]), rtol=1e-9
    )
    assert np.allclose(at["along_velocity"].reshape(-1, 15), np.einsum("ni,nij->nj", flat, at["by_velocity"]))
    assert np.allclose(np.einsum("nij,nj->ni", at["secant"], v.reshape(-1, 15)), force(), atol=1e-10)
    for column in range(3):
        step = 1e-6 * np.eye(3)[column]
        high, low = (
            friction_of(friction=numbers + step)["force"],
            friction_of(friction=numbers - step)["force"],
        )
        expected = ((high - low) * along).sum((1, 2)) / 2e-6
        assert np.abs(at["along_law"][:, column] - expected).max() < 1e-6 * np.abs(expected).max()
    # The stiffness enters through the normal force only.
    stiffer = friction_of(of=law | {"stiffness": 1.001 * law["stiffness"]})["force"]
    by_stiffness = _core.pair_energies_by_law(
        kind, x[:, :4], AREA, parallel, law, 0.0 * along[:, :4], at["along_normal_force"]
    )[:, 0]
    expected = ((stiffer - at["force"]) * along).sum((1, 2)) / (0.001 * law["stiffness"])
    assert np.abs(by_stiffness - expected).max() < 1e-9 * np.abs(expected).max()


def test_friction_is_that_of_ipctk_in_sticking_and_sliding() -> None:
    ipctk = pytest.importorskip("ipctk", reason="the oracle of contact is not installed")
    x = near_ones("edge_edge", random_pairs("edge_edge", 100, gap=0.1), LAW)
    # ipctk's velocity is that of the closest points, which is the slip where both parts are only shifted.
    v = np.repeat(np.random.default_rng(3).standard_normal((len(x), 2, 3)), (2, 3), axis=1)
    v *= np.geomspace(1e-3, 1e1, len(x))[:, None, None]
    at = _core.pair_frictions(
        "edge_edge", with_corners("edge_edge", x), AREA, 0.0, LAW, v, (0.5, 0.5, 0.1), v
    )
    v = v[:, :4]
    _, weights, normals, _ = _core.pair_proximities("edge_edge", x)
    force = _core.pair_energies("edge_edge", x, AREA, 0.0, LAW)["normal_force"]
    relative_velocity = np.einsum("ni,nik->nk", weights, v)
    tangential = relative_velocity - (relative_velocity * normals).sum(1)[:, None] * normals
    per_speed = np.array(
        [ipctk.smooth_friction_f1_over_x(u, 0.1) for u in np.linalg.norm(tangential, axis=1)]
    )
    expected = -0.5 * (force * per_speed)[:, None, None] * weights[:, :, None] * tangential[:, None, :]
    assert relative(at["force"][:, :2], expected[:, :2]) < 1e-8


def test_static_friction_falls_to_the_kinetic_one() -> None:
    x = np.array([[[0.2, 0.2, 0.1], [0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]]], float)
    v = np.zeros((1, 5, 3))
    shares = []
    for speed in (0.1, 1.0, 3.0, 10.0, 50.0):  # of the sticking speed
        v[0, 0, 0] = 0.02 * speed
        at = _core.pair_frictions("point_triangle", x, AREA, 0.0, LAW, v, (0.3, 0.6, 0.02), v)
        shares.append(
            -at["force"][0, 0, 0]
            / _core.pair_energies("point_triangle", x[:, :4], AREA, 0.0, LAW)["normal_force"][0]
        )
    assert shares[0] == pytest.approx(0.6 * 0.19) and shares[1] == pytest.approx(0.6)
    assert 0.3 < shares[2] < 0.6 and shares[3:] == pytest.approx([0.3, 0.3])


def test_contact_law_of_neighbours_fits_the_room_between_them() -> None:
    x = near_ones("point_triangle", random_pairs("point_triangle", 200, gap=0.1), LAW)
    law, small = (
        LAW | {"min_distance": 0.02},
        LAW | {"min_distance": 0.01, "activation_distance": 0.2, "smoothing": 0.05},
    )
    halved = _core.pair_energies("point_triangle", x, AREA, 0.0, law, room=0.21)
    expected = _core.pair_energies("point_triangle", x, AREA, 0.0, small)
    assert relative(halved["gradient"], expected["gradient"]) < 1e-10
    rng = np.random.default_rng(1)
    along, none = rng.standard_normal((len(x), 4, 3)), np.zeros(len(x))
    got = _core.pair_energies_by_law("point_triangle", x, AREA, 0.0, law, along, none, room=0.21)
    for column, name in ((1, "activation_distance"), (2, "min_distance")):
        high, low = (
            (
                along
                * _core.pair_energies("point_triangle", x, AREA, 0.0, law | {name: each}, room=0.21)[
                    "gradient"
                ]
            )
            for each in (law[name] + 1e-7, law[name] - 1e-7)
        )
        expected = (high - low).sum((1, 2)) / 2e-7
        assert np.abs(got[:, column] - expected).max() < 1e-5 * np.abs(expected).max()
