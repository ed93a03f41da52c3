"""Input that the factorizations of sparse symmetric matrices refuse."""

import numpy as np
import pytest

from magshell import _core

BACKENDS = _core.factor_backends()


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((-1, [0], []), "cannot be -1"),
        ((2, [0, 1], [0]), "size \\+ 1 = 3 entries, got 2"),
        ((2, [0, 1, 3], [0, 1]), "run from 0 to the number of rows, 2; it runs from 0 to 3"),
        ((2, [0, 3, 2], [0, 1]), "column_starts\\[1\\] = 3 exceeds the 2 rows"),
        ((3, [0, 2, 1, 3], [0, 1, 2]), "decreases after column 1"),
        ((2, [0, 2, 4], [0, 1, 0, 1]), "rows\\[2\\] = 0 in column 1 is above the diagonal"),
        ((2, [0, 1, 2], [0, 2]), "rows\\[1\\] = 2 in column 1 is outside the matrix, whose size is 2"),
        (
            (3, [0, 3, 4, 5], [0, 2, 1, 1, 2]),
            "rows\\[2\\] = 1 in column 0 is not greater than the row before",
        ),
        ((2, [0, 1, 2], [1, 1]), "column 0 lacks its diagonal"),
        ((2, [0, 1, 1], [0]), "column 1 lacks its diagonal"),
    ],
)
def test_malformed_patterns_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        _core.analyze(*arguments)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(bad, backend):
    factor = _core.analyze(2, [0, 2, 3], [0, 1, 1], backend=backend)
    with pytest.raises(ValueError, match=f"values\\[1\\] is {bad}"):
        factor.factorize([2.0, bad, 2.0])


def test_wrong_sizes_and_names_are_refused():
    factor = _core.analyze(2, [0, 2, 3], [0, 1, 1])
    with pytest.raises(ValueError, match="factorize\\(\\) has not been called"):
        factor.solve([1.0, 1.0])
    with pytest.raises(ValueError, match="each of the 3 rows of the pattern, got 2"):
        factor.factorize([1.0, 2.0])
    factor.factorize([2.0, 1.0, 2.0])
    with pytest.raises(ValueError, match="must have 2 rows, got 3"):
        factor.solve(np.ones(3))
    with pytest.raises(ValueError, match="shape \\(n,\\) or \\(n, k\\)"):
        factor.solve(np.ones((2, 1, 1)))
    with pytest.raises(ValueError, match='must be one of "supernodal", "cholmod", "eigen", got "lu"'):
        _core.analyze(1, [0, 1], [0], backend="lu")
