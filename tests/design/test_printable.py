"""Printable magnetizations: properties of the printable set, axes of faces, and the search that rounds."""

import itertools
import pickle

import numpy as np
import pytest
import torch

import magshell as ms
from magshell import objectives, parametrize

SIX = np.vstack([np.eye(3), -np.eye(3)])
rng = np.random.default_rng(0)


def test_distances_are_to_rays_that_end_at_the_strength():
    ink = ms.PrintableSet(5.0, [(2, 0, 0), (-1, 0, 0)])
    m = np.array([(3.0, 4, 0), (0, 0, -2), (-5, 0, 0), (8, 4, 0)])
    np.testing.assert_allclose(ink.distances(m), [4 / 5, 2 / 5, 0, 1])
    np.testing.assert_allclose(ink.nearest(m), [(3, 0, 0), (0, 0, 0), (-5, 0, 0), (5, 0, 0)], atol=1e-15)
    assert objectives.printable(m, ink).item() == pytest.approx((16 + 4 + 0 + 25) / 25 / 4)
    assert objectives.printable(m, ink, areas=[1, 0, 0, 3]).item() == pytest.approx((16 + 3 * 25) / 25 / 4)


@pytest.mark.parametrize("levels", [None, (1,), (0, 1), (0.25, 0.5, 1)])
def test_nearest_magnetization_is_the_nearest_candidate(levels):
    """Compare with every candidate, one by one, in frames that are rotated on every face."""
    frames = np.linalg.qr(rng.normal(size=(7, 3, 3)))[0]
    ink = ms.PrintableSet(3e4, [(1, 1, 0), (0, -1, 2), (0, 0, -1)], levels=levels, frames=frames)
    m = 4e4 * rng.normal(size=(7, 3))
    found = ink.nearest(m)
    shares = np.linspace(0, 1, 2001) if levels is None else np.array(levels)
    for f in range(7):
        rays = (ink.directions[:, None, :] * shares[:, None]).reshape(-1, 3) @ frames[f]
        least = np.linalg.norm(m[f] / 3e4 - rays, axis=1).min()
        assert np.linalg.norm((m[f] - found[f]) / 3e4) == pytest.approx(
            least, abs=1e-3 if levels is None else 1e-12
        )
        assert ink.distances(m)[f] == pytest.approx(least, abs=1e-3 if levels is None else 1e-12)
    np.testing.assert_allclose(ink.distances(found), 0, atol=1e-12)
    direction, share = ink.choices(found)
    np.testing.assert_allclose(3e4 * share[:, None] * ink.rays_of(np.arange(7), direction), found, atol=1e-9)
    assert isinstance(ink.nearest(torch.from_numpy(m)), torch.Tensor)


def test_the_pull_has_no_unit():
    """Check that the number is the same for another strength, in other units, on a finer mesh."""
    m = rng.normal(size=(5, 3))
    at_first = objectives.printable(m, ms.PrintableSet(1.0, SIX)).item()
    assert objectives.printable(5e4 * m, ms.PrintableSet(5e4, SIX)).item() == pytest.approx(at_first)
    assert objectives.printable(np.repeat(m, 4, axis=0), ms.PrintableSet(1.0, SIX)).item() == pytest.approx(
        at_first
    )
    smooth = objectives.printable(m, ms.PrintableSet(1.0, SIX), sharpness=1e4).item()
    assert smooth == pytest.approx(at_first, abs=1e-3)


