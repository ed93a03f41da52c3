"""The limited-memory BFGS matrix in its compact form.

    B = theta I - W M W^T,   W = [Y, theta S],   M^-1 = [[-D, L^T], [L, theta S^T S]]

S, Y: the last steps and the changes of the gradient; D the diagonal of S^T Y, L what lies below it.
R. H. Byrd, P. Lu, J. Nocedal, C. Zhu, A limited memory algorithm for bound constrained optimization,
SIAM J. Sci. Comput. 16 (1995), (3.2)-(3.4), [BLNZ95].
"""

from __future__ import annotations

import numpy as np

_LEAST_CURVATURE = np.finfo(float).eps  # s.y / y.y of a pair that is kept
_FLATTEST = 1e-8  # of the steepest entry of a diagonal


class Curvature:
    """steps, changes: (k, n), oldest first. With none, B = theta I with the theta given."""

    def __init__(self, steps: np.ndarray, changes: np.ndarray, theta: float):
        self.theta = theta
        self.w: np.ndarray = np.concatenate([changes, theta * steps]).T  # (n, 2 k)
        inner = steps @ changes.T
        below = np.tril(inner, -1)
        inverse = np.block([[-np.diag(np.diag(inner)), below.T], [below, theta * steps @ steps.T]])
        self.m: np.ndarray = np.linalg.inv(inverse)

    def times(self, v: np.ndarray) -> np.ndarray:
        """B v."""
        return self.theta * v - self.w @ (self.m @ (self.w.T @ v))

    def solve_free(self, right: np.ndarray, free: np.ndarray) -> np.ndarray:
        """B_ff^-1 right over the free entries, (n free,). [BLNZ95] (5.11), by Sherman, Morrison and Woodbury."""
        w = self.w[free]
        small = np.eye(w.shape[1]) - self.m @ (w.T @ w) / self.theta
        return right / self.theta + w @ np.linalg.solve(small, self.m @ (w.T @ right)) / self.theta**2


def shows_curvature(step: np.ndarray, change: np.ndarray) -> bool:
    """Whether the gradient's change along a step is one that a convex function could have."""
    return bool(step @ change > _LEAST_CURVATURE * (change @ change))


def updated_diagonal(diagonal: np.ndarray | None, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """(n,) the diagonal of BFGS's update of a diagonal matrix B, which is first brought to the pair's size.

        B+ = r B - r (B s)^2 / s.B s + y^2 / s.y,    r = y.B^-1 y / s.y

    With none yet, B is the unit matrix. After J. C. Gilbert and C. Lemarechal, Some numerical experiments with
    variable-storage quasi-Newton algorithms, Math. Programming 45 (1989).
    """
    old = np.ones_like(step) if diagonal is None else diagonal
    along = step @ change
    size = change @ (change / old) / along
    new = size * old - size * (old * step) ** 2 / (step @ (old * step)) + change**2 / along
    return np.maximum(new, _FLATTEST * new.max())
