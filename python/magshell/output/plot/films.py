"""Writing of images as a GIF or MP4 file, which is complete or not written at all."""

from __future__ import annotations

import contextlib
import errno
import importlib
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..._runtime.files import replacing

if TYPE_CHECKING:
    from ..._input.kinds import FilePath

_NO_PILLOW = 'a GIF needs pillow: pip install "magshell[plot]"'
_NO_FFMPEG = (
    'an MP4 needs ffmpeg: pip install "magshell[movie]", or have ffmpeg on the PATH; a .gif needs neither'
)
COLORS = 256


def checked_path(path: FilePath, fps: float) -> Path:
    """Return the path of a movie after checks.

    Raises ValueError for another ending or too many frames per second for the format, ImportError if the library that
    writes it is not installed, FileNotFoundError if the folder does not exist.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in (".gif", ".mp4"):
        page = "; ms.write_page writes a page that plays" if ending in (".html", ".htm") else ""
        raise ValueError(f"a movie is saved as .gif or .mp4, got {path.name!r}{page}")
    if ending == ".gif" and fps > 50:
        raise ValueError(f"a .gif shows at most 50 frames a second, got fps={fps:g}; an .mp4 shows more")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path.name!r}: there is no folder {str(path.parent)!r}")
    _pillow() if ending == ".gif" else ffmpeg()
    return path


def write(path: Path, images: Iterable[np.ndarray], samples: list[np.ndarray], fps: float) -> None:
    """Write images (height, width, 3) uint8 as a movie.

    samples: images from which the colours of a GIF are chosen; together they should have all colours.
    """
    with replacing(path) as part:
        if path.suffix.lower() == ".gif":
            _write_gif(part, images, samples, fps)
        else:
            _write_mp4(part, images, fps)


def _write_gif(path: Path, images: Iterable[np.ndarray], samples: list[np.ndarray], fps: float) -> None:
    """Write a GIF with one palette for all frames and no dithering, so that parts at rest do not flicker."""
    image = _pillow()
    palette = _palette(samples)
    frames = (image.fromarray(each).quantize(palette=palette, dither=image.Dither.NONE) for each in images)
    first = next(frames)
    with path.open("wb") as file:
        first.save(
            file,
            format="GIF",
            save_all=True,
            append_images=frames,
            duration=10 * round(100 / fps),
            loop=0,
            optimize=False,
        )


def _palette(samples: list[np.ndarray]):
    """Return an image whose palette has the main colours of the samples, and white.

    Colours are weighted by the logarithm of their frequency, so that rare ones are represented as well.
    """
    image = _pillow()
    codes = [each.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], dtype=np.uint32) for each in samples]
    distinct, counts = np.unique(np.concatenate(codes, axis=None), return_counts=True)
    weighed = np.repeat(distinct, 1 + np.log2(counts).astype(np.int64))
    rgb = np.stack([weighed >> 16, weighed >> 8 & 255, weighed & 255], axis=1).astype(np.uint8)
    few = image.fromarray(rgb[None]).quantize(COLORS - 1, method=image.Quantize.MEDIANCUT).getpalette()
    chosen = np.array([255, 255, 255, *few], dtype=np.uint8).reshape(-1, 3)
    # pillow's search for the nearest colour is not exact: without nearly white colours, white stays white
    chosen[chosen.min(axis=1) > 240] = 255
    palette = image.new("P", (1, 1))
    palette.putpalette(chosen.ravel().tolist())
    return palette


def _write_mp4(path: Path, images: Iterable[np.ndarray], fps: float) -> None:
    images = iter(images)
    first = next(images)
    height, width, _ = first.shape
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-"]
    coding = ["-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"]
    command = [ffmpeg(), "-y", "-loglevel", "error", *raw, *coding, str(path)]
    with tempfile.TemporaryFile() as complaints:
        # a new session, so that Ctrl-C reaches this process only, which then ends ffmpeg
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=complaints,
            start_new_session=True,
        )
        try:
            process.stdin.write(first.tobytes())
            for each in images:
                process.stdin.write(each.tobytes())
            process.stdin.close()
            failed = process.wait() != 0
        except BrokenPipeError:
            failed = True
        finally:
            process.kill()
            process.wait()
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
        if failed:
            complaints.seek(0)
            said = complaints.read().decode(errors="replace").strip().splitlines() or ["it said nothing"]
            raise OSError(errno.EIO, f"ffmpeg failed: {said[-1]}")


def ffmpeg() -> str:
    """Return the path of ffmpeg, from the package imageio-ffmpeg or the PATH. Raises ImportError if there is none."""
    try:
        return importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        found = shutil.which("ffmpeg")
    if found is None:
        raise ImportError(_NO_FFMPEG)
    return found


def _pillow():
    try:
        return importlib.import_module("PIL.Image")
    except ImportError as error:
        raise ImportError(_NO_PILLOW) from error
