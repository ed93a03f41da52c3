"""Cost of a gradient and a Hessian of a solid for each tetrahedron: a table of `python -m benchmarks kernels`."""

from __future__ import annotations

from typing import Any

import numpy as np

import magshell as ms

from .report import print_table
from .timing import measure

CELLS, QUICK_CELLS = ((24, 6, 6), (52, 13, 13)), ((4, 1, 1),)
ALLOWED = 0.10  # [us] time per linear NeoHookean tetrahedron, gradient and Hessian, on one core


def solids(quick: bool, rounds: int) -> list[dict[str, Any]]:
    """Print the table of bars near their rest shape, held at one end; returns its numbers, times in s."""
    found = [
        cost(element, volume, cells, rounds)
        for cells in (QUICK_CELLS if quick else CELLS)
        for element in ("linear", "quadratic")
        for volume in ("ln J", "isochoric")
    ]
    rows = [
        [
            f"{each['element']}, NeoHookean {each['volume']}",
            str(each["tetrahedra"]),
            f"{1e6 * each['gradient'] / each['tetrahedra']:.3f}",
            f"{1e6 * each['hessian'] / each['tetrahedra']:.3f}",
            f"{1e6 * each['hessian'] / each['unknowns']:.3f}",
        ]
        for each in found
    ]
    headings = ["solid", "tetrahedra", "gradient", "and Hessian", "and Hessian, an unknown"]
    print_table(
        f"Microseconds a tetrahedron, best of {rounds} (linear, ln J: at most {ALLOWED})", headings, rows
    )
    return found


FORMS: dict[str, dict[str, Any]] = {
    "target stretch": {"stiffness": 1e5, "activation": 0.1},
    "active stress": {"peak_stress": 3e4, "activation": 0.5},
    "Hill": {
        "peak_stress": 3e4,
        "activation": 0.5,
        "force_length": [(0.5, 0.2), (0.75, 0.7), (1.0, 1.0), (1.25, 0.7), (1.5, 0.2)],
    },
}


def muscles(quick: bool, rounds: int) -> list[dict[str, Any]]:
    """Print the time that a muscle in all of a solid adds to its gradient and Hessian, over that of the solid alone."""
    found = []
    for element in ("linear", "quadratic"):
        cells = QUICK_CELLS[0] if quick else CELLS[0]
        for form, law in FORMS.items():
            alone, pulled = (cost(element, "ln J", cells, rounds, each) for each in (None, law))
            more = (pulled["hessian"] - alone["hessian"]) / alone["tetrahedra"]
            ratio = more * alone["tetrahedra"] / alone["hessian"]
            found.append({"element": element, "form": form, "added": more, "share": ratio})
    rows = [
        [f"{each['element']}, {each['form']}", f"{1e6 * each['added']:.3f}", f"{each['share']:.2f}"]
        for each in found
    ]
    headings = ["muscle", "added", "of the solid's own"]
    print_table(
        f"A muscle, microseconds a tetrahedron, best of {rounds} (at most 1 of the solid's own)",
        headings,
        rows,
    )
    return found


def cost(
    element: str, volume: str, cells: tuple[int, int, int], rounds: int, muscle: dict[str, Any] | None = None
) -> dict[str, Any]:
    material = ms.NeoHookean(volume, young_modulus=1e5, poisson_ratio=0.45 if volume == "isochoric" else 0.3)
    solid = ms.Solid(ms.meshes.box((4.0, 1.0, 1.0), cells=cells), material=material, element=element)
    actuators = [] if muscle is None else [ms.Muscle(solid, (1.0, 0.2, 0.1), **muscle)]
    scene = ms.Scene(solid, supports=[ms.Pin(solid.mesh.vertices_at(x=0.0))], actuators=actuators)
    model, load_parameters = scene._model, scene._load_parameter_layout.zeros()
    state = model.rest_state()
    state += 1e-3 / cells[0] * np.random.default_rng(0).standard_normal(state.size)
    return {
        "element": element,
        "volume": volume,
        "tetrahedra": solid.mesh.n_tetrahedra,
        "unknowns": state.size,
        "gradient": measure(lambda: model.gradient(state, load_parameters), rounds=rounds).best,
        "hessian": measure(lambda: model.assemble(state, load_parameters), rounds=rounds).best,
    }
