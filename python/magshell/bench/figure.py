"""The picture of the accuracy table: error against the number of faces and against time."""

from __future__ import annotations

from pathlib import Path

from .convergence import Convergence


def draw_convergence(studies: dict[tuple[str, str], Convergence], path: Path) -> None:
    """Writes the picture. Raises ImportError without matplotlib."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError('drawing needs matplotlib: pip install "magshell[plot]"') from error
    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    by_faces, by_time = figure.subplots(1, 2, sharey=True)
    colours = {name: f"C{k}" for k, name in enumerate(dict.fromkeys(name for name, _ in studies))}
    for (name, bending), study in studies.items():
        style = {"color": colours[name], "marker": "o", "linestyle": "-" if bending == "midedge" else "--"}
        label = f"{name}, {bending}, order {study.order:.2f}"
        by_faces.loglog(study.n_faces, study.mean_errors, label=label, **style)
        by_time.loglog(study.times.mean(axis=0), study.mean_errors, **style)
    by_faces.set(xlabel="faces", ylabel="error of the end / length of the strip")
    by_time.set(xlabel="time of one equilibrium from rest / s")
    figure.legend(fontsize="small", ncols=2, loc="outside upper center")
    for axes in (by_faces, by_time):
        axes.grid(True, which="both", alpha=0.3)
    figure.savefig(path, dpi=150)
