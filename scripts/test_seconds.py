"""Writes the processor time of the slow tests from a report of pytest: one line for each test function, parameters
together. The tests that are not listed take BUDGET seconds in sum.

`make seconds` runs it:

    python scripts/test_seconds.py build/tests.xml tests/seconds.txt
"""

import re
import sys
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from pathlib import Path

BUDGET = 60.0  # [s] of the processor for all quick tests together; pytest itself and imports come on top
HEADER = """\
# Tests that took longest, all parameters together: seconds of the processor, file::test. All others took {:.0f} s in sum.
# `make quick` leaves these out, and several processes begin with the files that take longest. Written by `make seconds`;
# a test that is not here is quick.
"""


def seconds_of(report: Path) -> dict[str, float]:
    """Return test_file.py::test_name -> seconds, with fixtures, as tests/support/parallel.py names and measures them."""
    seconds: dict[str, float] = defaultdict(float)
    for case in ElementTree.parse(report).iter("testcase"):
        file = case.attrib["classname"].split(".")[-1]  # tests are functions, in no class
        name = re.sub(r"\[.*", "", case.attrib["name"], flags=re.DOTALL)
        properties = case.iter("property")
        seconds[f"{file}.py::{name}"] += sum(
            float(each.attrib["value"]) for each in properties if each.attrib["name"] == "processor_seconds"
        )
    return seconds


def slow_tests(seconds: dict[str, float], budget: float) -> list[str]:
    """Return the names of the longest tests, in alphabetical order, without which the rest take at most `budget`."""
    left, slow = sum(seconds.values()), []
    for name in sorted(seconds, key=lambda name: (-seconds[name], name)):
        if left <= budget:
            break
        slow.append(name)
        left -= seconds[name]
    return sorted(slow)


if __name__ == "__main__":
    found = seconds_of(Path(sys.argv[1]))
    lines = "".join(f"{found[name]:.2f} {name}\n" for name in slow_tests(found, BUDGET))
    Path(sys.argv[2]).write_text(HEADER.format(BUDGET) + lines)
