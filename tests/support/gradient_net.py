"""Losses of the kinds of scene of gradient_kinds.py, their derivatives in both modes, and differences to compare with."""

from functools import cache
from typing import NamedTuple
from zlib import crc32

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_scenes import admissible, label, subject

import magshell as ms

torch = pytest.importorskip("torch")
from torch.autograd import forward_ad  # noqa: E402

LARGE = 1e-3  # m, of the mesh of 0.1 m, and per ms
OUTPUTS = {"displacements": 1.0 / LARGE, "edge_rotations": 0.1, "velocities": 1e-2 / LARGE, "numbers": 1.0}
LONGEST = 30.0  # as far, in steps of the kind, an input that matters little is moved along the one direction
NOISE = 1e3  # least share of each input, over the round-off of differences


@cache
def weights_of(name, shape):
    return torch.from_numpy(np.random.default_rng(len(name)).standard_normal(shape))


def loss_of(found):
    """Return a loss that is linear and quadratic in every differentiable result."""
    total = 0.0
    for name, size in OUTPUTS.items():
        if not hasattr(found, name):
            continue
        values = size * torch.as_tensor(getattr(found, name))
        total = total + (weights_of(name, values.shape) * values).sum() + 0.01 * (values[..., ::2] ** 2).sum()
    for part in found.scene.rigid_parts if hasattr(found, "scene") else ():
        turned, center = torch.as_tensor(found[part].rotation), torch.as_tensor(found[part].center)
        total = total + (weights_of("turned", turned.shape) * turned).sum()
        total = total + (weights_of("center", center.shape) * center / LARGE).sum()
    return total


def start_of(found):
    """Return where searches start that are to end on the branch of this equilibrium; None for other results."""
    return found if isinstance(found, ms.Equilibrium | ms.EquilibriumSet) else None


@cache
def at(name):
    """Return the equilibrium at which searches start, so that differences stay on one branch."""
    return start_of(kind(name).found({})) if kind(name).function is ms.equilibrium else None


def loss(name, given, start=None) -> float:
    return float(loss_of(kind(name).found(given, start)))


@cache
def rounding(name) -> float:
    """Return the error of differences of a kind that is as it was made."""
    return noise(name, loss(name, {}, at(name)))


def tensors_of(given):
    return {key: torch.tensor(value, requires_grad=True) for key, value in given.items()}


def gradients(name, given):
    tensors = tensors_of(given)
    loss_of(kind(name).found(tensors, at(name))).backward()
    return {key: tensor.grad.numpy() for key, tensor in tensors.items()}


def moved(given, direction, t: float):
    """Return the inputs, moved along a direction of some of them."""
    return {key: value + t * direction.get(key, 0.0) for key, value in given.items()}


def agrees(loss_at, exact: float, tolerance: float, step: float) -> bool:
    """Return whether a slope is the central difference of loss_at(t).

    A difference that does not agree is extrapolated with one of twice the step (Richardson), whose error is of fourth
    order.
    """

    def slope(size):
        return (loss_at(size) - loss_at(-size)) / (2.0 * size)

    short = slope(0.5 * step)
    if short == pytest.approx(exact, rel=0.0, abs=tolerance):
        return True
    long = slope(step)
    assert abs(long - short) < 100.0 * tolerance, "no smooth place: differences say nothing here"
    return (4.0 * short - long) / 3.0 == pytest.approx(exact, rel=0.0, abs=tolerance)


def size_of(name, key, value) -> float:
    return kind(name).reach.get(key[1], np.abs(value).max(initial=0.0) or 1.0)


def unit(vector):
    return vector / (np.linalg.norm(vector) or 1.0)


def noise(name, value: float) -> float:
    """Return the error of differences due to round-off, of a loss of this value: equilibria are found to about 1e-12 of it.

    Implicit contact multiplies contact and friction by up to 3.4, and their round-off: 2.2e-5 for 1.9e-5 on x86-64-v2.
    """
    accuracy = 3.4e-12 if "contact implicit" in name else 1e-12
    return accuracy * max(abs(value), 1.0) / kind(name).step


