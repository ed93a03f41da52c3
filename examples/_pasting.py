"""A helper that puts pictures of ms.plot into a figure."""

import io

import numpy as np

import magshell as ms


def paste(axes, picture: ms.Picture, margin: int = 12) -> None:
    """Draw the picture in place of the axes, without the white around it except for a margin in pixels."""
    from matplotlib import pyplot as plt

    image = plt.imread(io.BytesIO(picture._repr_png_()))
    inked = (image[..., :3] < 0.98).any(axis=2)
    span = []
    for inked_lines in (inked.any(axis=1), inked.any(axis=0)):
        lines = np.flatnonzero(inked_lines)
        span.append(slice(max(lines[0] - margin, 0), lines[-1] + margin))
    axes.imshow(image[tuple(span)], interpolation="lanczos")
    axes.set_axis_off()
