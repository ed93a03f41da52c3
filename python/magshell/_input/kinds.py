"""What may come as an argument or go back, for type checkers: nothing of it is needed to run."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any, Protocol, TypeAlias

    import torch
    from numpy.typing import ArrayLike

    from ..envs.actuator import Action
    from ..mesh.tetrahedra.tet_mesh import TetMesh
    from ..mesh.triangles.six_node_mesh import QuadraticTriangleMesh
    from ..mesh.triangles.triangle_mesh import TriangleMesh
    from ..model.fields.field import AppliedField
    from ..model.loads.face_energies import FaceEnergy
    from ..model.loads.loads import DeadLoad, EdgeCouple
    from ..model.loads.pressure import Pressure
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

    # An array, or a tensor in its graph where an input was one with a gradient. Which of both, only the values tell: a union
    # would have every program ask before it uses either.
    Computed: TypeAlias = Any

    FilePath: TypeAlias = str | os.PathLike[str]

    class HasMatrix(Protocol):
        """A Rotation of scipy's, which has no types of its own."""

        def as_matrix(self) -> Any: ...

    # A matrix (3, 3), or a Rotation of scipy's.
    Rotates: TypeAlias = Numbers | HasMatrix

    SolveResult: TypeAlias = Equilibrium | EquilibriumSet | EquilibriumPath | Trajectory

    # Where a search for an equilibrium begins.
    Starting: TypeAlias = Equilibrium | Numbers

    class HasPositions(Protocol):
        """A result of whatever solve."""

        @property
        def scene(self) -> Scene: ...
        @property
        def positions(self) -> Any: ...

    # What there are pictures of.
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
    Load: TypeAlias = DeadLoad | EdgeCouple | FaceEnergy | Pressure
    EnvActuator: TypeAlias = Action

    # A method of optimization, or what makes one for the parameters.
    Optimizing: TypeAlias = torch.optim.Optimizer | Callable[[list[Any]], Any]
