"""The figure, and the summary that is printed."""

from __future__ import annotations

import io

import numpy as np

import magshell as ms

from .design import FIELD, LIMIT
from .model import RADIUS, kirigami

COLORS = {"L-BFGS": "#20639b", "GCMMA": "#3d9970", "MMA": "#c8442d"}
GREY = "#777777"
PAPER = {"iterations": 95, "seconds": 3.9e2, "objective": -2.8}  # [Chen22] Table 1, six cores, unit not given


def draw_design(axes, found: dict) -> None:
    """Draw the flat sheet from above, each vertex in the colour of its height in the tower."""
    mesh = kirigami().mesh
    style = ms.Style(arrows=mesh.n_faces, show_field=False)
    _paste(axes, _picture(mesh, found, rest=True, view=(90, -90), style=style))


def draw_tower(axes, found: dict, switched: dict) -> None:
    """Draw the tower on its floor."""
    picture = _picture(
        switched["mesh"],
        {**found, **switched},
        rest=False,
        view=(12, -60),
        style=ms.Style(arrows=0),
        obstacles=ms.obstacles.Box((0.044, 0.044, 1e-3), center=(0, 0, -1e-3)),  # of the floor, so much
    )
    _paste(axes, picture)


def _picture(mesh: ms.TriangleMesh, found: dict, rest: bool, **options) -> ms.Picture:
    return ms.plot(
        mesh,
        positions=mesh.rest_positions if rest else found["positions"],
        remanent_magnetization=found["remanent_magnetization"],
        applied_flux_density=FIELD,
        color=ms.Color(
            1e3 * found["positions"][:, 2],
            label="height of the tower [mm]",
            range=(0.0, 1e3 * found["height"]),
        ),
        width=1100,
        **options,
    )


def _paste(axes, picture: ms.Picture) -> None:
    from matplotlib import pyplot as plt

    axes.imshow(plt.imread(io.BytesIO(picture._repr_png_())), interpolation="lanczos")
    axes.set_axis_off()


def draw_convergence(axes, searches: list[dict]) -> None:
    """Draw the height of the tallest tower so far against time, for every search."""
    for found in searches:
        method = found["name"].split(",")[0]
        main = found["name"] == method
        axes.plot(
            found["seconds"],
            1e3 * np.maximum.accumulate(found["heights"]),
            color=COLORS[method],
            lw=2.0 if main else 0.9,
            alpha=1.0 if main else 0.55,
            label=method if main else None,
        )
    axes.axhline(0.0, color=GREY, lw=0.8)
    axes.text(0.98, 0.0, "floor", color=GREY, va="bottom", ha="right", transform=axes.get_yaxis_transform())
    axes.set(xscale="log", xlabel="time [s]", ylabel="height of the center [mm]")
    axes.legend(frameon=False, loc="center right", bbox_to_anchor=(1.0, 0.5))


def draw_switching(axes, found: dict, switched: dict) -> None:
    axes.plot(1e3 * switched["fields"], 1e3 * switched["heights"], color=COLORS["L-BFGS"], lw=2)
    axes.plot(1e3 * FIELD[2], 1e3 * switched["height"], "o", color=COLORS["L-BFGS"], ms=6)
    axes.axhline(1e3 * found["height"], color=GREY, lw=0.8, ls=":")
    axes.text(0.0, 1e3 * found["height"], "designed", color=GREY, va="bottom")
    axes.annotate(
        "off the floor but\nfor what is glued",
        (1e3 * FIELD[2], 1e3 * switched["height"]),
        xytext=(0.62, 0.62),
        textcoords="axes fraction",
        arrowprops={"arrowstyle": "-", "color": GREY, "shrinkB": 5},
        color=COLORS["L-BFGS"],
    )
    axes.set(xlabel="flux density B [mT]", ylabel="height of the center [mm]", ylim=(0, None))


def summary(result: dict) -> str:
    """Return the summary: the searches, and the checks of the first one's tower."""
    best, check = result["tower"], result["checks"]
    rows = [
        f"  {found['name']:<24}{1e3 * found['height']:8.2f}{found['height'] / RADIUS:9.3f}"
        f"{1e3 * found['rises_to']:10.2f}{found['iterations']:12d}"
        f"{found['evaluations']:13d}{found['seconds'][-1]:9.2f}{found['seconds'][-1] / found['iterations']:11.3f}"
        for found in result["searches"]
    ]
    stored = sum(check["energies"][name] for name in ("membrane", "bending", "gravity"))
    gap = check["first_order"]
    return "\n".join(
        (
            f"Kirigami tower, {result['faces']} faces, {result['vertices']} vertices, radius {1e3 * RADIUS:.0f} mm,"
            f" B = {1e3 * FIELD[2]:.0f} mT, |M_r| at most {1e-3 * LIMIT:.0f} kA/m",
            "  search                    [mm]  /radius  rises to  iterations  evaluations  time [s]  s/iteration",
            *rows,
            f"  [Chen22] Table 1: {PAPER['iterations']} iterations in {PAPER['seconds']:.0f} s on six cores, "
            f"{PAPER['seconds'] / PAPER['iterations']:.1f} s each, objective {PAPER['objective']} in a unit not given,",
            "  for a kirigami of about as many faces; its size, cuts and field are not given either.",
            "The first one's tower",
            f"  without magnetization     hangs {-1e3 * result['hanging']:.2f} mm below its ring",
            f"  path along the rings      {1e3 * check['longest_path']:.2f} mm: "
            f"{best['height'] / check['longest_path']:.0%} of it upright",
            f"  lowest and off the axis   {1e3 * check['lowest']:.2f} mm, {1e3 * check['off_axis']:.2f} mm",
            f"  elastic energy + weight   {1e6 * stored:.0f} uJ of {-1e6 * check['energies']['magnetic']:.0f} uJ the "
            f"field gives, {1e6 * check['magnetic_at_most']:.0f} uJ were all of it aligned",
            f"  switched on, on its floor {1e3 * check['switched_on']['height']:.2f} mm, lowest "
            f"{1e3 * check['switched_on']['lowest'][-1]:.2f} mm, {check['switched_on']['crossings']} faces cross; on the "
            f"way the floor bears up to {1e3 * check['switched_on']['on_floor'].max():.2f} mN, the rings each other "
            f"{1e3 * check['switched_on']['on_itself'].max():.2f} mN",
            f"  2 % disturbed             {1e3 * check['disturbed'].min():.2f} to "
            f"{1e3 * check['disturbed'].max():.2f} mm",
            f"  to first order, a better magnetization would add {1e3 * gap['tower']:.1f} mm "
            f"({1e3 * gap['start']:.0f} mm at the start)",
            f"  on {check['finer']['faces']} faces           {1e3 * check['finer']['height']:.2f} mm",
        )
    )
