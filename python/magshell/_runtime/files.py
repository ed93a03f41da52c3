"""Files that are either the old one or the new one, never a part of either: written beside their place, then renamed.

Everything that the package writes goes through here.
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

_STEM = 40  # characters of the name that the file beside it bears: a name may be as long as the system allows


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """An empty file beside the path's, of the same ending, for a writer. It takes its place once the block has ended
    well and the disk has it all; after an error or Ctrl-C it is gone, and what was there is as it was.

    A link stays, and the file that it leads to is replaced. A new file has the permissions (and, where that is
    allowed, the owner) of the one it replaces. A device or a pipe has no place to take: it is written to as it is.

    Raises OSError, of the kind of its cause, with the path: also for a file that may not be written to, and for a
    folder in which no file may be made.
    """
    path = Path(path)
    with _named(path):
        place = Path(os.path.realpath(path))
        there = _status(place)
        if there is not None and not stat.S_ISREG(there.st_mode):
            yield place
            return
        part = _beside(place)
        try:
            yield part
            _keep_rights(part, there)
            with part.open("r+b") as file:
                os.fsync(file.fileno())  # else a disk may turn out to be full after the old file is gone
            part.replace(place)
        finally:
            part.unlink(missing_ok=True)


def replace_file(path: str | Path, write: Callable[[BinaryIO], object]) -> None:
    """`replacing` for what writes to an open file."""
    with replacing(path) as part, part.open("wb") as file:
        write(file)


def check_replaceable(path: str | Path) -> None:
    """Raises the OSError that `replacing` would raise for its path, before there is anything to write."""
    path = Path(path)
    with _named(path):
        place = Path(os.path.realpath(path))
        there = _status(place)
        if there is None or stat.S_ISREG(there.st_mode):
            _beside(place).unlink()


def _status(place: Path) -> os.stat_result | None:
    """Of what is there, if anything is. Raises OSError where it may not be written to."""
    try:
        there = place.stat()
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(there.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not os.access(place, os.W_OK, effective_ids=os.access in os.supports_effective_ids):
        # a rename would not ask
        raise PermissionError(errno.EACCES, "the file that is there may not be written to")
    return there


def _beside(place: Path) -> Path:
    part = place.with_name(f".{place.stem[:_STEM]}.{os.urandom(4).hex()}{place.suffix}")
    try:
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except OSError as error:
        if not place.parent.is_dir():
            reason = f"there is no folder {str(place.parent)!r}"
        elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            reason = (
                f"no file may be made in {str(place.parent)!r} ({os.strerror(error.errno)}), and a file is written "
                "beside its place first"
            )
        else:
            raise
        raise OSError(error.errno, reason) from error
    return part


def _keep_rights(part: Path, there: os.stat_result | None) -> None:
    if there is None:
        return
    if hasattr(os, "chown"):
        with contextlib.suppress(OSError):  # only root may give a file away
            os.chown(part, there.st_uid, there.st_gid)
    part.chmod(stat.S_IMODE(there.st_mode) & 0o777)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Errors of the system say which file was to be written, and not the one beside it."""
    try:
        yield
    except OSError as error:
        message = f"cannot write {str(path)!r}: {error.strerror or error}"
        raise (OSError(message) if error.errno is None else OSError(error.errno, message)) from error
