"""gymnasium, or how to get it."""

from __future__ import annotations


def require_gymnasium(what: str):
    """The gymnasium module. Raises ImportError that says how to get it."""
    try:
        import gymnasium
    except ImportError as error:
        raise ImportError(f'{what} needs gymnasium: pip install "magshell[gym]"') from error
    return gymnasium
