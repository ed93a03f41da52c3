"""Pictures and pages of sheets. Nothing outside this package sees a plotting library."""

from .animation import animate
from .drawing import plot
from .page import write_page
from .picture import Picture

__all__ = ["Picture", "animate", "plot", "write_page"]
