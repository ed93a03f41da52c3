"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from ._runtime import instructions as _  # noqa: F401 - first: it says whether the extension can run here

# isort: split
import sys

from . import envs, jax
from ._core import __version__
from ._runtime.threads import num_threads, set_num_threads, show_config
from .design import control, objectives, optim, parametrize
from .design.fitting.fit import fit
from .design.fitting.fit_parameter import FitParameter
from .design.fitting.fit_result import FitResult, Prediction
from .design.fitting.residual_tests import ResidualTests
from .design.minimize import minimize
from .design.minimum import MinimizeResult
from .design.multistart.multistart import multistart
from .design.multistart.sampling import random_starts
from .design.multistart.starts import MultistartResult
from .design.printable_minimum import PrintableMinimum, PrintableStage
from .design.printable_set import PrintableSet
from .design.printing import minimize_printable
from .design.study.points import latin_hypercube
from .design.study.stored import StoredStudy
from .design.study.stream import stream_study
from .design.study.study import study
from .design.study.table import Study, StudyRow
from .errors import (
    DesignRejected,
    EquilibriumJumped,
    FieldSamplingWarning,
    Interrupted,
    LargeStrainWarning,
    LinearTheoryWarning,
    MeshGroupWarning,
    MeshQualityWarning,
    MultistartFailed,
    NoGradient,
    NotConverged,
    ObjectiveFailed,
    ResolutionWarning,
    StepErrorWarning,
    SusceptibilityWarning,
    UnitWarning,
)
from .mesh import generate as meshes
from .mesh import shapes
from .mesh.io.read_write import read_fields, read_mesh, write_mesh
from .mesh.tetrahedra.tet_mesh import TetMesh
from .mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from .mesh.triangles.triangle_mesh import TriangleMesh
from .mesh.welding import Weld, weld
from .model.actuators.cavity import Cavity
from .model.actuators.cells import PneumaticCells
from .model.actuators.muscle import Muscle, MuscleResult
from .model.actuators.tendon import Tendon
from .model.bodies.ties import Tie
from .model.contact import obstacles
from .model.contact.body_contact import BodyContact, SelfContact
from .model.contact.contact import Contact
from .model.elastomers import Elastomer, elastomer
from .model.fields.adapters import CustomField, MagpylibField
from .model.fields.field import (
    AppliedField,
    Dipoles,
    SampledField,
    UniformField,
    magnetization_from_remanence,
)
from .model.fields.magnets import CuboidMagnet, CylinderMagnet
from .model.fields.posed_field import PlacedField
from .model.loads.custom_energy import CustomEnergy
from .model.loads.face_energies import SurfaceTension
from .model.loads.foundation import ElasticFoundation
from .model.loads.loads import AreaLoad, EdgeCouple, EdgeLoad, PointLoad
from .model.loads.pressure import Pressure
from .model.loads.spring import Spring
from .model.loads.water import Water
from .model.results.body_result import BodyResult
from .model.results.joint_result import JointResult
from .model.rigid.joint_dynamics import (
    bias_forces,
    coordinate_slices,
    forward_dynamics,
    inverse_dynamics,
    mass_matrix,
)
from .model.rigid.joints import Ball, Fixed, Joint, LoopClosure, Prismatic, Revolute, Screw
from .model.rigid.link import Link
from .model.rigid.rigid import RigidBody, RigidBodyResult
from .model.rigid.skeleton import Skeleton
from .model.scene.contact_state import ContactState
from .model.scene.own_field import OwnField
from .model.scene.reactions import Reaction
from .model.scene.scene import Scene
from .model.shells.crease import Crease
from .model.shells.shell import Shell
from .model.shells.strains import Strains
from .model.solids.fibres import Fibres, fibres_along
from .model.solids.materials import (
    Corotated,
    Guccione,
    MooneyRivlin,
    NeoHookean,
    ProjectiveMaterial,
    StableNeoHookean,
    StVenantKirchhoff,
    Yeoh,
)
from .model.solids.skin import Skin
from .model.solids.solid import Solid
from .model.supports.displacement_ties import EqualDisplacement, Periodic
from .model.supports.supports import Clamp, Pin, SymmetryPlane
from .output.live import LiveView, show
from .output.plot import (
    Color,
    Picture,
    Style,
    View,
    animate,
    plot,
    plot_history,
    plot_study,
    write_gltf,
    write_page,
    write_usd,
)
from .output.results.probes import Probe
from .output.results.saved import load, save
from .output.results.saved_scene import load_scene, save_scene
from .output.results.series import write_series
from .output.results.surface_files import write_surface
from .output.results.tables import to_pandas, to_xarray
from .solve.accuracy.error_estimate import ErrorEstimate, error_estimate
from .solve.accuracy.refined_for import RefinedResult, refined_for
from .solve.dynamics.balance import MotionBalance
from .solve.dynamics.batch import TrajectoryBatch
from .solve.dynamics.simulate import simulate
from .solve.dynamics.trajectory import MotionState, Trajectory
from .solve.linear.buckling import Buckling, linear_buckling
from .solve.linear.response import linear_response
from .solve.linear.response_batch import LinearResponseBatch
from .solve.linear.single_response import LinearResponse
from .solve.linear.vibration import VibrationModes, vibration_modes
from .solve.options import (
    SDIRK2,
    SDIRK3,
    TRBDF2,
    Adaptive,
    AdjointStorage,
    ImplicitEuler,
    MixedNewton,
    Newton,
    ProjectiveDynamics,
)
from .solve.statics.balance import EnergyBalance
from .solve.statics.critical_point import CriticalPoint
from .solve.statics.energies_at import energies, energy, forces, free_motions, hessian
from .solve.statics.equilibria import EquilibriumSet
from .solve.statics.equilibrium import Branch, Equilibrium
from .solve.statics.equilibrium_batch import EquilibriumBatch
from .solve.statics.extrapolation import Extrapolation, richardson_extrapolation
from .solve.statics.magnetic_state import MagneticState, field_of
from .solve.statics.multistable import find_equilibria
from .solve.statics.path import EquilibriumPath, follow_path
from .solve.statics.path_events import PathEvent
from .solve.statics.solve import equilibrium
from .solve.statics.solve_log import SolveLog, SolveStep
from .solve.statics.warm_start import WarmStart

