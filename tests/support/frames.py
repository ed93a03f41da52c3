"""Frames of coordinates, of units and of numbers, and scenes that are built in one of them.

Every number of a scene goes through its frame, so that a scene in any frame is the same physical scene.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import magshell as ms

DURATION = 12e-3  # s, by default


@dataclass(frozen=True)
class Frame:
    """A frame of coordinates, of units and of numbers.

    turn: orthogonal, a rotation or a reflection. shift: m. length, mass, time: the numbers that a metre, a kilogram and a
    second have. numbers_from: the seed of another order of vertices and faces; None keeps the order.
    """

    turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    shift: Sequence[float] = (0.0, 0.0, 0.0)
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0
    numbers_from: int | None = None

    def scalar(self, value, length: int = 0, mass: int = 0, time: int = 0):
        """Return a quantity of these dimensions in the frame's units."""
        return np.asarray(value, dtype=float) * self.length**length * self.mass**mass * self.time**time

    def point(self, x):
        return self.length * (np.asarray(x, dtype=float) @ self.turn.T + self.shift)

    def vector(self, x, length: int = 0, mass: int = 0, time: int = 0):
        return self.scalar(np.asarray(x, dtype=float) @ self.turn.T, length, mass, time)

    def axial(self, x, length: int = 0, mass: int = 0, time: int = 0):
        """Return a vector that a mirror reverses beside what it reflects: a rotation, a torque, a magnetization."""
        return self.vector(x, length, mass, time) * np.linalg.det(self.turn)

    def modulus(self, value):
        return self.scalar(value, -1, 1, -2)

    def density(self, value):
        return self.scalar(value, -3, 1)

    def force(self, x):
        return self.vector(x, 1, 1, -2)

    def torque(self, x):
        return self.axial(x, 2, 1, -2)

    def magnetic(self, x, length: int = 0):
        """Return a flux density or a magnetization, whose product is an energy density; with length=3 a moment."""
        return self.axial(x, length) * np.sqrt(self.modulus(1.0))

    def time_of(self, value):
        return self.scalar(value, time=1)


class PositionedMesh:
    """A mesh in a frame. own: the mesh with the numbers and the places of the description."""

    def __init__(self, frame: Frame, own, salt: int):
        x = frame.point(own.rest_positions)
        of_elements = own.tetrahedra if isinstance(own, ms.TetMesh) else own.faces
        kind = type(own)
        order, elements = np.arange(len(x)), np.arange(len(of_elements))
        if frame.numbers_from is not None:
            draw = np.random.default_rng([frame.numbers_from, salt])
            order, elements = draw.permutation(order), draw.permutation(elements)
        self.number = np.argsort(order)  # by the own number of a vertex
        rows = self.number[of_elements[elements]]
        if np.linalg.det(frame.turn) < 0.0:
            rows = rows[:, [0, 2, 1, *range(3, rows.shape[1])]]
        self.own, self.elements = own, elements
        self.mesh = kind(x[order], rows)

    def vertices(self, own_vertices):
        return self.number[own_vertices]

    def edges(self, own_edges):
        wanted = {tuple(sorted(pair)) for pair in self.number[self.own.edges[own_edges]].tolist()}
        return np.array(
            [k for k, pair in enumerate(self.mesh.edges.tolist()) if tuple(sorted(pair)) in wanted]
        )


class Numbered:
    """A mesh in a frame whose numbers are found by its places."""

    def __init__(self, mesh, own, frame: Frame):
        self.mesh, self.own = mesh, own
        there = frame.point(own.rest_positions)
        apart = np.linalg.norm(there[:, None] - mesh.rest_positions[None], axis=2)
        self.number = np.argmin(apart, axis=1)


class Build:
    """A scene that is being built.

    bodies: each with its PositionedMesh, or None. velocities: those of their vertices, in the numbers of the frame.
    """

    def __init__(self, frame: Frame):
        self.frame = frame
        self.bodies: list[tuple[Any, PositionedMesh | None]] = []
        self.velocities: list[np.ndarray] = []
        self.parts: dict[str, list] = {
            name: [] for name in ("supports", "loads", "contacts", "actuators", "field", "ties")
        }
        self.options: dict[str, Any] = {}
        self.keywords: dict[str, Any] = {}
        self.values: dict[Any, dict[str, Any]] = {}
        self.magnetized = False

    def add(self, body, positioned: PositionedMesh | None = None, velocity: Callable | None = None):
        self.bodies.append((body, positioned))
        if positioned is not None:
            x = positioned.own.rest_positions
            moving = np.zeros_like(x) if velocity is None else velocity(x)
            rows = np.empty_like(x)
            rows[positioned.number] = self.frame.vector(moving, 1, 0, -1)
            self.velocities.append(rows)
        return body

    def position(self, mesh) -> PositionedMesh:
        return PositionedMesh(self.frame, mesh, len(self.bodies))

    def scene(self) -> ms.Scene:
        parts = {name: given for name, given in self.parts.items() if given}
        return ms.Scene([body for body, _ in self.bodies], allow_rigid_motions=True, **parts, **self.options)

    def simulate(self, integrator, steps: int = 6, duration: float = DURATION) -> ms.Trajectory:
        keywords = dict(self.keywords)
        if self.velocities:
            keywords["velocities"] = np.concatenate(self.velocities)
        return ms.simulate(
            self.scene(),
            steps=steps,
            time_step=float(self.frame.time_of(duration / steps)),
            integrator=integrator,
            values=self.values,
            solver=ms.MixedNewton(tolerance=1e-13),
            progress=False,
            **keywords,
        )

    def positions(self, move) -> np.ndarray:
        """Return the positions of all vertices and centers of rigid bodies, as the description has them."""
        rows = []
        for body, positioned in self.bodies:
            if positioned is not None:
                rows.append(np.asarray(move[body].positions)[:, positioned.number])
            elif isinstance(body, ms.RigidBody):
                rows.append(np.asarray(move[body].center)[:, None])
            else:
                rows += [np.asarray(move[link].center)[:, None] for link in body.links]
        return (np.concatenate(rows, axis=1) / self.frame.length - self.frame.shift) @ self.frame.turn
