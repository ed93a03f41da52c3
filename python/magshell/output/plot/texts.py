"""The size of texts in inches, and their fitting into a box by line breaks and smaller type."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable

SMALLEST = 4.0  # [points] smallest size; longer texts are cut
_STEP = 0.9  # [-] ratio of successive sizes that are tried


class Ruler:
    """A measuring device for texts, with the fonts of the painted picture."""

    def __init__(self, dpi: float):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(dpi=dpi)
        FigureCanvasAgg(figure)
        self._dpi, self._text = dpi, figure.text(0.0, 0.0, "")
        self.size: Callable[[str, float], tuple[float, float]] = functools.cache(self._size)

    def _size(self, text: str, points: float) -> tuple[float, float]:
        """Return the width and height of a text, inches."""
        self._text.set(text=text, fontsize=points)
        box = self._text.get_window_extent()
        return box.width / self._dpi, box.height / self._dpi

    def broken(self, text: str, points: float, width: float) -> str:
        """Return a text with line breaks between words, so that it is no wider than `width` [inches] if possible."""
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
        """Return a text with line breaks, and the largest size up to `points` at which it fits into a box [inches].

        At the smallest size, the part that does not fit is cut off.
        """
        size = points
        while True:
            broken = self.broken(text, size, width)
            if self._fits(broken, size, width, height):
                return broken, size
            if size <= SMALLEST:
                return self._cut(text, size, width, height), size
            size = max(_STEP * size, SMALLEST)

    def _cut(self, text: str, points: float, width: float, height: float) -> str:
        """Return as much of the beginning of a text as fits, and an ellipsis."""
        text = text.replace("$", "")  # a formula that is cut would be invalid
        fitting, cut = 0, len(text)
        while cut - fitting > 1:
            middle = (fitting + cut) // 2
            tried = self.broken(text[:middle].rstrip() + "…", points, width)
            fitting, cut = (middle, cut) if self._fits(tried, points, width, height) else (fitting, middle)
        return self.broken(text[:fitting].rstrip() + "…", points, width)

    def _fits(self, text: str, points: float, width: float, height: float) -> bool:
        wide, high = self.size(text, points)
        return wide <= width and high <= height


def _words(line: str) -> list[str]:
    """Split a line at spaces; a formula between dollar signs is one word.

    >>> _words("a force [10$^{-3} N / m$] of it")
    ['a', 'force', '[10$^{-3} N / m$]', 'of', 'it']
    """
    formula = r"(?:\$[^$]*\$|\S)+" if line.count("$") % 2 == 0 else r"\S+"
    return re.findall(formula, line) or [""]
