"""The pictures of the bench: errors against the number of faces, of steps, and against time."""

from __future__ import annotations

from pathlib import Path

from .convergence import Convergence


def draw_convergence(studies: dict[tuple[str, str], Convergence], path: Path) -> None:
    """Writes the picture. Raises ImportError without matplotlib."""
    figure, by_faces, by_time = _two_panels()
    colours = {name: f"C{k}" for k, name in enumerate(dict.fromkeys(name for name, _ in studies))}
    for (name, bending), study in studies.items():
        style = {"color": colours[name], "marker": "o", "linestyle": "-" if bending == "midedge" else "--"}
        label = f"{name}, {bending}, order {study.order:.2f}"
        by_faces.loglog(study.n_faces, study.mean_errors, label=label, **style)
        by_time.loglog(study.times.mean(axis=0), study.mean_errors, **style)
    by_faces.set(xlabel="faces", ylabel="error of the end / length of the strip")
    by_time.set(xlabel="time of one equilibrium from rest / s")
    _finish(figure, path)


def draw_integrators(errors: dict[str, dict], path: Path) -> None:
    """Of motions. Writes the picture. Raises ImportError without matplotlib."""
    figure, by_steps, by_time = _two_panels()
    for name, rows in errors.items():
        by_steps.loglog(rows["steps"], rows["error"], marker="o", label=f"{name}, order {rows['order']:.2f}")
        by_time.loglog(rows["time"], rows["error"], marker="o")
    by_steps.set(xlabel="steps a period", ylabel="error of the positions / length of the strip")
    by_time.set(xlabel="time of the motion / s")
    _finish(figure, path)


def _two_panels():
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError('drawing needs matplotlib: pip install "magshell[plot]"') from error
    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    return figure, *figure.subplots(1, 2, sharey=True)


def _finish(figure, path: Path) -> None:
    figure.legend(fontsize="small", ncols=2, loc="outside upper center")
    for axes in figure.axes:
        axes.grid(True, which="both", alpha=0.3)
    figure.savefig(path, dpi=150)
