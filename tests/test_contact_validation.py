"""Contact against exact and published numbers: F1a, F2a, F3a, F4, F5, F7 and I3 of the validation set."""

import numpy as np
import pytest
import torch

import magshell as ms

GRAVITY = 9.81
RIGID = {"thickness": 1e-3, "young_modulus": 1e9, "mass_density": 1e3}


def everywhere(body) -> np.ndarray:
    return np.arange(body.mesh.n_vertices)


def flat(side, at=(0.0, 0.0, 0.0), cells=1, **given) -> ms.Shell:
    """A square around `at`, to be held: a floor."""
    mesh = ms.meshes.rectangle(side, side, cells=(cells, cells))
    return ms.Shell(mesh.transformed(translation=np.asarray(at) - (side / 2, side / 2, 0.0)), **{**RIGID, **given})


def held(body, **moved) -> ms.Pin:
    return ms.Pin(everywhere(body), body=body, **moved)


# F1a: force / (E R^2) on a ball of NeoHookean("isochoric"), nu = 0.45, when each plate has advanced by delta / R.
# Axisymmetric Taylor-Hood elements; a finer mesh changes the force by 0.14 %.
SQUEEZED = {0.05: 0.02058275337, 0.1: 0.06157763805, 0.2: 0.1939364072, 0.3: 0.4067555698}


def octant(cells, order=2, finer=1.6) -> ms.TetMesh:
    """An eighth of the unit ball, out of a cube, whose cells are smaller towards the z axis."""
    cube = ms.meshes.box((1, 1, 1), cells=(cells, cells, cells), diagonals="aligned")
    x = cube.rest_positions * [1.0, 1.0, 1.0]
    x[:, :2] = x[:, :2] ** finer
    out = np.abs(x).max(axis=1) / np.maximum(np.linalg.norm(x, axis=1), 1e-300)
    mesh = ms.TetMesh(x * out[:, None], cube.tetrahedra)
    if order == 1:
        return mesh
    mesh = mesh.second_order()
    x = mesh.rest_positions.copy()
    r = np.linalg.norm(x, axis=1)
    on = np.isin(np.arange(len(x)), np.unique(mesh.faces)) & ((x > 1e-9).all(axis=1) | (r > 0.95))
    x[on] /= r[on, None]
    return ms.TetMesh(x, mesh.tetrahedra)


def squeeze_force(cells, advance, reach=1e-3) -> float:
    """On a ball of radius 1 and modulus 1; what is left between ball and plate counts as ball."""
    mesh = octant(cells)
    ball = ms.Solid(mesh, material=ms.NeoHookean("isochoric", young_modulus=1.0, poisson_ratio=0.45))
    plate = flat(3.0, (0.1, 0.2, 1 + reach))
    touch = ms.Contact(plate, ball, minimal_distance=0.0, reach=reach, contact_stiffness=1.0)
    mirrors = [ms.Pin(mesh.vertices_at(**{axis: 0.0}), axis, body=ball) for axis in "xyz"]
    down = held(plate, displacement=(0, 0, -advance - 0.3 * reach))
    found = ms.equilibrium(ms.Scene([plate, ball], supports=[down, *mirrors], contacts=[touch]))
    near = found.touching(touch)
    print(near, found.iterations, mesh)
    return 4 * found.touching(touch).forces[: plate.mesh.n_vertices, 2].sum()


if __name__ == "__main__":
    import sys, time
    for c in (3, 5):
        for a in (0.1, 0.3):
            t=time.time(); f=squeeze_force(c,a); print(c,a,f,f/SQUEEZED[a]-1,time.time()-t, flush=True)
