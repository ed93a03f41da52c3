"""The magnetization of a hand's skin for a gesture, found by gradient."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from _solid_designs.transfer import transferred

import magshell as ms

from .gestures import Anchors, anchors_of
from .shape import UNIT, hand

MATERIAL = ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.45)  # [Chen22] Table 1
SKIN = 1e-3  # m, [Chen22] Table 1 for all that is thin
FLUX_DENSITY = (0.0, 0.0, 0.05)  # T, upwards: the strongest in [Chen22]
LARGEST_MAGNETIZATION = 3e5  # A/m; the paper has no bound
HELD = 8 * UNIT  # m: the wrist is held up to there
PRICE = 3e-4  # weight of the mean square of |M_r| over its limit, added to the mean square error in fingers' lengths
REACH = 40 * UNIT  # m, about the length of a finger


@dataclass(frozen=True)
class Body:
    """The hand of about `n_tetrahedra` tetrahedra, with its scene."""

    n_tetrahedra: int
    element: str

    @cached_property
    def solid(self) -> ms.Solid:
        mesh = ms.meshes.from_distance(hand(), n_tetrahedra=self.n_tetrahedra)
        return ms.Solid(mesh, material=MATERIAL, element=self.element, skin=ms.Skin(thickness=SKIN))

    @cached_property
    def scene(self) -> ms.Scene:
        held = ms.Pin(self.solid.mesh.vertices_where(lambda points: points[:, 2] < HELD))
        return ms.Scene(self.solid, supports=[held], field=ms.UniformField())

    @property
    def faces(self) -> np.ndarray:
        """The face of the four-node mesh that each face of the skin is, or is a quarter of, (k,)."""
        parts = 4 if self.element == "quadratic" else 1
        return self.solid.skin.faces // parts

    def anchors(self, gesture: str) -> Anchors:
        mesh = self.solid.mesh
        return anchors_of(mesh.rest_positions, gesture, np.unique(mesh.faces))

    def equilibrium(self, magnetization) -> ms.Equilibrium:
        """Find the equilibrium in the field. magnetization: (k, 3) A/m, for the skin's faces."""
        return ms.equilibrium(
            self.scene,
            applied_flux_density=FLUX_DENSITY,
            values={self.solid.skin: {"remanent_magnetization": magnetization}},
        )


@dataclass(frozen=True)
class State:
    """An equilibrium of a hand in the field. remanent_magnetization: (k, 3) A/m, of the skin's faces. positions:
    (n_v, 3) m.
    """

    body: Body
    gesture: str
    remanent_magnetization: np.ndarray
    positions: np.ndarray

    @property
    def anchors(self) -> Anchors:
        return self.body.anchors(self.gesture)

    @property
    def distances(self) -> np.ndarray:
        """The distances of the anchors from their targets, (k,) m."""
        anchors = self.anchors
        return np.linalg.norm(self.positions[anchors.vertices] - anchors.targets, axis=1)

    @property
    def rms_distance(self) -> float:
        """The root mean square distance of the anchors from their targets, m."""
        return rms(self.distances)


@dataclass(frozen=True)
class Design(State):
    """The best state of a search. history: that of ms.minimize, whose `terms` hold the mean square error."""

    history: list

    @property
    def iterations(self) -> int:
        return self.history[-1].iteration

    @property
    def seconds_per_iteration(self) -> float:
        return (self.history[-1].seconds - self.history[0].seconds) / max(1, self.iterations)

    @property
    def rms_history(self) -> np.ndarray:
        """The root mean square distance at every iteration, m."""
        return REACH * np.sqrt([float(record.terms["error"]) for record in self.history])


def rms(distances: np.ndarray) -> float:
    return float(np.sqrt(np.mean(distances**2)))


def on(body: Body, design: Design) -> State:
    """Find the state that a design takes on another mesh of the hand when the field is turned on."""
    magnetization = transferred(design.remanent_magnetization, design.body.solid, body.solid)
    return State(body, design.gesture, magnetization, body.equilibrium(magnetization).positions)


def designed(body: Body, gesture: str, iterations: int, progress: bool = False) -> Design:
    """Search for the magnetization by L-BFGS from zero, and return the best design."""
    anchors, skin = body.anchors(gesture), body.solid.skin
    faces, targets = torch.tensor(body.faces), torch.tensor(anchors.targets)
    count = int(faces.max()) + 1
    shares = torch.zeros((count, 3), dtype=torch.float64, requires_grad=True)
    areas = torch.zeros(count, dtype=torch.float64)
    areas.index_add_(0, faces, torch.tensor(body.solid.mesh.surface.face_areas[skin.faces]))
    areas /= areas.sum()
    at_rest = ms.WarmStart(body.scene)

    def magnetization():
        return (LARGEST_MAGNETIZATION * ms.parametrize.softly_limited(shares, 1.0))[faces]

    def objective(*_):
        rest = at_rest(
            applied_flux_density=FLUX_DENSITY,
            values={skin: {"remanent_magnetization": magnetization()}},
        )
        squares = ms.objectives.shape_matching(rest.positions, targets, anchors.vertices)
        error = squares / (len(targets) * REACH**2)
        price = PRICE * ms.objectives.magnitude(ms.parametrize.softly_limited(shares, 1.0), areas)
        return error + price, {"error": error.detach()}

    found = ms.minimize(
        objective, [shares], ms.optim.LBFGS([shares]), max_iterations=iterations, progress=progress
    )
    with torch.no_grad():
        final = magnetization().numpy().copy()
    return Design(body, gesture, final, body.equilibrium(final).positions, found.history)
