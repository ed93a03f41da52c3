"""Forces and torques of magnets and dipoles on each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy

from .field import AppliedField, Dipoles
from .magnets import CuboidMagnet, CylinderMagnet, Magnet
from .posed_field import PlacedField

# Gauss points per direction of a panel, and the error of all panels over the sum of the absolute parts at which panels are
# no longer divided; see test_forces_between_cuboid_magnets_equal_the_closed_form.
_ORDER, _ACCURACY = 8, 1e-12
# Panels at one time, beyond which division stops, and the error that is accepted then: of magnets that touch.
_MOST_PANELS, _ACCEPTED = 4000, 1e-6
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_ORDER)


class Action(NamedTuple):
    """A force (3,) N and a torque (3,) N m about the origin."""

    force: np.ndarray
    torque: np.ndarray

    def __neg__(self) -> Action:
        return Action(-self.force, -self.torque)


class _Patch(NamedTuple):
    """A part of a magnet's surface over the unit square: points (n, 3) m and charges per unit square (n,) A m of its
    parameters (n,), (n,).
    """

    points: Callable[[np.ndarray, np.ndarray], np.ndarray]
    charges: Callable[[np.ndarray, np.ndarray], np.ndarray]


def action_between(on: AppliedField, of: AppliedField) -> Action | None:
    """Return the force and torque of one source on another, computed from the charges or moments of `on`; None if where
    these are is not known.

    Raises ValueError if they overlap, or touch such that the force cannot be computed.
    """
    if isinstance(on, Magnet):
        return _on_magnet(on, of)
    dipoles = _as_dipoles(on)
    if dipoles is None:
        return None
    flux, gradient = of._samples(dipoles.positions, order=1)[:2]
    _require_numbers(flux, on, of)
    forces = np.einsum("nij,ni->nj", gradient, dipoles.moments)
    couples = np.cross(dipoles.positions, forces) + np.cross(dipoles.moments, flux)
    return Action(forces.sum(axis=0), couples.sum(axis=0))


def magnetic_moment_of(source: AppliedField) -> np.ndarray | None:
    """Return the magnetic moment (3,) A m2 of a magnet or of dipoles; None if it is not known."""
    if isinstance(source, Magnet):
        volume = (
            float(np.prod(source.dimensions))
            if isinstance(source, CuboidMagnet)
            else np.pi * source.radius**2 * source.height
        )
        return volume * _rotation(source.rotation).apply(np.array(source.remanent_magnetization))
    dipoles = _as_dipoles(source)
    return None if dipoles is None else dipoles.moments.sum(axis=0)


def _as_dipoles(source: AppliedField) -> Dipoles | None:
    if isinstance(source, PlacedField) and isinstance(source.field, Dipoles):
        turn = _rotation(source.rotation)
        return Dipoles(
            turn.apply(np.array(source.field.positions)) + source.center,
            turn.apply(np.array(source.field.moments)),
        )
    return source if isinstance(source, Dipoles) else None


def _on_magnet(on: Magnet, of: AppliedField) -> Action:
    patches = list(_patches(on))
    panels = np.array([(k, 0.0, 0.0, 1.0) for k in range(len(patches))])  # patch, lower corner, width
    total = np.zeros(6)
    if not patches:
        return Action(total[:3], total[3:])
    values, size = _integrals(patches, panels, on, of)
    scales = size * np.repeat([1.0, on._sphere_around_sources()[1]], 3)
    while len(panels) and size > 0.0:
        quarter = 0.5 * panels[:, 3]
        parts = np.concatenate(
            [
                np.column_stack(
                    [panels[:, 0], panels[:, 1] + i * quarter, panels[:, 2] + j * quarter, quarter]
                )
                for i, j in product((0, 1), repeat=2)
            ]
        )
        parts_values, _ = _integrals(patches, parts, on, of)
        refined = parts_values.reshape(4, -1, 6).sum(axis=0)
        errors = (np.abs(refined - values) / scales).max(axis=1)
        ready = errors <= _ACCURACY * panels[:, 3] ** 2
        if 4 * np.count_nonzero(~ready) > _MOST_PANELS:
            if errors.sum() > _ACCEPTED:
                raise ValueError(
                    f"the force between {on!r} and {of!r} cannot be computed: they touch or nearly touch"
                )
            ready[:] = True
        total += refined[ready].sum(axis=0)
        open_parts = np.tile(~ready, 4)
        panels, values = parts[open_parts], parts_values[open_parts]
    force = total[:3]
    return Action(force, total[3:] + np.cross(on.center, force))


def _integrals(
    patches: list[_Patch], panels: np.ndarray, on: Magnet, of: AppliedField
) -> tuple[np.ndarray, float]:
    """Return the force and the torque about the magnet's center of each panel, (n, 6), and the sum of the absolute parts
    of all forces.
    """
    first, second = (each.ravel() for each in np.meshgrid(0.5 + 0.5 * _NODES, 0.5 + 0.5 * _NODES))
    weights = 0.25 * np.outer(_WEIGHTS, _WEIGHTS).ravel()
    points = np.empty((len(panels), len(weights), 3))
    charges = np.empty(points.shape[:2])
    for k, patch in enumerate(patches):
        rows = panels[:, 0] == k
        corner, width = panels[rows, 1:3], panels[rows, 3:]
        at = (corner[:, :1] + width * first).ravel(), (corner[:, 1:] + width * second).ravel()
        points[rows] = patch.points(*at).reshape(-1, len(weights), 3)
        charges[rows] = patch.charges(*at).reshape(-1, len(weights)) * (width**2 * weights)
    flat = points.reshape(-1, 3)
    if of._in_magnets(flat).any():
        raise ValueError(
            f"{on!r} and {of!r} overlap or touch: the force between them is not that of two magnets that are apart"
        )
    flux = of.flux_density(flat)
    _require_numbers(flux, on, of)
    forces = charges[..., None] * flux.reshape(points.shape)
    torques = np.cross(points - on.center, forces)
    return np.concatenate([forces, torques], axis=2).sum(axis=1), float(np.abs(forces).sum())


def _require_numbers(flux: np.ndarray, on: AppliedField, of: AppliedField) -> None:
    if not np.isfinite(flux).all():
        raise ValueError(f"{of!r} has no field at {on!r}, so that there is no force between them")


def _patches(magnet: Magnet) -> Iterator[_Patch]:
    """Yield the parts of a magnet's surface that have a charge."""
    turn, m = _rotation(magnet.rotation), magnet.remanent_magnetization

    def to_world(own: np.ndarray) -> np.ndarray:
        return turn.apply(own) + magnet.center

    if isinstance(magnet, CuboidMagnet):
        for axis, side in product(range(3), (-0.5, 0.5)):
            if m[axis] != 0.0:
                yield _side_of_cuboid(magnet.dimensions, axis, side, float(m[axis]), to_world)
    elif isinstance(magnet, CylinderMagnet):
        yield from _sides_of_cylinder(magnet.radius, magnet.height, m, to_world)
    else:
        raise ValueError(f"forces on a {type(magnet).__name__} are not supported")


