"""Estimates the error of magnetic forces on three-node faces from how they sample the field, and warns where it is large.

A face with the magnetic moment m has the mean of F = (dB/dx)^T m over its area and its thickness as its force. Far from
sources it takes F once, at its barycenter x_b. Near them it samples the field finely, at 32 points in its plane and through
its thickness (fine_faces.py says which faces do). The mean of F at those points shows how far F(x_b) is off,

    error = |sum F(x_b) - sum mean F| / max(|sum mean F|, sum |mean F| / 10, sum |m x B| / extent),

for each body: relative to the resultant force, or to the forces and moments that act where these cancel in it. Faces that
sample finely are compared with their quarters, at three levels in the thickness.

For two parallel magnets 10 mm wide, 0.2 mm thick and 0.2 mm apart one point is off by 12.8, 2.4, 0.6 and 1.5 % with 16,
32, 48 and 64 cells, the fine points by 0.1 % at most.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.warning_stacklevel import callers_level
from ...errors import FieldSamplingWarning
from ..shells.deformed_magnetization import deformed_magnetization, frames_of
from ..solids.solid import Solid
from .element_rules import FacePoints
from .element_sampling import KEY, Sources, element_forces, has_elements
from .magnetization import magnetized_bodies

if TYPE_CHECKING:
    from .values import Values

# [-] Error of a body's magnetic force above which faces and elements sample the field finely; fixed by
# test_the_force_of_a_magnet_is_right_to_0_1_percent_at_every_distance and
# test_the_force_of_a_near_magnet_on_elements_is_right_to_0_1_percent
LARGEST_COARSE = 0.001
# [-] Error above which a warning is given
TRUSTED = 0.01
# [-] Smallest reference for the error, as a fraction of the sum of the forces' magnitudes: where forces cancel, the
# resultant is too small to refer to.
CANCELLING = 0.1
# [-] Estimate of the core above which the error is computed. It is 0.6 to 1.2 times the error where that is 0.1 to 3 %, and
# a quarter of it or more on meshes far too coarse; see test_the_estimate_of_the_core_is_0_6_to_1_2_times_the_error.
_SUSPECT = 0.35 * LARGEST_COARSE
_ON_SURFACE = 1e-9  # [-] distance from a magnet's surface, over the extent, within which a vertex is on it
_MOST_NAMED = 4  # faces in a warning
_TOGETHER = 2048  # faces whose samples are in memory at the same time


class _Faces(NamedTuple):
    """The magnetized three-node faces of one body in a state.

    body: the Shell or Skin. label: of its values in the core. corners: (n, 3, 3) m. moments: (n, 3) A m2, the remanent ones.
    thickness: (n,) m. fine: (n,), which of them sample finely. response: (n, 3, 3) A m2/T, the moments that a flux density
    induces; zero without a susceptibility.
    """

    body: Any
    label: str
    corners: np.ndarray
    moments: np.ndarray
    thickness: np.ndarray
    fine: np.ndarray
    response: np.ndarray

    def moments_in(self, flux: np.ndarray) -> np.ndarray:
        """Return the moments in flux densities (n, n_points, 3) T, of the same shape, A m2."""
        return self.moments[:, None] + np.einsum("fij,fqj->fqi", self.response, flux)

    def points(self, rule: FacePoints) -> np.ndarray:
        """Return the points of a rule, (n, n_points, 3) m."""
        x0, x1, x2 = np.moveaxis(self.corners, 1, 0)
        across = np.cross(x1 - x0, x2 - x0)
        across *= (self.thickness / np.linalg.norm(across, axis=1))[:, None]
        return np.einsum("qk,fkd->fqd", rule.at, self.corners) + rule.heights[:, None] * across[:, None]

    def part(self, which: Any) -> _Faces:
        arrays = (self.corners, self.moments, self.thickness, self.fine, self.response)
        return _Faces(self.body, self.label, *(each[which] for each in arrays))


class SamplingError(NamedTuple):
    """The relative error of the magnetic force on one body.

    label: of the body's values in the core. vectors: (n, 3), the error of each face or element by the reference of `error`,
    which is that of their sum; NaN where the field has no value at some point of it. fine: (n,), which sample finely.
    """

    body: Any
    label: str
    error: float
    vectors: np.ndarray
    fine: np.ndarray

    @property
    def off(self) -> np.ndarray:
        """The sizes of the errors, (n,)."""
        return np.linalg.norm(self.vectors, axis=1)


def is_suspect(estimate: float) -> bool:
    """Return whether the error of three-node faces has to be computed, by the core's estimate from the samples of the solve
    (NaN if unknown).
    """
    return not estimate <= _SUSPECT


def warn_of_sampling(found: Iterable[SamplingError], where: str) -> None:
    """Warn if the magnetic force on a body is off by more than 1 %, or if that cannot be told.

    found: the errors of all bodies, by sampling_errors().
    """
    found = list(found)
    worst = max(found, key=lambda each: each.error, default=None)
    if worst is not None and worst.error > TRUSTED:
        warn_of_forces(
            f"{where}: the magnetic force on {worst.body!r} is off by about {worst.error:.2%}, {_advice(worst)}"
        )
    for each in found:
        if len(unknown := np.flatnonzero(np.isnan(each.off))):
            warn_of_forces(
                f"{where}: {_named(unknown)} of {each.body!r}, with their thickness, reach to where a field has no value, "
                "into a magnet or out of a grid, so that the error of the magnetic force on them cannot be told. Keep the "
                "body farther away, or take a larger grid"
            )


def warn_of_elements(found: Iterable[SamplingError], where: str) -> None:
    """Warn if the magnetic force on a six-node shell or a solid is off by more than 1 %, or if that cannot be told.

    found: the errors of all bodies, by element_errors().
    """
    for each in found:
        if each.error > TRUSTED:
            order = np.argsort(-np.nan_to_num(each.off), kind="stable")
            why, what_to_do = (
                "as its elements sample the field at few points",
                "start nearer to the source, or take",
            )
            if each.fine[order[0]]:
                why, what_to_do = "although elements near the sources sample the field at many points", "take"
            warn_of_forces(
                f"{where}: the magnetic force on {each.body!r} is off by about {each.error:.2%}, {why}, and it changes "
                f"over them; most of that is of {_named(order, 'elements')}. To mend it, {what_to_do} smaller elements "
                "there, or keep the body farther away"
            )
        if len(unknown := np.flatnonzero(np.isnan(each.off))):
            warn_of_forces(
                f"{where}: {_named(unknown, 'elements')} of {each.body!r} reach to where a field has no value, into a "
                "magnet or out of a grid, so that the error of the magnetic force on them cannot be told. Keep the body "
                "farther away, or take a larger grid"
            )


def element_errors(
    values: Values, positions: np.ndarray, field_factor: float, flux_density: Any
) -> Iterator[SamplingError]:
    """Yield the error of each magnetized six-node shell and solid that has elements near a source.

    Arguments as for sampling_errors().
    """
    if not has_elements(values):
        return
    sources = _sources(values, positions, field_factor, flux_density)
    if sources is None:
        return
    for each in element_forces(values, positions, sources):
        off = each.taken - each.mean
        known = np.isfinite(off).all(axis=1)
        total = _size_of_forces(each.mean[known], each.couples[known], values.scene._bodies.extent)
        if (total > 0.0 and np.isfinite(total)) or not known.all():
            total = total or 1.0  # without a force or a couple to compare with, no error is known
            error = float(np.linalg.norm(off[known].sum(axis=0))) / total
            vectors = np.where(known[:, None], off / total, np.nan)
            yield SamplingError(each.body, each.label, error, vectors, each.fine)


def _advice(worst: SamplingError) -> str:
    order = np.argsort(-np.nan_to_num(worst.off), kind="stable")
    named = f"most of that is of {_named(order)}"
    if worst.fine[order[0]]:
        return f"although faces near the sources sample the field at many points; {named}. Take a finer mesh there"
    shorter = np.sqrt(worst.error / TRUSTED)
    return (
        f"as these faces sample the field once each, and it changes over them; {named}. Faces that come near a source on "
        "the way sample it once all the time: start nearer to the source, or take a finer mesh (edges "
        f"{shorter:.2g} times shorter leave {TRUSTED:.0%})"
    )


def _named(faces: np.ndarray, what: str = "faces") -> str:
    more = ", ..." if len(faces) > _MOST_NAMED else ""
    return f"{what} {', '.join(map(str, faces[:_MOST_NAMED].tolist()))}{more}"


def warn_of_forces(text: str) -> None:
    warnings.warn(FieldSamplingWarning(text), stacklevel=callers_level())


def warn_of_entry(values: Values, positions: np.ndarray, where: str) -> None:
    """Warn if vertices of magnetized bodies are inside of a magnet, where its field has another formula.

    positions: (n_v, 3) m.
    """
    scene = values.scene
    magnetized = [
        span.vertices
        for body, span in zip(scene.bodies, scene._bodies.spans, strict=True)
        if not isinstance(body, Solid) or body.skin is not None or body.remanent_magnetization is not None
    ]
    if not magnetized or not np.isfinite(positions).all():
        return
    rows = np.concatenate([np.arange(each.start, each.stop) for each in magnetized])
    # Vertices that are on the surface of a magnet, to round-off, are not inside.
    around = _ON_SURFACE * scene._bodies.extent * np.concatenate([np.eye(3), -np.eye(3)])
    for field in map(values.current, scene.fields):
        inside = rows[np.all([field._in_magnets(positions[rows] + each) for each in around], axis=0)]
        if len(inside):
            warn_of_forces(
                f"{where}: {_named(inside, 'vertices')} are inside of {field!r:.80}. Its field has another formula there, "
                "and it does not stop a body: add a Contact with an obstacle of its shape, or keep it farther away"
            )


def sampling_errors(
    values: Values, positions: np.ndarray, field_factor: float, flux_density: Any
) -> Iterator[SamplingError]:
    """Yield the error of each body with magnetized three-node faces, if a field varies in space.

    values: with the field sources as in this state. positions: (n_v, 3) m. field_factor: of the sources. flux_density:
    (3,) T of a uniform field, or None.
    """
    sources = _sources(values, positions, field_factor, flux_density)
    if sources is None:
        return
    extent = values.scene._bodies.extent
    fine, finer = FacePoints.fine(), FacePoints.finer()
    for faces in _magnetized_faces(values, positions):
        if not (faces.moments.any() or faces.response.any()):
            continue
        taken, mean, flux = (np.empty_like(faces.moments) for _ in range(3))
        for part, taking, reference in (
            (np.flatnonzero(~faces.fine), None, fine),
            (np.flatnonzero(faces.fine), fine, finer),
        ):
            for chunk in np.split(part, range(_TOGETHER, len(part), _TOGETHER)):
                some = faces.part(chunk)
                flux[chunk], taken[chunk] = _mean_forces(sources, some, taking)
                mean[chunk] = _mean_forces(sources, some, reference)[1]
        couples = np.cross(faces.moments_in(flux[:, None])[:, 0], flux)
        off = taken - mean
        known = np.isfinite(off).all(axis=1)
        total = _size_of_forces(mean[known], couples[known], extent)
        if (total > 0.0 and np.isfinite(total)) or not known.all():
            total = total or 1.0  # without a force or a couple to compare with, no error is known
            error = float(np.linalg.norm(off[known].sum(axis=0))) / total
            vectors = np.where(known[:, None], off / total, np.nan)
            yield SamplingError(faces.body, faces.label, error, vectors, faces.fine)


def _size_of_forces(forces: np.ndarray, couples: np.ndarray, extent: float) -> float:
    """Return the force [N] to which an error refers, from forces (n, 3) N and couples (n, 3) N m on the parts of a body."""
    with np.errstate(over="ignore"):  # the caller asks whether the result is finite
        return max(
            float(np.linalg.norm(forces.sum(axis=0))),
            CANCELLING * float(np.linalg.norm(forces, axis=1).sum()),
            float(np.linalg.norm(couples, axis=1).sum()) / extent,
        )


def _sources(values: Values, positions: np.ndarray, field_factor: float, flux_density: Any) -> Sources | None:
    """Return the fields that vary in space, or None if there are none."""
    fields = [
        each for each in map(values.current, values.scene.fields) if not getattr(each, "_is_uniform", False)
    ]
    if not fields or field_factor == 0.0 or not np.isfinite(positions).all():
        return None
    return Sources(
        [each._core for each in fields],
        [float(field_factor)] * len(fields),
        np.zeros(3) if flux_density is None else np.asarray(flux_density, dtype=np.float64),
        [each._sphere_around_sources() for each in fields],
    )


def _mean_forces(sources: Sources, faces: _Faces, rule: FacePoints | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean flux density B [T] and force [N] of faces by a rule; without one, at their barycenters."""
    points = faces.corners.mean(axis=1)[:, None] if rule is None else faces.points(rule)
    weights = np.ones(1) if rule is None else rule.weights
    places = points.reshape(-1, 3)
    flux, gradient, _ = _core.sample_fields(sources.fields, sources.factors, places, np.zeros_like(places), 1)
    flux = flux.reshape(points.shape) + sources.uniform
    forces = np.einsum("fqij,fqi->fqj", gradient.reshape(*points.shape, 3), faces.moments_in(flux))
    return np.einsum("q,fqd->fd", weights, flux), np.einsum("q,fqd->fd", weights, forces)


