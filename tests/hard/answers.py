"""Answers of hard cases: numbers near a reference, bounds, states, refusals."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from registry import Answer

import magshell as ms


def near(name: str, got, expected, *, rel: float = 0.0, scale: float | None = None) -> Answer:
    """Compare numbers with a reference within `rel` of the largest expected one, or of `scale`.

    The number farthest off is shown.
    """
    got, expected = np.atleast_1d(np.asarray(got, float)), np.atleast_1d(np.asarray(expected, float))
    if got.shape != expected.shape:
        return Answer(f"{name} of shape {expected.shape}", f"shape {got.shape}", False)
    scale = float(np.abs(expected).max()) if scale is None else scale
    errors = np.abs(got - expected) / scale
    worst = np.unravel_index(int(np.argmax(errors)), errors.shape)
    right = bool(np.isfinite(got).all() and errors[worst] <= rel)
    return Answer(
        f"{name} {expected[worst]:.6g} to {rel:.0e}", f"{got[worst]:.6g}, off by {errors[worst]:.1e}", right
    )


def below(name: str, got: float, limit: float) -> Answer:
    return Answer(f"{name} < {limit:.3g}", f"{got:.3g}", bool(got < limit))


def above(name: str, got: float, limit: float) -> Answer:
    return Answer(f"{name} > {limit:.3g}", f"{got:.3g}", bool(got > limit))


def holds(name: str, condition, got: str = "") -> Answer:
    return Answer(name, got or ("yes" if condition else "no"), bool(condition))


def both(*answers: Answer) -> Answer:
    """Combine several answers to one, which is right if all are."""
    return Answer(
        "; ".join(each.expected for each in answers),
        "; ".join(each.got for each in answers),
        all(each.right for each in answers),
    )


def refused(act: Callable[[], object], words: str, error: type[Exception] = ValueError) -> Answer:
    """Check that act() raises this error with a message that matches `words`."""
    expected = f"{error.__name__}: ...{words}..."
    try:
        result = act()
    except Exception as raised:
        right = isinstance(raised, error) and re.search(words, str(raised)) is not None
        return Answer(expected, f"{type(raised).__name__}: {raised}", right)
    return Answer(expected, f"no error, but {type(result).__name__}", False)


def at_rest(found: ms.Equilibrium) -> Answer:
    """Check that an equilibrium is stable and its forces balance to the solver's tolerance."""
    right = found.stable and found.load_fraction == 1.0 and found.residual <= 1e-10
    return Answer(
        "stable, in balance", f"{'stable' if found.stable else 'unstable'}, {found.residual:.0e}", right
    )
