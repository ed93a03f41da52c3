"""Surface tension of shells against theory, and refused input. Its gradients: test_every_gradient.py."""

import numpy as np
import pytest
from scipy.optimize import brentq

import magshell as ms


def pulled_strip(tension, **options):
    """Return a scene of a strip bent by a load, so that no part of it lies in a plane."""
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(6, 3))
    sheet = ms.Shell(mesh, thickness=2e-4, young_modulus=1e6, poisson_ratio=0.3)
    loads = [
        ms.PointLoad(mesh.nearest_vertex((0.02, 0, 0)), (0, 1e-5, 2e-5)),
        ms.SurfaceTension(tension, **options),
    ]
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=loads)


def areas(scene, positions):
    a, b, c = positions[scene.mesh.faces].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_energy_is_tension_times_area():
    faces = np.arange(4, 20)
    tension = np.linspace(0.01, 0.03, len(faces))
    scene = pulled_strip(tension, faces=faces)
    rest = ms.equilibrium(scene, load_factor=0.8)
    expected = 0.8 * tension @ areas(scene, rest.positions)[faces]
    assert rest.energies["surface tension"] == pytest.approx(expected, rel=1e-14)


def test_number_and_equal_values_per_face_agree():
    one = ms.equilibrium(pulled_strip(0.02))
    each = ms.equilibrium(pulled_strip(np.full(36, 0.02)))
    assert np.array_equal(one.positions, each.positions)
    again = ms.equilibrium(scene := pulled_strip(0.0), values={scene.loads[1]: {"surface_tension": 0.02}})
    assert np.array_equal(one.positions, again.positions)


@pytest.mark.parametrize("load_factor", [1.0, 0.5])
def test_a_free_sheet_shrinks(load_factor):
    """Compare with the Green strain e given by Y h / (1 - nu) e + gamma = 0, where the area is 1 + 2 e."""
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(6, 3))
    sheet = ms.Shell(mesh, thickness=1e-5, young_modulus=1e6, poisson_ratio=0.3)
    sides = [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0)), ms.Pin(mesh.nearest_vertex((0, 0, 0)))]
    scene = ms.Scene(sheet, supports=sides, loads=[ms.SurfaceTension(0.05)], allow_rigid_motions=True)
    stretch = ms.equilibrium(scene, load_factor=load_factor).positions[:, :2].max(axis=0) / (0.02, 0.01)
    green = -0.05 * load_factor * (1 - 0.3) / (1e6 * 1e-5)
    assert np.allclose(stretch, np.sqrt(1 + 2 * green), rtol=1e-10)


def test_a_film_between_two_rings_is_a_catenoid():
    """Compare the neck c of a film of negligible stiffness with c cosh(distance / 2 c) = radius of the rings."""
    ring, half = 0.01, 0.005
    neck = brentq(lambda c: c * np.cosh(half / c) - ring, 0.6 * ring, ring)
    mesh = ms.meshes.cylinder(ring, 2 * half, cells=(48, 12))
    sheet = ms.Shell(mesh, thickness=1e-6, young_modulus=50.0, poisson_ratio=0.3)
    film = ms.Scene(sheet, supports=[ms.Pin(mesh.boundary_vertices)], loads=[ms.SurfaceTension(0.05)])
    rest = ms.equilibrium(film)
    around = np.delete(rest.positions, 1, axis=1)
    assert np.linalg.norm(around, axis=1).min() == pytest.approx(neck, rel=2e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"surface_tension": -0.01}, r"surface_tension \[N/m\] must not be negative, got -0.01"),
        ({"surface_tension": [[0.01]]}, "must be a number or one a face, got shape"),
        ({"surface_tension": np.nan}, "must be finite"),
        ({"surface_tension": [0.01, 0.02]}, r"must be a number or have shape \(36,\), got \(2,\)"),
        ({"surface_tension": 0.01, "faces": [36]}, r"faces must be in \[0, 36\), got 36"),
        ({"surface_tension": 0.01, "faces": []}, "faces are empty"),
        ({"surface_tension": 0.01, "body": "sheet"}, "body must be a Shell"),
    ],
)
def test_bad_surface_tension_is_refused(given, message):
    tension = given.pop("surface_tension")
    with pytest.raises(ValueError, match=message):
        pulled_strip(tension, **given)
