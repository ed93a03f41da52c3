"""Restriction of states to the surfaces of solids, because their inside is not visible."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..results.state import State
from .colors import Scalar


def on_surfaces(states: list[State]) -> list[State]:
    """Return the states with the surfaces of their meshes; triangle meshes stay. Faces keep their numbers."""
    drawn: dict[int, tuple[TriangleMesh, np.ndarray]] = {}
    found = []
    for state in states:
        mesh = state.mesh
        if isinstance(mesh, TriangleMesh):
            found.append(state)
            continue
        surface, vertices = drawn.setdefault(id(mesh), (mesh.surface, mesh.surface_vertices))
        found.append(
            replace(
                state,
                mesh=surface,
                positions=state.positions[vertices],
                elements=None,
                loads=_on_vertices(state.loads, vertices),
            )
        )
    return found


def _on_vertices(loads, vertices: np.ndarray):
    return None if loads is None else lambda: loads().of(vertices)


def scalar_on_surfaces(scalar: Scalar | None, states: list[State]) -> Scalar | None:
    """Return a scalar without its values at vertices inside solids. states: those before `on_surfaces`."""
    if scalar is None:
        return None
    pairs = zip(scalar.values, states, strict=True)
    return replace(scalar, values=[_on_surface(values, state) for values, state in pairs])


def _on_surface(values: np.ndarray, state: State) -> np.ndarray:
    if isinstance(state.mesh, TriangleMesh) or len(values) == state.mesh.n_faces:
        return values
    return values[state.mesh.surface_vertices]
