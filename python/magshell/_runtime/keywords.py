"""What `values` may say of a solve itself, and the keywords that are short forms of it: controls, damping."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

FLUX_DENSITY = "applied_flux_density"
FACTORS = ("load_factor", "gravity_factor", "field_factor", "support_factor")
CONTROLS = (FLUX_DENSITY, *FACTORS)
OF_MOTION = (
    "damping",
    "stiffness_damping",
    "maxwell_modulus",
    "maxwell_time",
)  # which ms.simulate has beside them


def controls_of(owner, scene) -> tuple[str, ...]:
    """What an object has that is no value in the core: all belongs to the scene, its uniform field's to that as well."""
    if owner is scene:
        return (*CONTROLS, *OF_MOTION)
    return (FLUX_DENSITY,) if getattr(owner, "_is_uniform", False) else ()


def as_keywords(scene, named: dict[Any, Any], known) -> dict[Any, Any]:
    """The keywords of a solve with what `values` say of it among them, as far as it has such a keyword (`known`).

    Raises ValueError where one is given twice. What else is wrong with `values` is told where they are checked.
    """
    values = named.get("values")
    if not isinstance(values, dict):
        return named
    kept, controls = {}, {}
    for owner, of_owner in values.items():
        its_own = controls_of(owner, scene) if any(owner is each for each in (scene, *_fields(scene))) else ()
        if not isinstance(of_owner, dict) or not its_own:
            kept[owner] = of_owner
            continue
        rest = dict(of_owner)
        for name in its_own:
            if name not in of_owner or name not in known:
                continue
            if named.get(name) is not None:
                raise ValueError(f"{name} was given twice: as an argument and in values")
            if name in controls:
                raise ValueError(f"{name} was given twice in values: of the scene and of its UniformField")
            controls[name] = rest.pop(name)
        if rest or not of_owner:
            kept[owner] = rest
    return {**named, **controls, "values": kept or None}


def check_known(function: str, named, known, groups: dict[str, type[Any]]) -> None:
    """Raises TypeError on a keyword that a function does not have: with the group that has it, {parameter: dataclass},
    or the keywords that are most like it."""
    for name in named:
        if name in known:
            continue
        for parameter, group in groups.items():
            for field in group.__dataclass_fields__:
                if name in (field, f"{parameter}_{field}"):
                    there = f"{parameter}=ms.{group.__name__}({field}=...)"
                    raise TypeError(f"{function}() has no keyword {name!r}: it is said by {there}")
        there = [each for each in known if each != "self"]
        use = f"{use}; it has" if (use := meant(name, there)) else "it has, most like it first"
        raise TypeError(f"{function}() has no keyword {name!r}; {use}: {nearest_first(name, there)}")


# What other programs and textbooks call things, and their names here, of which a function may have one.
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
    """Return "use ..." with the names, of those that are there, that one from elsewhere stands for; empty without one."""
    for own, others in _ELSEWHERE.items():
        if name in others and set(own.split(" and ")) <= set(there):
            return f"use {own}"
    return ""


def nearest_first(name, names) -> str:
    """The names that there are, the one most like `name` in front."""
    from difflib import SequenceMatcher  # for errors alone

    return ", ".join(sorted(sorted(names), key=lambda each: -SequenceMatcher(None, str(name), each).ratio()))


def _fields(scene) -> tuple[Any, ...]:
    return tuple(getattr(scene, "fields", ()))
