"""Positions and lengths of arrows: magnetization on bodies, fields around them, contact forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..results.state import State

ARROWS = 60  # approximate number of arrows on a body
LENGTH = 0.85  # [-] length of the longest arrow over the spacing of arrows
RADIUS = 0.04  # [-] radius of the shafts over the spacing of arrows
NEGLIGIBLE = 1e-3  # [-] shorter vectors, relative to the longest one, are not drawn


@dataclass(frozen=True)
class Glyphs:
    """Arrows with starts and vectors (k, 3) m, the radius [m] of their shafts, and their lift [m] towards the eye."""

    starts: np.ndarray
    vectors: np.ndarray
    radius: float
    lift: float = 0.0


def largest(states: list[State]) -> float:
    """Return the largest remanent magnetization in all states, A/m; 0 if none is magnetized."""
    given = [state.remanent_magnetization for state in states if state.remanent_magnetization is not None]
    return max((float(np.linalg.norm(m, axis=1).max()) for m in given), default=0.0)


def spacing_of(mesh: TriangleMesh, count: int) -> float:
    """Return the distance between `count` arrows distributed over a surface, m."""
    return float(np.sqrt(mesh.face_areas.sum() / count))


def sample_faces(mesh: TriangleMesh, spacing: float) -> np.ndarray:
    """Choose faces about a spacing [m] apart: one near the center of each box of a lattice around the rest shape."""
    centers = mesh.face_barycenters
    low, extent = mesh.rest_positions.min(axis=0), np.ptp(mesh.rest_positions, axis=0)
    counts = np.maximum(1, np.round(extent / spacing)).astype(np.int64)
    step = np.where(extent > 0, extent / counts, 1.0)
    box = np.minimum((centers - low) // step, counts - 1)
    distance = np.linalg.norm(centers - low - (box + 0.5) * step, axis=1)
    nearest_first = np.lexsort((distance, *box.T))
    _, first = np.unique(box[nearest_first], axis=0, return_index=True)
    return np.sort(nearest_first[first])


def magnetization_glyphs(state: State, count: int, unit_vector: float) -> Glyphs:
    """Return about `count` arrows of the magnetization F_0 M_r or R M_r.

    A vector of length `unit_vector` [A/m] is drawn LENGTH spacings long. A tangential arrow is centered on its face, a
    normal one starts there.
    """
    spacing = spacing_of(state.mesh, count)
    faces = sample_faces(state.mesh, spacing)
    vectors = state.magnetization[faces]
    shown = np.linalg.norm(vectors, axis=1) > NEGLIGIBLE * unit_vector
    vectors = vectors[shown] * (LENGTH * spacing / unit_vector)
    x0, x1, x2 = np.moveaxis(state.positions[state.mesh.faces[faces[shown]]], 1, 0)
    normal = np.cross(x1 - x0, x2 - x0)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangential = vectors - np.einsum("ki,ki->k", vectors, normal)[:, None] * normal
    # Tangential arrows are lifted towards the eye, or a curved surface would hide parts of them; normal ones are not, or
    # they would be visible through the surface.
    flat = float(np.linalg.norm(tangential)) / max(float(np.linalg.norm(vectors)), 1e-300)
    starts = (x0 + x1 + x2) / 3.0 - 0.5 * tangential + 0.02 * (vectors - tangential)
    return Glyphs(starts, vectors, RADIUS * spacing, 0.5 * flat * spacing)


class ContactForces(NamedTuple):
    """The contact forces (k, 3) N on vertices at positions (k, 3) m."""

    positions: np.ndarray
    forces: np.ndarray


def contact_forces(state: State) -> ContactForces:
    """Return the contact forces of a state, without those that are negligible compared with the largest one."""
    if state.loads is None:
        return ContactForces(np.zeros((0, 3)), np.zeros((0, 3)))
    forces = state.loads().forces
    sizes = np.linalg.norm(forces, axis=1)
    shown = sizes > NEGLIGIBLE * sizes.max(initial=0.0)
    return ContactForces(state.positions[shown], forces[shown])


def halo(states: list[State], size: float) -> np.ndarray:
    """Return points (k, 3) m of a coarse lattice around the bodies, neither on them nor far away."""
    positions = np.concatenate([state.positions for state in states])
    spacing = size / 7.0
    low, high = positions.min(axis=0) - spacing, positions.max(axis=0) + spacing
    counts = np.maximum(2, np.round((high - low) / spacing)).astype(np.int64) + 1
    axes = [np.linspace(a, b, n) for a, b, n in zip(low, high, counts.tolist(), strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    barycenters = np.concatenate([state.barycenters for state in states])
    distance, _ = scipy.spatial.cKDTree(barycenters).query(points)
    return points[(distance > 0.55 * spacing) & (distance < 1.4 * spacing)]


def field_glyphs(points: np.ndarray, flux_densities: np.ndarray, size: float, unit_vector: float) -> Glyphs:
    """Return arrows of the flux density (k, 3) T, centered on points (k, 3) m.

    Flux densities of `unit_vector` [T] and more are drawn at full length. NaN and very small values are not drawn.
    """
    spacing = size / 7.0
    magnitude = np.linalg.norm(flux_densities, axis=1)
    shown = magnitude > 0.02 * unit_vector  # False for NaN
    vectors = flux_densities[shown] * np.minimum(1.0, unit_vector / magnitude[shown])[:, None]
    vectors = vectors * (0.7 * spacing / unit_vector)
    return Glyphs(points[shown] - 0.5 * vectors, vectors, 0.022 * spacing)


def sources_glyphs(
    states: list[State], points: list[np.ndarray], size: float, full_length: float | None = None
) -> tuple[list[Glyphs | None], float]:
    """Return arrows of each state's fields that vary in space, at its points, and the flux density [T] of full length."""
    sampled = [
        (at, state.flux_density_at(at)) if state.has_sources else (at[:0], at[:0])
        for state, at in zip(states, points, strict=True)
    ]
    if full_length is None:
        magnitudes = np.concatenate([np.linalg.norm(values, axis=1) for _, values in sampled])
        magnitudes = magnitudes[np.isfinite(magnitudes)]
        # the 90 % quantile: the field close to a source would make all other arrows too short to be seen
        full_length = float(np.quantile(magnitudes, 0.9)) if magnitudes.any() else 0.0
    if not full_length:
        return [None] * len(states), 0.0
    return [field_glyphs(*one, size, full_length) if len(one[0]) else None for one in sampled], full_length
