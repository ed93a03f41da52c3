"""Warns if faces with an angle near 180 degrees make a bent sheet too stiff (membrane locking).

Such a face, a cap, of height H stands on an edge of length b. If the sheet bends with curvature k along that edge, the
cap's tip leaves the edge by k b^2 / 8: the face tilts by p = k b^2 / (8 H) and, as it is flat, stretches by p^2 / 2
across the edge. The sheet itself does not stretch. If that takes more energy than bending does around the cap,

    L = (A_cap Y h p^4 / 8) / (A Y h^3 k^2 / 24) = 3 (A_cap / A) p^4 / (h k)^2   beyond 1,

with A the area of the cap and of the adjacent faces, the sheet cannot bend there as it should. The core measures the
strain of most caps on other triangles (assembly/membrane_faces.h); this module is about the remaining ones.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from ..._runtime.frozen import remember
from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshQualityWarning

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ..scene.scene import Scene
    from .shell import Shell

LEAST_ANGLE = np.radians(120.0)  # smallest angle that makes a face a cap
# [-] Fraction of the bending energy that caps may obstruct without a warning. Measured on strips of crossed cells, 1/25 to
# 1/400 of their length thick and bent by 0.1 to 1 rad: the deflection is wrong by 0.1 to 0.6 times this fraction, so at
# this limit by 0.3 to 2 %.
TRUSTED_FRACTION = 0.03
_MOST_NAMED = 4  # faces in a warning


class ObtuseFaces:
    """The caps of a sheet that stretch as they tilt.

    recut: caps to leave out, because the core measures their strain on other triangles.
    """

    def __init__(self, shell: Shell, recut: Numbers = ()):
        mesh, quality = shell.mesh, shell.quality
        is_cap = quality.largest_angles > LEAST_ANGLE
        is_cap[np.asarray(recut, dtype=int)] = False
        self.faces: np.ndarray = np.flatnonzero(is_cap)
        self._mesh = mesh
        edges = mesh.face_edges[self.faces]  # (k, 3)
        self._bases = np.take_along_axis(edges, np.argmax(mesh.edge_lengths[edges], axis=1)[:, None], 1)[:, 0]
        self._heights = quality.heights[self.faces]
        # The faces at the edges of each cap: adjacent ones, and the cap itself three times.
        around = np.sort(mesh.edge_faces[edges].reshape(-1, 6), axis=1)
        new = (around >= 0) & (np.diff(around, axis=1, prepend=-1) > 0)
        self._areas = np.where(new, mesh.face_areas[around], 0.0).sum(axis=1)
        self._rest_curvatures = self._curvatures(mesh.rest_positions)

    def obstructed_fractions(self, positions: np.ndarray, shell: Shell, bending_energy: float) -> np.ndarray:
        """Return the bending energy that each cap obstructs, as a fraction of the whole bending energy, (k,).

        shell: with the values of the solve.
        """
        if not (self.faces.size and bending_energy > 0.0 and np.isfinite(positions).all()):
            return np.zeros(len(self.faces))
        thickness, young_modulus = shell.thickness[self.faces], shell.young_modulus[self.faces]
        curvature = self._curvatures(positions) - self._rest_curvatures
        sagitta = np.abs(curvature) * self._mesh.edge_lengths[self._bases] ** 2 / 8
        bending = self._areas * young_modulus * thickness**3 * curvature**2 / 24
        stretch = 0.5 * (sagitta / self._heights) ** 2
        stretching = 0.5 * self._mesh.face_areas[self.faces] * young_modulus * thickness * stretch**2
        total = bending + stretching
        return np.divide(
            bending * stretching, total * bending_energy, out=np.zeros_like(total), where=total > 0
        )

    def _curvatures(self, positions: np.ndarray) -> np.ndarray:
        """Return the curvature along the base of each cap, by the rotation of the sheet's normal, (k,) 1/m."""
        mesh = self._mesh
        if not self.faces.size:
            return np.zeros(0)
        starts, ends = mesh.edges[self._bases].T
        normals = mesh.normals_at_vertices(positions)
        along = positions[ends] - positions[starts]
        return ((normals[ends] - normals[starts]) * along).sum(axis=1) / (along**2).sum(axis=1)


def warn_of_obtuse_faces(
    scene: Scene, positions: np.ndarray, shell: Shell, bending_energy: float, where: str
) -> None:
    """Warn, once per scene, if caps make the sheet too stiff in this state. where: the result, in words."""
    if scene._warned_of_obtuse_faces or not scene.bodies or not scene._bodies.has_only_three_node_shells:
        return
    caps = scene._obtuse_faces
    fractions = caps.obstructed_fractions(positions, shell, bending_energy)
    if fractions.sum() <= TRUSTED_FRACTION:
        return
    remember(scene, _warned_of_obtuse_faces=True)
    worst = np.argsort(-fractions, kind="stable")
    worst = worst[fractions[worst] > 0.01 * fractions.max()]
    warnings.warn(
        f"{where} cannot be trusted. {describe_faces(shell, caps.faces[worst])} almost flat, and the sheet bends along "
        "the long edge, which such a face cannot follow: it makes the sheet too stiff. Move the vertex at the blunt "
        "corner away from that edge, or onto it and leave the face out. `mesh.quality` has the shapes of all faces",
        MeshQualityWarning,
        stacklevel=callers_level(),
    )


def describe_faces(shell: Shell, faces: np.ndarray) -> str:
    """Return the beginning of a sentence that names the first few faces and the shape of the first one."""
    quality, first = shell.quality, faces[0]
    shape = (
        f"{first} (largest angle {np.degrees(quality.largest_angles[first]):.6g} deg, height "
        f"{quality.heights_over_thickness[first]:.2g} of the thickness)"
    )
    if len(faces) == 1:
        return f"Face {shape} is"
    others = ", ".join(map(str, faces[1:_MOST_NAMED].tolist()))
    return (
        f"{len(faces)} faces, {'among them' if len(faces) > _MOST_NAMED else 'namely'} {shape}, {others}, are"
    )
