"""The inputs by which a kind of scene can be differentiated: found, not listed.

A new value of an object (`_replaceable`), or a new keyword of a solve, is an input by being there.
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
import pytest
from gradient_shapes import BoundShape, is_bound

import magshell as ms
from magshell.model.scene.reshaped import reshaped
from magshell.model.solids.materials import SolidMaterial

torch = pytest.importorskip("torch")
IN_TIME = ", in time"
# Filters of warnings: the scenes have a dozen elements, and steps that are long for their bodies.
OF_SMALL_SCENES = [
    f"ignore::magshell.{kind}Warning"
    for kind in (
        "StepError",
        "LargeStrain",
        "MeshQuality",
        "Unit",
        "FieldSampling",
        "LinearTheory",
        "Susceptibility",
    )
]
# Keywords of a solve that are no numbers to differentiate by.
SETTINGS = {"batch", "threads", "scene", "values", "solver", "progress"}
SETTINGS_OF = {
    ms.equilibrium: SETTINGS
    | {"require_stable", "ignore_velocity_forces", "start"},  # wherever the search began: a tensor is refused
    ms.simulate: SETTINGS | {"steps", "integrator", "record_every", "adjoint_storage"},
}


@cache
def continuous(solve) -> set[str]:
    """Return the keywords of ms.equilibrium or ms.simulate that are inputs."""
    return set(inspect.signature(solve).parameters) - SETTINGS_OF[solve]


@dataclass(frozen=True)
class Kind:
    """A kind of scene, and how it is solved.

    solve: (scene, start=None, **keywords) to what has positions; function: the one of magshell behind it. inputs: by
    keyword, the inputs that belong to no object. fixed: other keywords. step: of differences, over the size of a
    value; reach: that size, where it is not the value's own. in_time: steps of the motion over which everything
    varies_in_time somewhere that can, or 0. keeps_shape: whether the solve takes no rest positions. by_default: names of
    values that stay as they were made where all inputs are given together, as they follow from rest positions then.
    """

    scene: ms.Scene
    inputs: dict[str, object]
    function: Callable = ms.equilibrium
    solve: Callable | None = None
    fixed: dict[str, object] = field(default_factory=dict)
    step: float = 1e-4
    reach: dict[str, float] = field(default_factory=dict)
    in_time: int = 0
    keeps_shape: bool = False
    by_default: tuple[str, ...] = ()

    def found(self, given: dict[tuple, object], start=None):
        """Find the solution with these inputs, {(object or None, name): value}, in place of its own."""
        keywords, values = {**self.fixed, **self.inputs}, {}
        for (owner, name), value in given.items():
            if owner is None:
                keywords[name] = value
            elif isinstance(owner, BoundShape):
                for body, rest in owner.bodies(value).items():
                    values.setdefault(body, {})[name] = rest
            else:
                values.setdefault(owner, {})[name] = value
        if start is not None:
            keywords["start"] = start
        return (self.solve or self.function)(self.scene, values=values, **keywords)

    @cached_property
    def of_objects(self) -> dict[tuple, np.ndarray]:
        """The values of all objects in the scene, {(object, name): value}."""
        owners = (self.scene, *self.scene.objects)
        moving = self.function is ms.simulate
        found = {
            (owner, name): self._over_time(owner, name, np.array(value, dtype=np.float64))
            for owner in owners
            for name, value in _values_of(self.scene, owner, moving).items()
            if name != "rest_positions" or not self.keeps_shape
        }
        if is_bound(self.scene) and not self.keeps_shape:
            found[BoundShape(self.scene), "rest_positions"] = np.array(self.scene.mesh.rest_positions)
        return found

    def varies_in_time(self, owner, name: str) -> bool:
        """Return whether this value is another at each end of a step."""
        return self.in_time > 0 and name in getattr(owner, "_in_time", ())

    def _over_time(self, owner, name: str, value: np.ndarray) -> np.ndarray:
        if not self.varies_in_time(owner, name):
            return value
        rng = np.random.default_rng(len(name))
        way = self.reach.get(name, 0.1 * np.abs(value).max()) * admissible(
            (owner, name), rng.standard_normal(value.shape)
        )
        share = np.linspace(0.0, 1.0, self.in_time + 1).reshape(-1, *(1 for _ in value.shape))
        return value + 0.3 * share * (0.5 + share) * way

    @cached_property
    def of_solve(self) -> dict[tuple, np.ndarray]:
        """The keywords as {(None, keyword): value}: load parameters, and uniform values of the objects."""
        own = {(None, name): np.array(value, dtype=np.float64) for name, value in self.inputs.items()}
        for (owner, name), value in self.of_objects.items():
            if owner is self.scene and name in continuous(self.function):
                own[None, name] = value
            inside = (
                isinstance(owner, ms.Solid) and name == "remanent_magnetization"
            )  # the keyword is of faces
            # With several bodies only `values` can set this.
            if self.scene.bodies == (owner,) and name in continuous(self.function) and not inside:
                own[None, name] = value.mean()
        return own

    @cached_property
    def together(self) -> dict[tuple, np.ndarray]:
        """The inputs, each once and slightly changed, so that none has a default value."""
        once = {key: value for key, value in self.entries.items() if self._once(key)}
        rng = np.random.default_rng(23)
        off = {key: admissible(key, 0.02 * rng.uniform(-1, 1, value.shape)) for key, value in once.items()}
        # Rest positions move by a tenth of a millimetre: contacts neither begin nor end.
        moved = {
            (owner, name): value
            + off[owner, name] * (5e-3 if name == "rest_positions" else self.reach.get(name, value))
            if self.varies_in_time(owner, name) or name == "rest_positions"
            else value * (1.0 + off[owner, name])
            for (owner, name), value in once.items()
        }
        if self.scene.rigid_parts:  # which a start must not bend
            given = ("start", "velocities", "rest_positions")
            moved |= {key: value for key, value in once.items() if key[1] in given}
        return moved

    def _once(self, key: tuple) -> bool:
        owner, name = key
        return name in self.inputs if owner is None else name not in ("vertex_loads", *self.by_default)

    @cached_property
    def entries(self) -> dict[tuple, np.ndarray]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the mesh at other rest positions
            return {**self.of_solve, **self.of_objects}


def admissible(key: tuple, direction: np.ndarray) -> np.ndarray:
    """Return the admissible part of a direction: the value's free components, and symmetric where the value is."""
    direction = free(key) * direction
    if key[1] in ("growth", "rest_curvature") and direction.shape[-2:] == (3, 3):
        return 0.5 * (direction + np.swapaxes(direction, -1, -2))
    return direction


