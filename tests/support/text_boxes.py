"""The boxes of the texts of a matplotlib figure, and a check that they do not cross."""

from __future__ import annotations

from itertools import combinations

import numpy as np


def texts(figure) -> list[tuple[str, np.ndarray]]:
    """Return (text, (left, bottom, right, top) in pixels) of all visible texts."""
    from matplotlib.text import Text

    figure.canvas.draw()
    hidden = {
        id(text)
        for axes in figure.axes
        if not axes.axison
        for axis in (axes.xaxis, axes.yaxis)
        for text in axis.findobj(Text)
    }
    found = []
    for each in figure.findobj(Text):
        if each.get_visible() and each.get_text().strip() and id(each) not in hidden:
            box = each.get_window_extent()
            found.append((each.get_text(), np.array([box.x0, box.y0, box.x1, box.y1])))
    return found


def wrong_texts(figure, slack: float = 0.5) -> list[str]:
    """Return the pairs of texts that cross and those that leave the figure, by more than a slack in pixels."""
    found = texts(figure)
    width, height = figure.canvas.get_width_height()
    said = [
        f"{text!r} leaves the figure: {box.round(1).tolist()} of {width} x {height}"
        for text, box in found
        if (box[:2] < -slack).any() or box[2] > width + slack or box[3] > height + slack
    ]
    for (one, a), (other, b) in combinations(found, 2):
        if (np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]) > slack).all():
            said.append(f"{one!r} crosses {other!r}")
    return said
