"""The figure, and the summary that is printed."""

from __future__ import annotations

import numpy as np

from .model import LENGTH, MEASURED_SNAP, NO_SNAP, SHEAR_MODULUS
from .studies import beam_theory

BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"


def draw_path(axes, result: dict) -> None:
    for section in result["sections"]:
        style = {"ls": "-", "lw": 2} if section["stable"] else {"ls": (0, (4, 2)), "lw": 1.2}
        axes.plot(1e3 * section["fields"], 1e3 * section["displacements"], color=BLUE, **style)
    critical, other_side = result["critical"], result["sections"][2]
    at, start = 1e3 * critical["field"], 1e3 * critical["displacement"]
    end = 1e3 * np.interp(critical["field"], other_side["fields"], other_side["displacements"])
    axes.annotate(
        "",
        (at, end),
        (at, start),
        arrowprops={"arrowstyle": "-|>", "color": BLUE, "shrinkA": 0, "shrinkB": 0},
    )
    axes.plot(at, start, "o", ms=5, color=BLUE)
    measured = result["measured"]
    axes.plot(1e3 * measured["fields"], 1e3 * measured["displacements"], "o", ms=4, mfc="white", mec=RED)
    for text, place, color in (
        ("computed, stable", (-2.2, 6.7), BLUE),
        ("unstable", (0.3, 4.0), BLUE),
        (f"limit point, {at:.2f} mT", (at + 0.6, start - 0.75), BLUE),
        ("measured while B grows\nby 6.5 mT/s", (8.2, 7.0), RED),
    ):
        axes.text(*place, text, color=color, va="center")
    for text, modulus, side in (
        ("beam theory ", 3 * SHEAR_MODULUS, "right"),
        (" the same, 4G", 4 * SHEAR_MODULUS, "left"),
    ):
        field = 1e3 * beam_theory(modulus=modulus)[1]
        axes.plot((field, field), (9.0, 9.4), color=GREY, lw=1)
        axes.text(field, 9.2, text, color=GREY, ha=side, va="center")
    axes.set(
        xlabel="flux density B [mT]", ylabel="mid-span displacement [mm]", xlim=(-6.5, 16.8), ylim=(-0.4, 9.4)
    )


def draw_convergence(axes, study: dict) -> None:
    sizes = [1e3 * LENGTH / row["cells"][0] for row in study["rows"]]
    for kind, marker in (("limit", "o"), ("bifurcation", "s")):
        fields = [1e3 * row[kind]["field"] for row in study["rows"]]
        axes.plot(
            sizes,
            fields,
            marker,
            ls="-",
            lw=1,
            color=BLUE,
            mfc=BLUE if kind == "limit" else "white",
            label=f"{kind} point" if kind == "limit" else kind,
        )
    value, error = 1e3 * study["limit"]["value"], 1e3 * study["limit"]["error"]
    axes.errorbar(0, value, error, fmt="_", ms=12, color=BLUE)
    axes.text(0, value - 0.008, f"{value:.3f}", color=BLUE, va="top", ha="center")
    theory = 1e3 * beam_theory()[1]
    axes.axhline(theory, color=GREY, lw=1, ls=":")
    axes.text(0, theory, "beam theory", color=GREY, va="bottom")
    axes.set(
        xlabel="length of a cell [mm]", ylabel="critical field [mT]", xlim=(-0.5, None), ylim=(5.45, 5.85)
    )
    axes.legend(frameon=False, loc="lower right")


def summary(result: dict) -> str:
    """Return the summary: the critical point, its convergence, and the comparison with theory and experiment."""
    return "\n\n".join(
        (
            outcome(result),
            meshes(result["convergence"]),
            comparison(result["convergence"]["limit"]["value"]),
            from_beam_to_shell(result["differences"]["rows"]),
        )
    )


def outcome(result: dict) -> str:
    critical, plateau = result["critical"], {name: 1e3 * u for name, u in result["plateau"].items()}
    mode = "symmetric" if critical["symmetric"] else "antisymmetric"
    columns, rows = result["cells"]
    return f"""Bistable hard-magnetic beam, {columns} x {rows} cells
  buckled height               {1e3 * result["height"]:.3f} mm
  stable up to                 {1e3 * critical["field"]:.3f} mT, a {critical["kind"]} point, its mode {mode}
  displacement there           {1e3 * critical["displacement"]:.3f} mm
  plateau above 10 mT, mean    {plateau["computed"]:.2f} mm, measured {plateau["measured"]:.2f} mm"""


def meshes(study: dict) -> str:
    lines = ["Meshes            height [mm]   limit point [mT]   bifurcation [mT]   first to come"]
    for row in study["rows"]:
        name = f"{row['cells'][0]} x {row['cells'][1]}"
        lines.append(
            _row(name, row["height"], row["limit"]["field"], row["bifurcation"]["field"])
            + f"   {row['first']}"
        )
    for title, key in (("extrapolated", "value"), ("error estimate", "error")):
        lines.append(_row(title, *(study[name][key] for name in ("height", "limit", "bifurcation"))))
    return "\n".join(lines)


def _row(name: str, height: float, limit: float, bifurcation: float) -> str:
    return f"  {name:<15}{1e3 * height:12.4f}{1e3 * limit:19.4f}{1e3 * bifurcation:19.4f}"


def comparison(field: float) -> str:
    theory, plate = (1e3 * beam_theory(modulus=factor * SHEAR_MODULUS)[1] for factor in (3, 4))
    return f"""Critical field
  computed, static             {1e3 * field:.3f} mT
  measured, ramp of 6.5 mT/s   {1e3 * MEASURED_SNAP:.2f} mT
  measured, no snap at         {1e3 * NO_SNAP:.2f} mT, constant
  beam theory, E = 3G          {theory:.3f} mT
  the same, wide plate E = 4G  {plate:.3f} mT"""


def from_beam_to_shell(rows) -> str:
    lines = ["From beam theory to the shell                       height [mm]   critical field [mT]"]
    lines += [f"  {what:<48}{1e3 * height:13.3f}{1e3 * field:22.3f}" for what, height, field in rows]
    return "\n".join(lines)
