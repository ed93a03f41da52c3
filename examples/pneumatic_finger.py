"""A soft finger with a channel of air above its middle bends when that is blown up: pressure against bending angle.

A bar of 48 x 12 x 16 mm of silicone (60 kPa), held at one end, with a closed channel of 40 x 4 x 4 mm in its upper half, an
ms.Cavity: ms.follow_path follows it up to 14 kPa. Then the same finger with its channel closed off, blown up by
the air that is let in: as much as it takes is a value of the cavity too, and the pressure is what comes out.

What comes out:

- The finger bends away from its channel, by 6.8 degrees, faster and faster: the channel's cross-section grows, and with it
  what the same pressure does. At half the pressure the angle is a sixth. At 17.3 kPa is the largest pressure it can hold.
- Air that would press with 13.7 kPa in the channel at rest (115 kPa absolute) does so with 1.9 kPa once it has room.

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _run import run

import magshell as ms

SIZE = (48e-3, 12e-3, 16e-3)  # m
CELLS = (12, 3, 4)
PRESSURE = 14e3  # Pa
FILLED = 115e3  # Pa, absolute


def finger() -> ms.Solid:
    """Build the bar without the tetrahedra of its channel."""
    box = ms.meshes.box(SIZE, cells=CELLS)
    cell = np.array(SIZE) / CELLS
    at = np.floor(box.tetrahedron_barycenters / cell).astype(int)
    channel = (at[:, 0] > 0) & (at[:, 0] < CELLS[0] - 1) & (at[:, 1] == 1) & (at[:, 2] == 2)
    kept, numbered = np.unique(box.tetrahedra[~channel], return_inverse=True)
    mesh = ms.TetMesh(box.rest_positions[kept], numbered.reshape(-1, 4))
    silicone = ms.NeoHookean(young_modulus=60e3, poisson_ratio=0.45)
    return ms.Solid(mesh, material=silicone)


def bending_angle(solid: ms.Solid, positions: np.ndarray) -> np.ndarray:
    """Return the rotation of the plane of the free end, (...) rad, positive downwards."""
    x = solid.mesh.rest_positions
    end = np.flatnonzero(x[:, 0] > SIZE[0] - 1e-9)
    up = positions[..., end[x[end, 2] > SIZE[2] - 1e-9], :].mean(axis=-2)
    down = positions[..., end[x[end, 2] < 1e-9], :].mean(axis=-2)
    return np.arctan2(up[..., 0] - down[..., 0], up[..., 2] - down[..., 2])


def main() -> dict:
    """Return pressures (n,) Pa, angles (n,) rad and volumes (n,) m3 along the path, and of the finger filled with
    air.
    """
    solid = finger()
    root = [ms.Pin(solid.mesh.vertices_at(x=0.0))]
    channel = ms.Cavity(solid, pressure=PRESSURE)
    scene = ms.Scene(solid, supports=root, actuators=[channel])
    path = ms.follow_path(scene, max_step=0.05, progress=False)
    air = ms.Cavity(solid, gas_pressure=FILLED)
    filled = ms.equilibrium(ms.Scene(solid, supports=root, actuators=[air]))
    return {
        "solid": solid,
        "path": path,
        "pressures": path[channel].pressure,
        "volumes": path[channel].volume,
        "angles": bending_angle(solid, path.positions),
        "air": {
            "pressure": float(filled[air].pressure),
            "volume": float(filled[air].volume),
            "angle": float(bending_angle(solid, np.asarray(filled.positions))),
        },
    }


def plot(result: dict):
    """Draw the finger at rest, at half and at full pressure, and its angle over the pressure."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.4), layout="constrained")
    shapes, curve = figure.subplots(1, 2, width_ratios=(1.3, 1))
    solid, path = result["solid"], result["path"]
    edges = solid.mesh.faces
    side = np.abs(solid.mesh.rest_positions[edges][:, :, 1] - 0.0).max(axis=1) < 1e-9
    for index, shade in ((0, "0.8"), (len(path) // 2, "0.55"), (len(path) - 1, "#b04a2f")):
        x = 1e3 * np.asarray(path.positions[index])
        shapes.triplot(x[:, 0], x[:, 2], edges[side], color=shade, linewidth=0.6)
    shapes.set(xlabel="x, mm", ylabel="z, mm", aspect="equal")
    curve.plot(1e-3 * result["pressures"], np.degrees(result["angles"]), color="#b04a2f")
    air = result["air"]
    curve.plot(
        1e-3 * air["pressure"], np.degrees(air["angle"]), "o", color="0.3", label="filled with air, closed"
    )
    curve.set(xlabel="pressure, kPa", ylabel="bending angle, degrees")
    curve.legend(frameon=False)
    return figure


def summary(result: dict) -> str:
    angles, air = np.degrees(result["angles"]), result["air"]
    return (
        f"{result['solid'].mesh.n_tetrahedra} tetrahedra; {len(angles)} points of the path\n"
        f"bent by {angles[-1]:.1f} degrees at {1e-3 * result['pressures'][-1]:.0f} kPa, "
        f"the channel {result['volumes'][-1] / result['volumes'][0]:.2f} times as large\n"
        f"filled at {1e-3 * FILLED:.0f} kPa: {1e-3 * air['pressure']:.2f} kPa over the outside, "
        f"{np.degrees(air['angle']):.1f} degrees"
    )


def write(result: dict, folder: Path) -> None:
    plot(result).savefig(folder / "pneumatic_finger.png", dpi=150)


if __name__ == "__main__":
    run(main, summary, write)
