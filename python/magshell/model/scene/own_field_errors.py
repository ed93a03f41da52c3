"""Estimates the error of the own field's forces between bodies that are near each other, and warns where it is large.

Near edges and triangles are sampled at 4 x 4 and 16 points. Where the gap between two bodies is much less than the spacing
of these points, the forces are wrong. The core compares them with the closed form of one element at finer points of the
other,

    error = |sum F - sum F_finer| / max(|force of the own field on the body|, sum |F_finer| / 10),

for each body, by all near elements of the others, and likewise the couples about its center. The parts of one body, as of a
folded strip, are compared where their elements are near now but not at rest: the error is that of the sum of |F|. Moments of
rigid bodies are not compared.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .field_sampling import CANCELLING, TRUSTED, warn_of_forces

if TYPE_CHECKING:
    from .values import Values


COINCIDE = 1e-9  # [-] distance of two points, over the extent, below which they coincide


class GapError(NamedTuple):
    """The relative error of what acts on a body by others in its own field, and its distance from them [m].

    error: infinite where points of two bodies coincide. action: "force", "couple", or "within" for forces between parts of
    the body.
    """

    body: Any
    error: float
    gap: float
    action: str


def gap_errors(values: Values, state: np.ndarray) -> Iterator[GapError]:
    """Yield the errors of each body that is near others in the own field of a scene."""
    scene = values.scene
    if scene.own_field is None or not np.isfinite(state).all():
        return
    with values.in_core():
        owners, of_forces, of_couples, centers, gaps, *within = scene._model.own_field_gap_forces(state)
        taken_within, finer_within, gaps_within = within
        if not np.isfinite([*gaps, *gaps_within]).any():
            return
        layout = scene._load_parameter_layout
        factor = layout.packed({("scene", "own_field_factor"): np.ones(1)}, layout.zeros())
        forces = -scene._model.positions(scene._model.term_gradient("own field", state, factor))
        positions = scene._model.positions(state)
    objects = {label: each for each, label in scene._labels}
    for k, owner in enumerate(owners):
        body = objects[owner]
        if np.isfinite(gaps[k]):
            number = next(
                n
                for n, each in enumerate(scene.bodies)
                if each is body or getattr(each, "skin", None) is body
            )
            vertices = scene._bodies.spans[number].vertices
            couples = np.cross(positions[vertices] - centers[k], forces[vertices])
            for action, (taken, finer, sizes), all_of_it in (
                ("force", of_forces, forces[vertices]),
                ("couple", of_couples, couples),
            ):
                reference = max(float(np.linalg.norm(all_of_it.sum(axis=0))), CANCELLING * sizes[k])
                yield GapError(body, _ratio(np.linalg.norm(taken[k] - finer[k]), reference), gaps[k], action)
        if np.isfinite(gaps_within[k]):
            off = abs(taken_within[k] - finer_within[k])
            yield GapError(body, _ratio(off, finer_within[k]), gaps_within[k], "within")


def _ratio(off: Any, reference: float) -> float:
    """Return an error over its reference, infinite where it is not a number, 0 where nothing acts."""
    error = float(off) / reference if reference > 0.0 else 0.0
    return error if np.isfinite(error) else np.inf


def are_sources_together(values: Values, state: np.ndarray) -> bool:
    """Return whether points of two sources of the own field coincide that are of different bodies, or were apart at rest."""
    with values.in_core():
        found = values.scene._model.own_field_gap_forces(state)
    gaps = np.concatenate([found[4], found[7]])
    return bool(gaps.min(initial=np.inf) < COINCIDE * values.scene._bodies.extent)


def describe_coincident_points(values: Values, state: np.ndarray) -> str:
    """Return a sentence for an error message if points of two bodies with an own field coincide, else ""."""
    if values.scene.own_field is None or not np.isfinite(state).all():
        return ""
    if not are_sources_together(values, state):
        return ""
    return (
        "Bodies with an own field touch: points of their sources coincide, where forces are infinite. Leave a gap of a part "
        "of the edges' length between them."
    )


def warn_of_gaps(found: Iterable[GapError], where: str) -> None:
    """Warn if the force or the couple of the own field on a body is off by more than 1 %."""
    worst = max(found, key=lambda each: each.error, default=None)
    if worst is None or not worst.error > TRUSTED:
        return
    by = f"by about {worst.error:.0%}" if worst.error < 1.0 else "entirely"
    is_within = worst.action == "within"
    what = "forces of the own field between parts of" if is_within else f"{worst.action} of the own field on"
    warn_of_forces(
        f"{where}: the {what} {worst.body!r} {'are' if is_within else 'is'} off {by}, as "
        f"{'one of them' if is_within else 'another body'} is about {worst.gap:.2g} m away, much less than its edges are "
        "long, or passes through it. Take a finer mesh there, with edges of at most four times the gap, or keep them apart "
        "by a contact"
    )
