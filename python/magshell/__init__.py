"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from . import meshes
from ._core import __version__
from .io import read_fields, read_mesh, write_mesh
from .mesh import TriangleMesh
from .weld import Weld, weld

__all__ = [
    "TriangleMesh",
    "Weld",
    "__version__",
    "meshes",
    "read_fields",
    "read_mesh",
    "weld",
    "write_mesh",
]
