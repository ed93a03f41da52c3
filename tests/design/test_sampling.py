"""Random starts: in their box, evenly spread, and the same ones every time."""

import numpy as np
import pytest
import torch

import magshell as ms


def test_starts_lie_in_their_box_and_have_its_shape():
    lower, upper = np.array([[-1.0, 0.0, 5.0]]), np.array([[1.0, 2.0, 5.0], [3.0, 0.5, 6.0]])
    starts = ms.random_starts(50, lower, upper)
    assert starts.shape == (50, 2, 3) and starts.dtype == np.float64
    assert (starts >= lower).all() and (starts <= upper).all()
    assert (starts[:, 0, 2] == 5.0).all() and np.ptp(starts[:, 1, 0]) > 3.0
    assert ms.random_starts(3, 0.0, torch.ones(4)).shape == (3, 4)
    assert ms.random_starts(3, 0.0, 1.0).shape == (3,)


def test_starts_are_spread_evenly():
    starts = ms.random_starts(64, [0.0, 0.0], 1.0)
    cells = np.floor(starts * 8).astype(int)
    assert len({tuple(cell) for cell in cells}) == 64  # 64 starts, one in each cell of an 8 x 8 grid


@pytest.mark.parametrize("size", [3, 21202])
def test_a_seed_gives_the_same_starts_and_more_go_on_from_fewer(size):
    few, many = (ms.random_starts(count, np.zeros(size), 1.0, seed=7) for count in (3, 6))
    np.testing.assert_array_equal(few, many[:3])
    assert not np.array_equal(few, ms.random_starts(3, np.zeros(size), 1.0, seed=8))
    assert len(np.unique(many[:, 0])) == 6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, 0.0, 1.0), "count must be an integer of at least 1, got 0"),
        ((2.0, 0.0, 1.0), "count must be"),
        ((2, 0.0, 1.0, -1), "seed must be an integer of at least 0"),
        ((2, 0.0, 1.0, None), "seed must be"),
        ((2, 1.0, 0.0), "nowhere above upper"),
        ((2, -np.inf, 0.0), "must be finite"),
        ((2, 0.0, np.nan), "must be finite"),
        ((2, np.zeros(2), np.ones(3)), r"fit each other, got \(2,\) and \(3,\)"),
        ((2, "low", 1.0), "lower must be an array of real numbers"),
    ],
)
def test_bad_input_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        ms.random_starts(*arguments)
