"""Type aliases of arguments and results, for type checkers only: nothing here is needed at run time."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any, Protocol, TypeAlias

    import torch
    from numpy.typing import ArrayLike

    from ..envs.action import Action
    from ..mesh.tetrahedra.tet_mesh import TetMesh
    from ..mesh.triangles.six_node_mesh import QuadraticTriangleMesh
    from ..mesh.triangles.triangle_mesh import TriangleMesh
    from ..model.fields.field import AppliedField
    from ..model.loads.custom_energy import CustomEnergy
    from ..model.loads.face_energies import FaceEnergy
    from ..model.loads.loads import DeadLoad, EdgeCouple
    from ..model.loads.pressure import Pressure
    from ..model.loads.springs import Springs
    from ..model.scene.scene import Scene
    from ..model.shells.shell import Shell
    from ..model.solids.solid import Solid
    from ..solve.dynamics.trajectory import Trajectory
    from ..solve.statics.equilibria import EquilibriumSet
    from ..solve.statics.equilibrium import Equilibrium
    from ..solve.statics.path import EquilibriumPath

    # A number, an array, a tensor, or sequences of those.
    Numbers: TypeAlias = ArrayLike | torch.Tensor | Sequence["Numbers"]

    # The same, or a function of time [s].
    InTime: TypeAlias = Numbers | Callable[[float], Numbers]

    # An array, or a tensor in its graph if an input was a tensor with a gradient. The type is Any, not a union: with a
    # union, type checkers would ask every program to test which of the two it got.
    Computed: TypeAlias = Any

    FilePath: TypeAlias = str | os.PathLike[str]

    class HasMatrix(Protocol):
        """A rotation of scipy's (scipy.spatial.transform.Rotation), which has no type annotations of its own."""

        def as_matrix(self) -> Any: ...

    # A matrix (3, 3), or a Rotation of scipy's.
    Rotates: TypeAlias = Numbers | HasMatrix

    SolveResult: TypeAlias = Equilibrium | EquilibriumSet | EquilibriumPath | Trajectory

    # Where a search for an equilibrium begins.
    Starting: TypeAlias = Equilibrium | Numbers

    class HasPositions(Protocol):
        """A result of any solve: it has a scene and positions."""

        @property
        def scene(self) -> Scene: ...
        @property
        def positions(self) -> Any: ...

    # Anything that ms.plot can draw.
    Shown: TypeAlias = (
        TriangleMesh
        | QuadraticTriangleMesh
        | TetMesh
        | Shell
        | Solid
        | Scene
        | HasPositions
        | Iterable["Shown"]
    )

    # A plane through what is shown: an axis, an axis and where, a point and a normal.
    Cutting: TypeAlias = str | Sequence[Any]

    Fielded: TypeAlias = AppliedField | Iterable[AppliedField]
    Load: TypeAlias = DeadLoad | EdgeCouple | FaceEnergy | Pressure | CustomEnergy | Springs
    EnvActuator: TypeAlias = Action

    # An optimizer, or a function that makes one for a list of parameters.
    Optimizing: TypeAlias = torch.optim.Optimizer | Callable[[list[Any]], Any]
