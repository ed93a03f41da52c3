"""Factorizations and gain of energy of random contact scenes (contact_scenes.py), by integrator.

PYTHONPATH=tests/hard python tests/hard/contact_costs.py FIRST COUNT [WORD ...]

simulates the scenes of seeds FIRST to FIRST + COUNT - 1 by the integrators whose name contains one of the words (by default
by all in INTEGRATORS) and prints one line for each, after one for each scene with a costly step.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np
from contact_scenes import Watch, drawn

import magshell as ms

INTEGRATORS = (ms.ImplicitEuler(), ms.TRBDF2(), ms.TRBDF2(implicit_contact=True))
COSTLY = 60  # factorizations of a step that are too many (issue 32)


def motion(seed: int, integrator) -> tuple[ms.Trajectory, str | None, float]:
    """Return the motion of a seed, what is wrong with it or None, and its largest gain of energy over what was put in."""
    each = drawn(seed)
    each.arguments["integrator"] = integrator
    wrong = None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            move = ms.simulate(each.scene, **each.arguments)
        except ms.NotConverged as error:
            move, wrong = error.last_good, str(error).splitlines()[0]
    watch = Watch(each.scene)
    for positions in move.positions:
        wrong = wrong or watch.complaint(positions)
    return move, wrong, float(np.max(move.energy - move.energy[0]) / each.put_in)


def main(first: int, count: int, words: list[str]) -> None:
    """Print one line for each integrator, and one for each scene that ends wrongly or has a costly step."""
    for integrator in INTEGRATORS:
        if words and not any(word in repr(integrator) for word in words):
            continue
        costs, gains, wrongs = [], [], 0
        for seed in range(first, first + count):
            move, wrong, gain = motion(seed, integrator)
            costs.append(move._step_factorizations)
            gains.append(gain)
            wrongs += wrong is not None
            if wrong or costs[-1].max(initial=0) > COSTLY:
                remark = f"in parts {move.substeps} {wrong or ''} ({drawn(seed).words})"
                print(f"  {seed}: {costs[-1].tolist()} {remark}", flush=True)
        means = np.array([each.mean() for each in costs])
        largest = np.array([each.max() for each in costs])
        print(
            f"{integrator!r}: {count} scenes, {wrongs} end wrongly, energy gained {max(gains):.1e}, factorizations per step "
            f"{np.concatenate(costs).mean():.2f} in the mean, {means.max():.1f} in the costliest scene; above {COSTLY} in "
            f"the mean of {(means > COSTLY).sum()} scenes, in a step of {(largest > COSTLY).sum()}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])