def _magnetized_faces(values, positions) -> Iterator[_Faces]:
    """Yield the magnetized three-node faces of each body in the deformed state."""
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
        thickness = np.broadcast_to(now.thickness, (len(faces),))
        fine = scene._value_layout.of(values.numbers, label, KEY) != 0.0
        volumes = _areas(rest) * thickness
        chi = None if isinstance(body, Solid) else now.susceptibility
        induced = 0.0 if chi is None else _response(corners, chi)
        response = np.broadcast_to(induced * volumes[:, None, None], (len(faces), 3, 3))
        yield _Faces(now, label, corners, volumes[:, None] * turned, thickness, fine, response)


def _response(corners: np.ndarray, susceptibility: np.ndarray) -> np.ndarray:
    """Return how the magnetization of thin faces follows the flux density, dM/dB (n, 3, 3) A/(m T)."""
    normals = frames_of(corners)[:, :, 2]
    along = susceptibility / _core.vacuum_permeability
    across = susceptibility**2 / ((1.0 + susceptibility) * _core.vacuum_permeability)
    return along[:, None, None] * np.eye(3) - across[:, None, None] * np.einsum(
        "fi,fj->fij", normals, normals
    )


def _areas(corners: np.ndarray) -> np.ndarray:
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.linalg.norm(across, axis=1)
