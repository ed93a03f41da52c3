"""Imports JAX, or says how to install and set it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType


def require_jax(what: str) -> ModuleType:
    """Return the jax module. Raises ImportError with the command that installs it; what: the feature that needs it."""
    try:
        import jax
    except ImportError as error:
        raise ImportError(f'{what} needs jax: pip install "magshell[jax]"') from error
    return jax


def require_double_precision(jax: ModuleType, what: str) -> None:
    """Raise RuntimeError with the remedy if JAX computes in single precision."""
    if not jax.config.jax_enable_x64:
        raise RuntimeError(
            f'{what} needs double precision, which JAX leaves off by default: jax.config.update("jax_enable_x64", '
            "True) before the first array is made"
        )
