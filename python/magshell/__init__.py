"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from . import meshes, objectives, optim, parametrize
from ._config import num_threads, set_num_threads, show_config
from ._core import __version__
from .buckling import Buckling, linear_buckling
from .design import minimize
from .equilibria import Equilibria
from .equilibrium import Equilibrium
from .errors import (
    DesignRejected,
    EquilibriumJumped,
    Interrupted,
    NoGradient,
    NotConverged,
    ObjectiveFailed,
)
from .field import AppliedField, Dipoles, SampledField, UniformField, residual_to_remanent
from .field_adapters import CustomField, MagpylibField
from .io import read_fields, read_mesh, write_mesh
from .linear import LinearResponse, linear_response
from .loads import AreaLoad, EdgeCouple, EdgeLoad, PointLoad
from .mesh import TriangleMesh
from .minimum import Minimum
from .path import CriticalPoint, Path, follow
from .plotting import Picture, plot, write_page
from .scene import Scene
from .shell import Shell
from .solvers import MixedNewton, Newton
from .statics import equilibrium
from .supports import Clamp, Pin, SymmetryPlane
from .warm_start import WarmStart
from .weld import Weld, weld

__all__ = [
    "AppliedField",
    "AreaLoad",
    "Buckling",
    "Clamp",
    "CriticalPoint",
    "CustomField",
    "DesignRejected",
    "Dipoles",
    "EdgeCouple",
    "EdgeLoad",
    "Equilibria",
    "Equilibrium",
    "EquilibriumJumped",
    "Interrupted",
    "LinearResponse",
    "MagpylibField",
    "Minimum",
    "MixedNewton",
    "Newton",
    "NoGradient",
    "NotConverged",
    "ObjectiveFailed",
    "Path",
    "Picture",
    "Pin",
    "PointLoad",
    "SampledField",
    "Scene",
    "Shell",
    "SymmetryPlane",
    "TriangleMesh",
    "UniformField",
    "WarmStart",
    "Weld",
    "__version__",
    "equilibrium",
    "follow",
    "linear_buckling",
    "linear_response",
    "meshes",
    "minimize",
    "num_threads",
    "objectives",
    "optim",
    "parametrize",
    "plot",
    "read_fields",
    "read_mesh",
    "residual_to_remanent",
    "set_num_threads",
    "show_config",
    "weld",
    "write_mesh",
    "write_page",
]
