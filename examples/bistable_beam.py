"""A buckled hard-magnetic beam snaps through in a transverse field: the experiment of Tan et al.

A strip of 120.47 x 20 x 2.5 mm, its two halves magnetized against each other along its length, is clamped at both ends.
The clamps are moved together by 0.47 mm, so it buckles and has two states. A transverse field B pushes one through to
the other: with the magnetization M_r of the halves it acts like a force of 2 M_r B (width x thickness) at mid-span.

What comes out (Young's modulus 3G, Poisson's ratio 1/2, converged over four meshes): the buckled beam stands 3.68 mm high
and loses its stability at 5.51 mT, at a limit point; the antisymmetric bifurcation lies on the unstable part of the
path just behind it, 0.01 mT lower. The experiment snaps at 6.26 mT in a ramp and does not at a constant 5 mT.

Beam theory says 3.82 mm and 5.76 mT. `differences` takes the steps from the one to the other one at a time:

- The beam is not inextensible. The axial force at the critical field alone shortens it by 0.35 of the 0.47 mm; without
  that the theory would say 4.79 mm and 11.35 mT. The buckling has the remaining 0.12 mm, which makes everything below
  count for much: a shortening 1 % larger raises the critical field by 2.5 %.
- Without Poisson's effect, and scaled to small slopes and strains, the shell is the beam, to 0.05 %. At its
  true slopes (0.1) and strains (0.3 %) it loses stability 0.6 % earlier.
- The rest, 3 to 4 % in height and field, is the width: it grows with Poisson's ratio and with the width. A clamp lets a
  sheet bend neither sideways nor widen, which stiffens it more in bending than in compression. A sheet that is stiffer in
  bending buckles later, has less of the shortening left to stand high with, and snaps at a *lower* field.

Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import magshell as ms

# Case and data of Tan et al., as used by Stewart & Anand, J. Mech. Phys. Solids, 2023.
LENGTH, WIDTH, THICKNESS = 120.47e-3, 20e-3, 2.5e-3  # m
SHORTENING = 0.47e-3  # m
SHEAR_MODULUS = 1.4e6  # Pa
YOUNG_MODULUS = 3.0 * SHEAR_MODULUS
RESIDUAL_FLUX_DENSITY = 67.5e-3  # T
RAMP = 6.5e-3  # T/s
HIGHEST_FIELD = 16.25e-3  # T
MEASURED_SNAP = 6.26e-3  # T, where the ramp passes 4 mm
NO_SNAP = 5.0e-3  # T, a constant field under which the beam stays

MESHES = ((24, 4), (48, 8), (96, 16), (192, 32))
BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"


@dataclass(frozen=True)
class Beam:
    """A scene, the magnetization of its halves (n_f, 3) [A/m], and the vertex in the middle."""

    scene: ms.Scene
    remanent_magnetization: np.ndarray
    middle: int
    shortening: float

    def equilibrium(self, field=0.0, **options) -> ms.Equilibrium:
        return ms.equilibrium(self.scene, **self._controls(field), **options)

    def follow(self, field, **options) -> ms.Path:
        return ms.follow(self.scene, **self._controls(field), progress=False, **options)

    def _controls(self, field):
        return {"remanent_magnetization": self.remanent_magnetization, "applied_flux_density": (0, 0, field)}

    def height(self, positions) -> float:
        """Of mid-span, m."""
        return float(positions[self.middle, 2])


def beam(cells, *, width=WIDTH, thickness=THICKNESS, shortening=SHORTENING, poisson_ratio=0.5) -> Beam:
    """The beam between clamps that share the shortening, with an even number of cells each way."""
    mesh = ms.meshes.rectangle(LENGTH, width, cells=cells)
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=YOUNG_MODULUS, poisson_ratio=poisson_ratio)
    clamps = [
        ms.Clamp(mesh.edges_at(x=0.0), displacement=(shortening / 2, 0, 0)),
        ms.Clamp(mesh.edges_at(x=LENGTH), displacement=(-shortening / 2, 0, 0)),
    ]
    magnetization = np.zeros((mesh.n_faces, 3))
    outwards = np.sign(mesh.face_barycenters[:, 0] - LENGTH / 2)
    magnetization[:, 0] = outwards * ms.residual_to_remanent(RESIDUAL_FLUX_DENSITY)
    middle = mesh.nearest_vertex((LENGTH / 2, width / 2, 0))
    return Beam(ms.Scene(sheet, supports=clamps, field=ms.UniformField()), magnetization, middle, shortening)


def buckled(beam: Beam) -> ms.Equilibrium:
    """The beam without field, buckled to the side +z.

    Compressed straight it would rest on a saddle between two sides; a field that pushes upwards chooses one.
    """
    scale = beam.shortening / SHORTENING
    pushed = beam.equilibrium(field=-1e-3 * scale**1.5)
    return beam.equilibrium(field=0.0, start=pushed)


def stability_loss(beam: Beam, *, field=8e-3, largest_step=0.006) -> dict:
    """Height [m], and the field [T] and height of the limit point and of the bifurcation, the first to come named."""
    start = buckled(beam)
    height = beam.height(start.positions)
    path = beam.follow(
        field,
        start=start,
        largest_step=largest_step,
        until=lambda _, positions: beam.height(positions) < 0.3 * height,
    )
    found = {"height": height, "first": path.critical[0].kind}
    for point in path.critical:
        found[point.kind] = {"field": field * point.parameter, "height": beam.height(point.positions)}
    return found


def beam_theory(*, shortening=SHORTENING, modulus=YOUNG_MODULUS, bending=1.0, extensible=True) -> tuple[float, float]:
    """Buckled height [m] and critical field [T] of a shallow clamped beam; `bending`: a factor on its stiffness EI.

    Under an axial force P = k^2 EI and a force F at mid-span, the slope from the clamp to the middle is
        w' = F / (2P) (1 - cos(k x - a/2) / cos(a/2)),                                   a = k L / 2,
    and the clamps come together by the compression P L / EA and by the integral of w'^2 / 2. Stability ends at the
    antisymmetric bifurcation, tan a = a.
    """
    area, inertia = WIDTH * THICKNESS, bending * WIDTH * THICKNESS**3 / 12

    def left_for_bending(k):
        return shortening - (k**2 * inertia / area * LENGTH if extensible else 0.0)

    height = 2 / np.pi * np.sqrt(LENGTH * left_for_bending(2 * np.pi / LENGTH))
    a = 4.493409457909064
    k = 2 * a / LENGTH
    integral = a - 4 * np.tan(a / 2) + (a + np.sin(a)) / (2 * np.cos(a / 2) ** 2)
    force = 2 * k**2 * modulus * inertia * np.sqrt(left_for_bending(k) * k / integral)
    return height, force / (2 * ms.residual_to_remanent(RESIDUAL_FLUX_DENSITY) * area)


def straight_buckling(beam: Beam) -> float:
    """The shortening [m] at which the straight beam buckles."""
    path = beam.follow(0.0, first_step=0.02, largest_step=2e-5, until=lambda parameter, _: parameter > 0.6)
    return path.critical[0].parameter * beam.shortening


def differences(cells) -> dict:
    """From beam theory to the shell, one effect at a time: rows of (what, height [m], critical field [T])."""
    rows = [
        ("beam theory, inextensible", *beam_theory(extensible=False)),
        ("beam theory", *beam_theory()),
    ]
    # A sheet thinner by `scale`, shortened by scale^2, is the same beam with slopes smaller by `scale`; B goes with scale^3.
    scale = 1 / 8
    thin = beam(cells, thickness=scale * THICKNESS, shortening=scale**2 * SHORTENING, poisson_ratio=0.0)
    found = stability_loss(thin, field=8e-3 * scale**3, largest_step=0.006 * scale)
    rows.append(("shell, no Poisson's effect, small slopes", *_height_and_field(found, 1 / scale, scale**-3)))
    no_poisson = beam(cells, poisson_ratio=0.0)
    rows.append(("... its true slopes and strains", *_height_and_field(stability_loss(no_poisson))))
    narrow = beam((cells[0], max(2, cells[1] // 4 // 2 * 2)), width=WIDTH / 4)
    rows.append(("... Poisson's ratio 1/2, a quarter of the width", *_height_and_field(stability_loss(narrow))))
    full = beam(cells)
    rows.append(("... the full width", *_height_and_field(stability_loss(full))))
    stiffening = straight_buckling(full) / straight_buckling(no_poisson)
    rows.append((f"beam theory, bending stiffness x {stiffening:.3f}", *beam_theory(bending=stiffening)))
    longer = stability_loss(beam(cells, shortening=1.01 * SHORTENING))
    rows.append(("shell, shortening 1 % larger", *_height_and_field(longer)))
    return {"rows": rows, "stiffening": stiffening}


def _height_and_field(found: dict, per_height=1.0, per_field=1.0) -> tuple[float, float]:
    return found["height"] * per_height, found[found["first"]]["field"] * per_field


def convergence(meshes=MESHES) -> dict:
    """Height, limit point and bifurcation on each mesh, and what they tend to.

    The last three meshes, each twice as fine as the one before, give the order by the ratio of their differences and the
    limit by Aitken's formula; how far that moves when the finest mesh is left out is the error estimate.
    """
    rows = [{"cells": cells, **stability_loss(beam(cells))} for cells in meshes]
    columns = {
        "height": [row["height"] for row in rows],
        "limit": [row["limit"]["field"] for row in rows],
        "bifurcation": [row["bifurcation"]["field"] for row in rows],
    }
    return {"rows": rows, **{name: _extrapolated(values) for name, values in columns.items()}}


def _extrapolated(values) -> dict:
    def aitken(a, b, c):
        return c - (c - b) ** 2 / ((c - b) - (b - a))

    value = aitken(*values[-3:])
    error = abs(value - (aitken(*values[-4:-1]) if len(values) > 3 else values[-1]))
    return {"value": value, "error": error, "order": np.log2((values[-2] - values[-3]) / (values[-1] - values[-2]))}


def measured_ramp() -> dict:
    """Field [T] and displacement [m] of the experiment's ramp."""
    seconds, millimeters = np.loadtxt(Path(__file__).with_suffix("").as_posix() + "_ramp.csv", delimiter=",").T
    return {"fields": RAMP * seconds, "displacements": 1e-3 * millimeters}


