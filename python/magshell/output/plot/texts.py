"""How long and high texts are, in inches, and how they are broken into lines and made smaller until they have room."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable

SMALLEST = 4.0  # points, below which a text is cut instead
_STEP = 0.9  # from one size to the next smaller one


class Ruler:
    """Measures texts as the painter will write them."""

    def __init__(self, dpi: float):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(dpi=dpi)
        FigureCanvasAgg(figure)
        self._dpi, self._text = dpi, figure.text(0.0, 0.0, "")
        self.size: Callable[[str, float], tuple[float, float]] = functools.cache(self._size)

    def _size(self, text: str, points: float) -> tuple[float, float]:
        """Width and height, inches."""
        self._text.set(text=text, fontsize=points)
        box = self._text.get_window_extent()
        return box.width / self._dpi, box.height / self._dpi

    def broken(self, text: str, points: float, width: float) -> str:
        """With line breaks so that it is no wider than so many inches, as far as words allow."""
        lines = []
        for line in text.split("\n"):
            words = _words(line)
            current = words[0]
            for word in words[1:]:
                longer = f"{current} {word}"
                if self.size(longer, points)[0] <= width:
                    current = longer
                else:
                    lines.append(current)
                    current = word
            lines.append(current)
        return "\n".join(lines)

    def fitted(self, text: str, points: float, width: float, height: float) -> tuple[str, float]:
        """The text, broken, and a size of at most so many points at which it fits into a box [inches]; at the smallest size
        what does not fit is cut."""
        size = points
        while True:
            broken = self.broken(text, size, width)
            if self._fits(broken, size, width, height):
                return broken, size
            if size <= SMALLEST:
                return self._cut(text, size, width, height), size
            size = max(_STEP * size, SMALLEST)

    def _cut(self, text: str, points: float, width: float, height: float) -> str:
        """As much of its beginning as fits, and an ellipsis."""
        text = text.replace("$", "")  # half a formula would not be one
        kept, cut = 0, len(text)
        while cut - kept > 1:
            middle = (kept + cut) // 2
            tried = self.broken(text[:middle].rstrip() + "…", points, width)
            kept, cut = (middle, cut) if self._fits(tried, points, width, height) else (kept, middle)
        return self.broken(text[:kept].rstrip() + "…", points, width)

    def _fits(self, text: str, points: float, width: float, height: float) -> bool:
        wide, high = self.size(text, points)
        return wide <= width and high <= height


def _words(line: str) -> list[str]:
    """Parts between spaces; a formula between dollars is one.

    >>> _words("a force [10$^{-3} N / m$] of it")
    ['a', 'force', '[10$^{-3} N / m$]', 'of', 'it']
    """
    formula = r"(?:\$[^$]*\$|\S)+" if line.count("$") % 2 == 0 else r"\S+"
    return re.findall(formula, line) or [""]
