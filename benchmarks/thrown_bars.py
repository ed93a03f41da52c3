"""Cost of contact between two bars per time step: a table of `python -m benchmarks dynamics`."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import magshell as ms

from .ratios import note
from .report import print_table

CELLS, QUICK_CELLS = (24, 9, 2), (6, 3, 1)
TIME_STEP, STEPS, QUICK_STEPS = 1e-3, 10, 4
SPEED = 0.1  # [m/s] speed of the upper bar
ALLOWED = 0.4  # [-] largest fraction of a step's time that contact takes


def bars(cells: tuple[int, int, int], in_contact: bool) -> ms.Scene:
    """Return two bars of rubber, 10 cm x 4 cm x 1 cm, one within the activation distance of the other.

    The lower one is held at its bottom. in_contact: whether there is contact between them.
    """
    material = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.4)
    lower = ms.meshes.box((0.1, 0.04, 0.01), cells=cells)
    cell = 0.1 / cells[0]
    upper = lower.transformed(translation=(0.3 * cell, 0.2 * cell, 0.01 + 2e-4))
    pair = [ms.Solid(mesh, material=material, mass_density=1e3, element="linear") for mesh in (lower, upper)]
    held = ms.Pin(lower.vertices_at(z=lower.rest_positions[:, 2].min()), body=pair[0])
    contacts = [ms.Contact(*pair)] if in_contact else []
    return ms.Scene(pair, supports=[held], contacts=contacts, allow_rigid_motions=True)


def thrown(scene: ms.Scene, steps: int) -> ms.Trajectory:
    """Simulate the upper bar thrown at the lower one, in steps of implicit Euler."""
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[scene.mesh.n_vertices // 2 :, 2] = -SPEED
    return ms.simulate(
        scene,
        steps=steps,
        time_step=TIME_STEP,
        velocities=velocities,
        integrator=ms.ImplicitEuler(),
        progress=False,
    )


def without_contact(scene: ms.Scene, motion: ms.Trajectory) -> dict[str, Any]:
    """Return the counts for the steps of a motion repeated without contact, each from its own start.

    These differ from a free motion because bars vibrate after a collision.
    """
    steps = len(motion.positions) - 1
    counts = {"iterations": 0, "factorizations": 0}
    for positions, velocities in zip(motion.positions[:-1], motion.velocities[:-1], strict=True):
        one = ms.simulate(
            scene,
            steps=1,
            time_step=TIME_STEP,
            start=positions,
            velocities=velocities,
            integrator=ms.ImplicitEuler(),
            progress=False,
        )
        for name in counts:
            counts[name] += getattr(one, name) / steps
    return counts


def measure(rounds: int, quick: bool) -> dict[str, Any]:
    """Print the table of steps with contact and without.

    Returns {"touching", "free": {"step" [s], "iterations", "factorizations"}, "same states": the last two, "pairs",
    "share", "of iteration"}. A bar without contact moves on unchanged, in one iteration a step. So the fraction of contact
    is given for an iteration as well, and the counts of the same steps without contact.
    """
    cells, steps = (QUICK_CELLS, QUICK_STEPS) if quick else (CELLS, STEPS)
    results: dict = {}
    scenes = {name: bars(cells, name == "touching") for name in ("touching", "free")}
    tetrahedra = sum(body.mesh.n_tetrahedra for body in scenes["free"].bodies)
    for name, scene in scenes.items():
        best = np.inf
        for _ in range(rounds):
            began = time.process_time()
            motion = thrown(scene, steps)
            best = min(best, time.process_time() - began)
        results[name] = {
            "step": best / steps,
            "iterations": motion.iterations / steps,
            "factorizations": motion.factorizations / steps,
        }
        if name == "touching":
            contact = scene.contacts[0]
            results["pairs"] = max(len(motion.contact_state(contact, k).pairs) for k in range(steps + 1))
            results["same states"] = without_contact(scenes["free"], motion)
    over = results["touching"]["step"] / results["free"]["step"]
    results["share"] = 1.0 - 1.0 / over
    results["of iteration"] = 1.0 - results["touching"]["iterations"] / results["free"]["iterations"] / over
    missed = note(
        "share",
        f"two bars of {tetrahedra} tetrahedra: contact's of a step",
        results["share"],
        at_most=None if quick else ALLOWED,
    )
    note("share", f"two bars of {tetrahedra} tetrahedra: contact's of an iteration", results["of iteration"])
    print_table(
        f"Two bars of {tetrahedra} tetrahedra that collide, up to {results['pairs']} pairs: a step of implicit Euler",
        ["contact", "ms", "iterations", "factorizations", "contact's share", "of an iteration"],
        [
            [
                name,
                f"{1e3 * results[name]['step']:.2f}",
                f"{results[name]['iterations']:.1f}",
                f"{results[name]['factorizations']:.1f}",
                *shares,
            ]
            for name, shares in (
                (
                    "touching",
                    (f"{100 * results['share']:.0f} %{missed}", f"{100 * results['of iteration']:.0f} %"),
                ),
                ("free", ("", "")),
            )
        ]
        + [
            [
                "free, each step from the same state",
                "",
                f"{results['same states']['iterations']:.1f}",
                f"{results['same states']['factorizations']:.1f}",
                "",
                "",
            ]
        ],
    )
    return results
