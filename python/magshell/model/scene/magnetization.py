"""The magnetization of a solve: of all faces at once (of six-node sheets, their elements), of each body by itself, or their
own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import is_tensor, require_torch
from ..solids.solid import Solid

if TYPE_CHECKING:
    from .scene import Scene

_NAME = "remanent_magnetization"


def check_given_once(scene: Scene, given: Any, replaced: dict[object, dict[Any, Any]]) -> None:
    """Raises ValueError where it is given twice, or without a field, or not for every shell and skin."""
    replacing = any(_NAME in replaced.get(carrier, {}) for _, carrier, _ in carriers(scene))
    if not scene.fields:
        if given is not None or replacing:
            raise ValueError(
                "remanent_magnetization was given, but the scene has no field: Scene(..., field=...)"
            )
        return
    if given is not None and replacing:
        raise ValueError("remanent_magnetization was given twice: as an argument and in values")
    for k, carrier, _ in carriers(scene):
        if (
            given is None
            and _NAME not in replaced.get(carrier, {})
            and carrier.remanent_magnetization is None
        ):
            whose = f" of body {k}" if len(scene.bodies) > 1 else ""
            skin = "" if carrier is scene.bodies[k] else ", of its skin,"
            raise ValueError(f"the scene has a field, so remanent_magnetization{whose}{skin} [A/m] is needed")


def check_on_skins(scene: Scene, given: np.ndarray) -> None:
    """Raises ValueError where one of all faces (3,), or of single ones (n_f of all, 3), is of none that can have one."""
    if given.ndim == 1:
        if given.any() and scene.bodies and not any(True for _ in carriers(scene)):
            raise ValueError(
                "remanent_magnetization was given for all faces, but the scene has no Shell, and no Solid with a skin"
                + _of_solids(scene)
            )
        return
    bare = np.zeros(scene._bodies.n_magnetized, dtype=bool)
    for body, span in zip(scene.bodies, scene._bodies.spans, strict=True):
        bare[span.rows] = isinstance(body, Solid)
    for _, _, faces in carriers(scene):
        bare[faces] = False
    idle = bare & given.any(axis=1)
    if idle.any():
        raise ValueError(
            f"remanent_magnetization [A/m] of face {np.argmax(idle)} must be zero: it is of a Solid that has no skin there"
            + _of_solids(scene)
        )


def _of_solids(scene: Scene) -> str:
    """Say how solids are magnetized throughout, in a message that begins with what has gone wrong."""
    if any(isinstance(body, Solid) and body.remanent_magnetization is not None for body in scene.bodies):
        return '. A Solid magnetized throughout takes it as values={solid: {"remanent_magnetization": ...}}'
    return ". A Solid is magnetized throughout by Solid(..., remanent_magnetization=...)"


def of_carriers(scene: Scene, magnetization: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """(core owner, its rows) of shells and skins, of one for all faces (n_f of all, 3)."""
    labels = {id(each): label for each, label in scene._labels}
    for _, carrier, faces in carriers(scene):
        yield labels[id(carrier)], magnetization[faces]


def gradient_by_all(scene: Scene, gradient: Any) -> np.ndarray:
    """(n_f of all, 3): the transpose of `of_carriers`."""
    labels = {id(each): label for each, label in scene._labels}
    found = np.zeros((scene._bodies.n_magnetized, 3))
    for _, carrier, faces in carriers(scene):
        found[faces] = gradient.value(labels[id(carrier)], _NAME)
    return found


def of_all_bodies(scene: Scene, replaced: dict[object, dict[Any, Any]]) -> Any:
    """(n_f of all, 3) A/m where it was not an argument, zero on what has none: a tensor in its graph where there is one,
    None without a field.

    For what has been checked.
    """
    if not scene.fields or not scene.bodies:
        return None
    parts = [
        (replaced.get(carrier, {}).get(_NAME, carrier.remanent_magnetization), faces)
        for _, carrier, faces in carriers(scene)
    ]
    n_rows = scene._bodies.n_magnetized
    if not any(is_tensor(given) for given, _ in parts):
        rows = np.zeros((n_rows, 3))
        for given, faces in parts:
            rows[faces] = given
        return rows
    torch = require_torch("a tensor")
    rows = torch.zeros((n_rows, 3), dtype=torch.float64)
    for given, faces in parts:
        tensor = given if is_tensor(given) else torch.tensor(np.array(given, dtype=float))
        rows = rows.index_put((torch.from_numpy(faces),), tensor.to(rows).expand(len(faces), 3))
    return rows


def carriers(scene: Scene) -> Iterator[tuple[int, Any, np.ndarray]]:
    """Yields (number of the body, Shell or Skin, its rows among those of all (k,)) of what faces are magnetized with."""
    for k, (body, span) in enumerate(zip(scene.bodies, scene._bodies.spans, strict=True)):
        if not isinstance(body, Solid):
            yield k, body, span.first_row + np.arange(body.mesh.n_elements)
        elif body.skin is not None:
            yield k, body.skin, span.first_row + body.skin.faces
