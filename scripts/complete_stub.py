"""Completes the types of containers in the extension's stub, which pybind11 leaves bare. `make stubs` runs it.

A type checker counts a bare `dict` as unknown: it becomes `dict[str, typing.Any]`.
"""

import re
import sys
from pathlib import Path

FULL = {
    "dict": "dict[str, typing.Any]",
    "list": "list[typing.Any]",
    "tuple": "tuple[typing.Any, ...]",
    "collections.abc.Callable": "collections.abc.Callable[..., typing.Any]",
}


def completed(stub: str) -> str:
    """Return the stub with complete container types in annotations: behind a colon or an arrow."""
    names = "|".join(map(re.escape, FULL))
    stub = re.sub(r"(?<=\*\*kwargs)(?!:)", ": typing.Any", stub)
    return re.sub(rf"(?<=[:>|] )({names})(?![\w.\[])", lambda found: FULL[found[1]], stub)


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(completed(path.read_text()))
