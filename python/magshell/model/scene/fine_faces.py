"""Decides which faces, and which tetrahedra, sample the applied field finely, inside and through their thickness.

A "face" is a three-node face here, a six-node face or a tetrahedron. At the state in which a solve begins, with the fields
as they will be at its end, the error of the magnetic force on each body is computed (field_sampling.py,
element_sampling.py). Where it is more than 0.1 %, faces sample finely from then on, those with the largest errors first,
until the others together are off by at most 0.02 %. They stay the same during the solve, its linear algebra and its
gradients: the energy would jump where they changed. A search for one equilibrium looks again at its end, and goes on from
there with more fine faces if they are needed; paths and motions warn. A solve that starts from an earlier result keeps its
fine faces.

Which faces sample finely depends on the sum of all fields. The force of several fields is therefore the sum of the forces of
each to the accuracy of sampling, not to round-off. Faces that depended on each field alone would cost 32 points of every
field in the whole scene, also of those that are far.
"""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..._input.quantity import quantity
from ..fields.field import UniformField
from .element_sampling import FAR_EDGES, KEY, labels_of_elements
from .field_sampling import (
    LARGEST_COARSE,
    SamplingError,
    element_errors,
    is_suspect,
    sampling_errors,
)

if TYPE_CHECKING:
    from .parameter_layout import Layout
    from .solve_inputs import Inputs
    from .values import Values

# [-] Largest error by all faces that do not sample finely, beside some that do, over the one above which some do. With a
# half the force is off by up to 0.105 % at a gap of a thickness; fixed by
# test_the_force_of_a_magnet_is_right_to_0_1_percent_at_every_distance and
# test_the_force_of_a_near_magnet_on_elements_is_right_to_0_1_percent
_LEFT = 0.2
# [-] Errors of faces closer to each other than this ratio count as equal, so that of two faces that mirror each other both
# sample finely, or none; fixed by test_hard_case_reaches_its_answer, a strip close to a dipole
_EQUAL = 1.0 - 1e-6


def keeping_fine_faces(inputs: Inputs, before: Values) -> Inputs:
    """Return the inputs with the fine faces of the values of an earlier solve in addition to their own.

    The earlier solve may be one of another scene, whose bodies with as many faces count as the same.
    """
    layout, earlier = inputs.scene._value_layout, before.scene._value_layout
    numbers = {}
    for key in _keys(layout):
        if key not in earlier:
            continue
        own, other = layout.of(inputs.values.numbers, *key), earlier.of(before.numbers, *key)
        if own.shape == other.shape and np.any(other > own):
            numbers[key] = np.maximum(own, other)
    return _with(inputs, numbers)


def fine_faces(values: Values) -> np.ndarray:
    """Return which faces sample finely, as numbers 0 and 1, body after body, (n,)."""
    layout = values.scene._value_layout
    return np.concatenate([np.zeros(0), *(layout.of(values.numbers, *key) for key in _keys(layout))])


def having_fine_faces(inputs: Inputs, numbers: np.ndarray) -> Inputs:
    """Return the inputs with the fine faces that fine_faces() returned for an equal scene. Raises ValueError if they do not
    fit this one.
    """
    layout, first, found = inputs.scene._value_layout, 0, {}
    n_faces = len(fine_faces(inputs.values))
    numbers = quantity("fine_faces", "1", numbers, (n_faces,))
    for key in _keys(layout):
        count = len(layout.of(inputs.values.numbers, *key))
        found[key] = numbers[first : first + count]
        first += count
    return _with(inputs, found)


def with_fine_faces(
    inputs: Inputs, state: np.ndarray, load_parameters: np.ndarray, estimate: float | None = None
) -> Inputs:
    """Return the inputs with more fine faces, as the fields in a state need them; the inputs themselves if they need none.

    estimate: of the core for this state, if it is known.
    """
    return with_fine_faces_and_errors(inputs, state, load_parameters, estimate)[0]


class Errors(NamedTuple):
    """The errors of sampling in a state, of three-node faces and of elements; None if not computed."""

    faces: list[SamplingError] | None = None
    elements: list[SamplingError] | None = None


