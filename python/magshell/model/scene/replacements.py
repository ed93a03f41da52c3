"""Collects and checks the values that a solve's arguments replace in its scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..._input.keyword_value import keyword_value
from ..._input.quantity import quantity
from ..._runtime.keywords import load_parameters_of, meant, nearest_first
from ..._runtime.solve_keywords import SOLVE_KEYWORDS
from ..loads.loads import DeadLoad
from ..shells.shell import Shell
from .time_varying import refuse_functions

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from .scene import Scene


def requested(
    scene: Scene,
    vertex_loads: Numbers,
    values: Any,
    moving: bool = False,
    in_time: bool = False,
    **shell: Any,
) -> dict[object, dict[str, object]]:
    """Collect the values that a solve's arguments replace: {object of the scene: {name: value}}.

    moving: the scene has inertia in this solve. in_time: values may change during it.
    Raises ValueError for a value that the scene or the solve does not have.
    """
    asked: dict[object, dict[str, object]] = {}
    if values is not None and not isinstance(values, dict):
        raise ValueError(
            f"values must be a dict {{object of the scene: {{name: value}}}}, got {type(values).__name__}"
        )
    for owner, named in (values or {}).items():
        _check(scene, owner, named)
        for name, value in named.items():
            if not in_time:
                refuse_functions(owner, name, value, in_time)
        asked[owner] = dict(named)
    for name, value in shell.items():
        if value is not None:
            body = _one_body(scene, name)
            if name not in body._replaceable:
                raise ValueError(f"{name} was given, but a {type(body).__name__} has none: {body!r}")
            _add(asked, body, name, value)
    if vertex_loads is not None:
        _add(asked, scene, "vertex_loads", vertex_loads)
    _check_against_scene(scene, asked, moving)
    return asked


def checked(scene: Scene, owner: Any, name: str, value: Any) -> Any:
    """Return a value of the scene itself after a check of its shape; constructors check those of other objects."""
    if owner is not scene:
        return value
    if name == "gravity":
        return quantity("gravity", "m/s2", value, (3,))
    return keyword_value(SOLVE_KEYWORDS[name], value, {"n_v": scene.mesh.n_vertices})


def _add(asked: dict[Any, Any], owner, name: str, value) -> None:
    if name in asked.setdefault(owner, {}):
        raise ValueError(f"{name} was given twice: as an argument and in values")
    asked[owner][name] = value


def _one_body(scene, name: str) -> Shell:
    if len(scene.bodies) > 1:
        raise ValueError(
            f"{name} was given as an argument, but the scene has {len(scene.bodies)} bodies: say whose it is, "
            f"values={{body: {{{name!r}: ...}}}}"
        )
    return scene.bodies[0]


def _check(scene, owner, named) -> None:
    if not any(owner is item for item in (scene, *scene.objects)):
        raise ValueError(f"values has a key that is not the scene, nor an object of it: {owner!r}")
    if not isinstance(named, dict):
        raise ValueError(f"values of {owner!r} must be a dict {{name: value}}, got {type(named).__name__}")
    names = (*getattr(owner, "_replaceable", ()), *load_parameters_of(owner, scene))
    for name in named:
        if name in load_parameters_of(owner, scene):  # a solve that has it has taken it already
            raise ValueError(f"{name} of the scene has no part in this solve: leave it out of values")
        if name not in names:
            what = f"it has {nearest_first(name, names)}" if names else "it has none that can be"
            what = f"{use}; {what}" if (use := meant(name, names)) else what
            raise ValueError(
                f"{type(owner).__name__} has no value {name!r} to be replaced in a solve: {what}"
            )


def _check_against_scene(scene, asked: dict[Any, Any], moving: bool) -> None:
    heavy = bool(scene.gravity.any())
    dense = any("mass_density" in asked.get(body, {}) for body in scene.bodies)
    idle_density = dense and not moving
    if not heavy and ("gravity" in asked.get(scene, {}) or idle_density):
        raise ValueError(
            "gravity or mass_density was given, but the scene has no gravity: Scene(..., gravity=...)"
        )
    if "vertex_loads" in asked.get(scene, {}):
        forces = [load for load in scene.loads if isinstance(load, DeadLoad)]
        if not forces:
            raise ValueError(
                "vertex_loads was given, but the scene has no PointLoad, EdgeLoad or AreaLoad: Scene(..., loads=...), zero "
                "will do"
            )
        if any(load in asked for load in forces):
            raise ValueError(
                "vertex_loads stands for all point, edge and area loads: leave them out of values"
            )
