"""Every input of every object in every kind of scene against differences; one that is new is here by being there.

A gradient that forgets a way from an input to the shape is a wrong number that nobody notices. So each input is taken
alone, where everything else is as it was made, defaults too, and all together, where nothing is left to a default.
"""

from functools import cache

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_scenes import admissible, label, subject, subjects

import magshell as ms

torch = pytest.importorskip("torch")

LARGE = 1e-3  # m, of the mesh of 0.1 m, and per ms
PRECISION = 2e-5
OUTPUTS = {"displacements": 1.0 / LARGE, "edge_rotations": 0.1, "velocities": 1e-2 / LARGE, "numbers": 1.0}


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


@cache
def at(name):
    """Return the equilibrium at which searches start, so that differences stay on one branch."""
    found = kind(name).found({})
    return found if isinstance(found, ms.Equilibrium | ms.EquilibriumSet) else None


def loss(name, given) -> float:
    return float(loss_of(kind(name).found(given, at(name))))


def gradients(name, given):
    tensors = {key: torch.tensor(value, requires_grad=True) for key, value in given.items()}
    loss_of(kind(name).found(tensors, at(name))).backward()
    return {key: tensor.grad.numpy() for key, tensor in tensors.items()}


def slope(name, given, direction, size) -> float:
    """Return the central difference along a direction."""
    above, below = (
        loss(name, {key: value + sign * size * direction.get(key, 0.0) for key, value in given.items()})
        for sign in (1, -1)
    )
    return (above - below) / (2.0 * size)


def check(name, given, key, by, along, steepest):
    """Compare the gradient by one input along a direction with differences.

    The direction is scaled to the input's size. A difference that does not agree is extrapolated with one of twice the
    step (Richardson), whose error is of fourth order.
    """
    direction = {key: size_of(name, key, given[key]) * along}
    exact = float((by * direction[key]).sum())
    tolerance = PRECISION * steepest + rounding(name)
    short = slope(name, given, direction, 0.5 * kind(name).step)
    if short == pytest.approx(exact, rel=0.0, abs=tolerance):
        return
    long = slope(name, given, direction, kind(name).step)
    assert abs(long - short) < 100.0 * tolerance, "no smooth place: differences say nothing here"
    assert (4.0 * short - long) / 3.0 == pytest.approx(exact, rel=0.0, abs=tolerance), label(kind(name), key)


def size_of(name, key, value) -> float:
    return kind(name).reach.get(key[1], np.abs(value).max(initial=0.0) or 1.0)


def unit(vector):
    return vector / (np.linalg.norm(vector) or 1.0)


@cache
def rounding(name) -> float:
    """Return the error of differences due to round-off: equilibria are found to a relative 1e-13.

    Implicit contact multiplies contact and friction by up to 3.4, and their round-off: 2.2e-5 for 1.9e-5 on x86-64-v2.
    """
    accuracy = 3.4e-12 if "contact implicit" in name else 1e-12
    return accuracy * max(abs(loss(name, {})), 1.0) / kind(name).step


ROWS = [
    pytest.param(name, key, id=f"{name}: {label(kind(name), key)}")
    for name in MAKERS
    for key in kind(name).entries
]


@pytest.mark.parametrize("name, key", ROWS)
def test_an_input_alone(name, key):
    given = {key: kind(name).entries[key]}
    by = gradients(name, given)[key]
    assert by.shape == given[key].shape and np.isfinite(by).all()
    steepest = size_of(name, key, given[key]) * np.linalg.norm(by)
    some = admissible(key, np.random.default_rng(5).standard_normal(by.shape))
    for along in (by, some) if by.size > 1 and steepest else (some,):
        check(name, given, key, by, unit(along), steepest)


@cache
def differentiated(name):
    given = kind(name).together
    return given, gradients(name, given)


@pytest.mark.parametrize("name", MAKERS)
def test_all_inputs_together(name):
    given, by = differentiated(name)
    for key, each in by.items():
        some = admissible(key, np.random.default_rng(6).standard_normal(each.shape))
        steepest = size_of(name, key, given[key]) * np.linalg.norm(each)
        check(name, given, key, each, unit(unit(each) + 0.5 * unit(some)), steepest)


# Nothing depends on these.
WITHOUT_EFFECT = {(ms.obstacles.Sphere, "rotation"), (ms.Prismatic, "origin"), (ms.Fixed, "origin")}


def test_no_input_is_forgotten_and_each_matters_somewhere():
    """Check that each value of an object and each keyword of a solve has an effect in some kind of scene."""
    seen = set(WITHOUT_EFFECT)
    for name in MAKERS:
        given, by = differentiated(name)
        for key in kind(name).entries:
            if key not in given or (
                size_of(name, key, given[key]) * np.linalg.norm(by[key]) > 1e2 * rounding(name)
            ):
                seen.add(subject(kind(name), key))
    missing = sorted(f"{what.__name__}: {name}" for what, name in subjects() - seen)
    assert not missing, missing
