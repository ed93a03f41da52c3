"""Writes the processor time of each test from a report of pytest: one line for each test function, parameters
together.

`make seconds` runs it:

    python scripts/test_seconds.py build/tests.xml tests/seconds.txt
"""

import re
import sys
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from pathlib import Path

LEAST = 0.5  # [s] shorter tests are not listed
HEADER = """\
# Tests that took more than half a second of the processor, all parameters together: seconds, file::test.
# `make quick` leaves them out, and several processes begin with the files that take longest. Written by `make seconds`;
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


if __name__ == "__main__":
    found = seconds_of(Path(sys.argv[1]))
    listed = sorted((name, took) for name, took in found.items() if took >= LEAST)
    Path(sys.argv[2]).write_text(HEADER + "".join(f"{took:.1f} {name}\n" for name, took in listed))
