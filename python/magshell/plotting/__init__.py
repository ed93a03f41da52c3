"""Pictures and pages of sheets. Nothing outside this package sees a plotting library."""

from .page import write_page
from .picture import Picture
from .plot import plot

__all__ = ["Picture", "plot", "write_page"]
