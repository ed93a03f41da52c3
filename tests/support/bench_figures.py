"""Whether a file is a picture of something."""

from pathlib import Path


def is_a_picture(path: Path) -> bool:
    """Return whether a file is a PNG of some size that is neither blank nor completely painted."""
    from matplotlib.image import imread

    if not path.read_bytes().startswith(b"\x89PNG"):
        return False
    pixels = imread(path)[..., :3]
    painted = (pixels.min(axis=2) < 0.9).mean()
    return min(pixels.shape[:2]) > 200 and 0.005 < painted < 0.6
