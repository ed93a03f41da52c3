"""The magnetic field that magnetized bodies make themselves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from ..._input.arrays import count, number
from ..._input.checked_list import checked_list
from ..._runtime.frozen import Frozen
from ..rigid.rigid import RigidBody
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from .scene import Scene

_MOST_POINTS = 1_000_000
_TIGHTEST, _LOOSEST = 1e-9, 1e-2  # accuracies that the trees of the core keep


class OwnField(Frozen):
    """The magnetic field that the magnetized bodies of a scene make themselves, for Scene(..., own_field=...).

    Without it a scene has the model of the papers: magnetized bodies feel the applied field only. With it they attract
    and repel each other and themselves. The sources of a shell lie on the edges of its mesh, two by two points on each
    edge with a source and four by four where edges are near (docs/theory.md); a six-node face is four flat triangles between
    its nodes. A uniform tangential magnetization has
    sources on the border of a shell only; a normal one, or a tangential one that rotates without stretching
    (magnetization_law="rotates"), has sources on all edges. The sources of a solid are charges on the faces of its
    tetrahedra, four points a face; a uniform magnetization that stretches with the solid has them on the surface only. Up
    to 8,000 points all pairs are summed; beyond, distant points are summed by boxes of a tree.

    A magnet that moves freely is a RigidBody or Link with a magnetic_moment, a point dipole at its center: right from a
    distance of some sizes on. Nearer it is a Solid all of whose vertices belong to a RigidBody.

    The rest shape is that of the body without its magnetization, so that a solve loads it with the own field too.

    bodies: the bodies whose field acts, on all of them: Shells, Solids that are magnetized throughout, Solids with a skin,
        and RigidBodies or Links with a magnetic_moment; None: all magnetized bodies of the scene, which must be such.
        Shells that are tied to each other may have it if no edge has more than two faces.
    accuracy: error of the sums over more than 8,000 points, over the size of the forces, from 1e-9 to 1e-2; None: all sums
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
        bodies: Shell | Solid | RigidBody | Iterable[Shell | Solid | RigidBody] | None = None,
        *,
        accuracy: float | None = 1e-6,
        max_points: int = _MOST_POINTS,
    ):
        self.bodies: tuple[Shell | Solid | RigidBody, ...] | None = (
            None if bodies is None else checked_list("bodies", bodies, (Shell, Solid, RigidBody))
        )
        if self.bodies == ():
            raise ValueError("bodies is empty: name the bodies whose own field acts, or leave it out for all")
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
    none: list[int] = []
    if given is None:
        return {
            "own_field_shells": none,
            "own_field_six_node_shells": none,
            "own_field_solids": none,
            "own_field_skins": none,
            "own_field_rigid": none,
            "own_field_max_points": 0,
            "own_field_accuracy": 0.0,
        }
    chosen = bodies_with_own_field(scene)
    if not chosen:
        raise ValueError("own_field: no body of the scene has a magnetization")
    for body in chosen:
        if not any(body is each for each in (*scene.bodies, *scene.rigid_parts)):
            raise ValueError(
                f"own_field names a {type(body).__name__} that is not among the bodies of the scene"
            )
        if not isinstance(body, RigidBody):
            _check(scene.bodies.index(body), body)
        elif body.magnetic_moment is None:
            raise ValueError(f"own_field names a {type(body).__name__} without a magnetic_moment")
    bodies = scene._bodies
    return {
        "own_field_shells": _numbers(bodies.three_node_shells, chosen),
        "own_field_six_node_shells": _numbers(bodies.six_node_shells, chosen),
        "own_field_solids": _numbers(
            bodies.solids, [each for each in chosen if _is_magnetized_throughout(each)]
        ),
        "own_field_skins": _numbers(
            bodies.skins, [each.skin for each in chosen if isinstance(each, Solid) and each.skin is not None]
        ),
        "own_field_rigid": _numbers(scene.rigid_parts, chosen),
        "own_field_max_points": given.max_points,
        "own_field_accuracy": given.accuracy or 0.0,
    }


def bodies_with_own_field(scene: Scene) -> Sequence[Shell | Solid | RigidBody]:
    """Return the bodies whose field acts: those that the OwnField of a scene names, or all that are magnetized."""
    if scene.own_field is None or scene.own_field.bodies is not None:
        return () if scene.own_field is None else scene.own_field.bodies
    bodies = [
        body
        for body in scene.bodies
        if isinstance(body, Shell) or body.skin is not None or _is_magnetized_throughout(body)
    ]
    return [*bodies, *(part for part in scene.rigid_parts if part.magnetic_moment is not None)]


def _is_magnetized_throughout(body: object) -> bool:
    return isinstance(body, Solid) and body.remanent_magnetization is not None


def _numbers(of: Sequence[object], chosen: Sequence[object]) -> list[int]:
    """Return the places of those that are chosen."""
    return [k for k, body in enumerate(of) if any(body is each for each in chosen)]


def _check(number: int, body: Shell | Solid) -> None:
    """Raise ValueError if the own field of a body is not supported, or if it has no magnetization."""
    name = f"own_field does not support body {number}"
    if isinstance(body, Shell):
        if body.susceptibility is not None:
            raise ValueError(
                f"{name}, which has a susceptibility: the magnetization that a field "
                "induces in it makes no field here. Name the other bodies in ms.OwnField(bodies=...)"
            )
        return
    if _is_magnetized_throughout(body):
        if body.skin is not None:
            raise ValueError(
                f"{name}, a Solid that is magnetized throughout and has a skin: the charges of both would lie on each "
                "other. Name the other bodies in ms.OwnField(bodies=...)"
            )
    elif body.skin is None:
        raise ValueError(
            f"{name}, a Solid without magnetization: give it a remanent_magnetization or a skin, or leave it out of "
            "ms.OwnField(bodies=...)"
        )
