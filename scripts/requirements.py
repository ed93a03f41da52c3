"""Prints what an extra of pyproject.toml brings beside the package, a requirement a line, for `pip install -r`.

    python scripts/requirements.py EXTRA...

`make` installs it while the package is compiled. Extras that an extra names, magshell[...], are put in its place.
"""

import re
import sys
from pathlib import Path

try:
    import tomllib
except ImportError:  # Python 3.10
    from pip._vendor import tomli as tomllib

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
OWN = re.compile(rf"{PROJECT['name']}\[([^]]+)\]")


def requirements_of(extra: str) -> list[str]:
    """Return the requirements of an extra, with those of the extras that it names."""
    found = []
    for each in PROJECT["optional-dependencies"][extra]:
        own = OWN.fullmatch(each)
        found += [of for name in own[1].split(",") for of in requirements_of(name.strip())] if own else [each]
    return found


if __name__ == "__main__":
    wanted = PROJECT["dependencies"] + [each for extra in sys.argv[1:] for each in requirements_of(extra)]
    print("\n".join(dict.fromkeys(wanted)))
