"""Estimates how much of the elastic energy of a shell its mesh does not resolve, and warns where that is a large part.

Strains of three-node faces are constant in each. Their averages at the vertices, interpolated in the faces, are nearer to
the true strains, so that the energy of the difference estimates that of the error [Zienkiewicz87]:

    e = sum over faces  int (N - N*) : (E - E*) + (M - M*) : (K - K*) dA,   relative to the same sum of N : E + M : K, plus e

of membrane forces N, strains E, moments M, curvatures K and their averages N*, ... Displacements under loads are off by
about as much: too small by membrane locking, often too large where curvatures are not resolved. Averages at a vertex do not
cross folds, creases and edges where the thickness or Young's modulus jumps, as strains jump there. Six-node faces do not
take part.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.warning_stacklevel import callers_level
from ...errors import ResolutionWarning
from ...mesh.connected import connected_groups
from ..loads.foundation import ElasticFoundation
from ..shells.shell import Shell

if TYPE_CHECKING:
    from ..scene.values import Values

# [-] Estimated part of the energy above which a warning is given. Where it is 1 to 20 %, displacements are off by 0.4 to 1.5
# times as much; it does not exceed about a third. Fixed by test_estimate_is_near_the_error_of_displacements.
TRUSTED = 0.1
_SMOOTH = np.cos(np.radians(30.0))  # [-] of the largest angle between the normals at an edge that is no fold
_SAME = 1.01  # [-] ratio of thickness or Young's modulus across an edge, above which strains jump there
_ROUND_OFF = 1e-9  # [-] strains below this are round-off
_LEFT = 0.01  # [-] error fraction that the advised mesh should reach
_SATURATES = 0.2  # [-] estimate above which the error may be larger, as the estimate does not exceed a third
_MOST_NAMED = 4  # faces in a warning
_ROWS, _COLUMNS = (0, 1, 2, 1, 0, 0), (0, 1, 2, 2, 2, 1)  # of a symmetric tensor's six components


class Unresolved(NamedTuple):
    """The part of the elastic energy of a shell that its mesh does not resolve.

    membrane, bending: by membrane strains and by curvatures. by_face: (n_f,), the shares of the faces; they add up to
    the sum of both.
    """

    body: Shell
    membrane: float
    bending: float
    by_face: np.ndarray


def unresolved(values: Values, state: np.ndarray) -> list[Unresolved]:
    """Return the estimates for the strained three-node shells of a scene, in a state of its core with these values."""
    found = []
    for number, body in enumerate(values.scene._bodies.shells):
        if body.mesh.order == 1:
            with values.in_core():
                tensors = _core.shell_stresses(values.scene._model, number, state)
            found.append(_estimate(body, values.current(body), tensors))
    return [each for each in found if each is not None]


def warn_of_resolution(
    found: list[Unresolved], values: Values, flux_density: np.ndarray | None, where: str
) -> None:
    """Warn of the shell whose mesh leaves the largest part of its energy unresolved, if that is more than TRUSTED.

    flux_density: (3,) T, the uniform one, or None. where: the result, in words.
    """
    worst = max(found, key=lambda each: each.membrane + each.bending, default=None)
    if worst is None or worst.membrane + worst.bending <= TRUSTED:
        return
    fraction = worst.membrane + worst.bending
    of_membrane = worst.membrane > worst.bending
    what = (
        "membrane strains, such as those of a strip that bends in its plane," if of_membrane else "curvatures"
    )
    faces = ", ".join(map(str, np.argsort(-worst.by_face, kind="stable")[:_MOST_NAMED].tolist()))
    lengths = "" if of_membrane else _lengths_in_words(worst.body, values, flux_density)
    number = values.scene._bodies.number(worst.body)
    named = f"body {number}" if len(values.scene.bodies) > 1 else "the sheet"
    as_much = "about as much" if fraction < _SATURATES else "at least as much"
    warnings.warn(
        ResolutionWarning(
            f"{where}: the mesh of {named} is too coarse to resolve its {what} most at faces {faces}. An "
            f"estimated {fraction:.0%} of its elastic energy is error, and displacements are off by {as_much}{lengths}. "
            "Take six-node elements (`order=2`, or ms.QuadraticTriangleMesh.from_triangles(mesh)), or edges "
            f"{np.sqrt(fraction / _LEFT):.2g} times shorter, which leaves about {_LEFT:.0%}"
        ),
        stacklevel=callers_level(),
    )


def _lengths_in_words(body: Shell, values: Values, flux_density: np.ndarray | None) -> str:
    """Return a clause on the lengths over which loads bend the shell that are shorter than two of its edges, or ""."""
    mesh, now = body.mesh, values.current(body)
    stiffness = now.young_modulus * now.thickness**3 / (12.0 * (1.0 - now.poisson_ratio**2))
    lengths = []
    for each in values.scene.loads:
        if isinstance(each, ElasticFoundation) and each.body in (None, body):
            faces = slice(None) if each.faces is None else each.faces
            with np.errstate(divide="ignore"):
                of_faces = np.broadcast_to(stiffness, (mesh.n_faces,))[faces] / values.current(each).stiffness
            lengths.append(("its foundation bends it over (D/k)^(1/4)", float(of_faces.min()) ** 0.25))
    if flux_density is not None and now.remanent_magnetization is not None:
        couple = (
            np.linalg.norm(now.remanent_magnetization, axis=-1) * now.thickness * np.linalg.norm(flux_density)
        )
        if np.max(couple) > 0.0:
            with np.errstate(divide="ignore"):
                lengths.append(
                    ("the field bends it over (D/(M B h))^(1/2)", float(np.min(stiffness / couple)) ** 0.5)
                )
    longest = float(mesh.edge_lengths.max())
    told = [f"{what} = {length:.2g} m" for what, length in lengths if longest > 0.5 * length]
    return "".join(f"; {each}" for each in told) + (
        f", and edges are up to {longest:.2g} m long" if told else ""
    )


def _estimate(body: Shell, now: Shell, tensors: tuple[np.ndarray, ...]) -> Unresolved | None:
    """Return the estimate from E, K, N and M, (n_f, 3, 3) each, or None for a shell without strains."""
    strains, curvatures, forces, moments = (
        np.ascontiguousarray(each[:, _ROWS, _COLUMNS].T) for each in tensors
    )
    largest = max(np.abs(strains).max(), np.abs(now._face_thickness * curvatures).max())
    if not largest > _ROUND_OFF:
        return None
    mesh, corners = body.mesh, _corners(body, now)
    areas = mesh.face_areas * np.linalg.det(now._grown_by)
    at_corners = np.repeat(areas, 3)
    weights = np.bincount(corners.ravel(), at_corners)

    def differences(tensor: np.ndarray) -> np.ndarray:
        """Return the averages at the corners less the tensor, with their sum as fourth column, (6, n_f, 4)."""
        mean = [np.bincount(corners.ravel(), at_corners * np.repeat(each, 3)) / weights for each in tensor]
        off = np.stack(mean)[:, corners] - tensor[:, :, None]
        return np.concatenate([off, off.sum(axis=2, keepdims=True)], axis=2)

    energy, errors = 0.0, []
    for force, strain in ((forces, strains), (moments, curvatures)):
        energy += float(areas @ _product(force, strain))
        products = _product_in_plane(differences(force), differences(strain), mesh.face_normals.T[:, :, None])
        errors.append(areas / 12.0 * np.maximum(products.sum(axis=1), 0.0))
    total = energy + sum(float(each.sum()) for each in errors)
    if not 0.0 < total < np.inf:
        return None
    membrane, bending = (float(each.sum()) / total for each in errors)
    return Unresolved(body, membrane, bending, (errors[0] + errors[1]) / total)


def _product(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return A : B of symmetric tensors, six components first."""
    return (one[:3] * other[:3]).sum(axis=0) + 2.0 * (one[3:] * other[3:]).sum(axis=0)


