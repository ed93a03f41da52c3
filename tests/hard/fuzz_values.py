"""Values that no function should choke on: junk of every type, and valid values spoilt in one way."""

from __future__ import annotations

import datetime
import decimal
import fractions
from collections.abc import Callable

import numpy as np

HUGE_COUNT = 2**31  # beyond every index; smaller ones would only ask for time


class Refuses:
    """Says that it is an array, a number and a sequence, and then is none of them."""

    def __array__(self, *_, **__):
        raise TypeError("no array")

    def __float__(self):
        raise TypeError("no number")

    def __len__(self):
        raise TypeError("no length")

    def __iter__(self):
        raise TypeError("no items")


class Subclass(np.ndarray):
    """An array of another class."""


def _structured() -> np.ndarray:
    return np.zeros(3, dtype=[("x", float), ("y", int)])


def _recursive() -> list:
    itself: list = []
    itself.append(itself)
    return itself


JUNK: tuple[Callable[[], object], ...] = (
    lambda: None,
    lambda: True,
    lambda: "",
    lambda: "xyz",
    lambda: "\0",
    lambda: "x" * 10_000,
    lambda: b"bytes",
    lambda: object(),
    lambda: object,
    lambda: [],
    lambda: (),
    lambda: {},
    lambda: {"x": 1.0},
    lambda: {1, 2, 3},
    lambda: {1: 2},
    lambda: 0,
    lambda: -1,
    lambda: 1,
    lambda: HUGE_COUNT,
    lambda: 2**63,
    lambda: 10**30,
    lambda: -(10**30),
    lambda: 10**400,
    lambda: 0.0,
    lambda: -0.0,
    lambda: 0.5,
    lambda: 1e308,
    lambda: -1e308,
    lambda: 5e-324,
    lambda: float("nan"),
    lambda: float("inf"),
    lambda: float("-inf"),
    lambda: 1j,
    lambda: fractions.Fraction(1, 3),
    lambda: decimal.Decimal("0.1"),
    lambda: datetime.timedelta(1),
    lambda: [1, [2, 3]],
    lambda: [[1.0, 2.0, 3.0], [4.0, 5.0]],
    lambda: [None],
    lambda: [(0, 0, 0)],
    lambda: _recursive(),
    lambda: range(3),
    lambda: (i for i in range(3)),
    lambda: lambda *arguments, **named: None,
    lambda: lambda *arguments, **named: "text",
    lambda: lambda points, *arguments: np.zeros(np.shape(points)),
    lambda: lambda *arguments, **named: np.zeros(3),
    lambda: np.array(3.0),
    lambda: np.zeros((0, 3)),
    lambda: np.zeros(0),
    lambda: np.zeros(3),
    lambda: np.zeros((3, 3)),
    lambda: np.zeros((2, 3, 4, 5)),
    lambda: np.zeros((1,) * 20),
    lambda: np.ones(3, dtype=bool),
    lambda: np.array([None, 1], dtype=object),
    lambda: np.array(["a", "b", "c"]),
    lambda: np.array(["2026-01-01"], dtype="datetime64[D]"),
    lambda: np.array([1, 2, 3], dtype=np.uint64) + np.uint64(2**63),
    lambda: np.ma.masked_array([1.0, 2.0, 3.0], mask=[0, 1, 0]),
    lambda: np.broadcast_to(1.0, (100, 100, 100)),
    lambda: np.float16(70000.0),
    lambda: np.int8(-5),
    lambda: np.datetime64("NaT"),
    lambda: memoryview(b"abc"),
    lambda: _structured(),
    lambda: Refuses(),
)


def junk(rng: np.random.Generator):
    return JUNK[rng.integers(len(JUNK))]()


