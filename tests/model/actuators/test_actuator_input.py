"""Errors that cavities, cells and tendons raise for bad input."""

import re

import numpy as np
import pytest
from actuated import box_sheet, held, hollow_block

import magshell as ms
from magshell.model.actuators.closed_surface import inner_faces

BLOCK, SHEET = hollow_block(), box_sheet()
TEN = hollow_block("quadratic")
INSIDE = inner_faces(BLOCK)
OPEN = ms.Shell(ms.meshes.rectangle(1.0, 1.0, cells=(2, 2)), thickness=0.01, young_modulus=1e6)
TURNED = ms.Shell(
    ms.TriangleMesh(SHEET.mesh.rest_positions, SHEET.mesh.faces[:, ::-1]), thickness=0.005, young_modulus=1e6
)
FULL = ms.Solid(
    ms.meshes.box((1, 1, 1), cells=(1, 1, 1)), material=ms.NeoHookean(young_modulus=1.0, poisson_ratio=0.3)
)
N_T = BLOCK.mesh.n_tetrahedra
ENDS = [(0.001, 0.002, 0.003), (0.02, 0.002, 0.001)]


def outer_faces() -> np.ndarray:
    return np.setdiff1d(np.arange(BLOCK.mesh.n_faces), INSIDE)


MISTAKES = {
    "one of pressure": (lambda: ms.Cavity(BLOCK), "takes one of pressure .* got none"),
    "two laws": (lambda: ms.Cavity(BLOCK, pressure=1.0, volume=1.0), "got pressure and volume"),
    "no number": (
        lambda: ms.Cavity(BLOCK, pressure="high"),
        r"pressure \[Pa\] must be an array of real numbers",
    ),
    "not finite": (lambda: ms.Cavity(BLOCK, pressure=np.nan), r"pressure \[Pa\] must be finite"),
    "shape": (
        lambda: ms.Cavity(BLOCK, pressure=[1.0, 2.0]),
        r"pressure \[Pa\] must be a number, got shape \(2,\)",
    ),
    "negative amount": (
        lambda: ms.Cavity(BLOCK, gas_pressure=-1.0),
        r"gas_pressure \[Pa\] must be at least 0",
    ),
    "no volume": (lambda: ms.Cavity(BLOCK, volume=0.0), r"volume \[m3\] must be above 0, got 0"),
    "bulk modulus of a gas": (
        lambda: ms.Cavity(BLOCK, gas_pressure=1e5, bulk_modulus=1e9),
        "bulk_modulus is that of a liquid",
    ),
    "no body": (lambda: ms.Cavity("ball", pressure=1.0), "takes a Shell or a Solid, or several as"),
    "a body twice": (lambda: ms.Cavity([BLOCK, BLOCK], pressure=1.0), "names each body once"),
    "faces of several": (lambda: ms.Cavity([BLOCK, SHEET], [0], pressure=1.0), "faces are those of one body"),
    "lids": (lambda: ms.Cavity(BLOCK, pressure=1.0, close_rims="yes"), "close_rims must be True or False"),
    "cells of a shell": (
        lambda: ms.PneumaticCells(SHEET, stiffness=1.0),
        "body of PneumaticCells must be a Solid, got Shell",
    ),
    "cells overlap": (
        lambda: ms.PneumaticCells(BLOCK, [[0, 1, 2], [5, 2]], stiffness=1.0),
        r"must not overlap, but tetrahedron 2 is in cells \[0, 1\]",
    ),
    "an empty cell": (
        lambda: ms.PneumaticCells(BLOCK, np.where(np.arange(N_T) < 9, 0, 2), stiffness=1.0),
        "cell 1 has no tetrahedron",
    ),
    "no cell": (lambda: ms.PneumaticCells(BLOCK, np.full(N_T, -1), stiffness=1.0), "groups holds no cell"),
    "groups of another mesh": (
        lambda: ms.PneumaticCells(BLOCK, np.zeros(3, int), stiffness=1.0),
        f"must be {N_T} integers",
    ),
    "a tetrahedron that is none": (lambda: ms.PneumaticCells(BLOCK, [[N_T]], stiffness=1.0), "Cells groups"),
    "stiffness of other cells": (
        lambda: ms.PneumaticCells(BLOCK, [[0], [1]], stiffness=[1.0, 2.0, 3.0]),
        r"stiffness \[Pa\] must be a number or one a cell, \(2,\), got \(3,\)",
    ),
    "soft cells": (lambda: ms.PneumaticCells(BLOCK, stiffness=0.0), r"stiffness \[Pa\] must be above 0"),
    "cells of no volume": (
        lambda: ms.PneumaticCells(BLOCK, stiffness=1.0, volume_ratio=-0.5),
        r"volume_ratio \[1\] must be above 0, got -0.5",
    ),
    "a tendon of one point": (lambda: ms.Tendon(ENDS[:1], BLOCK), "needs two points or more, got 1"),
    "a tendon nowhere": (lambda: ms.Tendon(ENDS), "runs through a Shell, a Solid or a RigidBody"),
    "points that are one": (
        lambda: ms.Tendon([ENDS[0], ENDS[0], ENDS[1]], BLOCK),
        "points 0 and 1 of the Tendon are one",
    ),
    "two bodies of a point": (lambda: ms.Tendon([(BLOCK, p) for p in ENDS], BLOCK), "so body= must not"),
    "it cannot push": (lambda: ms.Tendon(ENDS, BLOCK, tension=-1.0), r"tension \[N\] must be at least 0"),
    "slides": (lambda: ms.Tendon(ENDS, BLOCK, sliding=1), "sliding must be True or False"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_constructors_refuse_bad_arguments(mistake):
    make, says = MISTAKES[mistake]
    with pytest.raises(ValueError, match=says):
        make()


IN_SCENES = {
    "no hollow": (
        FULL,
        lambda: ms.Cavity(FULL, pressure=1.0),
        "the solid has no hollow inside it: say which",
    ),
    "open": (
        OPEN,
        lambda: ms.Cavity(OPEN, pressure=1.0),
        r"not closed: 8 edges have a face on one side only: \(1, 0\)",
    ),
    "a face is missing": (
        BLOCK,
        lambda: ms.Cavity(BLOCK, INSIDE[1:], pressure=1.0),
        "not closed: 3 edges have a face on one side only",
    ),
    "no such face": (BLOCK, lambda: ms.Cavity(BLOCK, [10**6], pressure=1.0), "Cavity faces"),
    "outer faces": (
        BLOCK,
        lambda: ms.Cavity(BLOCK, outer_faces(), pressure=1.0),
        r"inside out, its volume -2.7e-05 m3",
    ),
    "turned": (TURNED, lambda: ms.Cavity(TURNED, pressure=1.0), r"inside out, its volume -0.001 m3"),
    "flat": (
        OPEN,
        lambda: ms.Cavity(OPEN, pressure=1.0, close_rims=True),
        "the cavity has no volume at rest",
    ),
    "a part of a side": (
        TEN,
        lambda: ms.Cavity(TEN, inner_faces(TEN)[1:], pressure=1.0),
        "takes whole sides of quadratic elements",
    ),
    "another scene's": (
        FULL,
        lambda: ms.Cavity(BLOCK, pressure=1.0),
        "a body of the scene is one of scene.bodies",
    ),
    "a point outside": (
        BLOCK,
        lambda: ms.Tendon([ENDS[0], (0.05, 0, 0)], BLOCK, tension=1.0),
        r"point 1 of the Tendon, \[0.05, 0.0, 0.0\] m, lies outside every element",
    ),
    "a point in the hollow": (
        TEN,
        lambda: ms.Tendon([ENDS[0], (0.015, 0.015, 0.015)], TEN, tension=1.0),
        "lies outside every element of its body, 0.00",
    ),
    "beside a shell": (
        SHEET,
        lambda: ms.Tendon([(0, 0, 0), (0.05, 0.05, 0.05)], SHEET, tension=1.0),
        "point 1 of the Tendon",
    ),
    "no actuator": (
        BLOCK,
        lambda: ms.Pressure(1.0),
        "actuators must hold Muscle, Cavity, PneumaticCells and Tendon objects, got Pressure",
    ),
}


@pytest.mark.parametrize("mistake", IN_SCENES)
def test_scenes_refuse_bad_actuators(mistake):
    body, make, says = IN_SCENES[mistake]
    with pytest.raises(ValueError, match=says):
        held(body, actuators=[make()])


def test_a_cavity_is_closed_by_a_body_that_is_tied_to_another():
    """Close a cup of a solid with a shell as its lid; a lid with reversed faces is refused."""
    box = ms.meshes.box((0.03, 0.03, 0.03), cells=(3, 3, 3))
    at = box.tetrahedron_barycenters
    hole = (np.abs(at[:, :2] - 0.015).max(axis=1) < 0.005) & (at[:, 2] > 0.01)
    kept, numbered = np.unique(box.tetrahedra[~hole], return_inverse=True)
    cup = ms.Solid(
        ms.TetMesh(box.rest_positions[kept], numbered.reshape(-1, 4)),
        material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3),
        element="linear",
    )
    square = ms.TriangleMesh(
        [(0.01, 0.01, 0.03), (0.02, 0.01, 0.03), (0.02, 0.02, 0.03), (0.01, 0.02, 0.03)],
        [(0, 1, 2), (0, 2, 3)],
    )
    x = cup.mesh.rest_positions[cup.mesh.faces]
    inner = np.flatnonzero(
        (np.abs(x[..., :2] - 0.015).max(axis=(1, 2)) < 0.0051)
        & (x[..., 2].min(axis=1) > 0.009)
        & (x[..., 2].mean(axis=1) < 0.029)
    )
    lid, wrong = (
        ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
        for mesh in (square, ms.TriangleMesh(square.rest_positions, square.faces[:, ::-1]))
    )

    def scene(sheet):
        return ms.Scene(
            [cup, sheet],
            ties=[ms.Tie(cup, sheet)],
            supports=[ms.Pin(cup.mesh.vertices_at(z=0.0), body=cup)],
            actuators=[ms.Cavity([(cup, inner), sheet], pressure=500.0)],
        )

    with pytest.raises(ValueError, match="do not run the same way round"):
        scene(wrong)
    found = ms.equilibrium(scene(lid))
    (cavity,) = found.scene.actuators
    assert found.stable and float(found[cavity].volume) > cavity.rest_volume(found.scene) > 1.99e-6


def test_values_that_a_solve_cannot_have():
    gas = ms.Cavity(BLOCK, gas_pressure=1e5)
    scene = held(BLOCK, actuators=[gas])
    with pytest.raises(ValueError, match=r"Cavity has no value 'pressure'.*gas_pressure"):
        ms.equilibrium(scene, values={gas: {"pressure": 1.0}})
    with pytest.raises(ValueError, match=r"gas_pressure \[Pa\] must be at least 0, got -1"):
        ms.equilibrium(scene, values={gas: {"gas_pressure": -1.0}})
    with pytest.raises(ValueError, match=r"gas_pressure \[Pa\] must be at least 0, got -5"):
        ms.simulate(
            scene,
            steps=2,
            time_step=1e-3,
            values={gas: {"gas_pressure": [1.0, -5.0, 2.0]}},
            progress=False,
        )
    found = ms.equilibrium(scene)
    with pytest.raises(ValueError, match=re.escape("scene.actuators, got Cavity")):
        found[ms.Cavity(BLOCK, pressure=1.0)].volume  # noqa: B018
