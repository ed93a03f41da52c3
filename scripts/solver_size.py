"""Count the lines and the constants of the solver of statics.

python scripts/solver_size.py [--list]

Lines are those of the files of statics within solve/, with comments; lines of code are those without comments and empty
lines. A constant is a number with a name of its own: `constexpr`, of a number type, with a value that no other gives.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

SOLVE = Path(__file__).parents[1] / "cpp" / "magshell" / "solve"
# motion/, projective/, paths, modes and linear response have numbers of their own.
FILES = sorted(
    path
    for pattern in ("statics.*", "step_rules.h", "globalization/*", "newton/*")
    for path in SOLVE.glob(pattern)
)
_DECLARED = re.compile(r"constexpr (?:double|int|Index|std::size_t)\s+([^;]*);")
_COMMENT = re.compile(r"\s*//.*")


def main(arguments: list[str]) -> int:
    """Print the counts, and with --list the constants by file."""
    lines = code = 0
    named: list[str] = []
    for path in FILES:
        text = path.read_text()
        bare = [_COMMENT.sub("", line) for line in text.splitlines()]
        lines += len(bare)
        code += sum(bool(line.strip()) for line in bare)
        found = constants("\n".join(bare))
        named += found
        if found and "--list" in arguments:
            print(f"{path.relative_to(SOLVE)}: {', '.join(found)}")
    print(f"{lines} lines, {code} of them code; {len(named)} constants")
    return 0


def constants(text: str) -> list[str]:
    """Return the constants that a text without comments declares, but for those that follow from others."""
    found = []
    for declared in _DECLARED.findall(text):
        for part in declared.split(","):
            name, value = (side.strip() for side in part.split("=", 1))
            if not re.search(r"[A-Za-z_]{2,}", value):
                found.append(name)
    return found


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
