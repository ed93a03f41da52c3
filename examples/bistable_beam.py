"""A buckled hard-magnetic beam snaps through in a transverse field: the experiment of Tan et al.

A strip of 120.47 x 20 x 2.5 mm, its two halves magnetized against each other along its length, is clamped
at both ends. The clamps are moved together by 0.47 mm, so it buckles and has two states. A transverse
field B pushes one through to the other: with the magnetization M_r of the halves it acts like a force of
2 M_r B (width x thickness) at mid-span.

What comes out (Young's modulus 3G, Poisson's ratio 1/2, extrapolated from four meshes): the buckled beam
stands 3.68 mm high and loses its stability at 5.51 mT, at a limit point; the antisymmetric bifurcation
lies just behind it, on the unstable part of the path (coarse meshes exchange the two). The experiment
snaps at 6.26 mT in a ramp and does not at a constant 5 mT. Its displacement follows the computed one to
the limit point; the 0.1 s that it then takes to leave, while the field goes on growing, are for dynamics
to explain.

Beam theory says 3.82 mm and 5.76 mT. `differences` takes the steps from the one to the other one at a
time:

- That theory is not an inextensible one, which would say 4.79 mm and 11.35 mT: compression by the axial
  force takes 0.35 of the 0.47 mm at the critical field. Bending has the remaining 0.12 mm, so that small
  changes count for much: a shortening 1 % larger raises the critical field by 2.5 %.
- Without Poisson's effect, and scaled to small slopes and strains, the shell is the beam, to 0.05 %. At
  its true slopes of 0.1 it stands 0.2 % lower and snaps 0.6 % earlier.
- The rest, 3 to 4 % in height and field, is Poisson's effect in a sheet of some width: a strip a quarter
  as wide has a sixth of the loss in height, and none to speak of in field. Clamps that let the sheet
  neither bend sideways nor widen stiffen it more in bending than in compression: straight, it buckles
  only when shortened by 7 % more. Beam theory with a bending stiffness larger by these 7 % has less of
  the shortening left to bend with, and gives a *lower* field, 5.50 mT, with half of the loss in height.

Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _bistable.measurements import measured_ramp
from _bistable.model import HIGHEST_FIELD, Beam, beam, buckled
from _bistable.report import draw_convergence, draw_path, summary
from _bistable.studies import MESHES, convergence, differences
from _run import run

import magshell as ms


def main(cells=(96, 16), meshes=MESHES) -> dict:
    """Return the figure's numbers, in SI units; displacements are from the buckled state towards the other side."""
    sheet = beam(cells)
    start = buckled(sheet)
    height = sheet.height(start.positions)
    # Up to the critical field, back over unstable states to the other side, on to the end of the ramp.
    path = sheet.follow(HIGHEST_FIELD, start=start, max_step=0.001, min_parameter=-1.0)
    first = path.critical[0]
    critical_field = HIGHEST_FIELD * first.parameter
    curve = sections(sheet, path, HIGHEST_FIELD, height)

    # The beam does not follow the unstable path: just past the critical field it snaps to the other side.
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


def sections(sheet: Beam, path: ms.EquilibriumPath, field: float, height: float) -> list[dict]:
    """Return the path cut at its first and last critical points: fields [T], displacements [m], and whether it is
    stable.
    """
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


def plot(result: dict):
    """Draw displacement against field with the measured ramp, and the critical field against the cell size."""
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), width_ratios=(2.1, 1), layout="constrained")
    draw_path(left, result)
    draw_convergence(right, result["convergence"])
    for axes, letter in ((left, "a"), (right, "b")):
        axes.set_title(letter, loc="left", fontweight="bold")
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def picture(result: dict) -> ms.Picture:
    """Draw the beam buckled, at its critical field, and after the snap, with its magnetization and the field."""
    sheet, states = beam(result["cells"]), result["states"]
    return ms.plot(
        sheet.scene.mesh,
        positions=states["positions"],
        remanent_magnetization=sheet.remanent_magnetization,
        applied_flux_density=[(0, 0, field) for field in states["fields"]],
        titles=["buckled", "at the critical field", "after the snap"],
        view=(14, -86),
        columns=1,
    )


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "bistable_beam.png", dpi=200)
    picture(outcome).save(out / "bistable_beam_states.png")


if __name__ == "__main__":
    run(main, summary, write)