def _side_of_cuboid(
    dimensions: np.ndarray, axis: int, side: float, magnetization: float, to_world: Callable
) -> _Patch:
    others = [each for each in range(3) if each != axis]

    def points(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        own = np.empty((len(u), 3))
        own[:, axis] = side * dimensions[axis]
        for each, along in zip(others, (u, v), strict=True):
            own[:, each] = (along - 0.5) * dimensions[each]
        return to_world(own)

    charge = 2.0 * side * magnetization * float(np.prod(dimensions[others]))
    return _Patch(points, lambda u, _: np.full(len(u), charge))


def _sides_of_cylinder(radius: float, height: float, m: np.ndarray, to_world: Callable) -> Iterator[_Patch]:
    def at(distance: np.ndarray | float, revolution: np.ndarray, along: np.ndarray | float) -> np.ndarray:
        angle = 2.0 * np.pi * revolution
        return to_world(
            np.column_stack(np.broadcast_arrays(distance * np.cos(angle), distance * np.sin(angle), along))
        )

    if m[0] != 0.0 or m[1] != 0.0:
        yield _Patch(
            lambda u, v: at(radius, u, (v - 0.5) * height),
            lambda u, _: (
                2.0 * np.pi * radius * height * (m[0] * np.cos(2 * np.pi * u) + m[1] * np.sin(2 * np.pi * u))
            ),
        )
    for side in (-0.5, 0.5):
        if m[2] != 0.0:
            yield _Patch(
                lambda u, v, side=side: at(radius * u, v, side * height),
                lambda u, _, side=side: 4.0 * np.pi * radius**2 * side * m[2] * u,
            )


def _rotation(rotation: np.ndarray) -> scipy.spatial.transform.Rotation:
    return scipy.spatial.transform.Rotation.from_rotvec(np.array(rotation))
