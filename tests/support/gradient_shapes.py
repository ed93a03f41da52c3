"""Rest positions of scenes in which vertices cannot move alone: welded ones, periodic images, those in symmetry planes."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")


def is_bound(scene: ms.Scene) -> bool:
    """Return whether some rest positions of the scene determine others, or lie in a plane."""
    return bool(scene.ties) or any(
        isinstance(each, ms.Periodic | ms.SymmetryPlane) for each in scene.supports
    )


class BoundShape:
    """The rest positions of all bodies of a scene as one input, (n_v, 3) m, of which any values are admissible.

    Moves of welded vertices and of periodic images are those of one of them; moves in symmetry planes are without their
    normal component.
    """

    def __init__(self, scene: ms.Scene):
        self._scene = scene
        self._start = np.array(scene.mesh.rest_positions)
        self._leader = np.arange(len(self._start))
        for tie in scene.ties:
            rows = [self._rows(body) for body in (tie.a, tie.b)]
            for one, other in tie.pairs():
                leader, led = (self._leader[of[each]] for of, each in zip(rows, (one, other), strict=True))
                self._leader[self._leader == led] = leader
        for support in scene.supports:
            if isinstance(support, ms.Periodic):
                span = scene._bodies.of(support)
                own, image = self._leader[span.vertices][support._pairs(span.mesh)].T
                self._leader[image] = own
        self._free = np.tile(np.eye(3), (len(self._start), 1, 1))
        for plane in scene.supports:
            if isinstance(plane, ms.SymmetryPlane):
                height = (self._start - plane.point) @ plane.normal
                self._free[np.abs(height) < 1e-9] = np.eye(3) - np.outer(plane.normal, plane.normal)

    def _rows(self, body) -> np.ndarray:
        span = self._scene._bodies.spans[self._scene._bodies.number(body)]
        return np.arange(len(self._start))[span.vertices]

    def bodies(self, value) -> dict:
        """Return the rest positions of each body from those of all, an array or a tensor."""
        library = torch if torch.is_tensor(value) else np
        start, free = (library.asarray(each) for each in (self._start, self._free))
        rest = start + library.einsum("nij,nj->ni", free, (value - start)[self._leader])
        return {body: rest[self._rows(body)] for body in self._scene.bodies}
