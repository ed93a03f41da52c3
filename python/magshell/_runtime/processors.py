"""How many threads this process begins with: what its environment says, or the processors it may use."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

MOST_THREADS = 1024
MOST_BY_DEFAULT = 8  # loops are too short for more to be worth it on most sheets


def first_threads(environment: Mapping[str, str], root: Path = Path("/")) -> int:
    """MAGSHELL_NUM_THREADS, or the processors, at most OMP_NUM_THREADS or else 8.

    root is the folder that holds proc and sys. Raises ValueError where MAGSHELL_NUM_THREADS is no number of threads;
    OMP_NUM_THREADS is not ours, and ignored then.
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
    """Those the system lets this process run on, by its affinity and its control groups' quotas. At least 1.

    A quota of 1.5 is one: when a group has used up its share of a tenth of a second, all its threads are stopped.
    """
    try:
        count = len(os.sched_getaffinity(0))
    except AttributeError:  # not of this system
        count = os.cpu_count() or 1
    quotas = quotas_of(root)
    return max(1, min(count, int(min(quotas)))) if quotas else count


def quotas_of(root: Path = Path("/")) -> list[float]:
    """The quotas of this process's control groups and of those around them, in processors: versions 1 and 2."""
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
    """Where groups of the kind are mounted, and this one's folder below, of which containers may see no more than the
    mounted top."""
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
    """Of two numbers; None without a quota, which is "max" in version 2 and negative in version 1."""
    try:
        quota, period = map(int, words)
    except ValueError:
        return None
    return quota / period if quota > 0 and period > 0 else None
