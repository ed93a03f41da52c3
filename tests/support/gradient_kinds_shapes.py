"""Kinds of scene for gradient_kinds.py with numbers that follow from rest positions: lengths, areas, normals, fibres."""

from types import SimpleNamespace

import numpy as np
import pytest
from adjoint_scenes import MESH
from gradient_kinds_muscles import muscles_in_motion
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms

torch = pytest.importorskip("torch")
TIP = MESH.vertices_at(x=0.1)
MATTER = {"thickness": 1e-3, "young_modulus": 1e6, "poisson_ratio": 0.4, "mass_density": 1e3}
WEIGHT = {"gravity": (0.2, 0.1, -9.81)}


def _six_nodes(cells, size, bend=0.0, seed=4) -> ms.QuadraticTriangleMesh:
    """Build a mesh whose nodes lie off the middles of its edges, bent along x."""
    flat = ms.meshes.rectangle(*size, cells=cells, order=2)
    points = flat.rest_positions
    points = points + 4e-4 * np.random.default_rng(seed).standard_normal(points.shape)
    return ms.QuadraticTriangleMesh(points + bend * points[:, :1] ** 2 * (0, 0, 1), flat.elements)


def in_a_symmetry_plane() -> Kind:
    """Build half of a sheet, which a plane continues."""
    sheet = ms.Shell(MESH, **MATTER)
    supports = [ms.Clamp(MESH.edges_at(x=0.0)), ms.SymmetryPlane((0, 1, 0))]
    scene = ms.Scene(sheet, supports=supports, gravity=(0.2, 0.0, -9.81))
    return Kind(scene, {"gravity_factor": 0.9}, fixed=EXACT, reach=REACH)


def six_nodes_with_couples() -> Kind:
    """Build a motion under couples along curved borders, at whose two Gauss points the edges have other lengths."""
    mesh = _six_nodes((2, 1), (0.1, 0.06))
    flat = ms.meshes.rectangle(0.1, 0.06, cells=(2, 1), order=2)
    loads = [
        ms.EdgeCouple(flat.edges_at(x=0.1), 2e-4),
        ms.EdgeCouple(flat.edges_at(y=0.06), (1e-4, 3e-4, -2e-4)),
    ]
    scene = ms.Scene(ms.Shell(mesh, **MATTER), supports=[ms.Clamp(flat.edges_at(x=0.0))], loads=loads)
    fixed = {**EXACT, "steps": 3, "progress": False}
    return Kind(scene, {"time_step": 5e-3}, ms.simulate, fixed=fixed, reach=REACH)


def _tensors(n: int, middle: float, size: float) -> np.ndarray:
    some = size * np.random.default_rng(n).uniform(-1, 1, (n, 3, 3))
    return middle * np.eye(3) + some + np.swapaxes(some, 1, 2)


def grown_six_nodes(**grown) -> Kind:
    """Build a curved sheet of six-node elements that has grown or bent by itself, not both."""
    mesh = _six_nodes((3, 2), (0.1, 0.04), bend=4.0)
    clamp = ms.Clamp(mesh.edges_at(x=0.0, tolerance=2e-3))
    scene = ms.Scene(ms.Shell(mesh, **MATTER, **grown), supports=[clamp], **WEIGHT)
    reach = {**REACH, "growth": 0.1, "rest_curvature": 10.0}
    return Kind(scene, {"gravity_factor": 1.0}, fixed=EXACT, reach=reach, step=1e-5)


def grown_obtuse_faces() -> Kind:
    """Build faces that the membrane cuts along their other diagonal, whose growth is the mean of two faces.

    The step is longer than in other kinds: the sheet bends so easily that the round-off of its membrane forces leaves
    positions 3e-11 m off.
    """
    flat = ms.meshes.rectangle(0.1, 0.012, cells=(3, 2), diagonals="aligned")
    x, y = flat.rest_positions[:, :1], flat.rest_positions[:, 1:2]
    mesh = ms.TriangleMesh(
        flat.rest_positions + 2.0 * x**2 * (0, 0, 1) + 2.5 * y * np.array((1, 0, 0)), flat.faces
    )
    own = {**MATTER, "thickness": 2e-4, "growth": _tensors(mesh.n_faces, 1.01, 0.005)}
    # Without a weight no modulus of all faces would matter.
    clamp, weight = ms.Clamp(flat.edges_at(x=0.0)), (0.002, 0.001, -0.01)
    scene = ms.Scene(ms.Shell(mesh, **own), supports=[clamp], gravity=weight)
    reach = {**REACH, "growth": 0.1, "rest_positions": 1e-3}
    return Kind(scene, {}, fixed=EXACT, reach=reach, step=1e-3)


