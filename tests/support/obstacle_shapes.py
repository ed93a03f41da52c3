"""One obstacle of every kind, about a metre large, for tests of their common properties."""

from functools import cache

import numpy as np

import magshell as ms
from magshell import obstacles as ob

S = np.linspace(0, 1, 9)
WAVY = np.stack([2 * S - 1, 0.25 * np.sin(5 * S), 0.2 * S**2], axis=1)
RADII = 0.25 + 0.05 * np.cos(7 * S)
X, Y = np.linspace(-1, 1, 21), np.linspace(-0.9, 0.9, 19)
HILLS = 0.12 * np.sin(3 * X)[:, None] * np.cos(2.5 * Y)[None, :]


def ball(cells=64):
    return ms.meshes.spherical_cap(0.7, 0.0, np.pi, cells=(cells, cells // 2))


def torus(ring=0.6, radius=0.25, cells=(96, 48), flip=False):
    """Build a closed mesh of a torus around the z axis."""
    n, m = cells
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    rho = ring + radius * np.cos(v)
    points = np.stack([rho * np.cos(u), rho * np.sin(u), radius * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    d, c = i * m + (j + 1) % m, (i + 1) % n * m + (j + 1) % m
    quads = [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (a, c, d))]
    mesh = ms.TriangleMesh(points, np.concatenate(quads))
    return mesh.flipped() if flip else mesh


MAKERS = {
    "plane": lambda **place: ob.Plane((1, -2, 3), **place),
    "slope": lambda **place: ob.slope(0.4, uphill=(1, 1), **place),
    "sphere": lambda **place: ob.Sphere(0.6, **place),
    "sphere around": lambda **place: ob.Sphere(0.6, inside=True, **place),
    "rounded box": lambda **place: ob.Box((1.2, 0.8, 1.0), rounding=0.15, **place),
    "box around": lambda **place: ob.Box((1.2, 0.8, 1.0), rounding=0.3, inside=True, **place),
    "ellipsoid": lambda **place: ob.Ellipsoid((0.8, 0.5, 0.6), **place),
    "ellipsoid around": lambda **place: ob.Ellipsoid((0.8, 0.7, 0.6), inside=True, **place),
    "capsule": lambda **place: ob.Capsule([[-0.4, 0, 0.1], [0.3, 0.2, 0]], 0.3, **place),
    "capsule around": lambda **place: ob.Capsule(0.8, 0.3, inside=True, **place),
    "tube": lambda **place: ob.Tube(WAVY, RADII, **place),
    "closed tube": lambda **place: ob.Tube(WAVY, RADII, closed=True, **place),
    "horn": lambda **place: ob.Tube(WAVY, RADII, inside=False, closed=True, **place),
    "hills": lambda **place: ob.HeightField(X, Y, HILLS, **place),
    "ridge": lambda **place: ob.bump(0.15, 1.2, **place),
    "mound": lambda **place: ob.bump(0.15, 1.2, ridge=False, **place),
    "ball mesh": lambda **place: ob.MeshObstacle(ball(), resolution=24, **place),
    "torus mesh": lambda **place: ob.MeshObstacle(torus(), resolution=32, **place),
}


@cache
def made(name):
    """Build an obstacle at rest, in its own frame."""
    return MAKERS[name]()


def points_near_surface(obstacle, count, depth, seed=0):
    """Return points near the surface, up to `depth` on either side of it, (count, 3) m."""
    rng = np.random.default_rng(seed)
    vertices, faces = obstacle.surface(extent=2.0)
    corners = vertices[faces[rng.integers(len(faces), size=count)]]
    points = np.einsum("ki,kij->kj", rng.dirichlet(np.ones(3), count), corners)
    away = rng.uniform(-depth, depth, count) - obstacle.signed_distance(points)
    return points + away[:, None] * obstacle.normals(points)
