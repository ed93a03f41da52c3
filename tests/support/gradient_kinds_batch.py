"""Kinds of scene that are solved as one member of a batch, for gradient_kinds.py."""

import numpy as np
import pytest
from adjoint_scenes import DEFAULTS, everything
from gradient_kinds_linear import as_values, deflection
from gradient_scenes import Kind
from gradient_world import EXACT, FACTORS, REACH

import magshell as ms

torch = pytest.importorskip("torch")
MEMBER, MEMBERS = (
    1,
    4,
)  # no load acts on four vertices or edges, so that it is clear which axis is that of the members


def of_members(values, given):
    """Return values and keywords in which tensors have the same row for each member, and others are shared."""
    values = {
        owner: {name: repeated(each) for name, each in named.items()} for owner, named in values.items()
    }
    return values, {name: repeated(each) for name, each in given.items()}


def repeated(value):
    return torch.stack([value] * MEMBERS) if torch.is_tensor(value) else value


def one_of_equilibria(scene, values, start=None, solver=None, **given):
    """Return one equilibrium of a batch."""
    values, given = of_members(values, given)
    return ms.equilibrium(scene, batch=MEMBERS, values=values, start=start, solver=solver, **given)[MEMBER]


def one_of_warm_starts(scene, values, start=None, solver=None, **given):
    """Return the second equilibrium of one member of a batch of warm starts, near its first one."""
    warm = ms.WarmStart(scene, start=start, solver=solver, batch=MEMBERS)
    numbers = {name: value.detach() if torch.is_tensor(value) else value for name, value in given.items()}
    warm(**{**numbers, "applied_flux_density": 0.98 * np.asarray(numbers["applied_flux_density"])})
    values, given = of_members(values, given)
    with warm.accept_jumps():
        return warm(values=values, **given)[MEMBER]


def one_of_responses(scene, values, **given):
    """Return one linear response of a batch to all loads."""
    values, given = of_members(*as_values(scene, values, given))
    return deflection(ms.linear_response(scene, batch=MEMBERS, values=values, **given)[MEMBER])


def of_a_batch(solve, keeps_shape=False) -> Kind:
    """Build the sheet on which everything acts, as a member of a batch."""
    controls = {**DEFAULTS, **FACTORS}
    return Kind(everything(), controls, solve=solve, fixed=EXACT, reach=REACH, keeps_shape=keeps_shape)


RESPONSES = "a sheet in a batch of linear responses"  # which cannot be saved
BATCH_MAKERS = {
    "a sheet in a batch of equilibria": lambda: of_a_batch(one_of_equilibria),
    "a sheet in a batch of warm starts": lambda: of_a_batch(one_of_warm_starts),
    RESPONSES: lambda: of_a_batch(one_of_responses, keeps_shape=True),
}
