"""Part `kernels` of the benchmarks: cost of a gradient and a Hessian for each face, tetrahedron and contact."""

from __future__ import annotations

import argparse
import time
from typing import Any, NamedTuple

import numpy as np

import magshell as ms
from magshell.model.scene.values import Values

from .cases.outcome import order_of
from .contact_kernels import contacts
from .ratios import note
from .report import add_rounds, chosen, print_table
from .solid_kernels import muscles, solids
from .timing import Timing, clocked, measure, peak_memory

FACES, QUICK_FACES = (8192, 131072), (128, 512)
ALLOWED = 0.6  # [us] time per face of gradient and Hessian, of the first sheet on one core
ALLOWED_GROWTH = 1.1  # [-] time per face at 131,072 faces over that at 8192
REQUIRED_GAIN = 1.7  # [-] smallest speedup of two threads


class Sheet(NamedTuple):
    """A line of the table: the energies that a scene has."""

    name: str
    bending: str = "midedge"
    magnetization: tuple[float, float, float] | None = None  # A/m
    gravity: bool = False


SHEETS = (
    Sheet("midedge, magnetic", magnetization=(1e3, 2e2, 1e2)),
    Sheet("midedge, magnetic in its plane", magnetization=(1e3, 2e2, 0.0)),
    Sheet("midedge, gravity", gravity=True),
    Sheet("midedge"),
    Sheet("midedge2, magnetic", "midedge2", magnetization=(1e3, 2e2, 1e2)),
    Sheet("midedge2", "midedge2"),
    Sheet("hinge, magnetic", "hinge", magnetization=(1e3, 2e2, 1e2)),
    Sheet("hinge", "hinge"),
)


class Cost(NamedTuple):
    """The cost of one sheet at one size; times in s."""

    faces: int
    build: float
    gradient: Timing
    hessian: Timing  # gradient and Hessian, into the sparse matrix
    memory: int  # bytes of the model

    def microseconds(self, timing: Timing) -> Timing:
        return Timing(*(1e6 * value / self.faces for value in timing))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    shown = " and ".join(str(count) for count in FACES)
    parser.add_argument("--faces", type=int, nargs="+", help=f"sizes of the square sheet (default {shown})")
    add_rounds(parser, 7)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the table and return its numbers."""
    sizes = chosen(options.faces, options.quick, QUICK_FACES, FACES)
    if min(sizes) < 2:
        raise SystemExit("--faces must be at least 2")
    costs = {sheet.name: [cost(sheet, faces, options.rounds) for faces in sizes] for sheet in SHEETS}
    for name, (first, *_) in costs.items():
        note("share", f"{name}: Hessian too, over the gradient", first.hessian.best / first.gradient.best)
        note("time", f"{name}: gradient, us a face", first.microseconds(first.gradient).best)
    rows = [row for name, each in costs.items() for row in _rows(name, each)]
    headings = ["sheet", "faces", "gradient", "median", "and Hessian", "median", "model [MB]", "built in [s]"]
    print_table(
        f"Microseconds a face, best and median of {options.rounds}, {ms.num_threads()} thread(s)",
        headings,
        rows,
    )
    of_solids = solids(options.quick, options.rounds)
    of_muscles = muscles(options.quick, options.rounds)
    of_contacts = contacts(options.quick, options.rounds)
    gain = two_threads(SHEETS[0], sizes[0], options.rounds)
    _print_targets(costs[SHEETS[0].name], gain)
    return {
        "sheets": {name: [each._asdict() for each in of_sheet] for name, of_sheet in costs.items()},
        "solids": of_solids,
        "muscles": of_muscles,
        "contacts": of_contacts,
        "two threads": gain,
    }


def cost(sheet: Sheet, faces: int, rounds: int) -> Cost:
    """Measure a square sheet near its rest shape, clamped at one side, with an irregular mesh."""
    model, state, load_parameters, n_faces, build = _near_rest(sheet, faces)
    return Cost(
        n_faces,
        build,
        measure(lambda: model.gradient(state, load_parameters), rounds=rounds),
        measure(lambda: model.assemble(state, load_parameters), rounds=rounds),
        model.bytes,
    )


def two_threads(sheet: Sheet, faces: int, rounds: int) -> float:
    """Return the speedup of gradient and Hessian by two threads, in wall-clock time."""
    model, state, load_parameters, *_ = _near_rest(sheet, faces)
    before, times = ms.num_threads(), []
    try:
        for count in (1, 2):
            ms.set_num_threads(count)
            times.append(clocked(lambda: model.assemble(state, load_parameters), rounds=rounds).wall)
    finally:
        ms.set_num_threads(before)
    return times[0] / times[1]


def _near_rest(sheet: Sheet, faces: int):
    """Return the core's model, a state, load parameters, the number of faces, and the time [s] to build the scene."""
    cells = max(1, round((faces / 2) ** 0.5))
    order = order_of(sheet.bending)
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(cells, cells), irregular=0.2, order=order)
    shell = ms.Shell(
        mesh,
        thickness=1e-2,
        young_modulus=1e5,
        poisson_ratio=0.3,
        mass_density=1e3 if sheet.gravity else None,
        bending=sheet.bending,
    )
    began = time.perf_counter()
    scene = ms.Scene(
        shell,
        supports=[ms.Clamp(mesh.edges_at(x=0.0))],
        field=None if sheet.magnetization is None else ms.UniformField(),
        gravity=(0.0, 0.0, -9.81) if sheet.gravity else None,
    )
    build = time.perf_counter() - began
    model = scene._model
    if sheet.magnetization is not None:
        magnetization = np.tile(sheet.magnetization, (mesh.n_elements, 1))
        model.set_values(Values(scene, magnetization=magnetization).numbers)
    state = model.rest_state()
    state += 1e-3 / cells * np.random.default_rng(0).standard_normal(state.size)
    load_parameters = scene._load_parameter_layout.packed(
        {("scene", "applied_flux_density"): (0.0, 0.01, 0.02), ("scene", "gravity_factor"): 1.0},
        scene._load_parameter_layout.zeros(),
    )
    return model, state, load_parameters, mesh.n_elements, build


