"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from ._core import __version__
from .field import AppliedField, Dipoles, SampledField, UniformField, residual_to_remanent
from .field_adapters import CustomField, MagpylibField

__all__ = [
    "AppliedField",
    "CustomField",
    "Dipoles",
    "MagpylibField",
    "SampledField",
    "UniformField",
    "__version__",
    "residual_to_remanent",
]
