"""Prints the test files of rooms of the sources, the most concerned first, as many as fit into a time.

    python scripts/tests_of.py room contact                   for `make room`: a room's tests, then those that use it
    python scripts/tests_of.py change [BASE] [--seconds 450]  for `make change`: tests of the rooms changed since BASE and
                                                              of the rooms above them

Rooms, their order and their folders of tests are those of docs/map.md. The time is that of the processor as
tests/seconds.txt has it: of the tests of `make test` for a room, of the nightly ones for a change. BASE is a commit; by
default where HEAD left origin/main, or else the last commit that is four hours older than HEAD. What is chosen, and what is
left out, goes to the standard error.
"""

import argparse
import ast
import re
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROOM_SECONDS, CHANGE_SECONDS = 100.0, 450.0  # s of the processor: a minute and four of two processors
# Tests of the whole, which stand above all rooms.
ABOVE = ["gradients", "invariants", "hard", "physics", "examples", "docs", "benchmarks"]
# A change of these files counts as one of every room, as all depend on them.
FOUNDATIONS = ("CMakeLists.txt", "pyproject.toml", "cpp/bindings/")


@dataclass
class Room:
    """A room of the sources: its folder, or its files of one name, and the folders of its tests."""

    source: str
    tests: list[str]
    public: set[str] = field(default_factory=set)

    def holds(self, path: str) -> bool:
        """Return whether a file of the repository lies in this room."""
        return path.startswith((self.source + "/", self.source + "."))


def rooms() -> list[Room]:
    """Return the rooms on the map, from the lowest floor up: the core's first, then the package's."""
    found = []
    for line in (ROOT / "docs" / "map.md").read_text().split("\n## Tests\n")[0].splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) not in (4, 5) or not cells[-1].startswith("`tests/"):
            continue
        name = cells[-4].strip("`")
        source = name if name.startswith("cpp/") else "python/magshell/" + name.replace(".", "/")
        found.append(Room(source, re.findall(r"`([^`]+)`", cells[-1])))
    for statement in ast.parse((ROOT / "python/magshell/__init__.py").read_text()).body:
        if isinstance(statement, ast.ImportFrom) and statement.level == 1:
            module = "python/magshell/" + (statement.module or "").replace(".", "/")
            for room in found:
                if (module + "/").startswith(room.source + "/"):
                    room.public |= {each.asname or each.name for each in statement.names}
    return found


def files_below(folder: str) -> list[str]:
    return sorted(str(path.relative_to(ROOT)) for path in (ROOT / folder).rglob("test_*.py"))


def readers(chosen: list[Room]) -> list[str]:
    """Return the test files that use public names of rooms or import them, those that do so most often first."""
    names = sorted(set().union(*(room.public for room in chosen)))
    modules = [
        room.source.removeprefix("python/").replace("/", r"\.")
        for room in chosen
        if room.source.startswith("python/")
    ]
    patterns = [rf"\bms\.(?:{'|'.join(names)})\b"] if names else []
    pattern = re.compile("|".join(patterns + modules) or r"(?!)")
    uses = {path: len(pattern.findall((ROOT / path).read_text())) for path in files_below("tests")}
    return sorted((path for path in uses if uses[path]), key=lambda path: -uses[path])


def seconds_of_files() -> dict[bool, Counter[str]]:
    """Return {nightly: {name of a test file: seconds}} of the tests that are listed."""
    found: dict[bool, Counter[str]] = {False: Counter(), True: Counter()}
    for line in (ROOT / "tests" / "seconds.txt").read_text().splitlines():
        if not line.startswith("#"):
            seconds, name, *nightly = line.split()
            found[bool(nightly)][name.partition("::")[0]] += float(seconds)
    return found


def of_room(name: str) -> list[str]:
    """Return the files for rooms of a name, such as contact or model.contact."""
    ending = "/" + name.strip("/").replace(".", "/")
    chosen = [room for room in rooms() if ("/" + room.source).endswith(ending)]
    if not chosen:
        known = sorted({room.source.rpartition("/")[2] for room in rooms()})
        sys.exit(f"There is no room '{name}' in docs/map.md; there are: {' '.join(known)}")
    own = [path for room in chosen for folder in room.tests for path in files_below(folder)]
    return [*own, *readers(chosen)]


def of_change(changed: list[str]) -> list[str]:
    """Return the files for a change: changed tests, tests of changed rooms, those that use them, and all above."""
    every = rooms()
    if any(path.startswith(FOUNDATIONS) for path in changed):
        touched = every
    else:
        touched = [room for room in every if any(room.holds(path) for path in changed)]
        # A room within a room is the nearer one: model/contact, not model.
    tests = [path for path in changed if re.fullmatch(r"tests/(?:.*/)?test_\w+\.py", path)]
    own = [path for room in touched for folder in room.tests for path in files_below(folder)]
    lowest = min((every.index(room) for room in touched), default=len(every))
    folders = [folder for room in every[lowest:] for folder in room.tests]
    folders += [f"tests/{name}" for name in ABOVE] if touched else []
    folders += [f"tests/{name}" for name in ABOVE if any(path.startswith(f"{name}/") for path in changed)]
    above = [path for folder in folders for path in files_below(folder)]
    return [path for path in (*tests, *own, *readers(touched), *above) if (ROOT / path).exists()]


def git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else ""


def default_base() -> str:
    """Return where HEAD left origin/main, or the last commit that is four hours older than HEAD."""
    fork, head = git("merge-base", "origin/main", "HEAD"), git("rev-parse", "HEAD")
    if fork and fork != head:
        return fork
    made = git("show", "-s", "--format=%ct", "HEAD")
    older = git("rev-list", "-1", f"--before={int(made) - 4 * 3600}", "HEAD") if made else ""
    return older or git("rev-list", "--max-parents=0", "HEAD").partition("\n")[0]


def fitting(files: list[str], costs: Counter[str], budget: float) -> list[str]:
    """Return the files in their order, each once, without those that no longer fit; say what they take together."""
    chosen, left_out, spent = [], [], 0.0
    for path in dict.fromkeys(files):
        cost = costs[Path(path).name]
        if spent + cost > budget and chosen:
            left_out.append(path)
            continue
        chosen.append(path)
        spent += cost
    print(f"{len(chosen)} test files, {spent:.0f} s of the processor as measured", file=sys.stderr)
    if left_out:
        print(
            f"left out of {budget:.0f} s, the least concerned: {' '.join(left_out[:8])} ...", file=sys.stderr
        )
    return chosen


def main() -> None:
    """Print the chosen files, one a line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=["room", "change"])
    parser.add_argument("name", nargs="?", help="the room, or the commit since which files changed")
    parser.add_argument("--seconds", type=float, help="s of the processor that the files may take together")
    said = parser.parse_args()
    costs = seconds_of_files()
    if said.what == "room":
        if not said.name:
            sys.exit("Name a room of docs/map.md: make room ROOM=contact")
        chosen = fitting(of_room(said.name), costs[False], said.seconds or ROOM_SECONDS)
    else:
        base = said.name or default_base()
        changed = git("diff", "--name-only", base, "HEAD").splitlines() if base else []
        print(f"{len(changed)} files changed since {base[:12] or 'nothing that is known'}", file=sys.stderr)
        files = [path for path in of_change(changed) if costs[True][Path(path).name]]
        chosen = fitting(files, costs[True], said.seconds or CHANGE_SECONDS)
    print("\n".join(chosen))


if __name__ == "__main__":
    main()
