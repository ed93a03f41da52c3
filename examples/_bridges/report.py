"""Pictures, the movie, and the summary that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import magshell as ms

from .identified import NOISE, PRIOR_LOG, PRIOR_POISSON, Knowledge
from .search import Found
from .task import SAG, YOUNG_MODULUS

COLORS = {"suspension": "#20639b", "arch": "#c8442d"}
VIEW = (22, -62)


def draw_search(axes, searches: list[Found]) -> None:
    for found in searches:
        name = found.task.bridge.name
        label = f"{name}, {len(found.unknowns)} unknowns"
        axes.semilogy(found.simulations, 100 * found.errors, "o-", color=COLORS[name], label=label)
    axes.axhline(1, color="#999999", lw=0.8, ls=":")
    axes.set(xlabel="simulations", ylabel="distance from the target [% of the sag]")
    axes.legend(frameon=False, fontsize=8)


def draw_singular_values(axes, known: list[Knowledge]) -> None:
    for each, color in zip(known, ("#c8442d", "#e0a030", "#1a7f5a", "#20639b"), strict=True):
        count = np.arange(1, len(each.singular_values) + 1)
        axes.loglog(count, each.singular_values, "o-", ms=2.5, color=color, label=each.data)
    axes.axhline(1, color="#999999", lw=0.8, ls=":")
    axes.set(xlabel="combination of moduli", ylabel="known from data over known before", ylim=(1e-3, None))
    axes.legend(frameon=False, fontsize=8)


def picture(found: Found) -> ms.Picture:
    """Draw the bridge at rest and at the end, coloured by the modulus that was found."""
    task = found.task
    motion = task.motion(found.unknowns)
    moduli = task.moduli(found.unknowns)["young_modulus"] / YOUNG_MODULUS
    return ms.plot(
        [motion],
        states=[0, len(motion) - 1],
        color=ms.Color(
            [_of_faces(task.bridge.mesh, np.log10(moduli))] * 2,
            label="log10 of Young's modulus over the start's",
        ),
        titles=["at rest", f"after {1e3 * motion.times[-1]:.0f} ms"],
        view=VIEW,
    )


def _of_faces(mesh: ms.TetMesh, values: np.ndarray) -> np.ndarray:
    """Return the mean over the tetrahedra at each vertex: values of elements as values of vertices."""
    sums, counts = np.zeros(mesh.n_vertices), np.zeros(mesh.n_vertices)
    np.add.at(sums, mesh.tetrahedra, values[:, None])
    np.add.at(counts, mesh.tetrahedra, 1.0)
    return sums / counts


def movie(found: Found, path: Path, **options) -> Path:
    motion = found.task.motion(found.unknowns)
    title = f"{found.task.bridge.name} bridge"
    return ms.animate(motion, path, speed=0.02, view=VIEW, title=title, color=None, **options)


def summary(result: dict) -> str:
    lines = []
    for found in result["searches"]:
        mesh, task = found.task.bridge.mesh, found.task
        reached = (
            "not within 1 %"
            if found.iterations is None
            else f"within 1 % after {found.iterations} iterations"
        )
        lines.append(
            f"{task.bridge.name}: {mesh.n_vertices} nodes, {mesh.n_tetrahedra} tetrahedra, {len(task.bridge.held)} held; "
            f"{len(found.unknowns)} unknowns, a sag of {100 * SAG:.0f} cm {reached} and {found.simulations[-1]} "
            f"simulations ({found.seconds[-1]:.1f} s); slope against differences {result['slopes'][task.bridge.name]:.1e}"
        )
    lines.append(
        f"\nWhat measurements at rest (noise {1e3 * NOISE:g} mm) add to E known to {100 * PRIOR_LOG:.0f} % and nu to "
        f"{PRIOR_POISSON:g}, of the suspension bridge:"
    )
    lines.append(
        f"  {'data':34s}{'numbers':>8s}{'combinations known':>20s}{'spread left of E':>18s}{'of nu':>8s}{'E to half':>11s}"
    )
    for each in result["known"]:
        lines.append(
            f"  {each.data:34s}{each.numbers:8d}{each.directions:20d}{100 * each.of('young_modulus').mean():16.1f} %"
            f"{100 * each.of('poisson_ratio').mean():6.1f} %{100 * each.identified('young_modulus'):9.1f} %"
        )
    return "\n".join(lines)
