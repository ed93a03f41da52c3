"""Moduli that vary by a factor of 1e6 between neighbouring faces."""

from __future__ import annotations

import numpy as np
from answers import at_rest, both, near
from registry import case
from sheets import LENGTH, THICKNESS, YOUNG_MODULUS, cantilever, end_position, ends, shell, strip

import magshell as ms

CONTRAST = 1e6


def striped(cells: int, a_stripe: int) -> tuple[ms.TriangleMesh, np.ndarray, np.ndarray]:
    """Return a strip of alternating soft and stiff stripes of `a_stripe` cells: mesh, moduli (n_f,), stripe bounds."""
    mesh = strip((cells, 2))
    count = cells // a_stripe
    stripe = np.floor(mesh.face_barycenters[:, 0] / LENGTH * count).astype(int)
    modulus = np.where(stripe % 2 == 0, YOUNG_MODULUS, CONTRAST * YOUNG_MODULUS)
    return mesh, modulus, np.linspace(0.0, LENGTH, count + 1)


@case("stripes of moduli 1 to 1e6, pulled")
def springs_in_series():
    mesh, modulus, bounds = striped(20, 1)
    force = 1e-3  # N/m
    found = ms.linear_response(cantilever(shell(mesh, young_modulus=modulus), (force, 0, 0)))
    lengths = np.diff(bounds)
    expected = force / THICKNESS * (lengths[::2].sum() + lengths[1::2].sum() / CONTRAST) / YOUNG_MODULUS
    # Rounding of the matrix's entries may change the answer by the contrast times 1.1e-16, for each of the stripes.
    return near("end x", end_position(mesh, found.displacements)[0], expected, rel=20 * 1.1e-16 * CONTRAST)


@case("stripes of moduli 1 to 1e6, bent")
def beam_of_stripes():
    mesh, modulus, bounds = striped(80, 8)
    force = 1e-9
    found = ms.linear_response(cantilever(shell(mesh, young_modulus=modulus), (0, 0, force)))
    # The work of M = P (L - x): w = P sum of ((L - a)^3 - (L - b)^3) / (3 E I) over the stripes from a to b.
    inertia = THICKNESS**3 / 12.0
    parts = (LENGTH - bounds[:-1]) ** 3 - (LENGTH - bounds[1:]) ** 3
    moduli = np.where(np.arange(len(parts)) % 2 == 0, 1.0, CONTRAST) * YOUNG_MODULUS
    expected = force * float((parts / moduli).sum()) / (3.0 * inertia)
    return near("end z", end_position(mesh, found.displacements)[2], expected, rel=3e-3)


@case("two wings 1e6 times stiffer than the hinge between them, folded by {} degrees", over=(90, 170))
def living_hinge(degrees):
    mesh = strip((40, 2))
    middle = np.abs(mesh.face_barycenters[:, 0] - LENGTH / 2) < 0.05 * LENGTH
    sheet = shell(mesh, thickness=1e-4, young_modulus=np.where(middle, 1.0, CONTRAST) * YOUNG_MODULUS)
    near_end, far_end = ends(mesh)
    hinge, wing, angle = 0.1 * LENGTH, 0.45 * LENGTH, np.radians(degrees)
    couple = -angle / hinge * YOUNG_MODULUS * 1e-12 / 12.0
    scene = ms.Scene(sheet, supports=[ms.Clamp(near_end)], loads=[ms.EdgeCouple(far_end, couple)])
    found = ms.equilibrium(scene)
    radius = hinge / angle
    x = wing + radius * np.sin(angle) + wing * np.cos(angle)
    z = radius * (1.0 - np.cos(angle)) + wing * np.sin(angle)
    end = end_position(mesh, found.positions)
    got = (end[0], abs(end[2]))
    return both(near("end x, z", got, (x, z), rel=1e-2, scale=LENGTH), at_rest(found))


@case("moduli of single faces drawn from 1 to 1e6")
def reciprocity_of_a_patchwork():
    """Check Betti's theorem: the work of one load on the displacements of another is symmetric."""
    rng = np.random.default_rng(5)
    mesh = strip((20, 4), irregular=0.25)
    sheet = shell(mesh, young_modulus=YOUNG_MODULUS * CONTRAST ** rng.random(mesh.n_faces), poisson_ratio=0.4)
    vertices = np.arange(mesh.n_vertices)
    forces = 1e-9 * rng.normal(size=(2, mesh.n_vertices, 3))
    moved = []
    for force in forces:
        loads = [ms.PointLoad(vertices, force)]
        scene = ms.Scene(sheet, supports=[ms.Clamp(ends(mesh)[0])], loads=loads)
        moved.append(ms.linear_response(scene).displacements)
    works = np.sum(forces[0] * moved[1]), np.sum(forces[1] * moved[0])
    own = np.sqrt(np.sum(forces[0] * moved[0]) * np.sum(forces[1] * moved[1]))
    return near("f1.u2 - f2.u1, of the works", works[0] - works[1], 0.0, rel=1e-8, scale=own)


@case("moduli 1e6 apart in neighbouring faces, in a field that bends it far")
def patchwork_in_a_field():
    """Compare a magnetized strip with one under the end force h w M B, whatever its local moduli."""
    rng = np.random.default_rng(6)
    mesh = strip((40, 4))
    columns = rng.random(40)[np.floor(mesh.face_barycenters[:, 0] / LENGTH * 40).astype(int)]
    sheet = shell(mesh, thickness=1e-4, young_modulus=1e7 * CONTRAST**columns)
    force = 40 * 1e7 * 1e-12 / LENGTH**2
    scenes = cantilever(sheet, (0, 0, force)), cantilever(sheet, field=ms.UniformField())
    loaded = ms.equilibrium(scenes[0])
    magnetic = ms.equilibrium(
        scenes[1], remanent_magnetization=(4e4, 0, 0), applied_flux_density=(0, 0, force / (4e4 * 1e-4))
    )
    return both(
        near("positions", magnetic.positions, loaded.positions, rel=1e-6, scale=LENGTH),
        at_rest(loaded),
        at_rest(magnetic),
    )