def free(key: tuple) -> np.ndarray | float:
    """Return 1 for the components of a value that may change at all, and 0 for the others."""
    owner, name = key
    if isinstance(owner, ms.Pin | ms.Periodic) and name == "displacement":
        return np.array([float(axis in owner.components) for axis in "xyz"])
    return 1.0


def label(kind: Kind, key: tuple) -> str:
    """Return the name of an input for messages."""
    owner, name = key
    if owner is None:
        return name
    if isinstance(owner, BoundShape):
        return name
    owners = [kind.scene, *kind.scene.objects]
    number = next(k for k, each in enumerate(owners) if each is owner)
    return f"{type(owner).__name__}[{number}].{name}"


def subject(kind: Kind, key: tuple) -> tuple:
    """Return (class or function, name) of an input, by which coverage is counted; one over time is a different one."""
    owner, name = key
    if owner is not None and kind.varies_in_time(owner, name):
        name += IN_TIME
    return (kind.function if owner is None else type(owner), name)


def subjects() -> set[tuple]:
    """Return all subjects: keywords of solves, and values of every class that a scene may hold."""
    classes = [
        each for module in (ms, ms.obstacles) for each in vars(module).values() if isinstance(each, type)
    ]
    of_classes = {
        (each, name)
        for each in classes
        if not inspect.isabstract(each)
        for name in (
            *_names_of(each),
            *(name + IN_TIME for name in getattr(each, "_in_time", ())),
        )
    }
    return of_classes | {(solve, name) for solve in SETTINGS_OF for name in continuous(solve)}


def _names_of(kind: type) -> tuple[str, ...]:
    """Return the names of the values of a class; a solid's are its materials'."""
    if kind is not ms.Solid:
        return getattr(kind, "_replaceable", ())
    materials = [
        each for each in vars(ms).values() if isinstance(each, type) and issubclass(each, SolidMaterial)
    ]
    return tuple(
        {name for each in materials for name in each._ranges}
        | {"mass_density", "remanent_magnetization", "rest_positions"}
    )


def rest_positions_follow(scene: ms.Scene, body) -> bool:
    """Return whether there is a gradient by the rest positions of a body of the scene, in all directions."""
    if is_bound(scene):
        return False  # there is one by those of all bodies together: BoundShape
    given = torch.tensor(body.rest_positions, requires_grad=True)
    try:
        reshaped(scene, {body: {"rest_positions": given}})
    except (ms.NoGradient, ValueError):
        return False
    return True


def _values_of(scene: ms.Scene, owner, moving: bool) -> dict[str, object]:
    """Return the present values of an object that a solve of this scene may override; a new one must be added here."""
    names = getattr(owner, "_replaceable", ())
    if owner is scene:
        layout, key = scene._value_layout, ("loads", "forces")
        loads = layout.of(scene._values.numbers, *key) if key in layout else np.zeros(0)
        loads = loads[: scene.mesh.n_vertices]
        values = {"gravity": scene.gravity, "vertex_loads": loads}
        absent = {name for name, value in values.items() if not np.any(value)}
    elif isinstance(owner, ms.Contact):
        values = dict(zip(names, owner._law(*scene._values.contact_bodies(owner)), strict=True))
        absent = set() if scene.has_forces_of_motion else {"friction_coefficient"}
    elif isinstance(owner, ms.BodyContact):
        values = {name: getattr(owner, name) for name in names}
        absent = {name for name in names if values[name] is None}
        if owner.law == "barrier":
            absent.add("smoothing")
        if not moving:
            absent |= {"friction_coefficient", "static_friction_coefficient", "sticking_speed"}
    elif isinstance(owner, ms.Pin | ms.Clamp):
        motion = owner._held(scene._bodies.of(owner).mesh)[0].move
        values = {} if motion is None else {**motion._asdict(), "displacement": motion.translation}
        absent = set(names) if motion is None else set()
    elif isinstance(owner, ms.Periodic):
        values = {"displacement": owner.displacement}
        absent = set(names) if owner.displacement is None else set()
    elif isinstance(owner, ms.PlacedField):
        values, absent = {**owner.field._made_from, **owner._made_from}, set()
    elif isinstance(owner, ms.SampledField):
        values, absent = owner._made_from, set()
    else:
        values = {name: getattr(owner, name) for name in names}
        absent = set()
        if isinstance(owner, ms.RigidBody):
            absent = {name for name in names if values[name] is None}
        if isinstance(owner, ms.Shell):
            weightless = not (moving or scene.gravity.any())
            absent = {"mass_density"} if weightless else set()
            if owner.remanent_magnetization is None:  # the solve says it
                absent.add("remanent_magnetization")
        if isinstance(owner, ms.Shell | ms.Solid) and not rest_positions_follow(scene, owner):
            absent.add("rest_positions")
    return {name: values[name] for name in names if name not in absent}