def sections(sheet: Beam, path: ms.Path, field: float, height: float) -> list[dict]:
    """The path cut at its first and last critical points: fields [T], displacements [m], and whether it is stable."""
    joints = (path.critical[0], path.critical[-1])
    cuts = [joint.after_point + 1 for joint in joints]
    fields = np.split(field * path.parameters, cuts)
    displacements = np.split(height - path.positions[:, sheet.middle, 2], cuts)
    for k, joint in enumerate(joints):
        for values, value in (
            (fields, field * joint.parameter),
            (displacements, height - sheet.height(joint.positions)),
        ):
            values[k] = np.append(values[k], value)
            values[k + 1] = np.insert(values[k + 1], 0, value)
    return [
        {"fields": fields[k], "displacements": displacements[k], "stable": stable}
        for k, stable in enumerate((True, False, True))
    ]


def main(cells=(96, 16), meshes=MESHES) -> dict:
    """The figure's numbers, in SI units; displacements are from the buckled state towards the other side."""
    sheet = beam(cells)
    start = buckled(sheet)
    height = sheet.height(start.positions)
    # Up to the critical field, back over the unstable states to the other side, and on to the end of the ramp.
    path = sheet.follow(HIGHEST_FIELD, start=start, largest_step=0.001, lowest_parameter=-1.0)
    first = path.critical[0]
    critical_field = HIGHEST_FIELD * first.parameter
    curve = sections(sheet, path, HIGHEST_FIELD, height)

    # What the beam does instead of going back: just past the critical field, it leaves for the other side.
    snapped = sheet.equilibrium(1.05 * critical_field, start=first.positions)
    measured = measured_ramp()
    plateau = measured["fields"] > 10e-3
    computed = np.interp(measured["fields"][plateau], curve[2]["fields"], curve[2]["displacements"])
    return {
        "cells": cells,
        "height": height,
        "critical": {
            "kind": first.kind,
            "field": critical_field,
            "displacement": height - sheet.height(first.positions),
            "symmetric": abs(sheet.height(first.mode)) > 0.1,
        },
        "sections": curve,
        "snapped": {"field": 1.05 * critical_field, "displacement": height - sheet.height(snapped.positions)},
        "plateau": {"computed": computed.mean(), "measured": measured["displacements"][plateau].mean()},
        "measured": measured,
        "convergence": convergence(meshes),
        "differences": differences(cells),
        "states": {
            "fields": np.array([0.0, critical_field, 1.05 * critical_field]),
            "positions": np.stack([start.positions, first.positions, snapped.positions]),
        },
    }


