"""Products with a Jacobian from both sides, by forward and by reverse mode, for results that are torch tensors."""

from typing import NamedTuple

import numpy as np
import torch
from gradient_kinds import kind
from gradient_scenes import admissible


class BothModes(NamedTuple):
    """Holds w . (J d) by the tangent and (w . J) . d by the gradient, and the sizes that bound their difference."""

    forward: float
    backward: float
    size: float  # sum over results of |w| |J d|
    size_of_results: float  # sum of |w| |result|
    tangents: tuple[torch.Tensor, ...]  # J d of each result


def direction(name, key, value, rng):
    """Return a random direction of an input of a kind of the gradient net, as long as what the input may change by."""
    size = kind(name).reach.get(key[1], np.abs(value).max(initial=0.0) or 1.0)
    return torch.as_tensor(np.asarray(size * admissible(key, rng.standard_normal(value.shape))))


def by_both_modes(results, inputs, along, rng) -> BothModes:
    """Return the product of random weights, the Jacobian of `results` by `inputs` and the directions `along`."""
    zeros = [torch.zeros_like(each, requires_grad=True) for each in results]
    transposed = torch.autograd.grad(results, inputs, zeros, create_graph=True)
    tangents = torch.autograd.grad(transposed, zeros, along)
    weights = [torch.as_tensor(rng.standard_normal(each.shape)) for each in results]
    gradients = torch.autograd.grad(results, inputs, weights)
    return BothModes(
        sum(float((w * t).sum()) for w, t in zip(weights, tangents, strict=True)),
        sum(float((g * d).sum()) for g, d in zip(gradients, along, strict=True)),
        sum(float(w.norm() * t.norm()) for w, t in zip(weights, tangents, strict=True)),
        sum(float(w.norm() * r.detach().norm()) for w, r in zip(weights, results, strict=True)),
        tangents,
    )
