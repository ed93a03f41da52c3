"""Part `topology` of the benchmarks: the cost of an iteration, mesh independence, and void in large rotations."""

from __future__ import annotations

import argparse
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

import magshell as ms

from .ratios import note
from .report import bar, chosen, print_table
from .scaling import linear_algebra
from .timing import peak_memory

LENGTH, WIDTH, THICKNESS, YOUNG_MODULUS = 0.02, 0.01, 1e-3, 1e6  # m, Pa
RADIUS, VOLUME = 2.5e-3, 0.5  # m, of the sheet
STIFFNESS_LOAD = 1e-4  # N, on the end, for mesh independence
CELLS, QUICK_CELLS = (256, 128), (32, 16)  # of the iteration that is timed
MESHES, QUICK_MESHES = ((32, 16), (48, 24), (72, 36)), ((20, 10), (28, 14))
STAGES, QUICK_STAGES = ((2, 25), (4, 25), (8, 25), (16, 25)), ((2, 4), (4, 4))  # (sharpness, iterations)
SHEETS, QUICK_SHEETS = 12, 2  # random topologies that roll up
ALLOWED_ITERATION = 4.0  # [-] iteration without its solve, in factorizations
ALLOWED_SPREAD = 0.02  # [-] of the objective over three meshes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--cells",
        type=int,
        nargs=2,
        help=f"of the sheet of the timed iteration (default {CELLS[0]} {CELLS[1]})",
    )
    parser.add_argument("--only", choices=("iteration", "meshes", "void"), help="measure one of the three")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the tables and return their numbers."""
    found: dict[str, Any] = {}
    quick = options.quick
    if options.only in (None, "iteration"):
        found["iteration"] = _iterations(tuple(chosen(options.cells, quick, QUICK_CELLS, CELLS)))
    if options.only in (None, "meshes"):
        found["meshes"] = _meshes(QUICK_MESHES if quick else MESHES, QUICK_STAGES if quick else STAGES)
    if options.only in (None, "void"):
        found["void"] = _void(QUICK_SHEETS if quick else SHEETS)
    return found


class Design:
    """A sheet held at one end with a load at the other, whose density and magnetization are sought.

    Without a field it is the stiffest sheet of a volume that is sought.
    """

    def __init__(self, cells: tuple[int, int], flux_density: float, load: float):
        import torch

        self.torch, self.density = torch, ms.parametrize.density
        self.mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
        self.flux_density, self.load = flux_density, load
        x = self.mesh.face_barycenters[:, 0]
        self.root, end = np.flatnonzero(x < LENGTH / 24), np.flatnonzero(x > LENGTH * 23 / 24)
        self.solid = np.union1d(self.root, end)
        self.filter = self.density.HelmholtzFilter(self.mesh, RADIUS)
        self.variables = torch.full((self.mesh.n_faces,), VOLUME, dtype=torch.float64, requires_grad=True)
        self.directions = torch.zeros(self.mesh.n_faces, 3, dtype=torch.float64)
        self.directions[:, 0] = 0.5
        self.directions.requires_grad_(flux_density != 0.0)
        self.solve_seconds, self.solves = 0.0, 0
        self.matter = self.rest = None

    @property
    def free(self) -> list[Any]:
        """Return the tensors that the optimizer moves."""
        return [self.variables, self.directions] if self.flux_density else [self.variables]

    def optimizer(self) -> Any:
        """Return MMA for them."""
        lower = [0.0, -1.0] if self.flux_density else [0.0]
        return ms.optim.MMA(self.free, lower=lower, upper=1.0, move=0.1)

    def objective(self, sharpness: float) -> tuple[Any, Any]:
        """Return the work of the load, scaled, and the excess of volume."""
        filtered = self.filter(self.density.fixed(self.variables, solid=self.solid))
        densities = self.density.fixed(self.density.projected(filtered, sharpness), solid=self.solid)
        least = 0.1 if sharpness >= 8 else 0.0
        matter = self.density.Matter(self.mesh, densities, self.root, least)
        start = self._start(matter)
        values = matter.values(
            young_modulus=YOUNG_MODULUS, void_stiffness=1e-2 if least else 1e-4, **self._magnetization()
        )
        given = {"applied_flux_density": (0.0, 0.0, self.flux_density)} if self.flux_density else {}
        began = time.process_time()
        self.rest = ms.equilibrium(
            self._scene, values={self._sheet: values}, start=start, progress=False, **given
        )
        self.solve_seconds, self.solves = time.process_time() - began, self.solves + 1
        sag = -self.rest.positions[self._end, 2].mean()
        volume = self.density.volume_fraction(self.mesh, densities) / VOLUME - 1.0
        return sag / LENGTH, volume[None]

    def _magnetization(self) -> dict[str, Any]:
        if not self.flux_density:
            return {}
        columns = [2.0 * self.filter(0.5 * (1.0 + each)) - 1.0 for each in self.directions.T]
        return {
            "remanent_magnetization": ms.parametrize.softly_limited(
                6e4 * self.torch.stack(columns, dim=1), 6e4
            )
        }

    def _start(self, matter: Any) -> Any:
        """Return where to start the solve, after the scene is made anew if faces left or came."""
        if self.matter is not None and np.array_equal(matter.faces, self.matter.faces):
            return self.rest
        if not np.isin(self.solid, matter.faces).all():
            raise ms.DesignRejected("nothing holds the load")
        start = None if self.matter is None else matter.start(self.matter, self.rest.positions)
        self._end = matter.mesh.vertices_at(x=LENGTH)
        self._sheet = ms.Shell(matter.mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS)
        self._scene = ms.Scene(
            self._sheet,
            supports=[ms.Clamp(matter.mesh.edges_at(x=0.0))],
            loads=[ms.PointLoad(self._end, (0.0, 0.0, -self.load / len(self._end)))],
            field=ms.UniformField() if self.flux_density else None,
        )
        self.matter = matter
        return start


def _iterations(cells: tuple[int, int]) -> dict[str, Any]:
    """Measure iterations of a design, in a process of its own, whose memory nothing else has."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        rows = executor.submit(iteration_costs, cells).result()
    print_table(
        f"An iteration on a sheet of {2 * cells[0] * cells[1]} faces: processor time",
        [
            "void",
            "faces solved",
            "variables",
            "factorizations",
            "one / s",
            "solve / s",
            "iteration / s",
            "without its solve, in factorizations",
            "memory / MB",
        ],
        [
            [
                name,
                str(row["faces"]),
                str(row["variables"]),
                str(row["factorizations"]),
                f"{row['factorization']:.2f}",
                f"{row['solve']:.2f}",
                f"{row['iteration']:.2f}",
                f"{row['rest']:.2f}",
                f"{row['memory'] / 1e6:.0f}",
            ]
            for name, row in rows.items()
        ],
    )
    at_most = ALLOWED_ITERATION if cells == CELLS else None
    missed = "".join(
        note("share", f"iteration, void {name}: without its solve", row["rest"], at_most=at_most)
        for name, row in rows.items()
    )
    print(
        f"At {2 * CELLS[0] * CELLS[1]} faces at most {ALLOWED_ITERATION:g} factorizations of the whole sheet beside the "
        f"solve{missed}."
    )
    return rows


