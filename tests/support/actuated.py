"""For tests: bodies with cavities, cells and tendons, and their energies by torch."""

from __future__ import annotations

import numpy as np
import torch

import magshell as ms
from magshell.model.actuators.closed_surface import of_tetrahedra

SOFT = {"young_modulus": 1e5, "poisson_ratio": 0.3}


def box_sheet(size=0.1, cells=(2, 2, 1), thickness=5e-3, modulus=1e6, density=1e3) -> ms.Shell:
    """Build a closed box of a sheet."""
    box = ms.meshes.box((size, size, size), cells=cells)
    mesh = ms.TriangleMesh(box.rest_positions, box.faces)
    return ms.Shell(mesh, thickness=thickness, young_modulus=modulus, poisson_ratio=0.4, mass_density=density)


def hollow_block(element="linear", cells=3, **options) -> ms.Solid:
    """Build a cube of three cells a side without the one in the middle."""
    box = ms.meshes.box((0.03, 0.03, 0.03), cells=(cells, cells, cells))
    middle = np.abs(box.tetrahedron_barycenters - 0.015).max(axis=1) < 0.005
    kept, numbered = np.unique(box.tetrahedra[~middle], return_inverse=True)
    mesh = ms.TetMesh(box.rest_positions[kept], numbered.reshape(-1, 4))
    material = options.pop("material", ms.NeoHookean(**SOFT))
    return ms.Solid(mesh, material=material, element=element, mass_density=1e3, **options)


def held(body, **options) -> ms.Scene:
    return ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(z=0.0))], **options)


def gauge_pressure_of(cavity: ms.Cavity, volume, rest: float):
    """Return - dE/dV, computed by hand."""
    if cavity.law == "pressure":
        return float(cavity.pressure)
    if cavity.law == "gas":
        return float(cavity.gas_pressure) * rest / volume - float(cavity.outside_pressure)
    return -float(cavity.bulk_modulus) * (volume - float(cavity.volume)) / rest


def energy_by_torch(scene: ms.Scene, x: torch.Tensor, factor: float = 1.0) -> torch.Tensor:
    """Return the energy of all actuators at positions (n_v, 3), under a load factor."""
    total = torch.zeros((), dtype=torch.float64)
    for each in scene.actuators:
        if isinstance(each, ms.Cavity):
            total = total + _of_cavity(scene, each, x, factor)
        elif isinstance(each, ms.PneumaticCells):
            total = total + _of_cells(each, x, factor)
        else:
            total = total + factor * _of_tendon(scene, each, x)
    return total


def _of_cavity(scene, cavity, x, factor):
    surface = cavity.surface(scene._bodies)
    rest, volume = surface.volume(scene.mesh.rest_positions), surface.volume(x)
    if cavity.law == "pressure":
        return -factor * float(cavity.pressure) * volume
    if cavity.law == "gas":
        gas = float(cavity.gas_pressure) * rest
        outside = float(cavity.outside_pressure) * (volume - rest)
        return factor * (outside - gas * torch.log(volume / rest))
    wanted = rest + factor * (float(cavity.volume) - rest)
    return 0.5 * float(cavity.bulk_modulus) * (volume - wanted) ** 2 / rest


def _of_cells(cells, x, factor):
    total, mesh = 0.0, cells.body.mesh
    for k, group in enumerate(cells.groups):
        surface = of_tetrahedra(mesh.tetrahedra[group])
        rest = surface.volume(mesh.rest_positions)
        target, stiffness = (
            np.broadcast_to(v, cells.count)[k] for v in (cells.volume_ratio, cells.stiffness)
        )
        target = 1.0 + factor * (target - 1.0)
        total = total + 0.5 * rest * stiffness * (surface.volume(x) / rest - target) ** 2
    return total


def _of_tendon(scene, tendon, x):
    embedded = tendon._embedded(scene._bodies, scene._rigid)
    points = torch.stack([(torch.from_numpy(w)[:, None] * x[v]).sum(0) for v, w in embedded])
    lengths = (points[1:] - points[:-1]).norm(dim=1)
    rest = np.linalg.norm(np.diff(tendon.points, axis=0), axis=1)
    shares = np.array([1.0]) if tendon.sliding else rest / rest.sum()
    total = 0.0
    for length, share in zip([lengths.sum()] if tendon.sliding else lengths, shares, strict=True):
        e, d = length - share * float(tendon.rest_length), share * float(tendon.smoothing)
        spring = torch.where(
            e < d, torch.clamp(e, min=0.0) ** 3 / (6 * d), 0.5 * (e - 0.5 * d) ** 2 + d**2 / 24
        )
        total = total + float(tendon.tension) * length + float(tendon.stiffness) / share * spring
    return total
