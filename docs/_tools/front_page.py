"""Writes the pictures of the front page and of docs/examples.md: python docs/_tools/front_page.py [NAME ...].

Each is a small WebP in docs/pictures, most of them moving, computed anew from its example. The files are under version
control, so that the README shows them wherever it is read.
"""

from __future__ import annotations

import argparse
import os
import pickle
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PICTURES = ROOT / "docs" / "pictures"
sys.path[:0] = [str(HERE), str(ROOT / "examples")]

import example_scenes  # noqa: E402
import front_page_scenes  # noqa: E402
import own_field_scenes  # noqa: E402
from painter import write  # noqa: E402

SCENES = {
    **front_page_scenes.SCENES,
    **example_scenes.SCENES,
    **own_field_scenes.SCENES,
}


def main(arguments: list[str] | None = None) -> int:
    """Make the named pictures, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"by default all: {', '.join(SCENES)}"
    )
    parser.add_argument(
        "--keep",
        type=Path,
        metavar="FOLDER",
        help="keep computed shapes there, and use them again",
    )
    options = parser.parse_args(arguments)
    if unknown := set(options.names) - set(SCENES):
        parser.error(
            f"there are no pictures named {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}"
        )
    PICTURES.mkdir(exist_ok=True)
    if len(options.names) != 1:
        return _several(options.names or list(SCENES), options.keep)
    [name] = options.names
    size = write(
        SCENES[name].film(_data(name, options.keep)), PICTURES / f"{name}.webp"
    )
    seconds = time.process_time()
    print(f"{name}: {size / 1000:.0f} kB, {seconds:.0f} s of the processor", flush=True)
    return 0


def _several(names: list[str], folder: Path | None) -> int:
    """Make pictures in processes of their own, each on one thread, and return 1 if one of them failed."""
    environment = {**os.environ, "MAGSHELL_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    kept = [] if folder is None else ["--keep", str(folder)]

    def made(name: str) -> int:
        return subprocess.run(
            [sys.executable, __file__, name, *kept], env=environment
        ).returncode

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        failed = [
            name
            for name, code in zip(names, pool.map(made, names), strict=True)
            if code
        ]
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return int(bool(failed))


def _data(name: str, folder: Path | None) -> dict:
    """Compute the shapes of a picture, or read those that an earlier call left in a folder."""
    file = None if folder is None else folder / f"{name}.pickle"
    if file is not None and file.exists():
        return pickle.loads(file.read_bytes())
    data = SCENES[name].compute()
    if file is not None:
        folder.mkdir(parents=True, exist_ok=True)
        file.write_bytes(pickle.dumps(data))
    return data


if __name__ == "__main__":
    sys.exit(main())
