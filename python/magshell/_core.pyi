"""
The C++ core of magshell; use the functions of the package, not this module.
"""

from __future__ import annotations

__all__: list[str] = list()
__version__: str = "0.1.0"