def iteration_costs(cells: tuple[int, int]) -> dict[str, dict[str, float]]:
    """Return the times [s] of the third iteration of a grey design with void, and of a sharp one without."""
    rows = {}
    kinds = (("soft, densities alone", 2.0, 0.0), ("soft", 2.0, 2e-3), ("taken out", 8.0, 2e-3))
    for name, sharpness, flux_density in kinds:
        design = Design(cells, flux_density, load=1e-5)
        if name == "taken out":
            waves = np.sin(2.0 * np.pi * design.mesh.face_barycenters[:, 1] / (0.4 * WIDTH))
            design.variables.data += 0.4 * design.torch.tensor(waves)
        optimizer = design.optimizer()

        def closure(design=design, sharpness=sharpness):
            return design.objective(sharpness)

        for _ in range(3):
            began = time.process_time()
            optimizer.step(closure)
            ended = time.process_time() - began
        if name != "taken out":  # all faces of the sheet
            steps, _ = linear_algebra(design._scene, design.rest, 1)
            one = steps["factorization"].processor
        rows[name] = {
            "faces": len(design.matter.faces),
            "variables": sum(each.numel() for each in design.free),
            "factorizations": design.rest.factorizations,
            "factorization": one,
            "solve": design.solve_seconds,
            "iteration": ended,
            "rest": (ended - design.solve_seconds) / one,
            "memory": peak_memory(),
        }
    return rows


