"""Pictures and pages of sheets. Nothing outside this package sees a plotting library."""

from .picture import Picture
from .plot import plot

__all__ = ["Picture", "plot"]
