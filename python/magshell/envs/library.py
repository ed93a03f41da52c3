"""Imports gymnasium, or says how to install it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType


def require_gymnasium(what: str) -> ModuleType:
    """Return the gymnasium module. Raises ImportError with the command that installs it; what: the feature that needs
    it."""
    try:
        import gymnasium
    except ImportError as error:
        raise ImportError(f'{what} needs gymnasium: pip install "magshell[gym]"') from error
    return gymnasium