def _meshes(meshes: Any, stages: Any) -> dict[str, float]:
    """Find the stiffest sheet on several meshes with one filter, and print the objectives."""
    found = {}
    with bar("meshes", len(meshes)) as shown:
        for cells in meshes:
            design = Design(cells, flux_density=0.0, load=STIFFNESS_LOAD)
            for sharpness, iterations in stages:

                def objective(*_, design=design, sharpness=sharpness):
                    sag, volume = design.objective(sharpness)
                    return 1e2 * sag, volume

                result = ms.minimize(
                    objective,
                    design.free,
                    design.optimizer(),
                    max_iterations=iterations,
                    feasibility=1e-3,
                    progress=False,
                )
            found[f"{2 * cells[0] * cells[1]}"] = result.objective
            shown.update()
    spread = max(found.values()) / min(found.values()) - 1.0
    print_table(
        "The stiffest sheet of a volume, with one radius of the filter",
        ["faces", "objective"],
        [[name, f"{value:.5f}"] for name, value in found.items()],
    )
    missed = note("share", "objective over meshes", spread, at_most=ALLOWED_SPREAD)
    print(f"They differ by {100 * spread:.2f} % (at most {100 * ALLOWED_SPREAD:g} %){missed}.")
    return {**found, "spread": spread}


def _void(count: int) -> dict[str, Any]:
    """Compute how random topologies roll up with and without void, and print what the solves took."""
    import torch

    density = ms.parametrize.density
    mesh = ms.meshes.rectangle(0.1, 0.05, cells=(32, 16), irregular=0.1, seed=1)
    root = np.flatnonzero(mesh.face_barycenters[:, 0] < 0.1 / 32)
    smooth = density.HelmholtzFilter(mesh, 0.012)
    kinds = {"taken out": (0.1, 1e-2), "soft, 1e-2": (0.0, 1e-2), "soft, 1e-4": (0.0, 1e-4)}
    rows: dict[str, Any] = {}
    for name, (least, stiffness) in kinds.items():
        counts, descents, began = [], 0, time.process_time()
        for seed in range(count):
            generator = torch.Generator().manual_seed(seed)
            x = smooth(smooth(torch.rand(mesh.n_faces, dtype=torch.float64, generator=generator)))
            x = (x - x.min()) / (x.max() - x.min())
            matter = density.Matter(
                mesh, density.fixed(density.projected(x, 32.0, 0.4), solid=root), root, least
            )
            sheet = ms.Shell(matter.mesh, thickness=5e-4, young_modulus=YOUNG_MODULUS)
            scene = ms.Scene(sheet, supports=[ms.Clamp(matter.mesh.edges_at(x=0.0))], field=ms.UniformField())
            values = matter.values(
                young_modulus=YOUNG_MODULUS,
                remanent_magnetization=(6e4, 0.0, 0.0),
                void_stiffness=stiffness,
            )
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ms.LargeStrainWarning)
                rest = ms.equilibrium(
                    scene, values={sheet: values}, applied_flux_density=(0.0, 0.0, 2e-2), progress=False
                )
            counts.append(rest.factorizations)
            descents += rest.relaxation_steps > 0
        rows[name] = {
            "factorizations": float(np.mean(counts)),
            "most": max(counts),
            "descents": descents,
            "seconds": (time.process_time() - began) / count,
        }
    print_table(
        f"{count} random topologies of {mesh.n_faces} faces that roll up in a strong field, sharpness 32",
        ["void", "factorizations", "most", "solves with descents", "s each"],
        [
            [
                name,
                f"{row['factorizations']:.1f}",
                str(row["most"]),
                str(row["descents"]),
                f"{row['seconds']:.2f}",
            ]
            for name, row in rows.items()
        ],
    )
    note("count", "factorizations without void", rows["taken out"]["factorizations"])
    return rows
