"""Part `terms` of the benchmarks: cost of each part of a scene, measured by adding one part at a time to a sheet."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any, NamedTuple

import magshell as ms

from .ratios import note
from .report import add_rounds, chosen, print_table
from .timing import Clocked, clocked

FACES, QUICK_FACES = 8192, 128
STEPS, TIME_STEP = 3, 1e-3
SIDE, THICKNESS = 0.1, 1e-3  # m
IN_PLANE, OUT_OF_PLANE = (4e4, 0.0, 0.0), (4e4, 0.0, 1e4)  # A/m
FLUX_DENSITY = (0.0, 0.0, 1e-3)  # T

COLUMNS = {"assembly": 2, "iteration": 1, "step_iteration": 1}  # {column of the table: its digits}


class Part(NamedTuple):
    """A part that a scene gets in addition to the parts before it.

    sheet: keywords for ms.Shell. scene: for ms.Scene, given the mesh; lists are added to those before, all else replaces
    the earlier value. solve: for ms.equilibrium and ms.simulate. For motions only: in_motion, as scene; motion, for
    ms.simulate.
    """

    name: str
    sheet: dict[str, Any] = {}  # noqa: RUF012
    scene: Callable[[ms.TriangleMesh], dict[str, Any]] = lambda mesh: {}
    solve: dict[str, Any] = {}  # noqa: RUF012
    in_motion: Callable[[ms.TriangleMesh], dict[str, Any]] = lambda mesh: {}
    motion: dict[str, Any] = {}  # noqa: RUF012

    def only_moves(self, mesh: ms.TriangleMesh) -> bool:
        return not (self.sheet or self.scene(mesh) or self.solve)


# A new term is one line here.
PARTS = (
    Part(
        "membrane, hinge bending, a load",
        {"bending": "hinge"},
        lambda mesh: {"loads": [ms.EdgeLoad(mesh.edges_at(x=SIDE), (0, 0, 0.01))]},
    ),
    Part("midedge bending instead", {"bending": "midedge"}),
    Part("area load", scene=lambda mesh: {"loads": [ms.AreaLoad((0, 0, -1.0))]}),
    Part("gravity", scene=lambda mesh: {"gravity": (0, 0, -1.0)}),
    Part(
        "magnetic in its plane, uniform field",
        scene=lambda mesh: {"field": [ms.UniformField()]},
        solve={"remanent_magnetization": IN_PLANE, "applied_flux_density": FLUX_DENSITY},
    ),
    Part("and out of its plane", solve={"remanent_magnetization": OUT_OF_PLANE}),
    Part("field of a dipole", scene=lambda mesh: {"field": [_dipole(1)]}),
    Part("of nine more dipoles", scene=lambda mesh: {"field": [_dipole(9)]}),
    Part("contact with a plane", scene=lambda mesh: {"contacts": (_floor(),)}),
    Part(
        "friction by the forces of the step before",
        in_motion=lambda mesh: {"contacts": (_floor(friction_coefficient=0.6, lagged_friction=True),)},
    ),
    Part("exact friction instead", in_motion=lambda mesh: {"contacts": (_floor(friction_coefficient=0.6),)}),
    Part("water", in_motion=lambda mesh: {"water": ms.Water()}),
    Part("viscous damping", motion={"damping": 1e-6}),
    Part("stiffness damping", motion={"stiffness_damping": 1e-4}),
    Part("Maxwell branch", motion={"maxwell_modulus": 0.5, "maxwell_time": 0.01}),
)


def _dipole(count: int) -> ms.Dipoles:
    """Return dipoles in a row under the sheet."""
    positions = [(SIDE * (k + 0.5) / count, 0.3 * SIDE, -2.0 * SIDE) for k in range(count)]
    return ms.Dipoles(positions, [(0.0, 0.0, 0.3 / count)] * count)


def _floor(**options) -> ms.Contact:
    return ms.Contact(ms.obstacles.Plane(), contact_stiffness=100.0, **options)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--faces", type=int, help=f"of the square sheet (default {FACES})")
    add_rounds(parser, 5)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the table and return its numbers."""
    faces = chosen(options.faces, options.quick, QUICK_FACES, FACES)
    if faces < 2:
        raise SystemExit("--faces must be at least 2")
    cells = max(1, round((faces / 2) ** 0.5))
    mesh = ms.meshes.rectangle(SIDE, SIDE, cells=(cells, cells))
    results: list[dict] = []
    for k, part in enumerate(PARTS):
        so_far = PARTS[: k + 1]
        before = results[-1] if results else None
        of_rest = before if before and part.only_moves(mesh) else None  # nothing changes at rest
        results.append({"part": part.name, **_costs(mesh, so_far, options.rounds, of_rest)})
    _print(mesh.n_faces, results)
    return {"faces": mesh.n_faces, "parts": results}


