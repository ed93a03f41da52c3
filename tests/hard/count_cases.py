"""Cases whose counts are kept: every family of effort.py, untuned scenes, motions, contact and projective iterations."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import effort
import untuned_scenes

import magshell as ms
from benchmarks import motion_costs, projective_motions, surrounding_costs, thrown_bars

Counted = tuple[str, str, Callable[[], object]]  # family, case, the call to be counted

INTEGRATORS = (ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3())


def all_families() -> Iterator[Counted]:
    """Yield family, case and call of all that is counted."""
    for name, run in effort.all_named():
        if _is_counted(name):
            family, _, case = name.partition("/")
            yield family, case, run
    yield from untuned_scenes.counted()
    yield from _motions()
    yield from _projective()


def _is_counted(name: str) -> bool:
    """Return whether a case of effort.py is small enough for everyday runs."""
    parts = name.split("/")
    if parts[0] == "C1":
        return (parts[2] == "10x1" and parts[3] in ("2", "10", "50")) or parts[1:] == ["150", "40x4", "10"]
    if parts[0].startswith("A8"):
        return parts[1] == "8x8" or parts[1:] in (["12x12", "2000"], ["12x12", "-1000"])
    if parts[0] == "A6":
        return parts[1] == "8x8"
    if parts[0] == "rolled":
        return (parts[2] == "25x1" and parts[3] in ("1e-05", "0.001")) or parts[2:] == ["40x2", "0.01"]
    return name not in COSTLY


# Cases that take seconds each, or (scaling) repeat their solve for a given time.
COSTLY = {
    "hard solids/scaling",
    "hard contact/slope in steps, 1e-05",
    "hard contact/dropped, 10",
    "hard time steps/weak jumps",
    "hard cavities/filled, 30",
    "hard fields/against",
    "hard large rotations/twisted and back",
    "hard saddles/flat strip between clamps, 0.001",
    "hard saddles/flat strip between clamps, 0.0001",
    "hard saddles/strip magnetized against the field, 40",
    "hard slivers/far bent strip with a tinier face",
    "hard slivers/far bent strip with a face of nanometres",
    "hard solids/comes to rest, Corotated",
    "hard solids/crumples",
    "hard starts/folded",
    "hard starts/inverted",
    "hard starts/upside down",
    "hard starts/half size",
    "hard starts/rolled",
    "hard starts/random positions",
    "hard starts/squeezed",
}


def _motions() -> Iterator[Counted]:
    """Yield motions of sheets in a field, onto a floor and of bars that collide."""
    for method in INTEGRATORS:
        name = type(method).__name__
        sheet = motion_costs.strip((24, 4))
        yield "motions", name, lambda m=method, s=sheet: motion_costs.drive(s, 30, integrator=m)
    for name, each in surrounding_costs.SURROUNDINGS.items():
        yield (
            "surroundings",
            name,
            lambda e=each: surrounding_costs._motion(surrounding_costs.falling((12, 3), *e), 40, 1),
        )
        if each[0] is not None:
            yield (
                "surroundings, by default",
                name,
                lambda e=each: surrounding_costs._motion(surrounding_costs.falling((12, 3), *e), 40, 1, None),
            )
    for touching in (True, False):
        yield (
            "thrown bars",
            "touching" if touching else "free",
            lambda t=touching: thrown_bars.thrown(thrown_bars.bars((6, 3, 1), t), 8),
        )


def _projective() -> Iterator[Counted]:
    """Yield falling beams whose rounds of Projective Dynamics are counted, to a residual of 1e-6."""
    for name, history in projective_motions.HISTORIES.items():
        method = ms.ProjectiveDynamics(tolerance=1e-6, history=history)
        scene = projective_motions.beam(projective_motions.MATERIALS["Projective"], (12, 3, 3))
        yield "projective", name, lambda m=method, s=scene: projective_motions._drive(s, m, 4)
