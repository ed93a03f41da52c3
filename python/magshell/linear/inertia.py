"""The consistent mass matrix of a scene's free unknowns."""

from __future__ import annotations

import numpy as np
import scipy

from ..scene.values import Values


def consistent_masses(values: Values) -> scipy.sparse.csc_array:
    """M (n, n), kg, of the free unknowns: zero for edge rotations. Raises ValueError with rigid parts, or where a body has
    no density."""
    scene = values.scene
    if scene.rigid_parts:
        raise ValueError(
            'mass="consistent" is for scenes without rigid parts, whose masses are lumped: mass="lumped"'
        )
    values.vertex_masses  # noqa: B018 - says which body has no density
    of_vertices = masses_of_vertices(values)
    # Each free unknown moves one vertex, along an axis or, where a support turns it, along one of its frame.
    model, n_v = scene._model, scene.mesh.n_vertices
    total = scipy.sparse.csc_array((model.free_size, model.free_size))
    for axis in range(3):
        ones, numbered = np.zeros((n_v, 3)), np.zeros((n_v, 3))
        ones[:, axis], numbered[:, axis] = 1.0, np.arange(1, n_v + 1)
        shares, products = (model.reduce(model.full_vector(rows)) for rows in (ones, numbered))
        moved = np.flatnonzero(np.abs(shares) > 1e-9)
        vertices = np.rint(products[moved] / shares[moved]).astype(int) - 1
        motions = scipy.sparse.csc_array((shares[moved], (vertices, moved)), shape=(n_v, model.free_size))
        total = total + motions.T @ of_vertices @ motions
    return scipy.sparse.csc_array(total)


def masses_of_vertices(values: Values) -> scipy.sparse.csc_array:
    """Return the masses between vertices (n_v, n_v), kg; welded vertices are the first of them. Raises ValueError where a
    body has no density."""
    scene = values.scene
    original, n_v = scene._bodies.original, scene.mesh.n_vertices
    rows, columns, numbers = [], [], []
    for span, body in zip(scene._bodies.spans, values.sheets, strict=True):
        skin = getattr(body, "skin", None)
        for nodes, masses in (body.element_masses, *(() if skin is None else (skin.element_masses,))):
            at = original[span.vertices][nodes]
            rows.append(np.broadcast_to(at[:, :, None], masses.shape).ravel())
            columns.append(np.broadcast_to(at[:, None, :], masses.shape).ravel())
            numbers.append(masses.ravel())
    joined = (np.concatenate(each) for each in (rows, columns))
    return scipy.sparse.csc_array(
        scipy.sparse.coo_array((np.concatenate(numbers), tuple(joined)), shape=(n_v, n_v))
    )


def in_places(matrix: scipy.sparse.csc_array, starts: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The entries of a symmetric matrix (n, n) in the places of a lower triangle, by columns."""
    columns = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    lower = scipy.sparse.coo_array(matrix)
    size = matrix.shape[0]
    keys = lower.col.astype(np.int64) * size + lower.row
    order = np.argsort(keys)
    wanted = columns.astype(np.int64) * size + rows
    found = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    hit = keys[order][found] == wanted
    return np.where(hit, lower.data[order][found], 0.0)
