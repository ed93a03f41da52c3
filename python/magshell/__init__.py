"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from . import control, meshes, objectives, obstacles, optim, parametrize
from ._body_result import BodyResult
from ._config import num_threads, set_num_threads, show_config
from ._core import __version__
from .buckling import Buckling, linear_buckling
from .contact import Contact
from .design import minimize
from .dynamics import simulate
from .equilibria import Equilibria
from .equilibrium import Equilibrium
from .errors import (
    DesignRejected,
    EquilibriumJumped,
    Interrupted,
    LargeStrainWarning,
    MeshQualityWarning,
    MultistartFailed,
    NoGradient,
    NotConverged,
    ObjectiveFailed,
)
from .field import AppliedField, Dipoles, SampledField, UniformField, residual_to_remanent
from .field_adapters import CustomField, MagpylibField
from .integrators import SDIRK2, SDIRK3, TRBDF2, ImplicitEuler
from .io import read_fields, read_mesh, write_mesh
from .linear import LinearResponse, linear_response
from .loads import AreaLoad, EdgeCouple, EdgeLoad, PointLoad
from .magnets import CuboidMagnet, CylinderMagnet
from .mesh import TriangleMesh
from .minimum import Minimum
from .multistart import multistart
from .path import CriticalPoint, Path, follow
from .placed_field import PlacedField
from .plotting import Picture, animate, plot, write_page
from .sampling import random_starts
from .scene import Scene
from .series import write_series
from .shell import Shell
from .solvers import MixedNewton, Newton
from .starts import Multistart
from .statics import equilibrium
from .strains import Strains
from .supports import Clamp, Pin, SymmetryPlane
from .trajectory import MotionState, Trajectory
from .vibration import VibrationModes, vibration_modes
from .warm_start import WarmStart
from .water import Water
from .weld import Weld, weld

__all__ = [
    "SDIRK2",
    "SDIRK3",
    "TRBDF2",
    "AppliedField",
    "AreaLoad",
    "BodyResult",
    "Buckling",
    "Clamp",
    "Contact",
    "CriticalPoint",
    "CuboidMagnet",
    "CustomField",
    "CylinderMagnet",
    "DesignRejected",
    "Dipoles",
    "EdgeCouple",
    "EdgeLoad",
    "Equilibria",
    "Equilibrium",
    "EquilibriumJumped",
    "ImplicitEuler",
    "Interrupted",
    "LargeStrainWarning",
    "LinearResponse",
    "MagpylibField",
    "MeshQualityWarning",
    "Minimum",
    "MixedNewton",
    "MotionState",
    "Multistart",
    "MultistartFailed",
    "Newton",
    "NoGradient",
    "NotConverged",
    "ObjectiveFailed",
    "Path",
    "Picture",
    "Pin",
    "PlacedField",
    "PointLoad",
    "SampledField",
    "Scene",
    "Shell",
    "Strains",
    "SymmetryPlane",
    "Trajectory",
    "TriangleMesh",
    "UniformField",
    "VibrationModes",
    "WarmStart",
    "Water",
    "Weld",
    "__version__",
    "animate",
    "control",
    "equilibrium",
    "follow",
    "linear_buckling",
    "linear_response",
    "meshes",
    "minimize",
    "multistart",
    "num_threads",
    "objectives",
    "obstacles",
    "optim",
    "parametrize",
    "plot",
    "random_starts",
    "read_fields",
    "read_mesh",
    "residual_to_remanent",
    "set_num_threads",
    "show_config",
    "simulate",
    "vibration_modes",
    "weld",
    "write_mesh",
    "write_page",
    "write_series",
]
