"""Compare the embedded estimate of ms.Adaptive with step doubling on the same ladder.

`PYTHONPATH=. python tests/support/step_doubling.py` prints factorizations at equal errors of a swinging strip.
"""

import numpy as np
from chosen_steps import distance, strip_scene, swinging_strip

import magshell as ms

INTERVAL, INTERVALS = 0.04, 5  # [s], [-]


def by_doubling(scene: ms.Scene, tolerance: float, integrator, order: int) -> tuple[ms.Trajectory, int]:
    """Return the motion in half steps whose error is estimated from a whole one, and its factorizations."""
    level = place = done = factorizations = 0
    start, halves = None, None
    while done < INTERVALS:
        length = INTERVAL / 2**level
        options = {"start": start, "integrator": integrator, "progress": False}
        whole = ms.simulate(scene, steps=1, time_step=length, **options)
        halves = ms.simulate(scene, steps=2, time_step=0.5 * length, **options)
        factorizations += whole.factorizations + halves.factorizations
        error = distance(whole, halves) / (2**order - 1)
        if error > tolerance:
            levels = 2 if error > 2 ** (order + 1) * tolerance else 1
            level, place = level + levels, place << levels
            continue
        start, place = halves.end, place + 1
        if place == 2**level:
            place, done = 0, done + 1
        if level and place % 2 == 0 and error * 2 ** (order + 1) < 0.5 * tolerance:
            level, place = level - 1, place // 2
    return halves, factorizations


def main() -> None:
    """Print the factorizations of step doubling over those of the embedded estimate, at equal errors."""
    scene, exact = strip_scene(), swinging_strip(2000, 1e-4, ms.SDIRK3())
    cases = [
        (ms.TRBDF2(), 2, np.geomspace(1e-4, 1e-7, 8)),
        (ms.ImplicitEuler(), 1, np.geomspace(1e-4, 3e-6, 5)),
    ]
    for integrator, order, tolerances in cases:
        embedded, doubled = [], []
        for tolerance in tolerances:
            steps = ms.Adaptive(INTERVAL, tolerance)
            move = ms.simulate(scene, steps=INTERVALS, time_step=steps, integrator=integrator, progress=False)
            halves, factorizations = by_doubling(scene, tolerance, integrator, order)
            embedded.append((distance(move, exact), move.factorizations))
            doubled.append((distance(halves, exact), factorizations))
        (x, a), (y, b) = np.log(embedded).T, np.log(doubled).T
        between = np.linspace(max(x.min(), y.min()), min(x.max(), y.max()), 5)
        ratios = np.exp(np.polyval(np.polyfit(y, b, 1), between) - np.polyval(np.polyfit(x, a, 1), between))
        print(type(integrator).__name__, np.exp(between), "m:", ratios.round(2), flush=True)


if __name__ == "__main__":
    main()
