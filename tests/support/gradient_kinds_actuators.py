"""Kinds of scene with cavities, cells and tendons, for gradient_kinds.py."""

import numpy as np
from actuated import box_sheet, hollow_block
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms

PATH = [(0.001, 0.004, 0.028), (0.012, 0.012, 0.022), (0.022, 0.009, 0.012), (0.029, 0.02, 0.004)]


def _actuated() -> tuple[list, list, list]:
    """Return bodies, supports and actuators: a hollow block with all kinds of actuators, and a box of a sheet with
    liquid.
    """
    block, box = hollow_block(), box_sheet(size=0.03, thickness=1e-3)
    tetrahedra = np.arange(block.mesh.n_tetrahedra)
    pins = [ms.Pin(body.mesh.vertices_at(z=0.0), body=body) for body in (block, box)]
    actuators = [
        ms.Cavity(block, gas_pressure=1.2e5),
        ms.Cavity(block, pressure=3e3),
        ms.Cavity(box, volume=2.9e-5, bulk_modulus=2e4),
        ms.PneumaticCells(
            block, [tetrahedra[:90], tetrahedra[90:120]], stiffness=5e4, volume_ratio=[1.1, 0.9]
        ),
        ms.PneumaticCells(block, [tetrahedra[3:5]], stiffness=[4e4], volume_ratio=1.2),
        ms.Tendon(PATH, block, tension=0.4, stiffness=60.0, rest_length=0.03),
        ms.Tendon(
            PATH[1:], block, tension=0.1, stiffness=40.0, rest_length=0.02, sliding=False, smoothing=4e-3
        ),
    ]
    return [block, box], pins, actuators


def actuated_at_rest() -> Kind:
    bodies, pins, actuators = _actuated()
    scene = ms.Scene(bodies, supports=pins, actuators=actuators, gravity=(0.2, 0.1, -9.81))
    return Kind(scene, {"load_factor": 0.9, "gravity_factor": 1.1}, fixed=EXACT, reach=REACH)


def actuated_in_motion(integrator, **options) -> Kind:
    """Build a motion in which all of their numbers change, those of groups of cells independently."""
    bodies, pins, actuators = _actuated()
    scene = ms.Scene(bodies, supports=pins, actuators=actuators)
    fixed = {"steps": 3, "integrator": integrator, "progress": False, **EXACT, **options}
    inputs = {"time_step": 1e-3, "load_factor": np.linspace(0.5, 1.0, 4)}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach=REACH, in_time=3)
