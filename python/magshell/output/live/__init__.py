"""Live views in a browser. No other package of magshell imports viser."""

from .live_view import LiveView
from .open_view import show

__all__ = ["LiveView", "show"]
