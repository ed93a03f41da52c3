"""Number of threads at the start of a process: from its environment variables, or the processors that it may use."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

MOST_THREADS = 1024
MOST_BY_DEFAULT = 8  # on most meshes the loops are too short to gain from more threads


def first_threads(environment: Mapping[str, str], root: Path = Path("/")) -> int:
    """Return MAGSHELL_NUM_THREADS, or else the number of processors, at most OMP_NUM_THREADS or else 8.

    root: the folder that holds proc and sys. Raises ValueError if MAGSHELL_NUM_THREADS is no number of threads. A
    bad OMP_NUM_THREADS is ignored, because it belongs to other programs.
    """
    ours = environment.get("MAGSHELL_NUM_THREADS", "").strip()
    if ours:
        if not (ours.isdecimal() and 1 <= int(ours) <= MOST_THREADS):
            raise ValueError(
                f"MAGSHELL_NUM_THREADS must be an integer between 1 and {MOST_THREADS}, got {ours!r}"
            )
        return int(ours)
    everyones = (
        environment.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    )  # a number for each nested loop
    said = int(everyones) if everyones.isdecimal() else 0
    return min(processors(root), said if 1 <= said <= MOST_THREADS else MOST_BY_DEFAULT)


def processors(root: Path = Path("/")) -> int:
    """Return the number of processors that the process may use, by its affinity and its control groups' quotas; at
    least 1.

    A quota of 1.5 counts as one: when a group has used up its share of a tenth of a second, all its threads are
    stopped.
    """
    try:
        count = len(os.sched_getaffinity(0))
    except AttributeError:  # not of this system
        count = os.cpu_count() or 1
    quotas = quotas_of(root)
    return max(1, min(count, int(min(quotas)))) if quotas else count


def quotas_of(root: Path = Path("/")) -> list[float]:
    """Return the quotas, in processors, of the process's control groups (versions 1 and 2) and of the groups around
    them."""
    try:
        groups = (root / "proc/self/cgroup").read_text().splitlines()
        mounts = (root / "proc/self/mountinfo").read_text().splitlines()
    except OSError:
        return []
    found = []
    for line in groups:
        number, controllers, group = line.split(":", 2)
        unified = number == "0" and not controllers
        if not unified and "cpu" not in controllers.split(","):
            continue
        read = _quota_of_version_2 if unified else _quota_of_version_1
        for top, below in _folders(mounts, group, unified):
            folder = root / top.lstrip("/") / below
            for _ in range(len(Path(below).parts) + 1):
                found.append(read(folder))
                folder = folder.parent
    return [quota for quota in found if quota is not None]


def _folders(mounts: list[str], group: str, unified: bool) -> Iterator[tuple[str, str]]:
    """Yield where control groups of this kind are mounted, and this group's folder below.

    A container may see no more than the mounted top folder.
    """
    for line in mounts:
        before, _, after = line.partition(" - ")
        _, _, _, mounted, top, *_ = before.split()
        kind, *_, options = after.split()
        if kind == "cgroup2" if unified else kind == "cgroup" and "cpu" in options.split(","):
            inside = os.path.relpath(group, _unescaped(mounted))
            yield _unescaped(top), "" if inside.startswith("..") else inside


def _unescaped(path: str) -> str:
    return re.sub(r"\\(\d{3})", lambda code: chr(int(code[1], 8)), path)


def _quota_of_version_2(folder: Path) -> float | None:
    return _ratio(_words(folder / "cpu.max"))


def _quota_of_version_1(folder: Path) -> float | None:
    return _ratio([*_words(folder / "cpu.cfs_quota_us"), *_words(folder / "cpu.cfs_period_us")])


def _words(path: Path) -> list[str]:
    try:
        return path.read_text().split()
    except OSError:
        return []


def _ratio(words: list[str]) -> float | None:
    """Return the quotient of two numbers; None if there is no quota, which is "max" in version 2 and negative in
    version 1."""
    try:
        quota, period = map(int, words)
    except ValueError:
        return None
    return quota / period if quota > 0 and period > 0 else None
