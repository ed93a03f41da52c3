"""An arm of a gripper whose outline and magnetization are found together, beside each of them found alone.

Four arms of 20 mm, 0.4 mm thick, leave a hub that is held. A uniform field along -z bends them down around an object, which
pulls the end of each arm up with 50 uN. One arm is computed, as the others are its images. It is to close as far as it can:
the objective is the height of its end. An arm has at most the area of the straight arm at the start, 4 mm wide.

Two things are free: half of the width at the clamp and at four stations along the arm (the end keeps 2 mm), and the
direction of the remanent magnetization of 60 kA/m at six stations, in the plane of bending. `ms.parametrize.MeshedOutline`
moves the border with the widths, and meshes the arm anew when a face is stretched by more than 1.5. The direction belongs to
the material: it is given on the faces of the first mesh.

What comes out: of three searches by MMA with the same number of solves from the same start, that of both closes most. Its
end sinks by 18.1 mm, by 15.5 mm with the outline alone, 14.1 mm with the magnetization alone, and 10.5 mm with neither. The
arm gets a narrow neck at its root, and its width behind that, where the torque of the field has a long way to act. There the
magnetization leans back, so that it is still across the field where the arm has turned far.

Needs the extra `gmsh`. Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from _run import run

import magshell as ms

LENGTH, WIDTH, THICKNESS = 20e-3, 4e-3, 0.4e-3  # m; the width of the straight arm
END = 2e-3  # m, the width of the end
YOUNG_MODULUS = 1e6  # Pa
MAGNETIZATION = 6e4  # A/m
FLUX_DENSITY = 2e-3  # T
PULL = 50e-6  # N, on the end of an arm
STATIONS = 6  # from the clamp to the end
NARROWEST, WIDEST = 1.2e-3, 8e-3  # m
SIZE = 1e-3  # m, of faces
STRAIGHT, BLUE, RED, GREEN = "#777777", "#20639b", "#c8442d", "#3a8a4d"


class Arm:
    """An arm with a border by its widths, and a magnetization by its angles at stations. size: of faces, m."""

    def __init__(self, size: float):
        self.stations = np.linspace(0.0, LENGTH, STATIONS)
        start = self.corners(self.widths(torch.zeros(STATIONS - 1, dtype=torch.float64))).numpy()
        self.meshes = []
        self.outline = ms.parametrize.MeshedOutline(
            ms.parametrize.Polygon(start),
            size=size,
            most_stretch=1.5,
            on_remesh=lambda before, after: self.meshes.append((before, after)),
        )
        along = self.outline.first_mesh.face_barycenters[:, 0] / LENGTH * (STATIONS - 1)
        self.between = torch.tensor(np.clip(1.0 - np.abs(along[:, None] - np.arange(STATIONS)), 0.0, None))

    def widths(self, changes: torch.Tensor) -> torch.Tensor:
        """Return the widths at all stations, (STATIONS,) m, from their relative changes; the end keeps its own."""
        return torch.cat([WIDTH * (1.0 + changes), changes.new_full((1,), END)])

    def corners(self, widths: torch.Tensor) -> torch.Tensor:
        """Return the corners of the border counter-clockwise from the clamp, (2 STATIONS, 2) m."""
        along = torch.tensor(self.stations)
        right = torch.stack([along, -0.5 * widths], dim=1)
        return torch.cat([right, (right * torch.tensor([1.0, -1.0])).flip(0)])

    def area(self, widths: torch.Tensor) -> torch.Tensor:
        """Return the area of the arm, m2."""
        return 0.5 * (widths[1:] + widths[:-1]).sum() * LENGTH / (STATIONS - 1)

    def magnetization(self, angles: torch.Tensor) -> torch.Tensor:
        """Return the magnetization of each face of the first mesh, (n_f, 3) A/m, from angles to the arm at stations, rad."""
        angle = self.between @ angles
        return MAGNETIZATION * torch.stack([angle.cos(), torch.zeros_like(angle), angle.sin()], dim=1)

    def closed(self, widths: torch.Tensor, angles: torch.Tensor, strength: float = 1.0) -> ms.Equilibrium:
        """Return the equilibrium in the field, with the pull on the end. strength: share of both."""
        outline = self.outline
        rest = outline.positions([self.corners(widths)])
        end = outline.mesh.edges_in(f"border 0 side {STATIONS - 1}")
        sheet = ms.Shell(outline.mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS)
        scene = ms.Scene(
            sheet,
            supports=[ms.Clamp(outline.mesh.edges_in(f"border 0 side {2 * STATIONS - 1}"))],
            loads=[ms.EdgeLoad(end, (0, 0, PULL / END))],
            field=ms.UniformField(),
        )
        values = {
            "rest_positions": rest,
            "remanent_magnetization": outline.transferred(self.magnetization(angles)),
        }
        return ms.equilibrium(
            scene,
            applied_flux_density=(0, 0, -strength * FLUX_DENSITY),
            load_factor=strength,
            values={sheet: values},
            progress=False,
        )

    def height(self, rest: ms.Equilibrium) -> torch.Tensor:
        """Return the height of the end of the arm, m."""
        end = self.outline.mesh.vertices_in(f"border 0 side {STATIONS - 1}")
        return rest.positions[end, 2].mean()


def main(size=SIZE, solves=30) -> dict:
    """Return the designs and the heights of their ends, in SI units. solves: of each search."""
    chosen = {
        "straight": (False, False, 1),
        "outline alone": (True, False, solves),
        "magnetization alone": (False, True, solves),
        "both": (True, True, solves),
    }
    return {"designs": {name: search(Arm(size), *options) for name, options in chosen.items()}}


def search(arm: Arm, outline: bool, magnetization: bool, solves: int) -> dict:
    """Search the widths, or the directions of the magnetization, or both, with so many solves; return the best design."""
    changes = torch.zeros(STATIONS - 1, dtype=torch.float64)
    angles = torch.zeros(STATIONS, dtype=torch.float64)
    most = float(arm.area(arm.widths(changes)))
    heights = []

    def objective(*_):
        widths = arm.widths(changes)
        height = arm.height(arm.closed(widths, angles))
        heights.append(float(height.detach()))
        excess = (arm.area(widths) / most - 1.0)[None]
        return 1e3 * height, excess if outline else torch.zeros(0, dtype=torch.float64)

    free = [changes] * outline + [angles] * magnetization
    for each in free:
        each.requires_grad_()
    if free:
        lower = [NARROWEST / WIDTH - 1.0] * outline + [-0.5 * np.pi] * magnetization
        upper = [WIDEST / WIDTH - 1.0] * outline + [np.pi] * magnetization
        optimizer = ms.optim.MMA(free, lower=lower, upper=upper, move=0.1)
        ms.minimize(objective, free, optimizer, max_iterations=solves - 1, feasibility=1e-4, progress=False)
    with torch.no_grad():
        widths = arm.widths(changes)
        rest = arm.closed(widths, angles)
        return {
            "height": float(arm.height(rest)),
            "heights": np.array(heights),
            "widths": widths.numpy(),
            "angles": angles.numpy(),
            "area": float(arm.area(widths)),
            "most_area": most,
            "mesh": rest.scene.mesh,
            "magnetization": arm.outline.transferred(arm.magnetization(angles)).numpy(),
            "positions": np.asarray(rest.positions),
            "n_meshes": arm.outline.n_meshes,
            "meshes": arm.meshes,
        }


def summary(result: dict) -> str:
    """Return the summary that is printed."""
    faces = result["designs"]["straight"]["mesh"].n_faces
    lines = [f"An arm of {1e3 * LENGTH:.0f} mm with {faces} faces. Its end stands at"]
    for name, design in result["designs"].items():
        lines.append(
            f"  {1e3 * design['height']:7.3f} mm: {name:<20} ({len(design['heights'])} solves, {design['n_meshes']} meshes, "
            f"{100 * design['area'] / design['most_area']:.1f} % of the area)"
        )
    both = result["designs"]["both"]
    lines.append(
        "Widths of the best one [mm]:            " + " ".join(f"{1e3 * w:6.2f}" for w in both["widths"])
    )
    lines.append(
        "Directions of its magnetization [deg]:  " + " ".join(f"{a:6.1f}" for a in np.degrees(both["angles"]))
    )
    return "\n".join(lines)


def plot(result: dict):
    """Draw the outlines with their magnetization, and the closed arms from the side."""
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    colors = dict(zip(result["designs"], (STRAIGHT, BLUE, GREEN, RED), strict=True))
    for row, (name, design) in enumerate(result["designs"].items()):
        x, y, _ = 1e3 * design["mesh"].rest_positions.T
        left.triplot(x, y - 9.0 * row, design["mesh"].faces, color=colors[name], lw=0.4)
        left.text(25.0, -9.0 * row, name, color=colors[name], va="center")
        at = np.linspace(0.0, 1e3 * LENGTH, STATIONS)
        left.quiver(
            at,
            np.full(STATIONS, -9.0 * row),
            np.cos(design["angles"]),
            np.sin(design["angles"]),
            color="black",
            width=0.004,
            scale=14,
        )
        place = 1e3 * design["positions"]
        right.triplot(place[:, 0], place[:, 2], design["mesh"].faces, color=colors[name], lw=0.8)
        right.plot([], [], color=colors[name], label=f"{name}: {1e3 * design['height']:.2f} mm")
    left.set(aspect="equal", xlim=(-2, 46), xlabel="x [mm]", yticks=[])
    left.set_title("outlines; arrows: magnetization, in the plane of bending", fontsize=9)
    right.set(aspect="equal", xlim=(-1.0, 36.0), xlabel="x [mm]", ylabel="height [mm]")
    right.legend(frameon=False, fontsize=8, loc="upper right")
    return figure


def write(result: dict, out: Path) -> None:
    """Write the pictures: the designs, and the meshes before and after each new mesh of the search of both."""
    ms.Picture(plot(result)).save(out / "gripper_outline.png", dpi=150)
    for number, (before, after) in enumerate(result["designs"]["both"]["meshes"]):
        ms.plot(before).save(out / f"gripper_outline_{number}_before.png")
        ms.plot(after).save(out / f"gripper_outline_{number}_after.png")


if __name__ == "__main__":
    run(main, summary, write)
