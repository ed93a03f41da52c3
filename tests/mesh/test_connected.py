"""Tests of connected groups."""

import numpy as np
import pytest
import scipy

from magshell.mesh.connected import connected_groups


@pytest.mark.parametrize("count, pairs", [(0, 0), (1, 0), (7, 3), (200, 80), (200, 150), (3000, 2500)])
@pytest.mark.parametrize("seed", range(3))
def test_connected_groups_equal_those_of_scipy(count: int, pairs: int, seed: int) -> None:
    chosen = np.random.default_rng(seed).integers(0, max(count, 1), (pairs, 2))
    graph = scipy.sparse.coo_array((np.ones(pairs), tuple(chosen.T)), shape=(max(count, 1), max(count, 1)))
    wanted = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][:count]
    np.testing.assert_array_equal(connected_groups(count, chosen), wanted)


@pytest.mark.parametrize("order", [1, -1])
def test_a_long_chain_is_one_group(order: int) -> None:
    chain = np.stack([np.arange(4999), np.arange(1, 5000)], axis=1)[::order]
    assert not connected_groups(5000, chain).any()
