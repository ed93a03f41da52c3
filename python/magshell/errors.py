"""What a solve raises when it cannot finish. Each error hands back what the solve had."""

from __future__ import annotations

from typing import Any


class DesignRejected(RuntimeError):
    """Raised inside an objective: this design cannot be evaluated, its equilibrium was not found or jumped. Go
    less far. `last_good` holds the last state of the same kind that could be, if there is one. `load_case`: the number
    of the load case that it is about, or None."""

    def __init__(self, message: str, last_good: Any = None, load_case: int | None = None):
        super().__init__(message)
        self.last_good: Any = last_good
        self.load_case = load_case


class NotConverged(DesignRejected):
    """A solve failed. `last_good` holds the last converged state, as a result of the same kind."""


class EquilibriumJumped(DesignRejected):
    """Between two designs the equilibrium snapped or buckled. `last_good` holds the one before the jump."""


class MeshQualityWarning(UserWarning):
    """Faces of the mesh are so flat that a result cannot be trusted, see TriangleMesh.quality; or a solid has too few
    tetrahedra for their mean volume."""


class UnitWarning(UserWarning):
    """A thickness, modulus, density, magnetization or field is by decades beyond any body, as where mm, kPa or mT were
    given for m, Pa or T. Said once a scene and kind of value; `warnings.filterwarnings("ignore",
    category=ms.UnitWarning)` for models without units."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C stopped a solve. `last_good` holds the last converged state, as a result of the same kind; None where
    there is nothing before all of it is done, as of linear solves, or where the start was not yet known."""

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class ObjectiveFailed(RuntimeError):
    """An optimization met an error, its cause, on the way. `last_good` holds the best design until then."""

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class MultistartFailed(RuntimeError):
    """The executor of a multistart broke, or none of the starts came to its end. `last_good` holds a Multistart of
    what finished."""

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class LargeStrainWarning(UserWarning):
    """A result has strains beyond 20 %, for which its material law is not meant. Said once a scene, and again where
    strains have doubled since. Where warnings are made errors, `last_good` holds the result."""

    def __init__(self, message: str, last_good: Any = None):
        super().__init__(message)
        self.last_good: Any = last_good


class FieldSamplingWarning(UserWarning):
    """The magnetic force on a sheet is off by more than 1 %, as the field of a source near by changes over its faces, which
    sample it once each. Said once a solve."""


class NoGradient(RuntimeError):
    """A gradient was asked for where there is none: at a state that did not converge or is not stable, by an input that
    has none, or of a gradient (second derivatives: take differences of gradients)."""
