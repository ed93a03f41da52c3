"""Growth of the cost of skeletons with their links, and the cost they add to a solid: a part of `python -m benchmarks
scaling`."""

from __future__ import annotations

from typing import Any

import numpy as np

import magshell as ms

from .ratios import note
from .report import print_table
from .solid_motions import beam, drive
from .timing import clocked

LINKS = (25, 50, 100, 200)
QUICK_LINKS = (5, 10)
CELLS, QUICK_CELLS = (15, 6, 6), (8, 4, 4)  # 3240 tetrahedra
BONES = 6
ALLOWED_TWISTS = 1e-4  # [s] largest time of B for a chain of 100 links
ALLOWED_SHARE = 1.3  # [-] largest time of an iteration with bones over one without
ALLOWED_EXPONENT = 1.2  # [-] largest exponent of the time of B against the sum of depths
STEPS = 3


def tree(links: int, children: int) -> ms.Scene:
    """Return rods on hinges, each on an earlier one; with one child each they form a chain."""
    length, made, joints = 0.05, [], []
    for k in range(links):
        parent = (k - 1) // children if k else -1
        start = np.zeros(3) if k == 0 else np.add(made[parent].center, (length / 2, 0, 0))
        start = np.add(start, (0, 0.3 * length * (k % children), 0))
        made.append(ms.Link(mass=0.01, inertia=1e-5, center=np.add(start, (length / 2, 0, 0))))
        axis = np.roll([0.0, 1.0, 0.2], k % 2)
        before = None if k == 0 else made[parent]
        joints.append(ms.Revolute(made[k], before, origin=start, axis=axis, spring_stiffness=1.0))
    return ms.Scene(ms.Skeleton(made, joints), gravity=(0, 0, -9.81))


def fleshed(cells: tuple[int, int, int]) -> ms.Scene:
    """Return the beam with bones on hinges along its middle."""
    bare = beam(cells)
    solid = bare.bodies[0]
    at = solid.mesh.rest_positions
    low, high = at.min(axis=0), at.max(axis=0)
    inside = np.abs(at[:, 1:] - (low + high)[1:] / 2).max(axis=1) < 0.26 * (high - low)[1]
    edges = np.linspace(low[0] + 0.1 * (high - low)[0], high[0] + 1e-9, BONES + 1)
    middle = (low + high) / 2
    links, joints = [], []
    for k in range(BONES):
        own = np.flatnonzero(inside & (at[:, 0] >= edges[k]) & (at[:, 0] < edges[k + 1]))
        links.append(ms.Link(own, body=solid))
        if k:
            origin = (edges[k], middle[1], middle[2])
            joints.append(ms.Revolute(links[k], links[k - 1], origin=origin, axis=(0, 1, 0)))
    return ms.Scene(
        [solid, ms.Skeleton(links, joints)],
        supports=bare.supports,
        field=ms.UniformField(),
        gravity=(0, 0, -9.81),
    )


def measure(rounds: int, quick: bool) -> dict[str, Any]:
    """Print the tables and return their numbers, on one thread."""
    threads = ms.num_threads()
    ms.set_num_threads(1)
    try:
        trees = {
            name: [_costs(links, children, rounds) for links in (QUICK_LINKS if quick else LINKS)]
            for name, children in (("chain", 1), ("binary", 2))
        }
        ratio = _ratio_with_skeleton(QUICK_CELLS if quick else CELLS, rounds)
    finally:
        ms.set_num_threads(threads)
    _print(trees, ratio, quick)
    return {"trees": trees, "share of bones": ratio}


def _costs(links: int, children: int, rounds: int) -> dict[str, Any]:
    scene = tree(links, children)
    model, load_parameters = scene._model, scene._load_parameter_layout.zeros()
    state = model.rest_state()
    step = clocked(lambda: _swing(scene), rounds=rounds).processor
    return {
        "links": links,
        "pairs": sum(_depth(k, children) for k in range(links)),
        "twists": clocked(lambda: model.linearize(state), rounds=rounds).processor,
        "matrix": clocked(lambda: model.hessian(state, load_parameters), rounds=rounds).processor,
        "iteration": step / _swing(scene).iterations,
    }


def _depth(link: int, children: int) -> int:
    depth = 1
    while link:
        link, depth = (link - 1) // children, depth + 1
    return depth


def _swing(scene: ms.Scene):
    return ms.simulate(
        scene,
        steps=STEPS,
        time_step=1e-3,
        integrator=ms.ImplicitEuler(),
        progress=False,
    )


def _ratio_with_skeleton(cells: tuple[int, int, int], rounds: int) -> float:
    """Measure an iteration of a step with bones over one without, from the best of alternating rounds."""
    scenes = beam(cells), fleshed(cells)
    best = [np.inf, np.inf]
    for _ in range(rounds + 1):
        for k, scene in enumerate(scenes):
            count = drive(scene, STEPS).iterations
            best[k] = min(best[k], clocked(lambda s=scene: drive(s, STEPS), rounds=1).processor / count)
    return best[1] / best[0]


def _print(trees: dict[str, Any], ratio: float, quick: bool) -> None:
    rows = [
        [
            name,
            f"{size['links']}",
            f"{size['pairs']}",
            *(f"{1e3 * size[key]:.3f}" for key in ("twists", "matrix", "iteration")),
        ]
        for name, sizes in trees.items()
        for size in sizes
    ]
    print_table(
        "Skeletons: milliseconds on one thread",
        ["tree", "links", "sum of depths", "B", "Hessian", "iteration"],
        rows,
    )
    for name, sizes in trees.items():
        first, last = sizes[0], sizes[-1]
        exponent = float(np.log(last["twists"] / first["twists"]) / np.log(last["pairs"] / first["pairs"]))
        missed = note(
            "share", f"exponent of B, {name}", exponent, at_most=None if quick else ALLOWED_EXPONENT
        )
        print(f"  B of a {name} grows with the sum of depths to the {exponent:.2f}{missed}")
        for size in sizes:
            note(
                "share",
                f"B over an iteration, a {name} of {size['links']} links",
                size["twists"] / size["iteration"],
            )
            if size["links"] == 100:
                missed = "" if size["twists"] <= ALLOWED_TWISTS else " MISSED"
                print(
                    f"  B of a {name} of 100 links takes {1e3 * size['twists']:.3f} ms (at most 0.1){missed}"
                )
    missed = note(
        "share", "an iteration with bones over one without", ratio, at_most=None if quick else ALLOWED_SHARE
    )
    print(
        f"  six bones in a solid: {ratio:.2f} times the iteration without (at most {ALLOWED_SHARE}){missed}"
    )
