"""Pairs of near sources of the own field against independent formulas."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.scene.solve_inputs import Inputs
from tests.support.magnet_forces import VACUUM_PERMEABILITY

THICKNESS = 2e-4  # [m]
# Two triangles that are nearer than their sides are long [m], not parallel, and further apart than a thickness.
CORNERS = np.array(
    [
        [[0.0, 0.0, 0.0], [3e-3, 2e-4, 1e-4], [4e-4, 2.6e-3, -2e-4]],
        [[1e-3, 3e-4, 7e-4], [3.4e-3, 9e-4, 1.1e-3], [1.2e-3, 3.1e-3, 9e-4]],
    ]
)
PLACES, WEIGHTS = (0.5 * np.array(each) for each in np.polynomial.legendre.leggauss(4))
HEIGHTS = 0.5 / np.sqrt(3.0) * np.array([-1.0, 1.0])  # of two Gauss points through a thickness of one


def normal_of(corners):
    across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return across / np.linalg.norm(across)


def mutual_energy(magnetizations):
    """Return the energy of two shells of one face each, less that of each alone, in J."""
    shells = [
        ms.Shell(ms.TriangleMesh(corners, [[0, 1, 2]]), thickness=THICKNESS, young_modulus=1e6)
        for corners in CORNERS
    ]
    scene = ms.Scene(shells, own_field=ms.OwnField(), allow_rigid_motions=True)

    def energy(first, second):
        inputs = Inputs(scene, np.array([first * magnetizations[0], second * magnetizations[1]]), None)
        with inputs.in_core():
            return scene._model.energies(scene._model.rest_state(), inputs.load_parameters)["own field"]

    return energy(1, 1) - energy(1, 0) - energy(0, 1)


def charged_points(corners, magnetization):
    """Return 16 points of each edge and their charges, in A m, of a face with a tangential magnetization."""
    normal = normal_of(corners)
    places, charges = [], []
    for k in range(3):
        start, line = corners[k], corners[(k + 1) % 3] - corners[k]
        charge = THICKNESS * magnetization @ np.cross(line, normal)
        for along, of_line in zip(PLACES, WEIGHTS, strict=True):
            for height, of_height in zip(PLACES, WEIGHTS, strict=True):
                places.append(start + (0.5 + along) * line + THICKNESS * height * normal)
                charges.append(charge * of_line * of_height)
    return np.array(places), np.array(charges)


def solid_angle(corners, point):
    """Return the solid angle of a triangle, positive on the side of its normal, by the angles of its sides [L'Huilier]."""
    rays = [(corner - point) / np.linalg.norm(corner - point) for corner in corners]
    sides = [
        np.arctan2(np.linalg.norm(np.cross(rays[k], rays[k - 1])), rays[k] @ rays[k - 1]) for k in range(3)
    ]
    half = sum(sides) / 2
    product = np.tan(half / 2) * np.prod([np.tan((half - side) / 2) for side in sides])
    return np.sign((point - corners[0]) @ normal_of(corners)) * 4 * np.arctan(np.sqrt(product))


def tangential(corners):
    return 3e4 * (corners[1] - corners[0]) / np.linalg.norm(corners[1] - corners[0])


def test_charges_of_near_edges_have_the_energy_of_their_points():
    magnetizations = [tangential(corners) for corners in CORNERS]
    (x, q), (y, p) = (charged_points(*each) for each in zip(CORNERS, magnetizations, strict=True))
    distances = np.linalg.norm(x[:, None] - y, axis=2)
    expected = VACUUM_PERMEABILITY / (4 * np.pi) * q @ (1 / distances) @ p
    assert mutual_energy(magnetizations) == pytest.approx(expected, rel=1e-12)


def test_charges_near_a_charged_side_see_its_solid_angle():
    magnetizations = [tangential(CORNERS[0]), 5e4 * normal_of(CORNERS[1])]
    current = THICKNESS * 5e4
    potential = 0.0
    for place, charge in zip(*charged_points(CORNERS[0], magnetizations[0]), strict=True):
        for height in HEIGHTS:
            face = CORNERS[1] + THICKNESS * height * normal_of(CORNERS[1])
            potential += charge * current * solid_angle(face, place) / 2
    expected = VACUUM_PERMEABILITY / (4 * np.pi) * potential
    assert mutual_energy(magnetizations) == pytest.approx(expected, rel=1e-12)