def _rows(name: str, costs: list[Cost]) -> list[list[str]]:
    rows = []
    for k, each in enumerate(costs):
        gradient, hessian = each.microseconds(each.gradient), each.microseconds(each.hessian)
        numbers = [f"{value:.3f}" for value in (*gradient, *hessian)]
        rows.append(
            [
                name if k == 0 else "",
                str(each.faces),
                *numbers,
                f"{each.memory / 1e6:.1f}",
                f"{each.build:.2f}",
            ]
        )
    return rows


def _print_targets(costs: list[Cost], gain: float) -> None:
    first, last = costs[0], costs[-1]
    best = first.microseconds(first.hessian).best
    name = f"{SHEETS[0].name}, us a face at {first.faces} faces"
    missed = note("time", name, best, at_most=ALLOWED)
    note("memory", f"bytes a face of the model at {first.faces} faces", first.memory / first.faces)
    print(
        f"\n{SHEETS[0].name}: {best:.2f} us a face at {first.faces} faces (at most {ALLOWED}){missed}", end=""
    )
    if len(costs) > 1:
        growth = last.microseconds(last.hessian).best / best
        missed = note("share", f"growth to {last.faces} faces", growth, at_most=ALLOWED_GROWTH)
        print(f", {growth:.2f} times that at {last.faces} (at most {ALLOWED_GROWTH}){missed}", end="")
    missed = note("share", "two threads, times as fast", gain, at_least=REQUIRED_GAIN)
    print(f". Two threads: {gain:.2f} times as fast (at least {REQUIRED_GAIN}){missed}", end="")
    memory = peak_memory()
    print("." if memory is None else f". Peak memory of the process: {memory / 1e6:.0f} MB.")