def plot(result: dict):
    """Displacement against field beside the measured ramp, and the critical field against the size of the cells."""
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), width_ratios=(2.1, 1), layout="constrained")
    draw_path(left, result)
    draw_convergence(right, result["convergence"])
    for axes, letter in ((left, "a"), (right, "b")):
        axes.set_title(letter, loc="left", fontweight="bold")
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def draw_path(axes, result: dict) -> None:
    for section in result["sections"]:
        style = {"ls": "-", "lw": 2} if section["stable"] else {"ls": (0, (4, 2)), "lw": 1.2}
        axes.plot(1e3 * section["fields"], 1e3 * section["displacements"], color=BLUE, **style)
    critical, other_side = result["critical"], result["sections"][2]
    at, start = 1e3 * critical["field"], 1e3 * critical["displacement"]
    end = 1e3 * np.interp(critical["field"], other_side["fields"], other_side["displacements"])
    axes.annotate("", (at, end), (at, start), arrowprops={"arrowstyle": "-|>", "color": BLUE, "shrinkA": 0, "shrinkB": 0})
    axes.plot(at, start, "o", ms=5, color=BLUE)
    measured = result["measured"]
    axes.plot(1e3 * measured["fields"], 1e3 * measured["displacements"], "o", ms=4, mfc="white", mec=RED)
    for text, place, color in (
        ("computed, stable", (-6.2, 5.2), BLUE),
        ("unstable", (-1.3, 2.9), BLUE),
        (f"snaps at {at:.2f} mT", (at + 0.3, start), BLUE),
        ("measured while B grows\nby 6.5 mT/s", (8.2, 7.0), RED),
    ):
        axes.text(*place, text, color=color, va="center")
    axes.set(xlabel="flux density B [mT]", ylabel="mid-span displacement [mm]", xlim=(-6.5, 16.8), ylim=(-0.4, 9.4))


