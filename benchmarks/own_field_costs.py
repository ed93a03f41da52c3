"""Cost of the own field: equilibria of a sheet with it over those without, one evaluation for a large sheet, and its modes.

Run as `python -m benchmarks.own_field_costs`; with "quick" on a coarse mesh.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import magshell as ms
from magshell.model.scene.solve_inputs import Inputs

from .report import print_table

MAGNETIZATION = 6e4  # [A/m]


def sheet_scene(cells: int, own_field: ms.OwnField | None) -> ms.Scene:
    """Return a square sheet with cells of 1 mm, 1 mm thick and clamped along one side, in a uniform field."""
    mesh = ms.meshes.rectangle(1e-3 * cells, 1e-3 * cells, cells=(cells, cells))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.45)
    clamp = ms.Clamp(mesh.edges_at(x=mesh.rest_positions[:, 0].min()))
    return ms.Scene(sheet, supports=clamp, field=ms.UniformField(), own_field=own_field)


def magnetizations(scene: ms.Scene) -> dict[str, np.ndarray]:
    """Return one magnetization for all faces and one that differs from face to face, in A/m."""
    mesh = scene.mesh
    x = mesh.rest_positions[mesh.faces].mean(axis=1)[:, 0]
    turns = 4.0 * x / np.ptp(mesh.rest_positions[:, 0])
    along = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    return {"uniform": MAGNETIZATION * np.array([1.0, 0.0, 0.0]), "of each face": MAGNETIZATION * along}


def solve_time(scene: ms.Scene, magnetization: np.ndarray, flux_density: float) -> float:
    """Return the processor time of an equilibrium, in s; the second of two, the first analyses."""
    seconds = 0.0
    for _ in range(2):
        began = time.process_time()
        ms.equilibrium(
            scene,
            remanent_magnetization=magnetization,
            applied_flux_density=(0.0, 0.0, flux_density),
            progress=False,
        )
        seconds = time.process_time() - began
    return seconds


def pass_time(cells: int) -> float:
    """Return the processor time of one evaluation of the forces, in s; the magnetization differs from face to face."""
    scene = sheet_scene(cells, ms.OwnField(max_points=10**7))
    inputs = Inputs(scene, magnetizations(scene)["of each face"], np.zeros(3))
    with inputs.in_core():
        state = scene._model.rest_state()
        began = time.process_time()
        scene._model.term_gradient("own field", state, inputs.load_parameters)
        return time.process_time() - began


def mode_times(cells: tuple[int, int]) -> tuple[int, float, float]:
    """Return degrees of freedom of a strip, and seconds of the processor for four frequencies and two buckling factors."""
    mesh = ms.meshes.rectangle(20e-3, 8e-3, cells=cells)
    sheet = ms.Shell(mesh, thickness=4e-4, young_modulus=1e6, poisson_ratio=0.3, mass_density=2e3)
    press = ms.EdgeLoad(mesh.edges_at(x=20e-3), (-1.0, 0.0, 0.0))
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=clamp, loads=[press], own_field=ms.OwnField())
    rest = ms.equilibrium(scene, remanent_magnetization=(0.0, 0.0, 4e4), load_factor=0.0, progress=False)
    began = time.process_time()
    ms.vibration_modes(scene, rest, count=4)
    between = time.process_time()
    ms.linear_buckling(scene, rest, load_factor=1.0, modes=2)
    return scene._model.free_size, between - began, time.process_time() - between


def main(quick: bool = False) -> None:
    """Print the tables."""
    ms.set_num_threads(1)
    cells = 16 if quick else 64
    rows = []
    for flux_density in (1e-4, 1e-3, 5e-3):
        free, own = sheet_scene(cells, None), sheet_scene(cells, ms.OwnField())
        for name, magnetization in magnetizations(own).items():
            if name != "uniform" and flux_density != 1e-3:
                continue
            without, with_own = (solve_time(each, magnetization, flux_density) for each in (free, own))
            rows.append([name, f"{1e3 * flux_density:g}", f"{without:.2f}", f"{with_own / without:.2f}"])
    print_table(
        f"Equilibrium of {2 * cells**2} faces with own field over that without",
        ["magnetization", "mT", "s without", "times"],
        rows,
    )
    sizes = (16, 32) if quick else (64, 128, 256)
    print_table(
        "One evaluation of the forces of the own field at the accuracy 1e-6",
        ["faces", "s"],
        [[str(2 * each**2), f"{pass_time(each):.2f}"] for each in sizes],
    )
    meshes = [(8, 3)] if quick else [(24, 10), (44, 20)]
    print_table(
        "Modes of a strip in its own field",
        ["degrees of freedom", "s of 4 frequencies", "s of 2 buckling factors"],
        [[str(size), f"{first:.1f}", f"{second:.1f}"] for size, first, second in map(mode_times, meshes)],
    )


if __name__ == "__main__":
    main("quick" in sys.argv[1:])
