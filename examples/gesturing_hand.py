"""Hands whose magnetized skin makes gestures in one vertical field, after [Chen22] section 6.4 and Figure 14.

A soft hand (neo-Hookean, Y = 1 MPa, nu = 0.45) with a magnetized skin stands on its wrist in 50 mT along z. Which
magnetization of its skin makes it point, show a V, or bow index and thumb as if to pinch? It is found by gradient, from
none, so that anchors on every finger come to where the gesture has them.

Three designs of each gesture, all with three numbers a face of the four-node mesh:

    linear                       the paper's element and about its 4975 tetrahedra: as much work
    linear, the paper's faces    about its 3320 faces: as many places to magnetize; 12,000 tetrahedra here, where the
                                 mesh has nodes inside, which the paper's has not
    quadratic                    ten-node tetrahedra, of the first mesh

and what the first and the last do on a converged mesh, quadratic and finer. A finger has two tetrahedra through it, and
with four nodes each it is too stiff, so that a design found with them overshoots in a hand that bends as the material does:
of 7 to 12 mm (rms) to go, anchors miss by 1.0 to 1.3 mm where they were designed and by 2.3 to 3.2 mm there; with the
design of quadratic elements by 0.8 to 0.9, and there by 0.9 to 1.1 mm.

What the paper does not say, and is chosen here: the shape (a signed distance) and its size, 6 cm; the gestures; a bound on
the magnetization (the paper has none), 300 kA/m, as in dense composites of NdFeB. Fingers curl to 95 degrees and less: a
torque spread evenly along a finger bends it most at the knuckle, and the targets are bent so. A field along z turns nothing
about z, so that the thumb, which leans, cannot fold over the palm without twisting: it misses most. Fingers do not feel
each other here.

Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _hand.design import Body, designed, on
from _hand.gestures import GESTURES
from _hand.report import draw_convergence, draw_hands, summary
from _run import run

import magshell as ms

N_TETRAHEDRA = 4975  # [Chen22] Table 1
OF_ITS_FACES = 12_000  # tetrahedra of a mesh with about its 3320 faces
CONVERGED = 8000


def main(
    gestures=tuple(GESTURES),
    n_tetrahedra: int = N_TETRAHEDRA,
    of_its_faces: int = OF_ITS_FACES,
    converged: int = CONVERGED,
    iterations=(40, 25),
    progress: bool = False,
) -> dict:
    """Return the designs of every gesture.

    {gesture: {"designs": {name: Design}, "converged": {name: State}, "way": rms distance from the reference shape to
    the targets, m}}. iterations: with linear and with quadratic elements.
    """
    coarse, fine = Body(n_tetrahedra, "linear"), Body(of_its_faces, "linear")
    quadratic, reference = Body(n_tetrahedra, "quadratic"), Body(converged, "quadratic")
    result = {}
    for gesture in gestures:
        designs = {
            "linear": designed(coarse, gesture, iterations[0], progress),
            "linear, the paper's faces": designed(fine, gesture, iterations[0], progress),
            "quadratic": designed(quadratic, gesture, iterations[1], progress),
        }
        anchors = coarse.anchors(gesture)
        way = coarse.solid.mesh.rest_positions[anchors.vertices] - anchors.targets
        result[gesture] = {
            "designs": designs,
            "converged": {name: on(reference, designs[name]) for name in ("linear", "quadratic")},
            "way": float(np.sqrt((way**2).sum(axis=1).mean())),
        }
    return result


def plot(result: dict):
    """Draw the distance of the anchors from their targets, against iterations and time."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), sharey=True, layout="constrained")
    draw_convergence(axes, result)
    return figure


def hands(result: dict):
    """Draw the magnetization of the skin, and the gestures with anchors and targets, as in [Chen22] Figure 14."""
    return draw_hands(result)


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "gesturing_hand_convergence.png", dpi=200)
    ms.Picture(hands(outcome)).save(out / "gesturing_hand.png", dpi=200)


if __name__ == "__main__":
    run(lambda: main(progress=True), summary, write)
