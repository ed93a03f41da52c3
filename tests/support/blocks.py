"""Stiff free sheets that rest and slide on obstacles, for the tests of contact, friction and water."""

import numpy as np

import magshell as ms

GRAVITY = 9.8  # m/s2, as in the published set-ups of F1
STIFFNESS = 1e4  # N/m, of every point
STICKING = 1e-5  # m/s


def block_sheet(cells=(2, 2), side=0.02, young_modulus=1e9) -> ms.Shell:
    mesh = ms.meshes.rectangle(side, side, cells=cells)
    return ms.Shell(mesh, thickness=2e-3, young_modulus=young_modulus, mass_density=1e3)


def smoothing_of(sheet: ms.Shell) -> float:
    """Return the default smoothing of a Contact, m."""
    return 1e-2 * float(sheet.thickness.mean())


def depth_under(force, smoothing: float, stiffness: float = STIFFNESS):
    """Return the penetration depth of a point under a force [N], m: the inverse of the documented law."""
    soft = np.asarray(force) / stiffness
    return np.where(soft < 0.5 * smoothing, np.sqrt(2.0 * smoothing * soft), soft + 0.5 * smoothing)


def force_at(depth, smoothing: float, stiffness: float = STIFFNESS):
    """Return the normal force [N] at a depth [m], zero where that is negative: d^2 / (2 s), from d = s on d - s / 2."""
    deep = np.maximum(depth, 0.0)
    return stiffness * np.where(deep < smoothing, deep**2 / (2.0 * smoothing), deep - 0.5 * smoothing)


def resting_on_plane(sheet: ms.Shell, normal_gravity: float = GRAVITY) -> np.ndarray:
    """Return the equilibrium positions of a sheet on the plane z = 0, found by long steps of a dissipative method."""
    level = block_on(ms.obstacles.Plane(), sheet=sheet, gravity=(0, 0, -normal_gravity))
    start = np.array(sheet.mesh.rest_positions)
    start[:, 2] -= depth_under(sheet.vertex_masses.mean() * normal_gravity, smoothing_of(sheet))
    return simulated(level, 6, 1.0, start=start).positions[-1]


def block_on(obstacle, friction=None, *, gravity=(0, 0, -GRAVITY), sheet=None, **contact) -> ms.Scene:
    """Build a scene of a free block and one obstacle."""
    touching = ms.Contact(
        obstacle,
        **{
            "friction_coefficient": friction,
            "contact_stiffness": STIFFNESS,
            "sticking_speed": STICKING,
            **contact,
        },
    )
    return ms.Scene(sheet or block_sheet(), contacts=[touching], gravity=gravity, allow_rigid_motions=True)


def simulated(scene: ms.Scene, steps: int, time_step: float, **options) -> ms.Trajectory:
    return ms.simulate(
        scene,
        steps=steps,
        time_step=time_step,
        **{"integrator": ms.ImplicitEuler(), "progress": False, **options},
    )


def weight_of(sheet: ms.Shell) -> float:
    """Return the weight of a sheet, N."""
    return float(sheet.vertex_masses.sum() * GRAVITY)
