"""Checks the value of a keyword of a solve by its row in the table of such keywords."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._runtime.solve_keywords import SolveKeyword
from .quantity import label, quantity, shape_of


def keyword_value(keyword: SolveKeyword, value: Any, sizes: Mapping[str, int]) -> np.ndarray:
    """Return the value as an array of finite numbers of one of the keyword's shapes.

    sizes: {"n_v": number of vertices, ...}, for the letters in the shapes; "n" stands for any size but zero. Raises
    ValueError with name, unit and shapes, or if a number is below the keyword's minimum.
    """
    name, unit, named = keyword.name, keyword.unit, label(keyword.name, keyword.unit)
    shapes = [tuple(sizes.get(each, each) for each in shape) for shape in keyword.shapes]
    shape = shapes[0]
    if len(shapes) > 1 and not any(_fits(shape := shape_of(named, value), each) for each in shapes):
        texts = [_described(*each) for each in zip(keyword.shapes, shapes, strict=True) if each[0]]
        number = "be a number or " if () in shapes else ""
        raise ValueError(f"{named} must {number}have shape {' or '.join(texts)}, got {shape}")
    array = quantity(name, unit, value, shape)
    if keyword.minimum and (array < 0 if keyword.minimum == "not negative" else array <= 0).any():
        what = f"got {array:g}" if array.ndim == 0 else f"but the smallest is {array.min():g}"
        which = "must not be negative" if keyword.minimum == "not negative" else "must be positive"
        raise ValueError(f"{named} {which}, {what}")
    return array


def _fits(shape: tuple[int, ...], wanted: tuple[int | str, ...]) -> bool:
    """Return whether a shape is the wanted one, in which "n" stands for any size but zero."""
    return len(shape) == len(wanted) and all(
        w == a or (w == "n" and a > 0) for a, w in zip(shape, wanted, strict=True)
    )


def _described(shape: tuple[int | str, ...], numbers: tuple[Any, ...]) -> str:
    letters = f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
    return letters if shape == numbers else f"{letters} = {numbers}"
