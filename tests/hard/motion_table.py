"""Prints what motions with contact reach by implicit Euler and by TR-BDF2 with implicit contact, the default, in one table.

PYTHONPATH=.:tests/hard:tests/support python tests/hard/motion_table.py [SCENES]

takes some minutes with 200 random scenes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
from ball_impacts import ball_rebound, ball_with_backspin
from contact_costs import COSTLY, motion
from impacts import bar_on_a_wall, bars_that_collide, cube_on_a_plane, rebound
from rolling_sheet import rolling_sheet, travel

import magshell as ms

Row = tuple[str, str, str]  # what, the bound that is wished, what was measured


def sheet_rows(integrator) -> Iterator[Row]:
    """Yield the costs of the rolling sheet, and how a small change of the field changes its way."""
    for step, most in ((8.0, 1000), (4.0, 1000), (2.0, 1200), (1.0, 1600)):
        move = rolling_sheet(1e-3 * step, integrator=integrator)
        parts = len(move.substeps)
        yield (
            f"rolling sheet, {step:g} ms: factorizations",
            f"{most}, none in parts",
            f"{move.factorizations}, {parts} in parts, {travel(move):.3f} mm",
        )
    changed, plain = (rolling_sheet(4e-3, factor, integrator=integrator) for factor in (1.0 + 1e-8, 1.0))
    moved = 1e3 * np.abs(changed.positions[-1] - plain.positions[-1]).max()
    yield "the same, field changed by 1e-8, 4 ms [mm]", "1e-6", f"{moved:.1e}"


def impact_rows(integrator) -> Iterator[Row]:
    """Yield the restitution of impacts whose restitution is known."""
    for steps, least in ((59, 0.98), (75, 0.98)):
        yield (
            f"elastic ball, {steps} steps in contact",
            f"{least}",
            f"{ball_rebound(integrator, steps)[0]:.3f}",
        )
    move, mass, speed = bars_that_collide(integrator, 50)
    back = -(mass @ move[move.scene.bodies[0]].velocities[-1][:, 0]) / mass.sum() / speed
    yield "two bars", "0.97", f"{back:.4f}"
    for stiffness in (50.0, 2500.0):
        move, mass, speed = bar_on_a_wall(integrator, 0.1, stiffness)
        gain = move.energy.max() / move.energy[0] - 1.0
        yield (
            f"bar on a wall of {stiffness:g} Pa/m, 20 steps; energy over its start",
            "0.93; 1e-6",
            f"{rebound(move, mass, speed):.3f}; {gain:.0e}",
        )
    for ratio in (2.0, 20.0, 200.0):
        phases = np.linspace(0.0, 1.0, 60)
        back = [rebound(*cube_on_a_plane(integrator, ratio, phase)) for phase in phases]
        yield f"unresolved impact, steps of {ratio:g} contact times, 60 phases", "0.45", f"{max(back):.3f}"
    for step in (4e-3, 2e-3):
        speed, time, _ = ball_with_backspin(integrator, step)
        yield (
            f"backspin, {1e3 * step:g} ms: speed, time over closed forms",
            "3 %, 3 %",
            f"{100 * (speed - 1):.1f} %, {100 * (time - 1):.1f} %",
        )


def scene_row(integrator, scenes: int) -> Row:
    """Return the costs of random contact scenes."""
    costs, gains, wrongs = [], [], 0
    for seed in range(scenes):
        move, wrong, gain = motion(seed, integrator)
        costs.append(move._step_factorizations)
        gains.append(gain)
        wrongs += wrong is not None
    each = np.concatenate(costs)
    return (
        f"{scenes} random scenes: factorizations a step",
        f"{COSTLY} at most, no gain",
        f"{each.mean():.2f} in the mean, {max(cost.mean() for cost in costs):.1f} in the costliest scene, {each.max()} in "
        f"the costliest step, {(each > COSTLY).sum()} steps above; {wrongs} end wrongly, energy gained {max(gains):.0e}",
    )


def main(scenes: int) -> None:
    """Print one line for each row and integrator."""
    for integrator in (ms.ImplicitEuler(), ms.TRBDF2(implicit_contact=True)):
        print(f"{integrator!r}", flush=True)
        for rows in (sheet_rows(integrator), impact_rows(integrator), iter([scene_row(integrator, scenes)])):
            for what, wished, measured in rows:
                print(f"  {what} (wished: {wished}): {measured}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
