"""Reads .npz files from unknown sources: arrays of numbers only, using no more memory than the file's size justifies."""

from __future__ import annotations

import math
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

_MAGIC = b"\x93NUMPY"
_LONGEST_HEADER = 10_000  # bytes; numpy's own limit for headers that it evaluates
_DEFLATED = 1032  # [-] at most so many bytes come out of one byte that was deflated


@contextmanager
def open_npz(source: Any) -> Iterator[Any]:
    """Open an .npz file for reading, as np.load does, once the sizes that its arrays claim fit the file.

    source: a path or an open binary file. Raises ValueError on anything else than an archive of arrays of numbers, or on
    one whose arrays claim to be larger than what is stored; OSError where it cannot be read.
    """
    try:
        with zipfile.ZipFile(source) as archive:
            for member in archive.infolist():
                _check_member(archive, member)
        if hasattr(source, "seek"):
            source.seek(0)
        with np.load(source, allow_pickle=False) as file:
            yield file
    # zipfile raises NotImplementedError for a compression that it does not know.
    except (zipfile.BadZipFile, zlib.error, struct.error, NotImplementedError, EOFError) as error:
        raise ValueError(f"it is no .npz archive, or a damaged one: {error}") from error


def _check_member(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> None:
    if member.file_size > _DEFLATED * max(member.compress_size, 1):
        raise ValueError(
            f"{member.filename} claims {member.file_size:,} bytes, more than what is stored can hold"
        )
    if member.flag_bits & 1:
        raise ValueError(f"{member.filename} is encrypted")
    with archive.open(member) as stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise ValueError(f"{member.filename} is no array of numpy's")
    with archive.open(member) as stream:
        shape, dtype = _header(stream)
        stored = member.file_size - stream.tell()
    claimed = math.prod(shape) * dtype.itemsize
    if claimed != stored and not dtype.hasobject:  # np.load says that objects are refused
        raise ValueError(
            f"the array {member.filename} claims shape {shape} of {dtype}, {claimed:,} bytes, but the file holds "
            f"{max(stored, 0):,} of it"
        )


def _header(stream: Any) -> tuple[tuple[int, ...], np.dtype[Any]]:
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(stream, max_header_size=_LONGEST_HEADER)
    return shape, dtype
