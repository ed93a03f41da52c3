"""The numbers of a scene as the core takes them, some replaced for one solve; gradients on the way back."""

from __future__ import annotations

import numpy as np

from . import _constraints
from .field import UniformField
from .loads import EdgeCouple


class Values:
    """A scene's values, its own or with `replaced`: {object of the scene: {name: array}}.

    The scene itself has the names "gravity" and "vertex_loads". Raises ValueError where a value does not fit.
    """

    def __init__(
        self, scene, constraints: _constraints.Constraints, replaced: dict[object, dict] | None = None
    ):
        self._scene = scene
        self._now = {
            item: item.replaced(**values) for item, values in (replaced or {}).items() if item is not scene
        }
        self.shell = self.current(scene.shell)
        self._constraints = constraints
        if any(support in self._now for support in scene.supports):
            self._constraints = self._moved(constraints)
        own = (replaced or {}).get(scene, {})
        self.gravity = own.get("gravity", scene.gravity)
        self._heavy = bool(scene.gravity.any())
        self.couple_edges, couples = self._couples()
        obstacles = [self.current(each) for each in scene.obstacles]
        self.core = {
            "thickness": self.shell.thickness,
            "young_modulus": self.shell.young_modulus,
            "poisson_ratio": self.shell.poisson_ratio,
            "curvature_scale": self.shell.curvature_scale,
            "vertex_mass": self.shell.vertex_masses if self._heavy else np.zeros(0),
            "gravity": self.gravity,
            "vertex_loads": own.get("vertex_loads", self._vertex_loads()),
            "couples": couples,
            "motions": np.array([motion[:3] for motion in self._constraints.motions]).reshape(-1, 3, 3),
            "contacts": np.array([self.current(each).law(self.shell) for each in scene.contacts]).reshape(
                -1, 5
            ),
            "placements": np.array([(now.center, now.rotation) for now in obstacles]).reshape(-1, 2, 3),
            "obstacles": [now._core for now in obstacles],
            "water": None if scene.water is None else self.current(scene.water)._core,
            "field_sources": [self.current(source)._core for source in _sources(scene)],
        }

    def same_as(self, other: Values) -> bool:
        mine, others = dict(self.core), dict(other.core)
        for objects in ("field_sources", "obstacles", "water"):
            if mine.pop(objects) != others.pop(objects):
                return False
        return all(np.array_equal(mine[name], others[name]) for name in mine)

    def gradients(self, owner, gradient: dict) -> dict[str, np.ndarray]:
        """By the values of one object of the scene, from the core's gradients; a row for each of its parts."""
        scene, mesh = self._scene, self._scene.mesh
        by_weights = gradient.get("vertex_weights")
        if owner is scene:
            found = {"vertex_loads": gradient.get("vertex_loads")}
            if by_weights is not None:
                found["gravity"] = self.shell.vertex_masses @ by_weights
            return found
        if owner is scene.shell:
            by_masses = gradient.get("mass")
            if by_weights is not None:
                by_masses = by_weights @ self.gravity + (0.0 if by_masses is None else by_masses)
            found = self.shell.gradients(by_masses, gradient)
            for contact, by_law in zip(scene.contacts, gradient["contacts"], strict=True):
                by_default = self.current(contact).by_thickness(self.shell, by_law)
                found["thickness"] = found["thickness"] + by_default
            return found
        if isinstance(owner, EdgeCouple):
            by_edge = np.zeros(mesh.n_edges)
            by_edge[self.couple_edges] = gradient["couples"]
            return owner.gradients(mesh, by_edge)
        if owner in scene.loads:
            return owner.gradients(mesh, gradient["vertex_loads"])
        if owner in scene.supports:
            return self._motion_gradients(self.current(owner), gradient["motions"])
        if owner in scene.contacts:
            return owner.gradients(gradient["contacts"][scene.contacts.index(owner)])
        if owner is scene.water:
            return gradient["water"]
        if owner in scene.obstacles:
            center, rotation = gradient["placements"][scene.obstacles.index(owner)]
            return {"center": center, "rotation": rotation}
        return owner.gradients(gradient["field_sources"][_sources(scene).index(owner)])

    def current(self, item):
        """An object of the scene as it is in this solve."""
        return self._now.get(item, item)

    def _moved(self, constraints: _constraints.Constraints) -> _constraints.Constraints:
        """The same constraints with other motions."""
        scene = self._scene
        supports = [self.current(support) for support in scene.supports]
        moved = _constraints.gather(scene.mesh, supports, scene._couple_directions)
        if not np.array_equal(moved.held_nodes, constraints.held_nodes):
            raise ValueError(
                "a support that stays cannot be moved by a solve: "
                "give it a displacement in the scene, zero will do"
            )
        return moved

    def _motion_gradients(self, support, by_motions: np.ndarray) -> dict[str, np.ndarray]:
        mine = [motion.support is support for motion in self._constraints.motions]
        center, rotation, displacement = by_motions[mine].sum(axis=0)
        return {"center": center, "rotation": rotation, "displacement": displacement}

    def _vertex_loads(self) -> np.ndarray:
        loads = [self.current(load) for load in self._scene.loads if not isinstance(load, EdgeCouple)]
        forces = [load.vertex_forces(self._scene.mesh) for load in loads]
        return np.sum(forces, axis=0) if forces else np.zeros((0, 3))

    def _couples(self) -> tuple[np.ndarray, np.ndarray]:
        """Edges and what turns them, N m."""
        loads = [self.current(load) for load in self._scene.loads if isinstance(load, EdgeCouple)]
        parts = [load.edge_couples(self._scene.mesh) for load in loads]
        if not parts:
            return np.zeros(0, dtype=np.int64), np.zeros(0)
        edges, couples = (np.concatenate(part) for part in zip(*parts, strict=True))
        unique, inverse = np.unique(edges, return_inverse=True)
        return unique, np.bincount(inverse, weights=couples)


def _sources(scene) -> list:
    return [field for field in scene.fields if not isinstance(field, UniformField)]
