"""Kinds of scene whose motions take steps of unequal lengths: given one by one, or chosen by their estimated errors."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from gradient_scenes import Kind

import magshell as ms

_RATIOS = np.array([1.0, 0.6, 1.7, 0.8, 1.3, 0.5])  # of neighbouring steps


def in_given_steps(made: Kind) -> Kind:
    """Build the kind with a length for each step."""
    lengths = made.inputs["time_step"] * np.resize(_RATIOS, made.fixed["steps"])
    return replace(made, inputs={**made.inputs, "time_step": lengths})


def in_divided_steps(made: Kind) -> Kind:
    """Build the kind with steps that divide the intervals of its time grid, as ms.Adaptive left them; all grow alike."""
    shares = np.concatenate(
        [[0.5, 0.25, 0.25], *([1.0] if k % 2 else [0.5, 0.5] for k in range(made.fixed["steps"] - 1))]
    )

    def solve(scene, values, time_step, **keywords):
        return ms.simulate(scene, values=values, time_step=time_step * _like(time_step, shares), **keywords)

    return replace(made, solve=solve)


def in_chosen_steps(made: Kind, tolerance: float) -> Kind:
    """Build the kind with steps of ms.Adaptive; the interval of the time grid takes the place of the time step."""

    def solve(scene, values, time_step, **keywords):
        return ms.simulate(scene, values=values, time_step=ms.Adaptive(time_step, tolerance), **keywords)

    return replace(made, solve=solve)


def _like(value, numbers: np.ndarray):
    return value.new_tensor(numbers) if hasattr(value, "new_tensor") else numbers


def step_makers(moving: Callable, thrown: Callable, with_motors: Callable, steps: int) -> dict[str, Callable]:
    """Return the makers of these kinds, by name, from those of kinds with equal steps."""
    return {
        "in steps of given lengths, everything moves": lambda: in_given_steps(
            moving(ms.TRBDF2(), in_time=steps, adjoint_storage="checkpoints")
        ),
        "in steps of given lengths, with a driven skeleton": lambda: in_given_steps(with_motors(ms.TRBDF2())),
        "in divided steps, onto a carried obstacle": lambda: in_divided_steps(thrown(in_time=6)),
        "in chosen steps": lambda: in_chosen_steps(moving(ms.SDIRK3(), "hinge"), 2e-5),
        "in chosen steps, onto an obstacle": lambda: in_chosen_steps(thrown(), 3e-5),
    }
