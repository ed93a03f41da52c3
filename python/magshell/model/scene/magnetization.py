"""Remanent magnetization of a solve: one array for the faces of all bodies, or an array for each shell and skin.

Of sheets of six-node elements the rows are elements, not faces.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import is_tensor, require_torch
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from .scene import Scene

_NAME = "remanent_magnetization"


def check_given_once(scene: Scene, given: Any, replaced: dict[object, dict[Any, Any]]) -> None:
    """Raise ValueError if the magnetization is given twice, or without a field, or not for every shell and skin."""
    replacing = any(_NAME in replaced.get(each, {}) for _, each, _ in magnetized_bodies(scene))
    if not scene.is_magnetic:
        if given is not None or replacing:
            raise ValueError(
                "remanent_magnetization was given, but the scene has no field: Scene(..., field=...)"
            )
        return
    if given is not None and replacing:
        raise ValueError("remanent_magnetization was given twice: as an argument and in values")
    for k, each, _ in magnetized_bodies(scene):
        own = each.remanent_magnetization is not None or _is_susceptible(each)
        if given is None and _NAME not in replaced.get(each, {}) and not own:
            whose = f" of body {k}" if len(scene.bodies) > 1 else ""
            skin = "" if each is scene.bodies[k] else ", of its skin,"
            raise ValueError(f"the scene has a field, so remanent_magnetization{whose}{skin} [A/m] is needed")


def check_on_skins(scene: Scene, given: np.ndarray) -> None:
    """Raise ValueError if a magnetization is given for faces that cannot have one.

    given: A/m, (3,) for all faces, or (n_f of all, 3).
    """
    if given.ndim == 1:
        if given.any() and scene.bodies and not any(True for _ in magnetized_bodies(scene)):
            raise ValueError(
                "remanent_magnetization was given for all faces, but the scene has no Shell, and no Solid with a skin"
                + _of_solids(scene)
            )
        return
    bare = np.zeros(scene._bodies.n_magnetized, dtype=bool)
    for body, span in zip(scene.bodies, scene._bodies.spans, strict=True):
        bare[span.rows] = isinstance(body, Solid)
    for _, _, faces in magnetized_bodies(scene):
        bare[faces] = False
    idle = bare & given.any(axis=1)
    if idle.any():
        raise ValueError(
            f"remanent_magnetization [A/m] of face {np.argmax(idle)} must be zero: it is of a Solid that has no skin there"
            + _of_solids(scene)
        )


def _of_solids(scene: Scene) -> str:
    """Return the end of an error message that says how solids are magnetized throughout."""
    if any(isinstance(body, Solid) and body.remanent_magnetization is not None for body in scene.bodies):
        return '. A Solid magnetized throughout takes it as values={solid: {"remanent_magnetization": ...}}'
    return ". A Solid is magnetized throughout by Solid(..., remanent_magnetization=...)"


def magnetization_rows(scene: Scene, magnetization: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield (core owner, its rows) for each shell and skin, from the magnetization of all faces (n_f of all, 3)."""
    labels = {id(each): label for each, label in scene._labels}
    for _, body, faces in magnetized_bodies(scene):
        yield labels[id(body)], magnetization[faces]


def gradient_by_all(scene: Scene, gradient: Any) -> np.ndarray:
    """Return the gradient with respect to the magnetization of all faces, (n_f of all, 3): the transpose of
    `magnetization_rows`.
    """
    labels = {id(each): label for each, label in scene._labels}
    found = np.zeros((scene._bodies.n_magnetized, 3))
    for _, body, faces in magnetized_bodies(scene):
        if gradient.has(
            labels[id(body)], _NAME
        ):  # not of bodies outside of the own field where no other field acts
            found[faces] = gradient.value(labels[id(body)], _NAME)
    return found


def of_all_bodies(scene: Scene, replaced: dict[object, dict[Any, Any]]) -> Any:
    """Return the magnetization of all faces, (n_f of all, 3) A/m, from the bodies' own and replaced values.

    It is zero on faces that have none, and None without a field. If any value is a tensor, so is the result, in its
    graph.
    The values must have been checked before.
    """
    if not scene.is_magnetic or not scene.bodies:
        return None
    parts = [
        (replaced.get(body, {}).get(_NAME, body.remanent_magnetization), faces)
        for _, body, faces in magnetized_bodies(scene)
    ]
    parts = [(np.zeros(3) if given is None else given, faces) for given, faces in parts]
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


def _is_susceptible(body: Any) -> bool:
    """Return whether a shell is magnetized by a field, so that it needs no remanent magnetization."""
    return isinstance(body, Shell) and body.susceptibility is not None


def magnetized_bodies(scene: Scene) -> Iterator[tuple[int, Any, np.ndarray]]:
    """Yield (number of the body, Shell or Skin, its rows (k,) among those of all faces) where faces can be magnetized."""
    for k, (body, span) in enumerate(zip(scene.bodies, scene._bodies.spans, strict=True)):
        if not isinstance(body, Solid):
            yield k, body, span.first_row + np.arange(body.mesh.n_elements)
        elif body.skin is not None:
            yield k, body.skin, span.first_row + body.skin.faces
