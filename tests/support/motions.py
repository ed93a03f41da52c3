"""A short motion for tests that write or draw one."""

import numpy as np

import magshell as ms


def lifted_strip(mesh: ms.TriangleMesh, steps: int = 8, record_every: int = 1) -> ms.Trajectory:
    """Simulate a clamped strip, magnetized along itself, for 40 ms in a vertical field that grows to 4 mT."""
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    return ms.simulate(
        scene,
        steps=steps,
        time_step=0.04 / steps,
        remanent_magnetization=(4e4, 0, 0),
        applied_flux_density=np.linspace(0, 1, steps + 1)[:, None] * (0, 0, 4e-3),
        record_every=record_every,
    )
