"""gymnasium, or how to get it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType


def require_gymnasium(what: str) -> ModuleType:
    """The gymnasium module. Raises ImportError that says how to get it."""
    try:
        import gymnasium
    except ImportError as error:
        raise ImportError(f'{what} needs gymnasium: pip install "magshell[gym]"') from error
    return gymnasium
