"""Pictures of ms.plot within a figure."""

import io

import numpy as np

import magshell as ms


def paste(axes, picture: ms.Picture, margin: int = 12) -> None:
    """The picture without the white around it but for a margin, pixels, in place of the axes."""
    from matplotlib import pyplot as plt

    image = plt.imread(io.BytesIO(picture._repr_png_()))
    inked = (image[..., :3] < 0.98).any(axis=2)
    span = []
    for inked_lines in (inked.any(axis=1), inked.any(axis=0)):
        lines = np.flatnonzero(inked_lines)
        span.append(slice(max(lines[0] - margin, 0), lines[-1] + margin))
    axes.imshow(image[tuple(span)], interpolation="lanczos")
    axes.set_axis_off()
