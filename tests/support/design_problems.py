"""Optimization problems with known or computable answers, shared by the tests of the optimizers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import nlopt
import numpy as np
import torch


@dataclass(frozen=True, eq=False)
class Problem:
    """function(x) -> objective, or (objective, constraints <= 0); start, lower, upper: (n,).

    scale: the variables' sizes, (n,), where the box does not tell them. known: the published or exact minimum.
    """

    name: str
    function: Callable
    start: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    iterations: int = 100
    scale: np.ndarray | None = None
    known: float | None = None

    def parameter(self, dtype=torch.float64) -> torch.Tensor:
        return torch.tensor(self.start, dtype=dtype, requires_grad=True)


def problem(name, function, start, lower, upper, iterations=100, scale=None, known=None) -> Problem:
    start = np.asarray(start, dtype=float)
    lower, upper = (np.broadcast_to(np.asarray(bound, dtype=float), start.shape) for bound in (lower, upper))
    scale = None if scale is None else np.broadcast_to(np.asarray(scale, dtype=float), start.shape).copy()
    return Problem(name, function, start, lower, upper, iterations, scale, known)


def vector(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float64)


def rosenbrock(x):
    return (100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2).sum()


def cantilever(x):
    """Return objective and constraint of case E1: five hollow beams, Svanberg 1987."""
    return 0.0624 * x.sum(), (vector(61, 37, 19, 7, 1) / x**3).sum()[None] - 1


def two_balls(x):
    """Return objective and constraints of case E2: the nearest point to the origin in two balls."""
    first, second = ((x - vector(*center)) ** 2 for center in ((5, 2, 1), (3, 4, 3)))
    return (x**2).sum(), torch.stack([first.sum() - 9, second.sum() - 9])


def two_bar_truss(x):
    """Return the weight of two bars of area x0 and half distance x1 and two stress limits, Svanberg 1987, 5.1."""
    length = torch.sqrt(1 + x[1] ** 2)
    stresses = [0.124 * length * (8 / x[0] + sign / (x[0] * x[1])) - 1 for sign in (1, -1)]
    return x[0] * length, torch.stack(stresses)


def hs12(x):
    a, b = x
    return 0.5 * a**2 + b**2 - a * b - 7 * a - 7 * b, (4 * a**2 + b**2 - 25)[None]


def hs24(x):
    root = 3**0.5
    objective = ((x[0] - 3) ** 2 - 9) * x[1] ** 3 / (27 * root)
    return objective, torch.stack([x[1] - x[0] / root, -x[0] - x[1] * root, x[0] + x[1] * root - 6])


def hs29(x):
    return -x.prod(), (x[0] ** 2 + 2 * x[1] ** 2 + 4 * x[2] ** 2 - 48)[None]


def hs35(x):
    objective = 9 - 8 * x[0] - 6 * x[1] - 4 * x[2] + 2 * x[0] ** 2 + 2 * x[1] ** 2 + x[2] ** 2
    return objective + 2 * x[0] * x[1] + 2 * x[0] * x[2], (x[0] + x[1] + 2 * x[2] - 3)[None]


def hs38(x):
    a, b, c, d = x
    objective = 100 * (b - a**2) ** 2 + (1 - a) ** 2 + 90 * (d - c**2) ** 2 + (1 - c) ** 2
    return objective + 10.1 * ((b - 1) ** 2 + (d - 1) ** 2) + 19.8 * (b - 1) * (d - 1)


def hs43(x):
    a, b, c, d = x
    objective = a**2 + b**2 + 2 * c**2 + d**2 - 5 * a - 5 * b - 21 * c + 7 * d
    return objective, torch.stack(
        [
            a**2 + b**2 + c**2 + d**2 + a - b + c - d - 8,
            a**2 + 2 * b**2 + c**2 + 2 * d**2 - a - d - 10,
            2 * a**2 + b**2 + c**2 + 2 * a - b - d - 5,
        ]
    )


def hs66(x):
    return 0.2 * x[2] - 0.8 * x[0], torch.stack([x[0].exp() - x[1], x[1].exp() - x[2]])


def hs76(x):
    a, b, c, d = x
    objective = a**2 + 0.5 * b**2 + c**2 + 0.5 * d**2 - a * c + c * d - a - 3 * b + c - d
    return objective, torch.stack([a + 2 * b + c + d - 5, 3 * a + b + 2 * c - d - 4, 1.5 - b - 4 * c])


def hs100(x):
    a, b, c, d, e, f, g = x
    objective = (a - 10) ** 2 + 5 * (b - 12) ** 2 + c**4 + 3 * (d - 11) ** 2 + 10 * e**6
    objective = objective + 7 * f**2 + g**4 - 4 * f * g - 10 * f - 8 * g
    return objective, torch.stack(
        [
            2 * a**2 + 3 * b**4 + c + 4 * d**2 + 5 * e - 127,
            7 * a + 3 * b + 10 * c**2 + d - e - 282,
            23 * a + b**2 + 6 * f**2 - 8 * g - 196,
            4 * a**2 + b**2 - 3 * a * b + 2 * c**2 + 5 * f - 11 * g,
        ]
    )


def bad_scales(x):
    """Return a problem with variables of sizes 1e8, 1 and 1e-4, an objective of size 1e-9 and a constraint of size
    1e6.
    """
    u = x / vector(1e8, 1.0, 1e-4)
    return 1e-9 * ((u - vector(0.7, 0.9, 0.2)) ** 2).sum(), 1e6 * (u.sum() - 1.2)[None]


def resource(x):
    """Return a problem in which many variables share one budget."""
    weights = torch.linspace(1, 3, len(x), dtype=x.dtype)
    return (weights / x).sum() / len(x), (x.mean() - 1)[None]


def many_quadratics(x):
    """Return an objective of 10^4 variables, a third of them at a bound, coupled to their neighbours."""
    target = 1.5 * torch.sin(torch.arange(len(x), dtype=x.dtype))
    return ((x - target) ** 2).sum() + 0.5 * ((x[1:] - x[:-1]) ** 2).sum()


def beale(x):
    a, b = x
    return sum((value - a * (1 - b**k)) ** 2 for k, value in ((1, 1.5), (2, 2.25), (3, 2.625)))


def log_barrier(x):
    return (x - torch.log(x)).sum() + 0.1 * (x.sum() - 3) ** 2


def eight_scales(x):
    return ((x / torch.logspace(-3, 6, 8) - 0.3) ** 4).sum() + (x[0] - 1e-3) ** 2


CONSTRAINED = [
    problem("two-bar truss", two_bar_truss, [1.5, 0.5], [0.2, 0.1], [4.0, 1.6]),
    problem("HS 12", hs12, [0.0, 0.0], -5.0, 5.0, known=-30.0),
    problem("HS 24", hs24, [1.0, 0.5], 0.0, 5.0, known=-1.0),
    problem("HS 29", hs29, [1.0, 1.0, 1.0], 0.0, 7.0, known=-16 * 2**0.5),
    problem("HS 35", hs35, [0.5, 0.5, 0.5], 0.0, 4.0, known=1 / 9),
    problem("HS 43", hs43, [0.0] * 4, -5.0, 5.0, known=-44.0),
    problem("HS 66", hs66, [0.0, 1.05, 2.9], 0.0, [5.0, 5.0, 10.0], known=0.5181632741),
    problem("HS 76", hs76, [0.5] * 4, 0.0, 5.0, known=-4.681818182),
    problem(
        "HS 100", hs100, [1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0], -5.0, 5.0, iterations=300, known=680.6300573
    ),
    problem("budget", resource, np.full(500, 0.5), 0.1, 5.0, iterations=60),
]

BOUNDED = [
    problem("Rosenbrock, corner", rosenbrock, [-1.2, 0.5], -2.0, 0.5),
    problem("Rosenbrock, 20", rosenbrock, np.linspace(-1.0, 0.7, 20), -1.5, 0.8),
    problem("Rosenbrock, 1000", rosenbrock, np.full(1000, -0.5), -2.0, 0.9),
    problem(
        "HS 4", lambda x: (x[0] + 1) ** 3 / 3 + x[1], [1.125, 0.125], [1.0, 0.0], [5.0, 5.0], known=8 / 3
    ),
    problem("HS 38", hs38, [-3.0, -1.0, -3.0, -1.0], -10.0, 10.0),
    problem("Beale", beale, [1.0, 1.0], -4.5, 4.5),
    problem(
        "one-sided", lambda x: ((x - 1) ** 2).sum() + x[0] * x[1], [3.0] * 3, [2.0, -np.inf, 0.0], np.inf
    ),
    problem("logarithms", log_barrier, np.linspace(0.2, 4.0, 50), 0.1, np.linspace(0.5, 5.0, 50), scale=1.0),
    problem(
        "eight scales",
        eight_scales,
        np.full(8, 0.5e-3),
        0.0,
        np.logspace(-3, 6, 8),
        scale=np.logspace(-3, 6, 8),
    ),
    problem("coupled 10^4", many_quadratics, np.zeros(10_000), -1.0, 1.0),
]


def value_and_rows(given: Problem, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return values (1 + m,) and gradients (1 + m, n), by autograd alone and without the library's code."""
    tensor = torch.tensor(x, requires_grad=True)
    result = given.function(tensor)
    values = torch.cat([result[0][None], result[1]]) if isinstance(result, tuple) else result[None]
    rows = [torch.autograd.grad(value, tensor, retain_graph=True)[0].numpy() for value in values]
    return values.detach().numpy(), np.array(rows)