def lengths_by_default(sliding: bool) -> Kind:
    """Build a tendon and springs in a sheet that are as long without force as its rest shape makes them."""
    sheet, middle = ms.Shell(MESH, **MATTER), MESH.rest_positions.mean(axis=0)
    path = [*(0.9 * MESH.rest_positions[TIP[:2]] + 0.1 * middle), middle]
    string = ms.Tendon([tuple(point) for point in path], sheet, tension=0.02, stiffness=3.0, sliding=sliding)
    springs = [
        ms.Spring((sheet, path[0]), (0.1, 0.0, 0.02), stiffness=0.6),
        ms.Spring((sheet, np.array(path[:2])), stiffness=[0.2, 0.3]),
        ms.Spring((sheet, path[1]), (sheet, path[2]), stiffness=2.0),
    ]
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    pull = ms.EdgeLoad(MESH.edges_at(x=0.1), (20.0, 0.0, 0.0))  # without it the tendon is slack
    scene = ms.Scene(sheet, supports=[clamp], loads=[*springs, pull], actuators=[string], **WEIGHT)
    inputs = {"gravity_factor": 0.9}
    return Kind(scene, inputs, fixed=EXACT, reach=REACH, by_default=("rest_length", "ground"))


def _on_foundations() -> tuple[ms.Scene, list]:
    """Build a sheet, a solid and a six-node sheet, apart, and all kinds of foundations under them."""
    sheet = ms.Shell(MESH, **MATTER)
    box = ms.meshes.box((0.06, 0.02, 0.02), cells=(2, 1, 1)).transformed(translation=(0.0, 0.1, 0.0))
    law = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)
    block = ms.Solid(box, material=law, mass_density=1e3, element="linear")
    six = ms.Shell(_six_nodes((2, 1), (0.1, 0.04)), **MATTER)
    flat = ms.meshes.rectangle(0.1, 0.04, cells=(2, 1), order=2)
    some = np.arange(2, 11)
    each = np.random.default_rng(2).uniform(2e3, 6e3, len(some))
    beds = [
        bed
        for way in ("normal", (0.3, -0.2, 1.0), None)
        for bed in (
            ms.ElasticFoundation(2e3, body=sheet, direction=way),
            ms.ElasticFoundation(each, faces=some, body=sheet, direction=way),
        )
    ]
    beds += [
        ms.ElasticFoundation(3e3, direction="normal", faces=np.arange(4, body.mesh.n_faces), body=body)
        for body in (block, six)
    ]
    supports = [
        ms.Clamp(MESH.edges_at(x=0.0), body=sheet),
        ms.Pin(box.vertices_at(x=0.0), body=block),
        ms.Clamp(flat.edges_at(x=0.0), body=six),
    ]
    return ms.Scene([sheet, block, six], supports=supports, loads=beds, **WEIGHT), beds


def on_foundations() -> Kind:
    scene, _ = _on_foundations()
    return Kind(scene, {"gravity_factor": 0.9}, fixed=EXACT, reach=REACH)


def forces_of_foundations() -> Kind:
    """Build the same, with the forces of the foundations as results: their ground points, areas and normals."""
    scene, beds = _on_foundations()

    def forces(scene, values, start=None, **given):
        found = ms.equilibrium(scene, values=values, start=start, **given)
        rows = [torch.as_tensor(found[bed].forces).reshape(-1) for bed in beds]
        return SimpleNamespace(numbers=1e3 * torch.cat(rows))

    return Kind(scene, {"gravity_factor": 0.9}, solve=forces, fixed=EXACT, reach=REACH)


FORCES = "forces of foundations"  # which cannot be saved
SHAPE_MAKERS = {
    "a sheet in a symmetry plane at rest": in_a_symmetry_plane,
    "a six-node sheet under couples in motion": six_nodes_with_couples,
    "a grown six-node sheet at rest, not bent": lambda: grown_six_nodes(growth=_tensors(12, 1.02, 0.01)),
    "a grown six-node sheet at rest, bent only": lambda: grown_six_nodes(
        rest_curvature=_tensors(12, 3.0, 2.0)
    ),
    "a grown sheet at rest, obtuse": grown_obtuse_faces,
    "lengths by default at rest": lambda: lengths_by_default(True),
    "lengths by default at rest, fixed tendon": lambda: lengths_by_default(False),
    "on foundations at rest": on_foundations,
    FORCES: forces_of_foundations,
    "a quadratic solid with muscles in motion": lambda: muscles_in_motion(
        ms.ImplicitEuler(), element="quadratic"
    ),
}
