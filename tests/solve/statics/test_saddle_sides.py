"""Escape from a saddle: the sheet goes to the side of lower energy, which is where loads push it."""

from __future__ import annotations

import numpy as np
import pytest

import magshell as ms

LENGTH, WIDTH, SHORTENING = 120e-3, 20e-3, 0.5e-3  # m


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
@pytest.mark.parametrize("field", [-1e-3, 1e-3])  # T
def test_a_pressed_beam_buckles_to_where_the_field_pushes_it(bending, field):
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=(48, 8))
    sheet = ms.Shell(mesh, thickness=2.5e-3, young_modulus=4.2e6, poisson_ratio=0.5, bending=bending)
    ends = [
        ms.Clamp(mesh.edges_at(x=x), displacement=(side * SHORTENING / 2, 0, 0))
        for x, side in ((0.0, 1), (LENGTH, -1))
    ]
    scene = ms.Scene(sheet, supports=ends, field=ms.UniformField())
    outwards = np.sign(mesh.face_barycenters[:, 0] - LENGTH / 2)[:, None] * np.array([5e4, 0, 0])  # A/m
    rest = ms.equilibrium(scene, remanent_magnetization=outwards, applied_flux_density=(0, 0, field))
    height = rest.positions[mesh.nearest_vertex((LENGTH / 2, WIDTH / 2, 0)), 2]
    assert rest.stable and -np.sign(field) * height > 3e-3
