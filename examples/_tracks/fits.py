"""Fields that lead the tip along a curve, found by several methods, and the resulting motions of the strip."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms
from magshell import control

from .model import LIMIT, TIME_STEP, Strip, Task

CONTROL_POINTS = 20


@dataclass(frozen=True)
class Method:
    """A method to find the field.

    unknowns: "steps", one field a step, or "spline", control points. optimizer: function that makes one from a list
    of tensors.
    """

    label: str
    unknowns: str
    optimizer: Callable
    integrator: ms.ImplicitEuler | ms.SDIRK2


def _mma(parameters):
    # A field of one step matters little; that of many together does: small moves, near asymptotes.
    return ms.optim.MMA(parameters, lower=-LIMIT, upper=LIMIT, move=0.02, asymptote_initial=0.04)


def _lbfgs(parameters):
    return ms.optim.LBFGS(parameters, lower=-LIMIT, upper=LIMIT)


METHODS = {
    "paper": Method("a value a step, MMA", "steps", _mma, ms.ImplicitEuler()),
    "spline": Method("spline, L-BFGS", "spline", _lbfgs, ms.ImplicitEuler()),
    "ours": Method("spline, L-BFGS, second order", "spline", _lbfgs, ms.SDIRK2()),
}


@dataclass(frozen=True)
class Fit:
    """The result of one method.

    field: (steps, 3), one a step, or (steps + 1, 3), at the ends of all steps, T. positions: (steps + 1, n_v, 3) m, of
    the strip in it. track: (steps + 1, 3) m, of the tip. replayed: the track in the same field, by an integrator whose
    errors are far smaller.
    """

    method: Method
    task: Task
    field: np.ndarray
    positions: np.ndarray
    track: np.ndarray
    replayed: np.ndarray
    history: list  # as that of ms.minimize

    @property
    def figures(self) -> dict[str, float]:
        return figures(self.track, self.task)

    @property
    def time_error(self) -> float:
        """The largest distance between the track and the replayed one, m."""
        return np.linalg.norm(self.track - self.replayed, axis=1).max()

    @property
    def seconds(self) -> float:
        """The wall time of an iteration, s."""
        return self.history[-1].seconds / max(1, self.history[-1].iteration)


def fitted(strip: Strip, task: Task, method: Method, *, iterations: int, progress: bool = False) -> Fit:
    """Search for the field from zero by one method."""
    rows = task.steps if method.unknowns == "steps" else CONTROL_POINTS
    unknowns = torch.zeros(rows, 3, dtype=torch.float64, requires_grad=True)

    def objective(unknowns):
        move = strip.move(_field(method, unknowns, task), task.steps, integrator=method.integrator)
        return task.squares(control.track(move.positions, strip.tip))

    found = ms.minimize(objective, [unknowns], method.optimizer, max_iterations=iterations, progress=progress)
    flux_density = _field(method, unknowns.detach(), task).numpy()
    positions = strip.move(flux_density, task.steps, integrator=method.integrator).positions
    return Fit(
        method=method,
        task=task,
        field=flux_density,
        positions=positions,
        track=positions[:, strip.tip],
        replayed=replayed(strip, task, flux_density),
        history=found.history,
    )


def _field(method: Method, unknowns, task: Task):
    if method.unknowns == "steps":
        return unknowns
    times = control.step_times(task.steps, TIME_STEP)
    return control.spline(times, unknowns, duration=task.steps * TIME_STEP)


def figures(track: np.ndarray, task: Task) -> dict[str, float]:
    """Return the figures of merit of a track.

    squares: the objective [m2]. mean, largest: distances from the curve over the frames that count; missed: largest
    distance of a point of the curve from the track; start, end: distance of the tip from these points at the requested
    times, m.
    """
    counts = track[task.first :]
    distances = task.curve.squared_distance(counts).numpy() ** 0.5
    passed = control.Polyline(counts).squared_distance(task.curve.at(np.linspace(0, 1, 201))).numpy() ** 0.5
    return {
        "squares": float(sum(task.squares(track).values())),
        "mean": distances.mean(),
        "largest": distances.max(),
        "missed": passed.max(),
        "start": float(np.linalg.norm(track[task.first] - task.curve.start.numpy())),
        "end": float(np.linalg.norm(track[-1] - task.curve.end.numpy())),
    }


def replayed(strip: Strip, task: Task, flux_density: np.ndarray, parts: int = 2) -> np.ndarray:
    """Simulate the track in the same field, by the third-order integrator in shorter steps."""
    if len(flux_density) == task.steps:
        finer = np.repeat(flux_density, parts, axis=0)
    else:
        ends, shares = np.arange(task.steps + 1), np.arange(parts * task.steps + 1) / parts
        finer = np.stack([np.interp(shares, ends, component) for component in flux_density.T], axis=1)
    move = strip.move(
        finer,
        parts * task.steps,
        integrator=ms.SDIRK3(),
        time_step=TIME_STEP / parts,
        record_every=parts,
    )
    return move.positions[:, strip.tip]


def cost(strip: Strip, fit: Fit) -> dict[str, float]:
    """Measure the processor time of a step [ms]: forward, and backward for the gradient by the field."""
    flux_density = torch.tensor(fit.field, requires_grad=True)
    began = time.process_time()
    move = strip.move(flux_density, fit.task.steps, integrator=fit.method.integrator)
    moved = time.process_time()
    sum(fit.task.squares(control.track(move.positions, strip.tip)).values()).backward()
    ended = time.process_time()
    a_step = 1e3 / fit.task.steps
    return {"forward": a_step * (moved - began), "backward": a_step * (ended - moved)}
