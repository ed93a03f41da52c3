"""Part `gradients` of the benchmarks: time of the gradient by all inputs, over that of its equilibrium."""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

import magshell as ms

from .ratios import note
from .report import add_rounds, chosen, print_table

FACES, QUICK_FACES = 8192, 128
CELLS, QUICK_CELLS = (24, 6, 6), (8, 2, 2)  # cells of the solid
ALLOWED_SHARE = 0.10  # [-] largest time of a gradient over that of its equilibrium


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--faces", type=int, help=f"of the sheet (default {FACES})")
    add_rounds(parser, 5)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the table and return its numbers."""
    faces = chosen(options.faces, options.quick, QUICK_FACES, FACES)
    if faces < 2:
        raise SystemExit("--faces must be at least 2")
    results = {
        **{bending: _cost(*_sheet(faces, bending), options.rounds) for bending in ("midedge", "hinge")},
        "solid, linear": _cost(*_solid(QUICK_CELLS if options.quick else CELLS), options.rounds),
    }
    for bending, cost in results.items():
        note("count", f"{bending}: factorizations", cost["factorizations"])
        note("time", f"{bending}: equilibrium, s", cost["equilibrium"])
        note(
            "share", f"{bending}: with tensors over without", cost["equilibrium"] / cost["plain equilibrium"]
        )
    rows = [
        [bending, cost["size"], cost["factorizations"]]
        + [f"{1e3 * cost[name]:.1f}" for name in ("plain equilibrium", "equilibrium", "gradient")]
        + [
            f"{100 * cost['share']:.1f} %"
            + note("share", f"{bending}: gradient over equilibrium", cost["share"], at_most=ALLOWED_SHARE)
        ]
        for bending, cost in results.items()
    ]
    headings = [
        "bending, or solid",
        "size",
        "factorizations",
        "without tensors, ms",
        "equilibrium, ms",
        "gradient, ms",
    ]
    headings.append(f"share (at most {100 * ALLOWED_SHARE:.0f} %)")
    print_table("The gradient by all inputs at once", headings, rows)
    return results


def _cost(scene: ms.Scene, inputs: dict[str, Any], values: dict[str, Any], rounds: int) -> dict[str, Any]:
    """Measure each time, s of the processor, as the best of some rounds."""
    import torch

    def tensors(arrays: dict) -> dict:
        return {name: torch.tensor(array, requires_grad=True) for name, array in arrays.items()}

    plain, solved, pulled = [], [], []
    for _ in range(rounds):
        began = time.process_time()
        ms.equilibrium(scene, **inputs, values=values)
        plain.append(time.process_time() - began)
        began = time.process_time()
        found = ms.equilibrium(
            scene, **tensors(inputs), values={owner: tensors(named) for owner, named in values.items()}
        )
        solved.append(time.process_time() - began)
        loss = (found.positions**2).sum()
        began = time.process_time()
        loss.backward()
        pulled.append(time.process_time() - began)
    return {
        "size": _size(scene.bodies[0]),
        "factorizations": found.factorizations,
        "plain equilibrium": min(plain),
        "equilibrium": min(solved),
        "gradient": min(pulled),
        "share": min(pulled) / min(solved),
    }


def _size(body: ms.Shell | ms.Solid) -> str:
    if isinstance(body, ms.Solid):
        return f"{body.mesh.n_tetrahedra} tetrahedra"
    return f"{body.mesh.n_faces} faces"


def _sheet(faces: int, bending: str) -> tuple[ms.Scene, dict[str, Any], dict[str, Any]]:
    """Return a square sheet with every kind of input: bent by fields, gravity and a load, with a clamp that moves and
    rotates."""
    cells = max(1, round((faces / 2) ** 0.5))
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(cells, cells))
    sheet = ms.Shell(
        mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.45, mass_density=1e3, bending=bending
    )
    clamp = ms.Clamp(mesh.edges_at(x=0.0), displacement=(0.0, 0.0, 1e-3), rotation=(0.0, -0.02, 0.0))
    load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0.0, 0.0, 0.005))
    dipoles = ms.Dipoles([[0.05, 0.05, -0.2]], [[0.0, 0.0, 0.3]])
    scene = ms.Scene(
        sheet, supports=[clamp], loads=[load], field=[ms.UniformField(), dipoles], gravity=(0, 0, -1.0)
    )
    inputs = {
        # rest_positions is no keyword: with it a solve makes the scene anew.
        **{name: np.array(getattr(sheet, name)) for name in sheet._replaceable if name != "rest_positions"},
        "remanent_magnetization": np.tile((2e4, 0.0, 5e3), (mesh.n_faces, 1)),
        "applied_flux_density": np.array((0.0, 0.0, 5e-4)),
        **{f"{name}_factor": np.array(1.0) for name in ("load", "gravity", "field", "support")},
    }
    values = {
        clamp: {"displacement": np.array((0.0, 0.0, 1e-3)), "rotation": np.array((0.0, -0.02, 0.0))},
        load: {"force_per_length": np.array((0.0, 0.0, 0.005))},
        dipoles: {"positions": np.array(dipoles.positions), "moments": np.array(dipoles.moments)},
    }
    return scene, inputs, values


def _solid(cells: tuple[int, int, int]) -> tuple[ms.Scene, dict[str, Any], dict[str, Any]]:
    """Return a beam with every kind of input: bent by a field, gravity and forces, with an end that moves."""
    mesh = ms.meshes.box((0.1, 0.025, 0.025), cells=cells)
    count, x = mesh.n_tetrahedra, mesh.rest_positions[:, 0]
    solid = ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.45),
        mass_density=1e3,
        element="linear",
        remanent_magnetization=(2e4, 0.0, 0.0),
    )
    pin = ms.Pin(np.flatnonzero(x < x.min() + 1e-9), displacement=(0.0, 0.0, 1e-3))
    end = np.flatnonzero(x > x.max() - 1e-9)
    load = ms.PointLoad(end, (0.0, 0.0, 0.3 / len(end)))
    scene = ms.Scene(solid, supports=[pin], loads=[load], field=[ms.UniformField()], gravity=(0.0, 0.0, -1.0))
    inputs = {
        "applied_flux_density": np.array((0.0, 0.0, 0.01)),
        **{f"{name}_factor": np.array(1.0) for name in ("load", "gravity", "field", "support")},
    }
    values = {
        solid: {
            "young_modulus": np.full(count, 1e5),
            "poisson_ratio": np.full(count, 0.45),
            "mass_density": np.full(count, 1e3),
            "remanent_magnetization": np.tile((2e4, 0.0, 0.0), (count, 1)),
        },
        pin: {"displacement": np.array((0.0, 0.0, 1e-3))},
        load: {"force": np.tile((0.0, 0.0, 0.3 / len(end)), (len(end), 1))},
    }
    return scene, inputs, values