__all__ = [
    "SDIRK2",
    "SDIRK3",
    "TRBDF2",
    "Adaptive",
    "AdjointStorage",
    "AppliedField",
    "AreaLoad",
    "Ball",
    "BodyContact",
    "BodyResult",
    "Branch",
    "Buckling",
    "Cavity",
    "Clamp",
    "Color",
    "Contact",
    "ContactState",
    "Corotated",
    "Crease",
    "CriticalPoint",
    "CuboidMagnet",
    "CustomEnergy",
    "CustomField",
    "CylinderMagnet",
    "DesignRejected",
    "Dipoles",
    "EdgeCouple",
    "EdgeLoad",
    "ElasticFoundation",
    "Elastomer",
    "EnergyBalance",
    "EqualDisplacement",
    "Equilibrium",
    "EquilibriumBatch",
    "EquilibriumJumped",
    "EquilibriumPath",
    "EquilibriumSet",
    "ErrorEstimate",
    "Extrapolation",
    "Fibres",
    "FieldSamplingWarning",
    "FitParameter",
    "FitResult",
    "Fixed",
    "Guccione",
    "ImplicitEuler",
    "Interrupted",
    "Joint",
    "JointResult",
    "LargeStrainWarning",
    "LinearResponse",
    "LinearResponseBatch",
    "LinearTheoryWarning",
    "Link",
    "LiveView",
    "LoopClosure",
    "MagneticState",
    "MagpylibField",
    "MeshGroupWarning",
    "MeshQualityWarning",
    "MinimizeResult",
    "MixedNewton",
    "MooneyRivlin",
    "MotionBalance",
    "MotionState",
    "MultistartFailed",
    "MultistartResult",
    "Muscle",
    "MuscleResult",
    "NeoHookean",
    "Newton",
    "NoGradient",
    "NotConverged",
    "ObjectiveFailed",
    "OwnField",
    "PathEvent",
    "Periodic",
    "Picture",
    "Pin",
    "PlacedField",
    "PneumaticCells",
    "PointLoad",
    "Prediction",
    "Pressure",
    "PrintableMinimum",
    "PrintableSet",
    "PrintableStage",
    "Prismatic",
    "Probe",
    "ProjectiveDynamics",
    "ProjectiveMaterial",
    "QuadraticTriangleMesh",
    "Reaction",
    "RefinedResult",
    "ResidualTests",
    "ResolutionWarning",
    "Revolute",
    "RigidBody",
    "RigidBodyResult",
    "SampledField",
    "Scene",
    "Screw",
    "SelfContact",
    "Shell",
    "Skeleton",
    "Skin",
    "Solid",
    "SolveLog",
    "SolveStep",
    "Spring",
    "StVenantKirchhoff",
    "StableNeoHookean",
    "StepErrorWarning",
    "StoredStudy",
    "Strains",
    "Study",
    "StudyRow",
    "Style",
    "SurfaceTension",
    "SusceptibilityWarning",
    "SymmetryPlane",
    "Tendon",
    "TetMesh",
    "Tie",
    "Trajectory",
    "TrajectoryBatch",
    "TriangleMesh",
    "UniformField",
    "UnitWarning",
    "VibrationModes",
    "View",
    "WarmStart",
    "Water",
    "Weld",
    "Yeoh",
    "__version__",
    "animate",
    "bias_forces",
    "control",
    "coordinate_slices",
    "elastomer",
    "energies",
    "energy",
    "envs",
    "equilibrium",
    "error_estimate",
    "fibres_along",
    "field_of",
    "find_equilibria",
    "fit",
    "follow_path",
    "forces",
    "forward_dynamics",
    "free_motions",
    "hessian",
    "inverse_dynamics",
    "jax",
    "latin_hypercube",
    "linear_buckling",
    "linear_response",
    "load",
    "load_scene",
    "magnetization_from_remanence",
    "mass_matrix",
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
    "plot_history",
    "plot_study",
    "random_starts",
    "read_fields",
    "read_mesh",
    "refined_for",
    "richardson_extrapolation",
    "save",
    "save_scene",
    "set_num_threads",
    "shapes",
    "show",
    "show_config",
    "simulate",
    "stream_study",
    "study",
    "to_pandas",
    "to_xarray",
    "vibration_modes",
    "weld",
    "write_gltf",
    "write_mesh",
    "write_page",
    "write_series",
    "write_surface",
    "write_usd",
]

_GROUPS = ("control", "meshes", "objectives", "obstacles", "optim", "parametrize", "shapes")


# The groups of functions keep their short names for users: `from magshell.meshes import rectangle` as well as `ms.meshes`.
sys.modules.update({f"{__name__}.{group}": globals()[group] for group in _GROUPS})


def __dir__() -> list[str]:
    """Return the public names, for tab completion; the inner packages and the benchmarks are left out."""
    return sorted(__all__)
