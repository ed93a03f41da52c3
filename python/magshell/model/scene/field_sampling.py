"""Estimates the error of magnetic forces on three-node faces, which sample the field once, and warns where it is large.

A face with the magnetic moment m at its barycenter x_b has the force F = (dB/dx)^T m. Over a face on which the field
changes, the mean of F at six points (Dunavant, degree 4) shows how far the one at the barycenter is off,

    error = |sum F(x_b) - sum mean F| / max(|sum mean F|, sum |mean F| / 10, sum |m x B| / extent),

for each body: relative to the resultant force, or to the forces and moments that act where these cancel in it. The
error of one point falls with the square of the edge length, that of six points with its fourth power: for two parallel
magnets 10 mm wide and 0.2 mm apart the estimate is 16.4, 5.0, 1.96 and 1.04 % with 16, 32, 48 and 64 cells, the error
itself 15.7, 5.0, 1.97 and 1.04 %.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.warning_stacklevel import callers_level
from ...errors import FieldSamplingWarning
from ..shells.deformed_magnetization import deformed_magnetization
from ..solids.solid import Solid
from .magnetization import magnetized_bodies

if TYPE_CHECKING:
    from .values import Values

# [-] Largest error of a body's magnetic force without a warning; fixed by
# test_a_warning_comes_where_the_force_is_off_by_more_than_1_percent
TRUSTED = 0.01
# [-] Smallest reference for the error, as a fraction of the sum of the forces' magnitudes: where forces cancel, the
# resultant is too small to refer to.
_CANCELLING = 0.1
# [-] Estimate of the core above which the error is computed. It is 0.6 to 1.2 times the error where that is about 1 %, and
# at least 0.4 of it on meshes that are far too coarse; see test_the_estimate_of_the_core_is_0_6_to_1_2_times_the_error.
_SUSPECT = 0.35 * TRUSTED
_MOST_NAMED = 4  # faces in a warning
_A, _B = 0.445948490915965, 0.091576213509771
_POINTS = np.array(  # (6, 3) barycentric coordinates of Dunavant's rule of degree 4
    [np.roll((each, each, 1.0 - 2.0 * each), turn) for each in (_A, _B) for turn in range(3)]
)
_WEIGHTS = np.repeat([0.223381589678011, 0.109951743655322], 3)


class SamplingError(NamedTuple):
    """The relative error of the magnetic force on one body.

    faces: (n,), in the order of their part in the error, the largest first.
    """

    body: Any
    error: float
    faces: np.ndarray


def is_suspect(estimate: float) -> bool:
    """Return whether the error has to be computed, by the core's estimate from the samples of the solve (NaN if unknown)."""
    return not estimate <= _SUSPECT


def warn_of_sampling(
    values: Values, positions: np.ndarray, field_factor: float, flux_density: Any, where: str
) -> None:
    """Warn if the magnetic force on a body is off by more than 1 %.

    values: with the field sources as in this state. positions: (n_v, 3) m. field_factor: of the sources. flux_density:
    (3,) T of a uniform field, or None.
    """
    worst = max(
        sampling_errors(values, positions, field_factor, flux_density),
        key=lambda each: each.error,
        default=None,
    )
    if worst is None or not worst.error > TRUSTED:
        return
    named = ", ".join(map(str, worst.faces[:_MOST_NAMED].tolist()))
    shorter = np.sqrt(worst.error / TRUSTED)
    warnings.warn(
        FieldSamplingWarning(
            f"{where}: the magnetic force on {worst.body!r} is off by about {worst.error:.2%}, as each of its faces samples "
            f"the field once, and it changes over them; most of that is of faces {named}. Take a finer mesh near the "
            f"sources (edges {shorter:.2g} times shorter leave {TRUSTED:.0%}), or six-node elements, which sample the field "
            "at more points"
        ),
        stacklevel=callers_level(),
    )


def sampling_errors(
    values: Values, positions: np.ndarray, field_factor: float, flux_density: Any
) -> Iterator[SamplingError]:
    """Yield the error of each body with magnetized three-node faces, if a field varies in space."""
    fields = [
        each._core
        for each in map(values.current, values.scene.fields)
        if not getattr(each, "_is_uniform", False)
    ]
    if not fields or field_factor == 0.0 or not np.isfinite(positions).all():
        return
    scales = [float(field_factor)] * len(fields)
    extent = values.scene._bodies.extent
    for body, corners, moments in _magnetized_faces(values, positions):
        if not moments.any():
            continue
        flux, once = _forces(fields, scales, corners.mean(axis=1), moments)
        points = np.einsum("qk,fkd->fqd", _POINTS, corners)
        _, each = _forces(fields, scales, points.reshape(-1, 3), np.repeat(moments, len(_POINTS), axis=0))
        mean = np.einsum("q,fqd->fd", _WEIGHTS, each.reshape(points.shape))
        couples = np.cross(moments, flux if flux_density is None else flux + flux_density)
        total = max(
            float(np.linalg.norm(mean.sum(axis=0))),
            _CANCELLING * float(np.linalg.norm(mean, axis=1).sum()),
            float(np.linalg.norm(couples, axis=1).sum()) / extent,
        )
        off = once - mean
        if total > 0.0 and np.isfinite(total) and np.isfinite(off).all():
            order = np.argsort(-np.linalg.norm(off, axis=1), kind="stable")
            yield SamplingError(body, float(np.linalg.norm(off.sum(axis=0))) / total, order)


def _forces(fields, scales, points, moments) -> tuple[np.ndarray, np.ndarray]:
    """Return the flux density B [T] at points (n, 3) and the forces [N] on magnetic moments [A m2] there."""
    flux, gradient, _ = _core.sample_fields(fields, scales, points, np.zeros_like(points), 1)
    return flux, np.einsum("nij,ni->nj", gradient, moments)


def _magnetized_faces(values, positions) -> Iterator[tuple[Any, np.ndarray, np.ndarray]]:
    """Yield for each body with magnetized three-node faces: the Shell or Skin, the corners of its faces, their moments.

    The corners are (n, 3, 3) m, the magnetic moments (n, 3) A m2, both in the deformed state.
    """
    scene = values.scene
    labels = {id(each): label for each, label in scene._labels}
    for number, magnetized, _ in magnetized_bodies(scene):
        span, now = scene._bodies.spans[number], values.current(magnetized)
        body = scene.bodies[number]
        if not isinstance(body, Solid) and span.mesh.order == 2:
            continue
        faces = span.mesh.faces[magnetized.faces] if isinstance(body, Solid) else span.mesh.faces
        label = labels[id(magnetized)]
        magnetization = scene._value_layout.of(values.numbers, label, "remanent_magnetization")
        rest, corners = span.mesh.rest_positions[faces], positions[span.vertices][faces]
        magnetization = np.broadcast_to(magnetization, (len(faces), 3))
        turned = deformed_magnetization(rest, corners, magnetization, now.magnetization_law == "rotates")
        yield now, corners, (_areas(rest) * now.thickness)[:, None] * turned


def _areas(corners: np.ndarray) -> np.ndarray:
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.linalg.norm(across, axis=1)
