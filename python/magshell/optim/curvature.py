"""The limited-memory BFGS matrix in its compact form.

    B = theta I - W M W^T,   W = [Y, theta S],   M^-1 = [[-D, L^T], [L, theta S^T S]]

S, Y: the last steps and the changes of the gradient; D the diagonal of S^T Y, L what lies below it.
Byrd, Lu, Nocedal, Zhu, A limited memory algorithm for bound constrained optimization, SIAM J. Sci. Comput. 16
(1995), (3.2)-(3.4).
"""

from __future__ import annotations

import numpy as np

_LEAST_CURVATURE = np.finfo(float).eps  # s.y / y.y of a pair that is kept


class Curvature:
    """steps, changes: (k, n), oldest first. With none, B = theta I with the theta given."""

    def __init__(self, steps: np.ndarray, changes: np.ndarray, theta: float):
        self.theta = theta
        self.w = np.concatenate([changes, theta * steps]).T  # (n, 2 k)
        inner = steps @ changes.T
        below = np.tril(inner, -1)
        inverse = np.block([[-np.diag(np.diag(inner)), below.T], [below, theta * steps @ steps.T]])
        self.m = np.linalg.inv(inverse)

    def times(self, v: np.ndarray) -> np.ndarray:
        """B v."""
        return self.theta * v - self.w @ (self.m @ (self.w.T @ v))

    def solve_free(self, right: np.ndarray, free: np.ndarray) -> np.ndarray:
        """B_ff^-1 right over the free entries, (n free,). [BLNZ95] (5.11), by Sherman, Morrison and
        Woodbury."""
        w = self.w[free]
        small = np.eye(w.shape[1]) - self.m @ (w.T @ w) / self.theta
        return right / self.theta + w @ np.linalg.solve(small, self.m @ (w.T @ right)) / self.theta**2


def remembered(pairs: tuple[np.ndarray, np.ndarray], step: np.ndarray, change: np.ndarray, memory: int):
    """The pairs (k, n) with a new one, the oldest dropped; unchanged where the new one shows no positive
    curvature."""
    if not step @ change > _LEAST_CURVATURE * (change @ change):
        return pairs
    return tuple(np.vstack([old, new])[-memory:] for old, new in zip(pairs, (step, change), strict=True))