def draw_convergence(axes, study: dict) -> None:
    sizes = [1e3 * LENGTH / row["cells"][0] for row in study["rows"]]
    for kind, marker in (("limit", "o"), ("bifurcation", "s")):
        fields = [1e3 * row[kind]["field"] for row in study["rows"]]
        axes.plot(sizes, fields, marker, ls="-", lw=1, color=BLUE, mfc=BLUE if kind == "limit" else "white", label=kind)
    axes.errorbar(0, 1e3 * study["limit"]["value"], 1e3 * study["limit"]["error"], fmt="_", ms=12, color=BLUE)
    theory = 1e3 * beam_theory()[1]
    axes.axhline(theory, color=GREY, lw=1, ls=":")
    axes.text(0, theory, "beam theory", color=GREY, va="bottom")
    axes.set(xlabel="length of a cell [mm]", ylabel="critical field [mT]", xlim=(-0.3, None), ylim=(5.45, 5.85))
    axes.legend(frameon=False, loc="lower right")


def picture(result: dict) -> ms.Picture:
    """The beam buckled, at its critical field, and after the snap; its magnetization and the field."""
    sheet, states = beam(result["cells"]), result["states"]
    return ms.plot(
        sheet.scene.mesh,
        positions=states["positions"],
        remanent_magnetization=sheet.remanent_magnetization,
        applied_flux_density=[(0, 0, field) for field in states["fields"]],
        titles=[
            f"{name}, {1e3 * field:.2f} mT"
            for name, field in zip(("buckled", "critical", "after the snap"), states["fields"], strict=True)
        ],
        columns=1,
    )


