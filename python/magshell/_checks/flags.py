"""Numbers that several obstacles ask for."""

from __future__ import annotations

from .quantity import quantity


def positive(name: str, unit: str, value) -> float:
    """A positive finite number, or a ValueError that names it."""
    number = float(quantity(name, unit, value, ()))
    if number <= 0:
        raise ValueError(f"{name} [{unit}] must be positive, got {number:g}")
    return number


def flag(name: str, value) -> bool:
    """True or False, or a ValueError that names it."""
    if not isinstance(value, bool):
        raise ValueError(f"{name} must be True or False, got {value!r:.60}")
    return value