@cache
def nlopt_mma(given: Problem) -> tuple[np.ndarray, float]:
    """Return the minimizer and the minimum that NLopt's MMA finds, with variables scaled to their bounds."""
    width = given.upper - given.lower
    optimizer = nlopt.opt(nlopt.LD_MMA, len(given.start))
    optimizer.set_lower_bounds(np.zeros_like(width))
    optimizer.set_upper_bounds(np.ones_like(width))
    values, rows = value_and_rows(given, given.start)
    sizes = np.abs(rows * width).max(axis=1)
    sizes[sizes == 0] = 1.0
    last = {}

    def at(u):
        if u.tobytes() not in last:
            last.clear()
            last[u.tobytes()] = value_and_rows(given, given.lower + width * u)
        return last[u.tobytes()]

    def function(i):
        def call(u, gradient):
            values, rows = at(u)
            if gradient.size:
                gradient[:] = rows[i] * width / sizes[i]
            return float(values[i] / sizes[i])

        return call

    optimizer.set_min_objective(function(0))
    for i in range(1, len(values)):
        optimizer.add_inequality_constraint(function(i), 1e-10)
    optimizer.set_xtol_rel(1e-9)
    optimizer.set_maxeval(1000)
    u = optimizer.optimize((given.start - given.lower) / width)
    return given.lower + width * u, optimizer.last_optimum_value() * sizes[0]


class AcceptsJumps:
    """A checkpointed object that can accept a jump of the equilibrium, like ms.WarmStart."""

    accepting = False

    @contextmanager
    def accept_jumps(self) -> Iterator[None]:
        self.accepting = True
        yield
        self.accepting = False
