"""The magnetic field that magnetized shells make themselves."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ..._input.arrays import count, number
from ..._input.checked_list import checked_list
from ..._runtime.frozen import Frozen
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from .scene import Scene

_MOST_POINTS = 1_000_000
_TIGHTEST, _LOOSEST = 1e-9, 1e-2  # accuracies that the trees of the core keep


class OwnField(Frozen):
    """The magnetic field that the magnetized shells of a scene make themselves, for Scene(..., own_field=...).

    Without it a scene has the model of the papers: magnetized bodies feel the applied field only. With it shells attract
    and repel each other and themselves. The sources lie on the edges of the mesh, two by two points on each edge with a
    source and four by four where edges are near (docs/theory.md). A uniform tangential magnetization has sources on the
    border of a shell only; a normal one, or a tangential one that rotates without stretching (magnetization_law="rotates"),
    has sources on all edges. Up to 16,000 points all pairs are summed; beyond, distant points are summed by boxes of a tree.

    The rest shape is that of the shell without its magnetization, so that a solve loads it with the own field too.

    bodies: the Shells of three-node faces whose field acts, on all of them; None: all bodies of the scene, which must be
        such shells. Shells that are tied to each other may have it if no edge has more than two faces.
    accuracy: error of the sums over more than 16,000 points, over the size of the forces, from 1e-9 to 1e-2; None: all sums
        are over all pairs, in a time that grows with the square of the number of points.
    max_points: the largest number of points with a source; a solve with more raises ValueError.

    >>> import magshell as ms
    >>> meshes = [ms.meshes.rectangle(0.01, 0.01, cells=(4, 4)).transformed(translation=(0, 0, z)) for z in (0, 1.2e-3)]
    >>> flaps = [ms.Shell(mesh, thickness=2e-4, young_modulus=1e6) for mesh in meshes]
    >>> held = [ms.Clamp(flap.mesh.edges_at(x=0.0), body=flap) for flap in flaps]
    >>> scene = ms.Scene(flaps, supports=held, own_field=ms.OwnField())
    >>> rest = ms.equilibrium(scene, remanent_magnetization=(6e4, 0, 0))  # parallel to both: they repel
    >>> bool(rest[flaps[1]].displacements[-1, 2] > 1e-6)
    True
    """

    def __init__(
        self,
        bodies: Shell | Iterable[Shell] | None = None,
        *,
        accuracy: float | None = 1e-6,
        max_points: int = _MOST_POINTS,
    ):
        self.bodies: tuple[Shell, ...] | None = (
            None if bodies is None else checked_list("bodies", bodies, (Shell,))
        )
        if self.bodies == ():
            raise ValueError("bodies is empty: name the shells whose own field acts, or leave it out for all")
        self.accuracy: float | None = None if accuracy is None else number("accuracy", accuracy)
        if self.accuracy is not None and not _TIGHTEST <= self.accuracy <= _LOOSEST:
            raise ValueError(
                f"accuracy must be in [{_TIGHTEST:g}, {_LOOSEST:g}], or None for sums over all pairs, got {accuracy!r}"
            )
        self.max_points: int = count("max_points", max_points)

    def __repr__(self) -> str:
        whose = "all bodies" if self.bodies is None else f"{len(self.bodies)} of the bodies"
        return f"OwnField: of {whose}, at most {self.max_points} points"


def own_field_inputs(scene: Scene) -> dict[str, object]:
    """Return the input of the core. Raises ValueError if the own field of a body is not supported."""
    given = scene.own_field
    if given is None:
        return {"own_field_shells": [], "own_field_max_points": 0, "own_field_accuracy": 0.0}
    chosen = scene.bodies if given.bodies is None else given.bodies
    if given.bodies is None:
        for k, body in enumerate(scene.bodies):
            _require_flat_shell(k, body)
        for k, part in enumerate(scene.rigid_parts):
            if part.magnetic_moment is not None:
                raise ValueError(
                    f"own_field does not support rigid part {k}, which has a magnetic_moment: name the shells, "
                    "ms.OwnField(bodies=...)"
                )
    numbers = []
    for body in chosen:
        if not any(body is each for each in scene.bodies):
            raise ValueError("own_field names a Shell that is not among the bodies of the scene")
        k = scene.bodies.index(body)
        _require_flat_shell(k, body)
        numbers.append(
            sum(isinstance(each.mesh, TriangleMesh) for each in scene.bodies[:k] if isinstance(each, Shell))
        )
    if len(set(numbers)) < len(numbers):
        raise ValueError("own_field names a Shell twice")
    return {
        "own_field_shells": sorted(numbers),
        "own_field_max_points": given.max_points,
        "own_field_accuracy": given.accuracy or 0.0,
    }


def _require_flat_shell(number: int, body: Shell | Solid) -> None:
    if isinstance(body, Shell) and isinstance(body.mesh, TriangleMesh):
        if body.susceptibility is not None:
            raise ValueError(
                f"own_field does not support body {number}, which has a susceptibility: the magnetization that a field "
                "induces in it makes no field here. Name the other shells in ms.OwnField(bodies=...)"
            )
        return
    kind = "a Solid" if isinstance(body, Solid) else "a Shell of six-node faces"
    raise ValueError(
        f"own_field does not support body {number}, {kind}: only Shells of three-node faces have it; name these in "
        "ms.OwnField(bodies=...)"
    )
