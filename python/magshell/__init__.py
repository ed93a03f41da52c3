"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from . import meshes
from ._core import __version__
from .mesh import TriangleMesh

__all__ = ["TriangleMesh", "__version__", "meshes"]
