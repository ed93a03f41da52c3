"""Errors and warnings of magshell.

An error raised by a solve has an attribute `last_good`: the last usable result before the failure.
"""

from __future__ import annotations

from typing import Any


class DesignRejected(RuntimeError):
    """An error for a design that an objective cannot evaluate: its equilibrium was not found, or has jumped.

    An optimizer answers it with a shorter step. `last_good` holds the last state of the same kind that could be computed,
    or None. `load_case` is the number of the load case that failed, or None.
    """

    def __init__(self, message: str, last_good: Any = None, load_case: int | None = None):
        super().__init__(message)
        self.last_good: Any = last_good
        self.load_case = load_case


class NotConverged(DesignRejected):
    """An error for a solve that did not converge.

    `last_good` holds the last converged state, as a result of the same kind.
    """


class EquilibriumJumped(DesignRejected):
    """An error for an equilibrium that snapped or buckled between two designs.

    `last_good` holds the equilibrium before the jump.
    """


class MeshQualityWarning(UserWarning):
    """A warning about a mesh whose results cannot be trusted.

    Either faces are nearly degenerate (see TriangleMesh.quality), or a solid has too few tetrahedra for the mean-volume
    formulation, or midside nodes are off a curved surface, or bodies start within the distance at which a contact begins by
    default.
    """


class MeshGroupWarning(UserWarning):
    """A warning about content of a mesh file that is not read, or about named groups that a mesh does not keep.

    It lists everything of one file at once.
    """


class UnitWarning(UserWarning):
    """A warning about a value whose unit is probably wrong, such as mm, kPa or mT given for m, Pa or T.

    It is raised once per scene and kind of value, where a thickness, modulus, density, magnetization, field or gravity is
    orders of magnitude away from that of any real body (the first three on every face), or of any magnetized soft one. For
    models without units, switch it off by `warnings.filterwarnings("ignore", category=ms.UnitWarning)`.
    """


class Interrupted(KeyboardInterrupt):
    """The KeyboardInterrupt of a solve that was stopped by Ctrl-C.

    `last_good` holds the last converged state, as a result of the same kind. It is None for linear solves, which have no
    intermediate states, and if the solve was stopped before its start was known.
    """

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class ObjectiveFailed(RuntimeError):
    """An error that stopped an optimization; its cause (`__cause__`) is the error raised by the objective.

    `last_good` holds the best design found until then.
    """

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class MultistartFailed(RuntimeError):
    """An error for a multistart or a study whose executor broke, or for a multistart of which no start finished.

    `last_good` holds a MultistartResult of the starts that finished, or the Study of the rows so far.
    """

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class LargeStrainWarning(UserWarning):
    """A warning about a result with strains above 20 %, for which its material law is not valid.

    It is raised once per scene, and again each time the strains have doubled. If warnings are turned into errors,
    `last_good` holds the result.
    """

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class StepErrorWarning(UserWarning):
    """A warning about the time steps of a motion.

    Either their estimated error exceeds 1 % of the extent, or more than a tenth of them took over 20 factorizations: then
    they are too long. Or contact created energy in a step, however short its parts were. Or a gradient is computed through
    steps that were taken in parts, where the objective may jump.
    Every motion with large errors warns; of many factorizations a scene warns once. If warnings are turned into errors,
    `last_good` holds the motion.
    """

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class FieldSamplingWarning(UserWarning):
    """A warning about a magnetic force on a body that is wrong by more than 1 %, or by an unknown amount.

    Faces that are near a source when a solve begins sample its field at many points (docs/theory.md). The warning comes
    where that is not enough, and where bodies come near a source in a motion or on a path. It comes also where a body has
    vertices inside of a magnet, and where bodies of an OwnField are too near each other for their meshes.
    """


class ResolutionWarning(UserWarning):
    """A warning about an equilibrium in which more than a tenth of a sheet's elastic energy is an error of its mesh.

    ms.equilibrium estimates that part of each sheet of three-node faces by how strains differ from face to face (Zienkiewicz
    and Zhu 1987), in the first, the second, the fourth, ... equilibrium of a scene, so that many cost little more.
    ms.error_estimate estimates the error of one number, for the work of several solves.
    """


class LinearTheoryWarning(UserWarning):
    """A warning about a linear solve whose displacements are not small, as linear theory takes them to be.

    ms.linear_buckling raises it where, at the first factor, a body rotates by more than 0.1 rad, or a shell bends so far
    that the strain of its rotation exceeds its membrane strain: a plate does when it has deflected by about its thickness.
    """


class SusceptibilityWarning(UserWarning):
    """A warning about a susceptible shell that is too strongly magnetized for its law, which neglects its own field.

    It is raised once per scene, where the susceptibility times the thickness is more than a tenth of the extent: about that
    part of the magnetization along the shell is wrong.
    """


class NoGradient(RuntimeError):
    """An error for a gradient that does not exist.

    It is raised at a state that did not converge or is not stable, for an input that is not differentiable, and for second
    derivatives of motions (use finite differences of gradients instead).
    """
