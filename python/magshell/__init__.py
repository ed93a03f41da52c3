"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from . import meshes
from ._core import __version__
from .field import AppliedField, Dipoles, SampledField, UniformField, residual_to_remanent
from .field_adapters import CustomField, MagpylibField
from .io import read_fields, read_mesh, write_mesh
from .mesh import TriangleMesh
from .weld import Weld, weld

__all__ = [
    "AppliedField",
    "CustomField",
    "Dipoles",
    "MagpylibField",
    "SampledField",
    "TriangleMesh",
    "UniformField",
    "Weld",
    "__version__",
    "meshes",
    "read_fields",
    "read_mesh",
    "residual_to_remanent",
    "weld",
    "write_mesh",
]
