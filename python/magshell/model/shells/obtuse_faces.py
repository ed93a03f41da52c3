"""Whether faces with an angle near 180 degrees stiffen a bent sheet, and a warning where they do.

A cap of height H stands on an edge of length b. Where the sheet bends with a curvature k along that edge, its tip leaves
the edge by k b^2 / 8: the face tilts by p = k b^2 / (8 H) and, flat as it is, stretches by p^2 / 2 across the edge. The
sheet itself does not. Once that costs more than bending does around the cap,

    L = (A_cap Y h p^4 / 8) / (A Y h^3 k^2 / 24) = 3 (A_cap / A) p^4 / (h k)^2   beyond 1,

A the area of the cap and the faces beside it, the sheet cannot bend there as it would. The core measures the stretch of
most caps on other triangles (assembly/membrane_faces.h); this is about those that it leaves.
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

LEAST_ANGLE = np.radians(120.0)  # of faces that are looked at
# Share of the bending energy that is in the way of caps. Measured on strips of crossed cells, of 1/25 to 1/400 of their
# length thick and bent by 0.1 to 1 rad: the end is off by 0.1 to 0.6 of it, so here by 0.3 to 2 %.
TRUSTED_SHARE = 0.03
_MOST_NAMED = 4  # faces in a warning


class ObtuseFaces:
    """Those of a sheet that stretch as they tilt. Costs nothing where there are none."""

    def __init__(self, shell: Shell, recut: Numbers = ()):
        """recut: faces whose stretch is measured on other triangles."""
        mesh, quality = shell.mesh, shell.quality
        is_cap = quality.largest_angles > LEAST_ANGLE
        is_cap[np.asarray(recut, dtype=int)] = False
        self.faces: np.ndarray = np.flatnonzero(is_cap)
        self._mesh = mesh
        edges = mesh.face_edges[self.faces]  # (k, 3)
        self._bases = np.take_along_axis(edges, np.argmax(mesh.edge_lengths[edges], axis=1)[:, None], 1)[:, 0]
        self._heights = quality.heights[self.faces]
        around = np.sort(mesh.edge_faces[edges].reshape(-1, 6), axis=1)  # the cap thrice
        new = (around >= 0) & (np.diff(around, axis=1, prepend=-1) > 0)
        self._areas = np.where(new, mesh.face_areas[around], 0.0).sum(axis=1)
        self._rest_curvatures = self._curvatures(mesh.rest_positions)

    def held_back(self, positions: np.ndarray, shell: Shell, bending_energy: float) -> np.ndarray:
        """(k,): the bending energy in the way of each cap, as a share of all of it. shell: with its values now."""
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
        """(k,), 1/m: by how much the sheet's normal turns along each base."""
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
    """Says once a scene that caps stiffen the sheet where it is bent like this. where: the result, in words."""
    if scene._warned_of_obtuse_faces or not scene.bodies or not scene._bodies.flat_sheets_alone:
        return
    caps = scene._obtuse_faces
    shares = caps.held_back(positions, shell, bending_energy)
    if shares.sum() <= TRUSTED_SHARE:
        return
    remember(scene, _warned_of_obtuse_faces=True)
    worst = np.argsort(-shares, kind="stable")
    worst = worst[shares[worst] > 0.01 * shares.max()]
    warnings.warn(
        f"{where} cannot be trusted. {describe_faces(shell, caps.faces[worst])} almost flat, and the sheet bends along "
        "the long edge, which such a face cannot follow: it makes the sheet too stiff. Move the vertex at the blunt "
        "corner away from that edge, or onto it and leave the face out. `mesh.quality` has the shapes of all faces",
        MeshQualityWarning,
        stacklevel=callers_level(),
    )


def describe_faces(shell: Shell, faces: np.ndarray) -> str:
    """The first few of them and the shape of the first, as the beginning of a sentence."""
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
