"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from ._core import __version__

__all__ = ["__version__"]
