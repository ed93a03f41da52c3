"""The table of quantities that solves take as keywords: checks, docstrings and lists of names are made from it.

Signatures are written out in the functions, so that help() and type checkers see them; tests/input/test_solve_keywords.py
holds them equal to the table. `solve_entry` puts the texts where a docstring has the line "{keywords}".
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import Any, NamedTuple

_LINE = 120  # characters of a line of a docstring

_FINDERS = ("equilibrium", "find_equilibria", "energies", "energy", "forces", "hessian")
_STATIC = (*_FINDERS, "follow_path", "linear_response", "linear_buckling")
_MOTION = ("simulate",)


class SolveKeyword(NamedTuple):
    """One row of the table.

    shapes: those of one load case, or at one time; "n_v" stands for the number of vertices of the scene, "n" for any.
    solves: names of the functions that have the keyword.
    text: for the docstring of the first of them; the others refer to it. motion_text: for ms.simulate, if that differs.
    group: "load parameter", "damping", "shell" (the shell's constructor checks the value) or "solve".
    default: that of the signatures. minimum: "positive", "not negative", or "" for any number.
    varies: whether it may vary in time in ms.simulate.
    """

    name: str
    unit: str
    shapes: tuple[tuple[int | str, ...], ...]
    solves: tuple[str, ...]
    text: str
    motion_text: str = ""
    group: str = "solve"
    default: Any = None
    minimum: str = ""
    varies: bool = False


_FACTORS = "multiply the loads, gravity, the field sources, and the prescribed motions of supports; (k,) with k load cases."
_FACTORS_IN_TIME = "as in ms.equilibrium; numbers, or in time as above."
_SHELL = "replace the shell's own values in this solve."
_MAXWELL = (
    "Maxwell branches beside the elastic stiffness of all bodies: their moduli over the elastic one, and their relaxation "
    "times, s; numbers of one branch, or (n,) of a Prony series of n. The elastic stiffness is that of slow loading and of "
    "statics, without the branches. They begin relaxed."
)


def _factor(name: str) -> SolveKeyword:
    return SolveKeyword(
        name, "1", ((),), _STATIC + _MOTION, _FACTORS, _FACTORS_IN_TIME, "load parameter", 1.0, varies=True
    )


def _of_shell(name: str, unit: str, per: str) -> SolveKeyword:
    return SolveKeyword(name, unit, ((), (per,)), _FINDERS + _MOTION, _SHELL, group="shell")


_TABLE = (
    SolveKeyword(
        "time_step",
        "s",
        ((),),
        _MOTION,
        "s, the length of a step; (m,), the lengths of m steps, which may be more than `steps` if they fill as many equal "
        "intervals; or ms.Adaptive, which chooses them.",
        minimum="positive",
    ),
    SolveKeyword(
        "remanent_magnetization",
        "A/m",
        ((3,), ("n_f", 3)),
        _STATIC + _MOTION,
        "A/m, rest frame, world axes: (n_f, 3), or (3,) on every face. Needed in a scene with a field.",
    ),
    SolveKeyword(
        "applied_flux_density",
        "T",
        ((3,),),
        _STATIC + _MOTION,
        "T, (3,): the value of the scene's UniformField. (k, 3): k load cases, which return k equilibria.",
        "T: constant (3,); per step (steps, 3); at the ends of all steps (steps + 1, 3), interpolated linearly; or a "
        "function of the time [s] that returns (3,). The time is that in `times`: 0 at the beginning of a motion, and it "
        "goes on if `start` is a motion. Arrays begin with the first step of this call.",
        "load parameter",
        varies=True,
    ),
    *map(_factor, ("load_factor", "gravity_factor", "field_factor", "support_factor")),
    _of_shell("thickness", "m", "n_f"),
    _of_shell("young_modulus", "Pa", "n_f"),
    _of_shell("poisson_ratio", "1", "n_f"),
    _of_shell("mass_density", "kg/m3", "n_f"),
    _of_shell("curvature_scale", "1", "n_e"),
    SolveKeyword(
        "vertex_loads",
        "N",
        (("n_v", 3),),
        _FINDERS + _MOTION,
        "N, (n_v, 3): replace all forces of the scene's loads.",
    ),
    SolveKeyword(
        "damping",
        "N s/m",
        ((), ("n_v",)),
        _MOTION,
        "N s/m, viscous, on every vertex or (n_v,).",
        group="damping",
        default=0.0,
        minimum="not negative",
    ),
    SolveKeyword(
        "stiffness_damping",
        "s",
        ((),),
        _MOTION,
        "s: the factor between the stress of the strain rate and that of an equal strain. For small motions the damping "
        "matrix is this factor times the stiffness matrix.",
        group="damping",
        default=0.0,
        minimum="not negative",
    ),
    SolveKeyword(
        "maxwell_modulus",
        "1",
        ((), ("n",)),
        _MOTION,
        _MAXWELL,
        group="damping",
        default=0.0,
        minimum="not negative",
    ),
    SolveKeyword("maxwell_time", "s", ((), ("n",)), _MOTION, _MAXWELL, group="damping", minimum="positive"),
    SolveKeyword(
        "velocities",
        "m/s",
        (("n_v", 3), (3,)),
        _MOTION,
        "m/s, (n_v, 3), or (3,) for all vertices; by default those of `start` if it is a motion, else zero.",
    ),
)

SOLVE_KEYWORDS: dict[str, SolveKeyword] = {each.name: each for each in _TABLE}


def names_of(group: str) -> tuple[str, ...]:
    """Return the keywords of a group, in the order of the table."""
    return tuple(each.name for each in _TABLE if each.group == group)


def keywords_of(solve: str) -> tuple[SolveKeyword, ...]:
    """Return the rows of the keywords that a function has, in the order of the table."""
    return tuple(each for each in _TABLE if solve in each.solves)


def given_to(solve: str, arguments: dict[str, Any]) -> dict[str, Any]:
    """Return those of a function's arguments that are in the table, and `values`: {name: value}.

    arguments: the function's locals() at its beginning.
    """
    return {name: arguments[name] for name in (*(each.name for each in keywords_of(solve)), "values")}


def with_keywords(solve: str, docstring: str | None) -> str | None:
    """Return the docstring of a function with the texts of its keywords instead of the line "{keywords}"."""
    if docstring is None or "{keywords}" not in docstring:
        return docstring
    return docstring.replace("    {keywords}", "\n".join(_paragraphs(solve)))


def _paragraphs(solve: str) -> Iterator[str]:
    """Yield the lines on each keyword of a function; consecutive keywords with one text are named together."""
    named: dict[str, list[str]] = {}
    for each in keywords_of(solve):
        named.setdefault(_text(each, solve), []).append(each.name)
    for text, names in named.items():
        yield textwrap.fill(
            f"{', '.join(names)}: {text}",
            _LINE,
            initial_indent="    ",
            subsequent_indent="        ",
            break_long_words=False,
            break_on_hyphens=False,
        )


def _text(keyword: SolveKeyword, solve: str) -> str:
    if solve == "simulate" and keyword.motion_text:
        return keyword.motion_text
    return keyword.text if solve == keyword.solves[0] else f"as in ms.{keyword.solves[0]}."
