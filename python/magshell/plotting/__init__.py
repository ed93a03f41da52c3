"""Pictures and pages of sheets. Nothing outside this package sees a plotting library."""

from .animate import animate
from .page import write_page
from .picture import Picture
from .plot import plot

__all__ = ["Picture", "animate", "plot", "write_page"]
