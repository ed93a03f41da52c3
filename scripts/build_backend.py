"""Builds magshell for pip in a folder that is kept, so that a second `pip install .` compiles only what has changed.

These are scikit-build-core's functions (PEP 517), with a build folder `build/PYTHON-PLATFORM`;
`--config-settings=build-dir=...` chooses another. Every build is configured anew, so that no option of an earlier one is
kept. The objects are kept, also where pip builds in another isolated environment, for which scikit-build-core deletes
them: Ninja compares commands and sources. What it cannot see is what `-march=native` means, and an update of the
compiler. So the objects are deleted where the compiler, or the processor that it compiles for, is another.
"""

import contextlib
import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

from scikit_build_core import build as backend
from scikit_build_core.build import *  # noqa: F403 (the other functions of a build backend)

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

Settings = dict[str, str | list[str]]
CONFIGURED = ("CMakeCache.txt", ".skbuild-info.json")  # of CMake's and scikit-build-core's last build
COMPILED_FOR = ".compiled-for"  # a file in the build folder that holds `target`


def target() -> str:
    """Return a digest of what the compiler defines for this processor: its own version and the instructions."""
    compiler = shlex.split(os.environ.get("CXX", "c++"))
    command = [*compiler, *"-march=native -dM -E -x c++".split(), os.devnull]
    try:
        defined = subprocess.run(command, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        defined = b""  # CMake finds another compiler, or says that there is none
    return hashlib.sha256(defined).hexdigest()


@contextlib.contextmanager
def build_folder(settings: Settings | None) -> Iterator[Settings]:
    """Yield the settings with a build folder that is to be configured anew; nobody else builds there meanwhile.

    Where the folder cannot be written, as in sources of somebody else, scikit-build-core builds in a temporary one.
    """
    settings = dict(settings or {})
    own = f"build/{sys.implementation.cache_tag}-{sysconfig.get_platform()}"
    folder = Path(str(settings.get("build-dir", own)))
    with contextlib.ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock = stack.enter_context((folder / ".lock").open("w"))
        except OSError:
            yield settings
            return
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        objects, compiled_for, now = folder / "CMakeFiles", folder / COMPILED_FOR, target()
        if objects.exists() and compiled_for.exists() and compiled_for.read_text() != now:
            shutil.rmtree(objects)
        compiled_for.write_text(now)
        for name in CONFIGURED:
            (folder / name).unlink(missing_ok=True)
        yield settings | {"build-dir": str(folder)}


def build_wheel(
    wheel_directory: str, config_settings: Settings | None = None, metadata_directory: str | None = None
) -> str:
    """Build a wheel and return its file name (PEP 517)."""
    with build_folder(config_settings) as settings:
        return backend.build_wheel(wheel_directory, settings, metadata_directory)


def build_editable(
    wheel_directory: str, config_settings: Settings | None = None, metadata_directory: str | None = None
) -> str:
    """Build an editable wheel and return its file name (PEP 660)."""
    with build_folder(config_settings) as settings:
        return backend.build_editable(wheel_directory, settings, metadata_directory)