def _product_in_plane(one: np.ndarray, other: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return A : B of the parts of tensors in the planes with these normals n: A : B - 2 An . Bn + n.An n.Bn."""
    x, y, z = normal

    def along_normal(tensor: np.ndarray) -> np.ndarray:
        xx, yy, zz, yz, xz, xy = tensor
        return np.stack([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z])

    first, second = along_normal(one), along_normal(other)
    across = (normal * first).sum(axis=0) * (normal * second).sum(axis=0)
    return _product(one, other) - 2.0 * (first * second).sum(axis=0) + across


def _corners(body: Shell, now: Shell) -> np.ndarray:
    """Return numbers of the corners of faces, (n_f, 3), equal where faces meet at a vertex and strains do not jump."""
    mesh = body.mesh
    one, other = mesh.edge_faces.T
    smooth = np.flatnonzero((one >= 0) & (other >= 0))
    smooth = np.setdiff1d(
        smooth, np.concatenate([np.zeros(0, dtype=int), *(each.edges for each in body.creases)])
    )
    cosines = np.einsum("ei,ei->e", mesh.face_normals[one[smooth]], mesh.face_normals[other[smooth]])
    smooth = smooth[cosines > _SMOOTH]
    young_modulus = np.broadcast_to(np.asarray(now.young_modulus, dtype=float), (mesh.n_faces,))
    for each in (now._face_thickness, young_modulus):
        ratios = each[one[smooth]] / each[other[smooth]]
        smooth = smooth[np.maximum(ratios, 1.0 / ratios) < _SAME]
    # The corners of two faces at either end of a smooth edge are one.
    around = mesh.faces[mesh.edge_faces[smooth]]  # (k, 2 faces, 3)
    at = [np.argmax(around == mesh.edges[smooth][:, None, [end]], axis=2) for end in (0, 1)]
    pairs = np.concatenate([3 * mesh.edge_faces[smooth] + each for each in at])
    return connected_groups(3 * mesh.n_faces, pairs).reshape(-1, 3)