def spoilt(valid, rng: np.random.Generator):
    """Return the value with an error or an oddity in it; junk where its kind has none of its own."""
    if isinstance(valid, bool) or valid is None:
        return junk(rng)
    if isinstance(valid, int | float):
        return _NUMBERS[rng.integers(len(_NUMBERS))](valid)
    if isinstance(valid, tuple | list) and valid and all(isinstance(each, int | float) for each in valid):
        valid = np.array(valid)
    if isinstance(valid, np.ndarray) and valid.size:
        return _ARRAYS[rng.integers(len(_ARRAYS))](np.array(valid), rng)
    if isinstance(valid, list | tuple) and valid:
        kept = list(valid)
        kept[rng.integers(len(kept))] = junk(rng)
        return kept
    return junk(rng)


_NUMBERS: tuple[Callable[[float], object], ...] = (
    lambda x: -x,
    lambda x: 0 * x,
    lambda x: x * 1e200,
    lambda x: x * 1e-200,
    lambda x: float("nan"),
    lambda x: float("inf"),
    lambda x: -HUGE_COUNT,
    lambda x: str(x),
    lambda x: [x],
    lambda x: np.array(x),
    lambda x: np.array([x]),
    lambda x: np.array([[x]]),
    lambda x: np.float32(x),
    lambda x: np.longdouble(x),
    lambda x: complex(x),
    lambda x: x + 0.5,
    lambda x: np.array([x, x]),
    lambda x: np.array(x, dtype=object),
)


def _with_entry(array: np.ndarray, rng, value) -> np.ndarray:
    changed = array.astype(np.int64 if array.dtype.kind in "iub" and isinstance(value, int) else float)
    changed.flat[rng.integers(changed.size)] = value
    return changed


def _read_only(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


_ARRAYS: tuple[Callable[[np.ndarray, np.random.Generator], object], ...] = (
    lambda a, rng: a[:-1],
    lambda a, rng: a[:0],
    lambda a, rng: a[..., :-1],
    lambda a, rng: a[..., :0],
    lambda a, rng: a[None],
    lambda a, rng: a[..., None],
    lambda a, rng: a.T,
    lambda a, rng: a.ravel(),
    lambda a, rng: np.concatenate([a, a]),
    lambda a, rng: a.flat[0],
    lambda a, rng: np.zeros_like(a),
    lambda a, rng: -a if a.dtype != bool else ~a,
    lambda a, rng: a + 10**6 if a.dtype != bool else a.astype(int) * 10**6,
    lambda a, rng: a * 1e200,
    lambda a, rng: a * 1e-200,
    lambda a, rng: _with_entry(a, rng, float("nan")),
    lambda a, rng: _with_entry(a, rng, float("inf")),
    lambda a, rng: _with_entry(a, rng, -1),
    lambda a, rng: _with_entry(a, rng, HUGE_COUNT),
    lambda a, rng: _with_entry(a, rng, -(2**40)),
    lambda a, rng: np.broadcast_to(a.flat[0], a.shape),
    lambda a, rng: a.astype(np.float32),
    lambda a, rng: a.astype(np.float16),
    lambda a, rng: a.astype(np.longdouble),
    lambda a, rng: a.astype(complex),
    lambda a, rng: a.astype(bool),
    lambda a, rng: a.astype(str),
    lambda a, rng: a.astype(object),
    lambda a, rng: a.astype(np.int16),
    lambda a, rng: a.astype(np.uint64),
    lambda a, rng: a.astype(a.dtype.newbyteorder()),
    lambda a, rng: np.asfortranarray(a),
    lambda a, rng: np.repeat(a, 2, axis=-1)[..., ::2],
    lambda a, rng: a[::-1],
    lambda a, rng: a[..., ::-1],
    lambda a, rng: _read_only(a),
    lambda a, rng: a.view(Subclass),
    lambda a, rng: np.matrix(a) if a.ndim <= 2 else a,
    lambda a, rng: np.ma.masked_array(a, mask=rng.random(a.shape) < 0.3),
    lambda a, rng: a.tolist(),
    lambda a, rng: [*a.tolist()[:-1], "x"] if a.ndim else "x",
    lambda a, rng: [a.tolist(), [1]],
    lambda a, rng: memoryview(np.ascontiguousarray(a)),
    lambda a, rng: rng.permutation(a) if a.ndim else a,
)
