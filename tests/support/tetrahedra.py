"""Small meshes of tetrahedra, which several tests look at."""

import numpy as np

import magshell as ms

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TWO = np.concatenate([CORNERS, [[1.0, 1, 1]]]), np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
BLOCK = ms.meshes.box((3.0, 2.0, 1.0), cells=(3, 2, 2))
BENT = ms.meshes.ball(1.0, cells=2, order=2)


def one(positions=CORNERS, tetrahedra=((0, 1, 2, 3),), **more):
    return ms.TetMesh(positions, tetrahedra, **more)


def positive_each(points, tetrahedra):
    x = points[tetrahedra]
    volume = np.linalg.det(x[:, 1:] - x[:, :1])
    return np.where((volume < 0)[:, None], tetrahedra[:, [1, 0, 2, 3]], tetrahedra)