def summary(result: dict) -> str:
    """What a person would ask first."""
    critical, study, plateau = result["critical"], result["convergence"], result["plateau"]
    mode = "symmetric" if critical["symmetric"] else "antisymmetric"
    limit, bifurcation = study["limit"], study["bifurcation"]
    lines = [
        f"Bistable hard-magnetic beam, {result['cells'][0]} x {result['cells'][1]} cells",
        f"  buckled height              {1e3 * result['height']:.3f} mm",
        f"  stable up to                {1e3 * critical['field']:.3f} mT, a {critical['kind']} point with a {mode} mode",
        f"  displacement there          {1e3 * critical['displacement']:.3f} mm",
        f"  plateau after the snap      {1e3 * plateau['computed']:.2f} mm, measured {1e3 * plateau['measured']:.2f} mm "
        "(means above 10 mT)",
        "",
        "Meshes             height [mm]   limit point [mT]   bifurcation [mT]   first to come",
    ]
    for row in study["rows"]:
        lines.append(
            f"  {row['cells'][0]:4d} x {row['cells'][1]:<8d}{1e3 * row['height']:12.4f}{1e3 * row['limit']['field']:19.4f}"
            f"{1e3 * row['bifurcation']['field']:19.4f}   {row['first']}"
        )
    lines += [
        f"  extrapolated   {1e3 * study['height']['value']:12.4f}{1e3 * limit['value']:19.4f}{1e3 * bifurcation['value']:19.4f}",
        f"  error estimate {1e3 * study['height']['error']:12.4f}{1e3 * limit['error']:19.4f}{1e3 * bifurcation['error']:19.4f}",
        "",
        "Critical field",
        f"  computed, static            {1e3 * limit['value']:.3f} mT",
        f"  measured                    {1e3 * MEASURED_SNAP:.2f} mT while the field grows by 6.5 mT/s; "
        f"no snap at a constant {1e3 * NO_SNAP:.0f} mT",
        f"  beam theory, E = 3G         {1e3 * beam_theory()[1]:.3f} mT",
        f"  the same, wide plate E = 4G {1e3 * beam_theory(modulus=4 * SHEAR_MODULUS)[1]:.3f} mT",
        "",
        "From beam theory to the shell                       height [mm]   critical field [mT]",
    ]
    for what, height, field in result["differences"]["rows"]:
        lines.append(f"  {what:<48}{1e3 * height:13.3f}{1e3 * field:22.3f}")
    return "\n".join(lines)


if __name__ == "__main__":
    began = time.perf_counter()
    outcome = main()
    print(summary(outcome))
    out = Path("out")
    out.mkdir(exist_ok=True)
    plot(outcome).savefig(out / "bistable_beam.png", dpi=200)
    picture(outcome).save(out / "bistable_beam_states.png")
    print(f"\nPictures in {out}/; {time.perf_counter() - began:.0f} s in all.")
