"""Pictures, movies and pages. No other package of magshell imports a plotting library."""

from .animation import animate
from .balances import plot_balance as _balance  # noqa: F401 - registers EnergyBalance.plot
from .drawing import plot
from .fits import plot_fit as _  # noqa: F401 - registers FitResult.plot
from .gltf import write_gltf
from .histories import plot_history
from .page import write_page
from .picture import Picture
from .studies import plot_study
from .style import Color, Style
from .usd import write_usd
from .view import View

__all__ = [
    "Color",
    "Picture",
    "Style",
    "View",
    "animate",
    "plot",
    "plot_history",
    "plot_study",
    "write_gltf",
    "write_page",
    "write_usd",
]
