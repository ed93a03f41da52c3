"""Writes files atomically: into a temporary file in the same folder, which is then renamed.

A reader finds the old file or the new one, never a part of either. Everything that the package writes goes through
here.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

_STEM = (
    40  # characters of the name that the temporary file keeps: longer names might exceed the system's limit
)


_ABANDONED = 3600.0  # [s] age of a temporary file that nobody writes any more: writing takes minutes at most


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield an empty temporary file, of the same folder and ending as `path`, for a writer.

    It replaces `path` once the block has ended without an error and the data are on the disk. After an error or
    Ctrl-C the temporary file is removed, and `path` is unchanged.

    A symbolic link stays, and the file that it leads to is replaced. A new file gets the permissions (and, where
    that is allowed, the owner) of the one it replaces. A device or a pipe cannot be replaced: it is written to
    directly.

    Raises OSError, of the kind of its cause, with the path: also for a file without write permission, and for a
    folder in which no file can be made.
    """
    path = Path(path)
    with _named(path):
        target = Path(os.path.realpath(path))
        there = _status(target)
        if there is not None and not stat.S_ISREG(there.st_mode):
            yield target
            return
        part = _create_temporary(target)
        try:
            yield part
            _copy_permissions(part, there)
            with part.open("r+b") as file:
                os.fsync(file.fileno())  # a full disk must show before the old file is gone
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)


def replace_file(path: str | Path, write: Callable[[BinaryIO], object]) -> None:
    """Replace a file by what `write` writes to an open binary file, with the guarantees of `replacing`."""
    with replacing(path) as part, part.open("wb") as file:
        write(file)


def check_replaceable(path: str | Path) -> None:
    """Raise the OSError that `replacing` would raise for this path, before there is anything to write."""
    path = Path(path)
    with _named(path):
        target = Path(os.path.realpath(path))
        there = _status(target)
        if there is None or stat.S_ISREG(there.st_mode):
            _create_temporary(target).unlink()


def _status(target: Path) -> os.stat_result | None:
    """Return the status of an existing file, None if there is none. Raises OSError if it may not be written to."""
    try:
        there = target.stat()
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(there.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not os.access(target, os.W_OK, effective_ids=os.access in os.supports_effective_ids):
        # renaming would not check this permission
        raise PermissionError(errno.EACCES, "the file that is there may not be written to")
    return there


def _create_temporary(target: Path) -> Path:
    """Create an empty file with a random name in the target's folder. Raises OSError with the reason if it cannot."""
    part = target.with_name(f".{target.stem[:_STEM]}.{os.urandom(4).hex()}{target.suffix}")
    try:
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        _remove_left_behind(target, part)
    except OSError as error:
        if not target.parent.is_dir():
            reason = f"there is no folder {str(target.parent)!r}"
        elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            reason = (
                f"no file may be made in {str(target.parent)!r} ({os.strerror(error.errno)}), and a file is written "
                "beside its place first"
            )
        else:
            raise
        raise OSError(error.errno, reason) from error
    return part


def _remove_left_behind(target: Path, part: Path) -> None:
    """Remove temporary files of the same target that processes left behind when they were killed."""
    named = re.compile(rf"\.{re.escape(target.stem[:_STEM])}\.[0-9a-f]{{8}}{re.escape(target.suffix)}")
    now = part.stat().st_mtime
    for other in target.parent.iterdir():
        if named.fullmatch(other.name) and other != part:
            with contextlib.suppress(OSError):
                if now - other.stat().st_mtime > _ABANDONED:
                    other.unlink()


def _copy_permissions(part: Path, there: os.stat_result | None) -> None:
    """Give the temporary file the permissions, and if allowed the owner, of the file that it replaces."""
    if there is None:
        return
    if hasattr(os, "chown"):
        with contextlib.suppress(OSError):  # only root may change the owner
            os.chown(part, there.st_uid, there.st_gid)
    part.chmod(stat.S_IMODE(there.st_mode) & 0o777)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Replace the message of the system's errors by one that names the file to be written, not the temporary one."""
    try:
        yield
    except OSError as error:
        message = f"cannot write {str(path)!r}: {error.strerror or error}"
        raise (OSError(message) if error.errno is None else OSError(error.errno, message)) from error