def test_frames_follow_the_faces():
    disk = ms.meshes.disk(0.02, cells=3).transformed(translation=(0.1, 0, 0))
    frames = parametrize.radial_frames(disk)
    outwards = disk.face_barycenters - (0.1, 0, 0)
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    np.testing.assert_allclose(frames[:, 0], outwards, atol=1e-6)
    np.testing.assert_allclose(
        frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (disk.n_faces, 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)
    cap = ms.meshes.disk(0.05, cells=3)
    x, y, _ = cap.rest_positions.T
    cap = ms.TriangleMesh(np.stack([x, y, 8 * (x**2 + y**2)], axis=1), cap.faces)
    along = parametrize.frames_along(cap, (1, 0, 0))
    assert (along[:, 0, 0] > 0).all() and np.abs((along[:, 0] * cap.face_normals).sum(axis=1)).max() < 1e-12
    np.testing.assert_allclose(along[:, 2], cap.face_normals, atol=1e-12)
    top = parametrize.radial_frames(disk, center=(0.05, 0, 0.3), axis=(0, 0, 2))
    assert np.abs(top[:, 0, 2]).max() < 1e-12  # away from the axis, not from the center


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ms.PrintableSet(0.0, SIX), r"strength \[A/m\] must be positive"),
        (lambda: ms.PrintableSet(1.0, [(0, 0, 0)]), "directions must not be zero"),
        (lambda: ms.PrintableSet(1.0, np.zeros((0, 3))), "directions must hold at least one"),
        (
            lambda: ms.PrintableSet(1.0, [1, 0]),
            r"directions \[1\] must have shape \(3,\) or \(k, 3\), got \(2,\)",
        ),
        (
            lambda: ms.PrintableSet(1.0, [SIX]),
            r"directions \[1\] must have shape \(3,\) or \(k, 3\), got \(1, 6, 3\)",
        ),
        (
            lambda: ms.PrintableSet(1.0, [(1, 0, 0), (1, 0)]),
            r"directions \[1\] must be an array of real numbers: ",
        ),
        (
            lambda: ms.PrintableSet(1.0, SIX, levels=[0, (1,)]),
            r"levels \[1\] must be an array of real numbers: ",
        ),
        (lambda: ms.PrintableSet(1.0, SIX, levels=(0,)), "levels must be shares"),
        (lambda: ms.PrintableSet(1.0, SIX, levels=(1, 2)), "levels must be shares"),
        (lambda: ms.PrintableSet(1.0, SIX, frames=[2 * np.eye(3)]), r"frames\[0\] are not"),
        (
            lambda: ms.PrintableSet(1.0, SIX, frames=[np.eye(3)]).nearest(np.ones((2, 3))),
            "frames for 1 faces",
        ),
        (lambda: parametrize.frames_along(FLAT, (0, 0, 1)), "no part in the plane of face 0"),
        (lambda: parametrize.frames_along(FLAT, np.ones((3, 3))), "direction must have shape"),
        (lambda: parametrize.radial_frames(FLAT, axis=(0, 0, 0)), "axis must not be zero"),
        (lambda: parametrize.radial_frames([0]), "mesh must be a TriangleMesh, got list"),
        (lambda: ms.minimize_printable(None, np.ones((2, 3)), INK), "objective must be a function"),
        (lambda: ms.minimize_printable(total, np.ones((2, 3)), SIX), "ink must be an ms.PrintableSet"),
        (lambda: ms.minimize_printable(total, np.ones(3), INK), "must have shape"),
        (lambda: ms.minimize_printable(total, np.zeros((0, 3)), INK), "has no faces"),
        (
            lambda: ms.minimize_printable(total, np.ones((2, 3)), INK, weights=(-1,)),
            "weights must not be neg",
        ),
        (lambda: ms.minimize_printable(total, np.ones((2, 3)), INK, blocks=0), "blocks must be an integer"),
        (lambda: ms.minimize_printable(constrained, np.ones((2, 3)), INK), "constraints"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


FLAT = ms.meshes.rectangle(1, 1, cells=(1, 1))
INK = ms.PrintableSet(1.0, SIX, levels=(1,))


def total(m):
    return (m**2).sum()


def constrained(m):
    return (m**2).sum(), m[:, 0]


mixing = np.random.default_rng(0)
MIX = torch.from_numpy(mixing.normal(size=(6, 24)))
WANTED = torch.from_numpy(mixing.normal(size=(6, 3)))


def mixed(m):
    """Return an objective of six sums over 24 faces, far fewer than there are choices: rounding errors can be
    compensated.
    """
    return ((MIX @ m - WANTED) ** 2).sum()


@pytest.mark.parametrize(("levels", "share"), [(None, 0.1), ((1,), 0.15), ((0, 1), 0.3)])
def test_rounding_makes_up_for_itself(levels, share):
    ink = ms.PrintableSet(1.0, SIX, levels=levels)
    found = ms.minimize_printable(mixed, np.full((24, 3), 0.1), ink, progress=False)
    assert found.free_objective < 1e-3
    assert found.objective < share * found.rounded_at_once
    assert found.not_printable == 0 and found.distances.max() < 1e-12
    rebuilt = found.shares[:, None] * ink.rays_of(np.arange(24), found.directions)
    np.testing.assert_allclose(rebuilt, found.remanent_magnetization, atol=1e-12)
    assert mixed(torch.from_numpy(rebuilt)).item() == pytest.approx(found.objective)
    assert [stage.name for stage in found.history][:4] == ["free", "weight", "weight", "weight"]
    assert found.history[-1].held == 24 and "all faces can be printed" in repr(found)
    assert pickle.loads(pickle.dumps(found)).objective == found.objective


def test_the_best_of_few_faces_is_found():
    """Compare with all 4^5 designs."""
    ink = ms.PrintableSet(1.0, [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], levels=(1,))

    def objective(m):
        return ((MIX[:2, :5] @ m - WANTED[:2]) ** 2).sum()

    every = (ink.directions[list(choice)] for choice in itertools.product(range(4), repeat=5))
    values = sorted(objective(torch.from_numpy(each)).item() for each in every)
    found = ms.minimize_printable(objective, np.zeros((5, 3)) + 0.1, ink, exchanges=60, progress=False)
    assert found.objective <= values[30]  # of 1024
    assert found.objective >= values[0] - 1e-12


def test_the_weight_pulls():
    """Check that a large weight leads nearer to printable magnetizations than none, and that without one nothing
    moves.
    """
    ink = ms.PrintableSet(1.0, SIX, levels=(1,))
    stages = {"blocks": 1, "exchanges": 0, "stage_iterations": 40, "progress": False}
    pulled = ms.minimize_printable(mixed, np.full((24, 3), 0.1), ink, weights=(0.01, 0.1, 1.0), **stages)
    distances = [stage.distance for stage in pulled.history[:4]]
    assert distances[3] < 0.2 * distances[0]
    at_once = ms.minimize_printable(mixed, np.full((24, 3), 0.1), ink, weights=(), **stages)
    assert at_once.objective == pytest.approx(at_once.rounded_at_once)


def test_radial_ink_prints_in_and_out_only():
    disk = ms.meshes.disk(1.0, cells=4)
    ink = ms.PrintableSet(2.0, [(1, 0, 0), (-1, 0, 0)], levels=(1,), frames=parametrize.radial_frames(disk))
    goal = torch.from_numpy(2.0 * np.sign(rng.normal(size=(disk.n_faces, 1))) * ink.frames[:, 0])
    found = ms.minimize_printable(
        lambda m: ((m - goal) ** 2).mean(), np.zeros((disk.n_faces, 3)), ink, progress=False
    )
    np.testing.assert_allclose(found.remanent_magnetization, goal, atol=1e-12)


def test_blocks_that_jump_are_halved():
    """Test an objective that refuses designs too far from the last one, as a WarmStart does."""
    last = [torch.full((24, 3), 0.1, dtype=torch.float64)]
    refused = []

    def refusing(m):
        if (m.detach() - last[0]).norm() > 1.6:
            refused.append(1)
            raise ms.EquilibriumJumped("too far")
        last[0] = m.detach().clone()
        return mixed(m)

    ink = ms.PrintableSet(1.0, SIX, levels=(1,))
    found = ms.minimize_printable(refusing, np.full((24, 3), 0.1), ink, exchanges=5, progress=False)
    assert refused and found.not_printable == 0 and found.rounded_at_once is None
    assert "cannot be evaluated" in repr(found)


@pytest.mark.parametrize(
    ("error", "raised"), [(KeyboardInterrupt, ms.Interrupted), (ZeroDivisionError, ms.ObjectiveFailed)]
)
def test_interrupted_search_returns_its_best_design(error, raised):
    calls = []

    def failing(m):
        calls.append(1)
        if len(calls) == 60:
            raise error
        return mixed(m)

    with pytest.raises(raised) as told:
        ms.minimize_printable(
            failing, np.full((24, 3), 0.1), ms.PrintableSet(1.0, SIX, levels=(1,)), progress=False
        )
    left = told.value.last_good
    assert isinstance(left, ms.PrintableMinimum)
    assert mixed(left.remanent_magnetization).item() == pytest.approx(left.objective)
    assert left.objective < mixed(torch.full((24, 3), 0.1, dtype=torch.float64)).item()


def test_the_way_back_may_jump():
    """Test an objective with a state, which refuses designs on the path back once the first face points backwards.

    Only its stored state leads back; the final value is evaluated there.
    """

    class Memory:
        def __init__(self):
            self.side = 1.0

        def state_dict(self):
            return {"side": self.side}

        def load_state_dict(self, state):
            self.side = state["side"]

        def __call__(self, m):
            first = m[0, 0].item()
            if self.side > 0 and first < -0.5:
                self.side = -1.0
            elif self.side < 0 and first > -0.5:
                raise ms.EquilibriumJumped("it stays on its side")
            return ((m - self.side * torch.tensor([0.6, 0, 0])) ** 2).sum() + 0.1 * (m[0, 0] + 0.45) ** 2

    memory = Memory()
    ink = ms.PrintableSet(1.0, [(-1, 0, 0), (0, 1, 0)], levels=(1,))
    start = np.tile((-0.1, 0.0, 0.0), (6, 1))
    found = ms.minimize_printable(memory, start, ink, stateful=[memory], progress=False)
    assert found.not_printable == 0
    assert memory(found.remanent_magnetization).item() == pytest.approx(found.objective)
