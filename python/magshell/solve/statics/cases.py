"""Load cases: one scene, the same design, several fields or loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from numbers import Number
from typing import Any

from ..._input.quantity import shape_of
from ..._runtime.keywords import FLUX_DENSITY, LOAD_PARAMETERS
from ..._runtime.solve_keywords import SOLVE_KEYWORDS
from ...errors import DesignRejected, Interrupted, NotConverged
from ...model.scene.scene import Scene
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .single_solve import Search, find

_DIMENSIONS = {name: len(SOLVE_KEYWORDS[name].shapes[0]) for name in LOAD_PARAMETERS}  # of one case


def _check_shape(name: str, shape: tuple[int, ...]) -> None:
    """Raise ValueError for a shape that is neither of one load case nor of several."""
    if name == FLUX_DENSITY and not (len(shape) in (1, 2) and shape[-1] == 3):
        raise ValueError(f"{name} [T] must have shape (3,), or (k, 3) for k load cases, got {shape}")
    if name != FLUX_DENSITY and len(shape) > 1:
        raise ValueError(f"{name} [1] must be a number, or have shape (k,) for k load cases, got {shape}")


def split(arguments: dict[Any, Any]) -> list[dict[Any, Any]] | None:
    """Split the arguments of several load cases, one dict each; return None for a single case.

    Raises ValueError if arguments have different numbers of cases.
    """
    for name, value in arguments.items():
        if name in _DIMENSIONS and (isinstance(value, Number | list | tuple) or hasattr(value, "ndim")):
            _check_shape(name, shape_of(name, value))
    of_cases = {
        name: arguments[name]
        for name, dimensions in _DIMENSIONS.items()
        if arguments.get(name) is not None and len(shape_of(name, arguments[name])) == dimensions + 1
    }
    if not of_cases:
        return None
    counts = {name: len(value) for name, value in of_cases.items()}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{name} of {count}" for name, count in counts.items())
        raise ValueError(f"every load case needs a value of its own: got {told}")
    count = next(iter(counts.values()))
    if count == 0:
        raise ValueError(f"{next(iter(counts))} has no load case in it")
    return [{**arguments, **{name: value[k] for name, value in of_cases.items()}} for k in range(count)]


def join(found: Sequence[Equilibrium], of_cases: bool) -> Equilibrium | EquilibriumSet:
    """Return the equilibria as a set if there were load cases, else the only one."""
    return EquilibriumSet(found) if of_cases else found[0]


def starts_of(start: Any, count: int) -> Sequence[Any]:
    """Return the start of each load case."""
    if not isinstance(start, EquilibriumSet):
        return [start] * count
    if len(start) != count:
        raise ValueError(f"start holds {len(start)} equilibria, for {count} load cases")
    return start


def of_case(error: BaseException, number: int, count: int, last_good: Any) -> BaseException:
    """Return the error with the number of its load case in the message."""
    told = f"load case {number} of {count}: {error}"
    if isinstance(error, DesignRejected):
        return type(error)(told, last_good, load_case=number)
    return type(error)(told, last_good)


def find_all(
    scene: Scene, cases: list[dict[Any, Any]], starts: Sequence[Any], search: Search
) -> EquilibriumSet:
    """Find the equilibrium of each load case.

    An error says which case failed; its `last_good` has the cases before and the last state of this one.
    """
    found: list[Equilibrium] = []
    for k, (arguments, start) in enumerate(zip(cases, starts, strict=True)):
        search.note(f"load case {k + 1} of {len(cases)}")
        try:
            found.append(find(scene, arguments, start, _part_of(search, k, len(cases))).equilibrium)
        except (NotConverged, Interrupted) as error:
            raise of_case(error, k, len(cases), EquilibriumSet([*found, error.last_good])) from error
        except ValueError as error:
            raise ValueError(f"load case {k} of {len(cases)}: {error}") from error
    return EquilibriumSet(found)


def _part_of(search: Search, k: int, count: int) -> Search:
    """Return the search whose progress is reported as a fraction of that of all load cases."""
    if search.progress is None:
        return search
    return replace(
        search, progress=lambda progress, residual: search.progress((k + progress) / count, residual)
    )
