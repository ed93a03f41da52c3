"""The magnetization of a solve: of all bodies at once, of each by itself, or their own."""

from __future__ import annotations

import numpy as np

from .._checks.tensors import is_tensor, require_torch
from ..bodies.bodies import joined

_NAME = "remanent_magnetization"


def check_given_once(scene, given, replaced: dict[object, dict]) -> None:
    """Raises ValueError where it is given twice, or without a field, or not for every body."""
    replacing = any(_NAME in replaced.get(body, {}) for body in scene.bodies)
    if not scene.fields:
        if given is not None or replacing:
            raise ValueError(
                "remanent_magnetization was given, but the scene has no field: Scene(..., field=...)"
            )
        return
    if given is not None and scene._bodies.solids:
        raise ValueError(
            "remanent_magnetization was given for all bodies, but a Solid has none: values={shell: {...}}"
        )
    if given is not None and replacing:
        raise ValueError("remanent_magnetization was given twice: as an argument and in values")
    for k, body in enumerate(scene.bodies):
        if given is None and _NAME not in replaced.get(body, {}) and body.remanent_magnetization is None:
            whose = f" of body {k}" if len(scene.bodies) > 1 else ""
            raise ValueError(f"the scene has a field, so remanent_magnetization{whose} [A/m] is needed")


def of_all_bodies(scene, replaced: dict[object, dict]):
    """(n_f of all, 3) A/m where it was not an argument: a tensor in its graph where there is one, None without a field.

    For what has been checked.
    """
    if not scene.fields or not scene.bodies:
        return None
    given = [replaced.get(body, {}).get(_NAME, body.remanent_magnetization) for body in scene.bodies]
    counts = [body.mesh.n_faces for body in scene.bodies]
    if not any(is_tensor(each) for each in given):
        return joined([np.broadcast_to(each, (n, 3)) for each, n in zip(given, counts, strict=True)])
    torch = require_torch("a tensor")
    tensors = [each if is_tensor(each) else torch.tensor(np.array(each, dtype=float)) for each in given]
    return torch.cat([each.expand(n, 3) for each, n in zip(tensors, counts, strict=True)])
