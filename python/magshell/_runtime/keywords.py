"""Keywords of a solve that may be given in `values` as well: load parameters and damping. Messages on unknown
keywords."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .solve_keywords import names_of

FLUX_DENSITY = "applied_flux_density"
LOAD_PARAMETERS = names_of("load parameter")
FACTORS = tuple(name for name in LOAD_PARAMETERS if name != FLUX_DENSITY)
OF_MOTION = names_of("damping")  # keywords of ms.simulate only


def load_parameters_of(owner, scene) -> tuple[str, ...]:
    """Return the keywords of a solve that `values` may hold for an object, though they are no parameters in the core.

    These are all keywords for the scene, the flux density for its uniform field, and none for other objects.
    """
    if owner is scene:
        return (*LOAD_PARAMETERS, *OF_MOTION)
    return (FLUX_DENSITY,) if getattr(owner, "_is_uniform", False) else ()


def as_keywords(scene, named: dict[Any, Any], known) -> dict[Any, Any]:
    """Return the keywords of a solve, with those among `values` moved to the keywords that the function has
    (`known`).

    Raises ValueError if one is given twice. Other errors in `values` are reported where they are checked.
    """
    values = named.get("values")
    if not isinstance(values, dict):
        return named
    kept, load_parameters = {}, {}
    for owner, of_owner in values.items():
        its_own = (
            load_parameters_of(owner, scene)
            if any(owner is each for each in (scene, *_fields(scene)))
            else ()
        )
        if not isinstance(of_owner, dict) or not its_own:
            kept[owner] = of_owner
            continue
        rest = dict(of_owner)
        for name in its_own:
            if name not in of_owner or name not in known:
                continue
            if named.get(name) is not None:
                raise ValueError(f"{name} was given twice: as an argument and in values")
            if name in load_parameters:
                raise ValueError(f"{name} was given twice in values: of the scene and of its UniformField")
            load_parameters[name] = rest.pop(name)
        if rest or not of_owner:
            kept[owner] = rest
    return {**named, **load_parameters, "values": kept or None}


def check_known(function: str, named, known, groups: dict[str, type[Any]]) -> None:
    """Raise TypeError on an unknown keyword, naming the group {parameter: dataclass} that has it, or the most similar
    keywords."""
    for name in named:
        if name in known:
            continue
        for parameter, group in groups.items():
            for field in group.__dataclass_fields__:
                if name in (field, f"{parameter}_{field}"):
                    there = f"{parameter}=ms.{group.__name__}({field}=...)"
                    raise TypeError(f"{function}() has no keyword {name!r}; use {there}")
        there = [each for each in known if each != "self"]
        has = f"it has, most like it first: {nearest_first(name, there)}"
        if use := meant(name, there):
            named = use.removeprefix("use ").split(" and ")
            has = f"{use}; it has: {', '.join([*named, *(each for each in there if each not in named)])}"
        raise TypeError(f"{function}() has no keyword {name!r}; {has}")


# Names of quantities in other programs and textbooks, by the keyword that magshell uses.
_ELSEWHERE = {
    "young_modulus": ("E", "Y", "youngs_modulus", "elastic_modulus", "modulus", "stiffness"),
    "poisson_ratio": ("nu", "poisson", "poissons_ratio"),
    "mass_density": ("rho", "density"),
    "thickness": ("h", "t"),
    "applied_flux_density": (
        "B",
        "b",
        "B0",
        "B_a",
        "B_applied",
        "field",
        "applied_field",
        "flux_density",
        "magnetic_field",
    ),
    "remanent_magnetization": ("M", "Mr", "M_r", "magnetization", "magnetisation", "remanence"),
    "steps and time_step": ("duration", "T", "t_end", "t_max", "tmax", "end_time", "time", "times"),
    "time_step": ("dt", "timestep", "delta_t", "step_size"),
    "steps": ("n_steps", "num_steps", "nsteps", "number_of_steps", "n"),
    "gravity": ("g",),
    "cells": ("n", "resolution", "divisions"),
}


def meant(name: str, there: Iterable[str]) -> str:
    """Return "use KEYWORD" if `name` is what other programs call one of the keywords `there`, else ""."""
    for own, others in _ELSEWHERE.items():
        if name in others and set(own.split(" and ")) <= set(there):
            return f"use {own}"
    return ""


def nearest_first(name, names) -> str:
    """Return the names as text: those that begin with `name` first, then the most similar to it."""
    from difflib import SequenceMatcher  # for errors alone

    def distance(each: str) -> tuple[bool, float]:
        return not each.startswith(str(name)), -SequenceMatcher(None, str(name), each).ratio()

    return ", ".join(sorted(sorted(names), key=distance))


def _fields(scene) -> tuple[Any, ...]:
    return tuple(getattr(scene, "fields", ()))
