"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from ._machine import instructions as _  # noqa: F401 - first: it says whether the extension can run here

# isort: split
from . import control, envs, meshes, objectives, obstacles, optim, parametrize, shapes
from ._core import __version__
from ._machine.threads import num_threads, set_num_threads, show_config
from .bodies.body_result import BodyResult
from .bodies.fibres import Fibres, fibres_along
from .bodies.joint import Joint
from .bodies.joint_result import JointResult
from .bodies.joints import Ball, Closure, Fixed, Prismatic, Revolute
from .bodies.link import Link
from .bodies.materials import Corotated, Guccione, NeoHookean, Projective, StableNeoHookean, StVenantKirchhoff
from .bodies.muscle import Muscle
from .bodies.muscle_result import MuscleResult
from .bodies.rigid import Rigid
from .bodies.rigid_result import RigidResult
from .bodies.shell import Shell
from .bodies.skeleton import Skeleton
from .bodies.skin import Skin
from .bodies.solid import Solid
from .bodies.strains import Strains
from .bodies.ties import Tie
from .design.minimize import minimize
from .design.minimum import Minimum
from .design.printable_minimum import PrintableMinimum, PrintableStage
from .design.printing import minimize_printable
from .dynamics.simulate import simulate
from .dynamics.trajectory import MotionState, Trajectory
from .errors import (
    DesignRejected,
    EquilibriumJumped,
    FieldSamplingWarning,
    Interrupted,
    LargeStrainWarning,
    MeshQualityWarning,
    MultistartFailed,
    NoGradient,
    NotConverged,
    ObjectiveFailed,
    UnitWarning,
)
from .fields.adapters import CustomField, MagpylibField
from .fields.field import AppliedField, Dipoles, SampledField, UniformField, residual_to_remanent
from .fields.magnets import CuboidMagnet, CylinderMagnet
from .fields.placed import PlacedField
from .ink import Ink
from .linear.buckling import Buckling, linear_buckling
from .linear.response import LinearResponse, linear_response
from .linear.vibration import VibrationModes, vibration_modes
from .mesh.io import read_fields, read_mesh, write_mesh
from .mesh.six_node_mesh import SixNodeMesh
from .mesh.tet_mesh import TetMesh
from .mesh.triangle_mesh import TriangleMesh
from .mesh.welding import Weld, weld
from .methods.integrators import SDIRK2, SDIRK3, TRBDF2, ImplicitEuler
from .methods.keep import Keep
from .methods.projective_dynamics import ProjectiveDynamics
from .methods.solvers import MixedNewton, Newton
from .plotting import Color, Picture, Style, View, animate, plot, write_page
from .scene.reactions import Reaction
from .scene.scene import Scene
from .scene.touching import Touching
from .starts.multistart import multistart
from .starts.sampling import random_starts
from .starts.starts import Multistart
from .states.saved import load, save
from .states.series import write_series
from .states.surface_files import write_surface
from .states.tables import to_pandas, to_xarray
from .statics.energies_at import energies
from .statics.equilibria import Equilibria
from .statics.equilibrium import Equilibrium
from .statics.extrapolation import Extrapolation, extrapolated
from .statics.multistable import equilibria
from .statics.path import CriticalPoint, Path, follow
from .statics.solve import equilibrium
from .statics.warm_start import WarmStart
from .surroundings.body_contact import BodyContact, SelfContact
from .surroundings.cavity import Cavity
from .surroundings.cells import Cells
from .surroundings.contact import Contact
from .surroundings.face_energies import SurfaceTension
from .surroundings.loads import AreaLoad, EdgeCouple, EdgeLoad, PointLoad
from .surroundings.pressure import Pressure
from .surroundings.supports import Clamp, Pin, SymmetryPlane
from .surroundings.tendon import Tendon
from .surroundings.water import Water

__all__ = [
    "SDIRK2",
    "SDIRK3",
    "TRBDF2",
    "AppliedField",
    "AreaLoad",
    "Ball",
    "BodyContact",
    "BodyResult",
    "Buckling",
    "Cavity",
    "Cells",
    "Clamp",
    "Closure",
    "Color",
    "Contact",
    "Corotated",
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
    "Extrapolation",
    "Fibres",
    "FieldSamplingWarning",
    "Fixed",
    "Guccione",
    "ImplicitEuler",
    "Ink",
    "Interrupted",
    "Joint",
    "JointResult",
    "Keep",
    "LargeStrainWarning",
    "LinearResponse",
    "Link",
    "MagpylibField",
    "MeshQualityWarning",
    "Minimum",
    "MixedNewton",
    "MotionState",
    "Multistart",
    "MultistartFailed",
    "Muscle",
    "MuscleResult",
    "NeoHookean",
    "Newton",
    "NoGradient",
    "NotConverged",
    "ObjectiveFailed",
    "Path",
    "Picture",
    "Pin",
    "PlacedField",
    "PointLoad",
    "Pressure",
    "PrintableMinimum",
    "PrintableStage",
    "Prismatic",
    "Projective",
    "ProjectiveDynamics",
    "Reaction",
    "Revolute",
    "Rigid",
    "RigidResult",
    "SampledField",
    "Scene",
    "SelfContact",
    "Shell",
    "SixNodeMesh",
    "Skeleton",
    "Skin",
    "Solid",
    "StVenantKirchhoff",
    "StableNeoHookean",
    "Strains",
    "Style",
    "SurfaceTension",
    "SymmetryPlane",
    "Tendon",
    "TetMesh",
    "Tie",
    "Touching",
    "Trajectory",
    "TriangleMesh",
    "UniformField",
    "UnitWarning",
    "VibrationModes",
    "View",
    "WarmStart",
    "Water",
    "Weld",
    "__version__",
    "animate",
    "control",
    "energies",
    "envs",
    "equilibria",
    "equilibrium",
    "extrapolated",
    "fibres_along",
    "follow",
    "linear_buckling",
    "linear_response",
    "load",
    "meshes",
    "minimize",
    "minimize_printable",
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
    "save",
    "set_num_threads",
    "shapes",
    "show_config",
    "simulate",
    "to_pandas",
    "to_xarray",
    "vibration_modes",
    "weld",
    "write_mesh",
    "write_page",
    "write_series",
    "write_surface",
]


def __dir__() -> list[str]:
    """What is public: neither the rooms that it is made in nor the bench."""
    return sorted(__all__)