def _costs(
    mesh: ms.TriangleMesh, parts: tuple[Part, ...], rounds: int, of_rest: dict[str, Any] | None
) -> dict[str, Any]:
    """Measure the times [s] of gradient and Hessian, of a Newton iteration, of a time step and of an iteration of it."""
    if of_rest is None:
        scene, solve, _ = _together(mesh, parts, moving=False)
        found = ms.equilibrium(scene, **solve)
        model, state, load_parameters = scene._model, found._state, found._load_parameters
        assembly = clocked(lambda: model.assemble(state, load_parameters), rounds=rounds)
        whole = clocked(lambda: ms.equilibrium(scene, **solve), rounds=rounds)
        iteration = Clocked(*(seconds / found.factorizations for seconds in whole))
        of_rest = {
            "unknowns": scene.n_dofs,
            "assembly": _seconds(assembly),
            "iteration": _seconds(iteration),
            "factorizations": found.factorizations,
        }
    scene, solve, motion = _together(mesh, parts, moving=True)
    moves: list[ms.Trajectory] = []

    def move() -> None:
        options = {"steps": STEPS, "time_step": TIME_STEP, "record_every": STEPS, "progress": False}
        options["integrator"] = ms.ImplicitEuler()
        moves[:] = [ms.simulate(scene, **options, **solve, **motion)]

    step = Clocked(*(seconds / STEPS for seconds in clocked(move, rounds=rounds)))
    names = ("unknowns", "assembly", "iteration", "factorizations")
    return {
        **{name: of_rest[name] for name in names},
        "step": _seconds(step),
        "step_iterations": moves[0].iterations / STEPS,
        "step_iteration": _seconds(step) * STEPS / moves[0].iterations,
    }


def _together(
    mesh: ms.TriangleMesh, parts: tuple[Part, ...], moving: bool
) -> tuple[ms.Scene, dict[str, Any], dict[str, Any]]:
    """Return a scene with all parts, the arguments of its solves, and further arguments of its motions."""
    shell = {"thickness": THICKNESS, "young_modulus": 1e6, "poisson_ratio": 0.45, "mass_density": 1e3}
    scene: dict[str, Any] = {"supports": [ms.Clamp(mesh.edges_at(x=0.0))]}
    solve, motion = {}, {}
    for part in parts:
        shell |= part.sheet
        solve |= part.solve
        motion |= part.motion
        more = part.scene(mesh) | (part.in_motion(mesh) if moving else {})
        for name, value in more.items():
            scene[name] = scene.get(name, []) + value if isinstance(value, list) else value
    return ms.Scene(ms.Shell(mesh, **shell), **scene), solve, motion


def _seconds(measured: Clocked) -> float:
    return measured.processor if ms.num_threads() == 1 else measured.wall


def _print(faces: int, results: list[dict[str, Any]]) -> None:
    rows = []
    for k, each in enumerate(results):
        before = results[max(0, k - 1)]
        if k:
            for name in COLUMNS:
                note("share", f"+ {each['part']}: {name} over the first", each[name] / results[0][name])
        row = [each["part"] if k == 0 else f"+ {each['part']}", str(each["unknowns"])]
        for name, digits in COLUMNS.items():
            row.append(f"{1e3 * each[name]:.{digits}f}")
            row.append("" if k == 0 else f"{1e3 * (each[name] - before[name]):+.{digits}f}")
        rows.append([*row, f"{1e3 * each['step']:.1f}", f"{each['step_iterations']:.1f}"])
    headings = [
        "scene",
        "unknowns",
        "gradient and Hessian",
        "more",
        "Newton iteration",
        "more",
        "of a time step",
        "more",
    ]
    headings += ["time step", "iterations"]
    print_table(
        f"What each part of a scene costs, ms, {faces} faces, one part more a line; steps of implicit Euler",
        headings,
        rows,
    )
