"""Makes scenes in which two sheets touch."""

import magshell as ms

PLATE = ms.meshes.rectangle(0.02, 0.02, cells=(4, 4))
SOFT = {"thickness": 1e-3, "young_modulus": 1e6, "mass_density": 1e3}
DOWN = (0, 0, -9.81)


def above(height, mesh=PLATE, **changes) -> ms.Shell:
    """Build a sheet at a height, shifted sideways, so that no vertex is over another."""
    return ms.Shell(mesh.transformed(translation=(1e-3, 5e-4, height)), **{**SOFT, **changes})


def two_sheets(height=1.15e-3, rubbing=None, **contact):
    """Build two sheets: the lower one clamped at a side, the upper one pinned there, and heavy."""
    lower, upper = ms.Shell(PLATE, **SOFT), above(height)
    supports = [
        ms.Clamp(PLATE.edges_at(x=0.0), body=lower),
        ms.Pin(upper.mesh.vertices_at(x=1e-3), body=upper),
    ]
    touch = ms.Contact(lower, upper, friction_coefficient=rubbing, **contact)
    return ms.Scene(
        [lower, upper], supports=supports, contacts=[touch], gravity=DOWN, allow_rigid_motions=True
    )
