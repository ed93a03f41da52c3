"""Strips next to each other in one scene."""

import numpy as np

import magshell as ms

FAR = 0.5  # m, between sheets of 0.1 m
STRONG = np.array([0.0, 0.0, 2e-3])


def strip(k=0, cells=(8, 2), **changed):
    """Build sheets that differ in mesh, bending, thickness, density and magnetization."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=cells, irregular=0.2, seed=k)
    mesh = mesh.transformed(translation=(0.0, FAR * k, 0.0))
    properties = {
        "thickness": (1.0 + 0.2 * k) * 1e-3,
        "young_modulus": 1e6,
        "mass_density": 1e3 + 300.0 * k,
        "bending": ("midedge", "hinge")[k % 2],
        "remanent_magnetization": ((2e4, 1e3, 0.0), (-1e4, 0.0, 3e3))[k % 2],
    }
    return ms.Shell(mesh, **{**properties, **changed})