class OneDirection(NamedTuple):
    """All inputs of a kind, the gradient by them, and one direction in which each has about the same share of the slope.

    given, by, way: by input. share: of each input. noise: of differences. tangent: the slope along the part of the
    direction of some inputs, `forward`, by forward mode.
    """

    given: dict[tuple, np.ndarray]
    by: dict[tuple, np.ndarray]
    way: dict[tuple, np.ndarray]
    share: float
    noise: float
    forward: list[tuple]
    tangent: float

    def exact(self, keys) -> float:
        """Return the slope along the part of the direction of these inputs, by the gradient."""
        return sum(float((self.by[key] * self.way[key]).sum()) for key in keys)


def direction_of(name, given, by, noise_of_differences) -> tuple[dict[tuple, np.ndarray], float]:
    """Return a direction of all inputs, and the share of the slope along it that each input has.

    The direction of each input is its gradient and half as much of a pseudo-random one. It is as long as gives it the
    median of the shares that steps of the input's size would have, but at most LONGEST steps.
    """
    ways, shares = {}, {}
    for key, each in by.items():
        rng = np.random.default_rng(crc32(f"{name} {label(kind(name), key)}".encode()))
        some = unit(admissible(key, rng.standard_normal(each.shape)))
        ways[key] = size_of(name, key, given[key]) * unit(unit(admissible(key, each)) + 0.5 * some)
        shares[key] = abs(float((each * ways[key]).sum()))
    share = max(float(np.median(list(shares.values()))), NOISE * noise_of_differences)
    least = share / LONGEST
    return {key: way * (share / max(shares[key], least)) for key, way in ways.items()}, share


@cache
def _first_kinds() -> dict[tuple, str]:
    """Return the first kind that has an input, by what it is an input of."""
    first: dict[tuple, str] = {}
    for name in MAKERS:
        for key in kind(name).together:
            first.setdefault(subject(kind(name), key), name)
    return first


def forward_inputs(name, given) -> list[tuple]:
    """Return the inputs by which tangents are compared: those that no kind before has, and one of the others.

    A tangent takes a difference of the forces for each input, and so as long as dozens of solves for all of them.
    """
    keys = list(given)
    new = [key for key in keys if _first_kinds()[subject(kind(name), key)] == name]
    one = keys[crc32(name.encode()) % len(keys)]
    return new if one in new else [*new, one]


def directed(name, given, forward, value_of) -> OneDirection:
    """Return derivatives of value_of(tensors), a loss, by all inputs together: one solve, one adjoint and one tangent."""
    tensors = tensors_of(given)
    value, one = value_of(tensors), torch.ones((), dtype=torch.float64, requires_grad=True)
    rows = torch.autograd.grad(value, list(tensors.values()), one, create_graph=True)
    by = {key: row.detach().numpy() for key, row in zip(tensors, rows, strict=True)}
    of_differences = noise(name, float(value.detach()))
    way, share = direction_of(name, given, by, of_differences)
    along = [torch.as_tensor((key in forward) * np.asarray(each)) for key, each in way.items()]
    (tangent,) = torch.autograd.grad(rows, one, along)
    return OneDirection(given, by, way, share, of_differences, forward, float(tangent))


@cache
def one_direction(name) -> tuple[OneDirection, object]:
    """Return derivatives of the loss of a kind, and where searches nearby start."""
    given, ends = kind(name).together, []

    def value_of(tensors):
        ends.append(kind(name).found(tensors))
        return loss_of(ends[0])

    return directed(name, given, forward_inputs(name, given), value_of), start_of(ends[0])


def dual_tangent(name) -> float:
    """Return the slope along the same part of the direction that is computed with a motion, step by step."""
    of, _ = one_direction(name)
    with forward_ad.dual_level():
        duals = {
            key: forward_ad.make_dual(torch.tensor(of.given[key]), torch.as_tensor(np.asarray(of.way[key])))
            for key in of.forward
        }
        return float(forward_ad.unpack_dual(loss_of(kind(name).found({**of.given, **duals}))).tangent)
