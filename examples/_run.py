"""The common script of all examples: compute, print the numbers, and write pictures and movies into out/."""

import time
from collections.abc import Callable
from pathlib import Path


def run(
    compute: Callable[[], dict], summary: Callable[[dict], str], write: Callable[[dict, Path], None]
) -> None:
    """Run an example as a script.

    write: function that writes pictures of the outcome into an existing folder.
    """
    began = time.perf_counter()
    outcome = compute()
    print(summary(outcome))
    out = Path("out")
    out.mkdir(exist_ok=True)
    write(outcome, out)
    print(f"\nPictures in {out}/; {time.perf_counter() - began:.0f} s in all.")
