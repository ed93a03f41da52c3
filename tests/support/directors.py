"""For tests: the edge rotations of a sheet that has given normals."""

import numpy as np


def directors(mesh, positions, normals):
    """Return the rotations (n_e,) for which the director at the middle of every edge is the given normal (n_e, 3)."""
    corners = positions[mesh.faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face_normals /= np.linalg.norm(face_normals, axis=1, keepdims=True)
    found = np.zeros(mesh.n_edges)
    for e, (forward, backward) in enumerate(mesh.edge_faces):
        start, end = positions[mesh.edges[e]]
        along = (end - start) / np.linalg.norm(end - start)
        if forward < 0:
            found[e] = angle_about(along, normals[e], face_normals[backward])
            continue
        found[e] = angle_about(along, normals[e], face_normals[forward])
        if backward >= 0:
            found[e] -= 0.5 * angle_about(along, face_normals[backward], face_normals[forward])
    return found


def angle_about(axis, a, b):
    a, b = a - (a @ axis) * axis, b - (b @ axis) * axis
    return np.arctan2(np.cross(a, b) @ axis, a @ b)
