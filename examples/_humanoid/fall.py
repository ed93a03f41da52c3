"""The fall of the figure on its feet, while its arms are lifted."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass

import numpy as np

import magshell as ms

from .body import HIP, MASS, POISSON_RATIO, SHOULDER, YOUNG_MODULUS, Body

KINDS = ("no skeleton", "rigid", "passive", "driven")
STEPS, TIME_STEP = 100, 1e-2  # s, as [Qiao21]'s
FRICTION = 0.1
RAISED = 0.8  # rad, of the shoulders: the Y pose
TORQUES = (20.0, 150.0)  # N m at most, in the air and on the ground, as theirs
GAIN = 600.0  # N m/rad: how soon the torque reaches its limit
HEIGHT = 0.25  # m, above the ground, of the mean start


@dataclass(frozen=True)
class Start:
    """The start of a fall. height: of the soles, m; velocity: (3,) m/s."""

    height: float
    velocity: np.ndarray

    @property
    def impact_time(self) -> float:
        """The time at which the soles reach the ground, s."""
        down = -self.velocity[2]
        return float((np.sqrt(down**2 + 2 * 9.81 * self.height) - down) / 9.81)


def starts(count: int) -> list[Start]:
    rng = np.random.default_rng(1)
    return [Start(HEIGHT * rng.uniform(0.6, 1.4), rng.normal(scale=(0.1, 0.1, 0.3))) for _ in range(count)]


class Figure:
    """One of the four kinds, as a scene. joints: (right shoulder, left shoulder, right hip, left hip) or none."""

    def __init__(self, body: Body, kind: str):
        self.body, self.kind = body, kind
        material = ms.NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO)
        density = MASS / body.mesh.volumes.sum()
        self.flesh = ms.Solid(body.mesh, material=material, mass_density=density, element="linear")
        self.joints: tuple[ms.Revolute, ...] = ()
        bodies: list = [self.flesh]
        if kind != "no skeleton":
            vertices = body.nearest if kind == "rigid" else body.link_vertices
            self.links = {name: ms.Link(each, body=self.flesh) for name, each in vertices.items()}
            self.joints = tuple(self._joints())
            bodies.append(ms.Skeleton(list(self.links.values()), self.joints))
        ground = ms.obstacles.Plane(center=(0, 0, 0))
        touch = ms.Contact(ground, friction_coefficient=FRICTION, contact_stiffness=2e3)
        self.scene = ms.Scene(bodies, gravity=(0, 0, -9.81), contacts=[touch], allow_rigid_motions=True)

    def _joints(self):
        """Yield the joints: rotation upwards is positive for the arms, outwards for the legs."""
        driven = {}
        if self.kind == "driven":
            driven = {"target_angle": RAISED, "servo_stiffness": GAIN, "torque_limit": TORQUES[0]}
        for place, limb, law in ((SHOULDER, "arm", driven), (HIP, "leg", {})):
            for side, sign in (("right", 1), ("left", -1)):
                yield ms.Revolute(
                    self.links[f"{side} {limb}"],
                    self.links["torso"],
                    origin=(sign * place[0], 0.0, place[1]),
                    axis=(0.0, -sign, 0.0),
                    **law,
                )

    def limits(self, start: Start, steps: int = STEPS) -> np.ndarray:
        """Return the torque limit of a shoulder in every step, (steps,) N m: smaller in the air."""
        return np.where(TIME_STEP * np.arange(steps) >= start.impact_time, *TORQUES[::-1])

    def fall(self, start: Start, steps: int = STEPS, limits=None) -> ms.Trajectory:
        """Simulate the fall from a start.

        limits: torque limits of the two shoulders, (steps,) N m each; by default those of `limits`.
        """
        values = {}
        if self.kind == "driven":
            both = [self.limits(start, steps)] * 2 if limits is None else limits
            shoulders = zip(self.joints[:2], both, strict=True)
            values = {joint: {"torque_limit": each} for joint, each in shoulders}
        with warnings.catch_warnings():  # large strains are intended at 0.8 kPa
            warnings.simplefilter("ignore", ms.LargeStrainWarning)
            return ms.simulate(
                self.scene,
                steps=steps,
                time_step=TIME_STEP,
                start=self.body.mesh.rest_positions + np.array((0.0, 0.0, start.height)),
                velocities=start.velocity,
                values=values,
                integrator=ms.ImplicitEuler(),
                progress=False,
            )


@dataclass(frozen=True)
class Fall:
    """The errors of one fall at its end.

    bone_error: the largest change of a bone's length; body_error: that of the distance from soles to crown; both over
    the values at rest. joint_error: rad, summed over four joints, from the Y pose. milliseconds: processor time of a
    step.
    """

    kind: str
    motion: ms.Trajectory
    bone_error: float
    body_error: float
    joint_error: float
    milliseconds: float


def fallen(figure: Figure, start: Start, steps: int = STEPS) -> Fall:
    began = time.process_time()
    motion = figure.fall(start, steps)
    milliseconds = 1e3 * (time.process_time() - began) / steps
    body, end = figure.body, motion.positions[-1]
    rest = body.mesh.rest_positions
    bones = [_length(end, each) / _length(rest, each) - 1 for each in body.ends.values()]
    tall = [np.linalg.norm(x[body.crown].mean(axis=0) - x[body.soles].mean(axis=0)) for x in (end, rest)]
    return Fall(
        figure.kind,
        motion,
        float(np.abs(bones).max()),
        float(abs(tall[0] / tall[1] - 1)),
        float(np.abs(angles(body, end) - np.array((RAISED, RAISED, 0, 0))).sum()),
        milliseconds,
    )


def angles(body: Body, positions: np.ndarray) -> np.ndarray:
    """Return the angles of shoulders and hips from the positions of the bones' vertices, (4,) rad, with or without
    joints.
    """
    torso = _turned(body, positions, "torso")
    found = []
    for limb in ("arm", "leg"):
        for side, sign in (("right", 1), ("left", -1)):
            turn = torso.T @ _turned(body, positions, f"{side} {limb}")
            found.append(np.arctan2(turn[2, 0] - turn[0, 2], turn[0, 0] + turn[2, 2]) * sign)
    return np.array(found)


def _turned(body: Body, positions: np.ndarray, name: str) -> np.ndarray:
    """Return the rotation (3, 3) that takes a bone from its reference positions closest to its present ones."""
    vertices = body.link_vertices[name]
    rest, now = (x[vertices] - x[vertices].mean(axis=0) for x in (body.mesh.rest_positions, positions))
    u, _, v = np.linalg.svd(now.T @ rest)
    return u @ np.diag((1, 1, np.linalg.det(u @ v))) @ v


def _length(positions: np.ndarray, ends: np.ndarray) -> float:
    return float(np.linalg.norm(positions[ends[0]] - positions[ends[1]]))


def slope_error(figure: Figure, start: Start, steps: int = STEPS, step: float = 1e-2) -> float:
    """Return the relative error of a directional derivative against central differences.

    It is the derivative of the mean height of both hands at the end, along the gradient by the torque limits of every
    step. step: of the differences, N m.
    """
    import torch

    points = figure.body.mesh.rest_positions
    hands = np.flatnonzero(np.abs(points[:, 0]) > 1.8)
    limits = np.stack([figure.limits(start, steps)] * 2)

    def height(both):
        return figure.fall(start, steps, both).positions[-1, hands, 2].mean()

    x = torch.tensor(limits, requires_grad=True)
    (gradient,) = torch.autograd.grad(height(x), x)
    slope = float(gradient.norm())
    direction = (gradient / slope).numpy()
    there, back = (float(height(limits + sign * step * direction)) for sign in (1, -1))
    return abs((there - back) / (2 * step) - slope) / slope