def with_fine_faces_and_errors(
    inputs: Inputs, state: np.ndarray, load_parameters: np.ndarray, estimate: float | None = None
) -> tuple[Inputs, Errors]:
    """Return what with_fine_faces() returns, and the errors of sampling in this state before."""
    layout = inputs.scene._load_parameter_layout
    if not _keys(inputs.scene._value_layout):
        return inputs, Errors()
    positions = inputs.scene._model.positions(state)
    at = (
        positions,
        float(layout.of(load_parameters, "scene", "field_factor")[0]),
        layout.of(load_parameters, "scene", "applied_flux_density")[0],
    )
    suspect = _are_faces_suspect(inputs, state, load_parameters, estimate)
    errors = Errors(
        faces=list(sampling_errors(inputs.values, *at)) if suspect else None,
        elements=list(element_errors(inputs.values, *at)),
    )
    numbers = {}
    for each in (*(errors.faces or ()), *errors.elements):
        if len(more := _to_refine(each)):
            numbers[each.label, KEY] = each.fine.astype(np.float64)
            numbers[each.label, KEY][more] = 1.0
    if numbers and any(
        field._in_magnets(positions).any() for field in map(inputs.values.current, inputs.scene.fields)
    ):
        # the field has another formula inside of a magnet, and fine faces would not mend that
        return inputs, errors
    return _with(inputs, numbers), errors


def _are_faces_suspect(
    inputs: Inputs, state: np.ndarray, load_parameters: np.ndarray, estimate: float | None
) -> bool:
    """Return whether the error of three-node faces has to be computed."""
    if not _keys_of_faces(inputs.values):
        return False
    if estimate is None:
        if _is_far(inputs.values, state):
            return False
        with inputs.in_core():
            estimate = inputs.scene._model.field_sampling_error(state, load_parameters)
    return is_suspect(estimate)


def _is_far(values: Values, state: np.ndarray) -> bool:
    """Return whether all sources are known to be so far that one sample a face is enough."""
    scene = values.scene
    layout = scene._value_layout
    thickness = max(
        float(layout.of(values.numbers, label, "thickness").max()) for label, _ in _keys_of_faces(values)
    )
    size = max(float(scene.mesh.edge_lengths.max()), thickness)
    positions = scene._model.positions(state)
    for field in map(values.current, scene.fields):
        if isinstance(field, UniformField):
            continue
        sphere = field._sphere_around_sources()
        if sphere is None:
            return False
        center, radius = sphere
        if not np.linalg.norm(positions - center, axis=1).min() - radius > FAR_EDGES * size:
            return False
    return True


def _to_refine(found: SamplingError) -> np.ndarray:
    """Return the faces or elements that have to sample finely, none if the error is small enough.

    Errors cancel in large part. So many, those with the largest errors first, that the sum of the others is small, and stays
    so with any more of them.
    """
    if not found.error > LARGEST_COARSE:
        return np.zeros(0, dtype=int)
    once = np.flatnonzero(~found.fine & np.isfinite(found.off))
    ascending = once[np.argsort(found.off[once], kind="stable")]
    left = np.linalg.norm(np.cumsum(found.vectors[ascending], axis=0), axis=1)
    too_large = found.off[ascending[np.maximum.accumulate(left) > _LEFT * LARGEST_COARSE]]
    return once[found.off[once] >= _EQUAL * too_large.min(initial=np.inf)]


def _keys_of_faces(values: Values) -> list[tuple[str, str]]:
    """Return the keys of three-node faces."""
    others = labels_of_elements(values.scene)
    return [key for key in _keys(values.scene._value_layout) if key[0] not in others]


def _keys(layout: Layout) -> list[tuple[str, str]]:
    return [key for key in layout if key[1] == KEY]


def _with(inputs: Inputs, numbers: dict[tuple[str, str], np.ndarray]) -> Inputs:
    if not numbers:
        return inputs
    values = copy(inputs.values)
    values.numbers = inputs.scene._value_layout.packed(numbers, inputs.values.numbers)
    return inputs.with_values(values)
