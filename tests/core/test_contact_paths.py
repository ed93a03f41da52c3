"""Step bounds of contact: how far pairs may move before they touch, against ipctk's CCD and samples of the path."""

import numpy as np
import pytest
from contact_pairs import KINDS, hard_pairs, random_pairs

from magshell import _core


def paths(kind, count, seed=0):
    """Return starts and ends of random motions, each (count, 4, 3) in m.

    Moves are short and long; half of the pairs start nearly in contact.
    """
    rng = np.random.default_rng(seed)
    begin = np.concatenate(
        [random_pairs(kind, count // 2, seed), random_pairs(kind, count - count // 2, seed, 1e-3)]
    )
    size = rng.choice([1e-3, 0.1, 1.0, 3.0], count)[:, None, None]
    return begin, begin + size * rng.uniform(-1.0, 1.0, (count, 4, 3))


def gaps(kind, begin, end, fraction, thickness):
    return _core.pair_proximities(kind, begin + fraction[:, None, None] * (end - begin))[0] - thickness


@pytest.mark.parametrize("kind", KINDS)
def test_never_later_than_the_first_contact_of_ipctk(kind) -> None:
    ipctk = pytest.importorskip("ipctk", reason="the oracle of contact is not installed")
    # ipctk stops at a 10,000th of the initial distance, ours at a thousandth.
    oracle = ipctk.TightInclusionCCD(tolerance=1e-9, max_iterations=10**7, conservative_rescaling=0.9999)
    begin, end = paths(kind, 600)
    ours = _core.pair_free_shares(kind, begin, end, 0.0, 1e-3)
    hits, ratios = 0, []
    for a, b, fraction in zip(begin, end, ours, strict=True):
        hit, first = getattr(oracle, f"{kind}_ccd")(*a, *b)[:2]
        if not hit:
            ratios.append(fraction)
            continue
        hits += 1
        assert fraction <= first
        ratios.append(fraction / max(first, 1e-12))
    assert hits > 50
    # The bound is rarely much too small: compared with the one that keeps a hundredth of the gap.
    assert np.quantile(ratios, 0.02) > 0.9


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("thickness", "keep"), [(0.0, 0.1), (0.05, 0.2), (0.0, 0.5)])
def test_gap_is_kept_along_the_path_up_to_the_bound(kind, thickness, keep) -> None:
    begin, end = paths(kind, 3000, seed=1)
    first = _core.pair_proximities(kind, begin)[0] - thickness
    fraction = _core.pair_free_shares(kind, begin, end, thickness, keep)
    assert (fraction >= 0.0).all() and (fraction <= 1.0).all()
    assert (fraction[first <= 0.0] == 0.0).all() and (fraction[first > 1e-12] > 0.0).all()
    apart = first > 0.0
    for t in np.linspace(0.0, 1.0, 120):
        assert (gaps(kind, begin, end, t * fraction, thickness) - keep * first)[apart].min() > -1e-14
    # Where the bound stops a pair, its gap is hardly larger than required.
    stopped = apart & (fraction < 1.0)
    left = gaps(kind, begin, end, fraction, thickness)[stopped] / first[stopped]
    assert stopped.sum() > 80 and np.quantile(left, 0.99) < keep + 0.02


@pytest.mark.parametrize("kind", KINDS)
def test_sliding_pairs_are_not_bounded(kind) -> None:
    # Pairs a millionth apart, moved along each other by a thousand times that.
    x, names = hard_pairs(kind, 1e-6)
    which = "above the inside" if kind == "point_triangle" else "parallel, side by side"
    begin = x[[names.index(which)]]
    end = begin.copy()
    end[0, : 1 if kind == "point_triangle" else 2] += [1e-3, 2e-3, 0.0]
    assert _core.pair_free_shares(kind, begin, end, 0.0, 0.5)[0] == 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_hard_pairs_that_close_stop_before_they_touch(kind) -> None:
    begin, names = hard_pairs(kind, 1e-3)
    first, _, normals, _ = _core.pair_proximities(kind, begin)
    end = begin.copy()
    end[:, : 1 if kind == "point_triangle" else 2] -= 2.0 * first[:, None, None] * normals[:, None, :]
    fraction = _core.pair_free_shares(kind, begin, end, 0.0, 0.1)
    assert fraction == pytest.approx(0.45, abs=0.01), names
    away = _core.pair_free_shares(kind, begin, 2.0 * begin - end, 0.0, 0.1)
    assert (away == 1.0).all(), names


def test_bound_far_from_the_origin_is_smaller_but_never_too_large() -> None:
    for kind in KINDS:
        begin, end = paths(kind, 400, seed=3)
        shift = np.array([1e6, -2e6, 5e5])
        fraction = _core.pair_free_shares(kind, begin + shift, end + shift, 0.0, 0.1)
        first = _core.pair_proximities(kind, begin)[0]
        there = gaps(kind, begin, end, fraction, 0.0)
        assert (there[first > 1e-6] > 0.05 * first[first > 1e-6]).all()
        assert np.isfinite(fraction).all()
