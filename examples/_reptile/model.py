"""The crawler: its mesh, its magnetization, the ground and the field."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import magshell as ms

# [Chen22] Table 1 and its footnote.
YOUNG_MODULUS, POISSON_RATIO = 1e5, 0.5  # Pa
THICKNESS, MASS_DENSITY = 1e-3, 1e3  # m, kg/m3
DAMPING = 1e-2  # N s/m, here of all vertices together
TIME_STEP = 1e-4  # s
CONTACT_STIFFNESS, FRICTION_COEFFICIENT = 1e4, 0.6  # N/m

# Not printed there.
BODY, LEG, ROOTS = (16, 5), (3, 7), (0, 4, 9, 13)  # cells along x and y; first column of each pair of legs
LEG_CELL, CELL, GAP = 0.5e-3, 1e-3, 3e-3  # m: along x in a leg, along y everywhere, between two legs
REMANENT_MAGNETIZATION = 4e4  # A/m
FLUX_DENSITY, FREQUENCY = 8e-3, 5.0  # T, Hz
GRAVITY = (0.0, 0.0, -9.81)
SLOPE = np.radians(10.0)
BUMP_HEIGHT, BUMP_LENGTH, BUMP_AT = 1.2e-3, 10e-3, 13e-3  # m; where its crest is, from the crawler's middle
CLEARANCE = 1e-6  # m, of the sheet above the ground at the start
STICKING_SPEED = 5e-4  # m/s


@dataclass(frozen=True)
class Ground:
    """An obstacle, and its slope at the start: the sheet begins parallel to it."""

    obstacle: ms.obstacles.Obstacle
    slope: float = 0.0  # rad

    def height(self, x: np.ndarray) -> np.ndarray:
        """Return the height of the ground at x (...) m in the plane y = 0, m."""
        if isinstance(self.obstacle, ms.obstacles.HeightField):
            middle = len(self.obstacle.y) // 2
            return np.interp(x - self.obstacle.center[0], self.obstacle.x, self.obstacle.heights[:, middle])
        return np.tan(self.slope) * x


def flat() -> Ground:
    return Ground(ms.obstacles.Plane())


def over_bump() -> Ground:
    """Build a ridge across the path, two thirds as long as the crawler, higher than the sheet is thick."""
    return Ground(ms.obstacles.bump(BUMP_HEIGHT, BUMP_LENGTH, center=(BUMP_AT, 0.0, 0.0)))


def uphill() -> Ground:
    return Ground(ms.obstacles.slope(SLOPE), SLOPE)


GROUNDS = {"flat": flat, "bump": over_bump, "slope": uphill}


@dataclass(frozen=True)
class Crawler:
    """A scene on a ground, the magnetization (n_f, 3) [A/m], and positions (n_v, 3) [m] to start from."""

    scene: ms.Scene
    remanent_magnetization: np.ndarray
    start: np.ndarray
    ground: Ground | None

    def crawl(self, cycles: float, *, time_step=TIME_STEP, sense=1, frames=40, **options) -> ms.Trajectory:
        """Simulate a number of rotations of the field, and record at least `frames` states of each.

        sense: -1 reverses the rotation.
        """
        a_cycle = round(1 / (FREQUENCY * time_step))
        every = max(n for n in range(1, max(a_cycle // frames, 1) + 1) if a_cycle % n == 0)
        return ms.simulate(
            self.scene,
            steps=every * round(cycles * a_cycle / every),
            time_step=time_step,
            start=self.start,
            remanent_magnetization=self.remanent_magnetization,
            applied_flux_density=lambda time: turning_field(time, sense),
            damping=DAMPING / self.scene.mesh.n_vertices,
            record_every=every,
            **({"integrator": ms.ImplicitEuler(), "progress": False} | options),
        )

    def centers(self, motion: ms.Trajectory) -> np.ndarray:
        """Return the center of mass, (n, 3) m."""
        masses = self.scene.shell.vertex_masses
        return np.einsum("v,tvi->ti", masses / masses.sum(), motion.positions)


def turning_field(time: float, sense=1) -> tuple[float, float, float]:
    """Return the field at a time [s], T.

    It rotates about the y axis, from x downwards, and grows to its full strength in the first quarter of a rotation.
    """
    angle = 2 * np.pi * FREQUENCY * time
    strength = FLUX_DENSITY * min(1.0, 4 * FREQUENCY * time)
    return strength * np.cos(angle), 0.0, -sense * strength * np.sin(angle)


def crawler(ground: Ground | None, **contact) -> Crawler:
    """Build the crawler on a ground; without a ground it floats, and has no weight."""
    mesh = lizard()
    sheet = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO,
        mass_density=MASS_DENSITY,
    )
    law = {
        "contact_stiffness": CONTACT_STIFFNESS,
        "friction_coefficient": FRICTION_COEFFICIENT,
        "sticking_speed": STICKING_SPEED,
    } | contact
    scene = ms.Scene(
        sheet,
        field=ms.UniformField(),
        contacts=[] if ground is None else [ms.Contact(ground.obstacle, **law)],
        gravity=None if ground is None else GRAVITY,
        allow_rigid_motions=True,
    )
    slope = 0.0 if ground is None else ground.slope
    x, y, _ = mesh.rest_positions.T
    normal = np.array([-np.sin(slope), 0.0, np.cos(slope)])
    start = np.stack([np.cos(slope) * x, y, np.sin(slope) * x], axis=1) + CLEARANCE * normal
    return Crawler(scene, magnetization(mesh), start, ground)


def lizard() -> ms.TriangleMesh:
    """Build a body with four pairs of legs: 496 faces and 326 vertices, symmetric left to right and front to back.

    By Euler's formula a sheet with these counts has 154 edges along its outline, and one of rectangles cut in halves
    has 248 rectangles. Few bodies of whole cells with legs of one size have both; this one has four pairs.
    """
    (columns, width), long = BODY, LEG[1]
    x, on_leg = across()
    y = CELL * (np.arange(width + 2 * long + 1) - width / 2 - long)
    cells = [
        (i, j)
        for i in range(columns)
        for j in range(width + 2 * long)
        if on_leg[i] or long <= j < long + width
    ]
    numbers: dict[tuple[int, int], int] = {}
    faces = []
    for i, j in cells:
        corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        a, b, c, d = (numbers.setdefault(corner, len(numbers)) for corner in corners)
        mirrored = (2 * i < columns) == (2 * j < width + 2 * long)
        faces += [(a, b, c), (a, c, d)] if mirrored else [(a, b, d), (b, c, d)]
    points = [(x[i], y[j], 0.0) for i, j in numbers]
    return ms.TriangleMesh(np.array(points), np.array(faces, dtype=np.int32))


def across() -> tuple[np.ndarray, np.ndarray]:
    """Return x of the lines between the columns of cells [m], zero in the middle, and whether each column is in a leg.

    All gaps have the same width, whatever their number of columns.
    """
    columns, thick = BODY[0], LEG[0]
    on_leg = np.zeros(columns, dtype=bool)
    for root in ROOTS:
        on_leg[root : root + thick] = True
    widths = np.full(columns, LEG_CELL)
    for root, following in pairwise(ROOTS):
        widths[root + thick : following] = GAP / (following - root - thick)
    x = np.append(0.0, np.cumsum(widths))
    return x - x[-1] / 2, on_leg


def magnetization(mesh: ms.TriangleMesh) -> np.ndarray:
    """Return the magnetization of every face, (n_f, 3) A/m.

    Legs are magnetized along themselves, outwards in one pair, inwards in the next; the body has none.
    """
    x, y, _ = mesh.face_barycenters.T
    pair = np.searchsorted(across()[0][list(ROOTS)], x) - 1
    on_leg = np.abs(y) > CELL * BODY[1] / 2
    vectors = np.zeros((mesh.n_faces, 3))
    vectors[:, 1] = np.where(on_leg, REMANENT_MAGNETIZATION * np.sign(y) * (-1.0) ** pair, 0.0)
    return vectors
