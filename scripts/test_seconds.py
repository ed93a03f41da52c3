"""Writes the processor time of tests from a report of pytest: one line for each test function that takes LISTED or more,
parameters together and with the fixtures that it shares. The longest are nightly, so many that all others take BUDGET.

`make seconds` runs it:

    python scripts/test_seconds.py build/tests.xml tests/seconds.txt
"""

import re
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter, defaultdict
from pathlib import Path

BUDGET = 480.0  # s of the processor for the tests of `make test`; collecting them and pytest itself take some 100 s more
LISTED = 0.2  # s
# Tests of `make test` whatever they take, as nothing else there guards the same lines.
KEPT = {
    "test_every_gradient.py::test_all_inputs_along_one_direction",
    "test_counts.py::test_counts_of_every_family_are_those_of_the_last_release",
}
HEADER = """\
# Tests that took longest, all parameters together: seconds of the processor with the fixtures that they share, file::test,
# and whether it is nightly. The others took {:.0f} s in sum, with those that are too quick to be listed.
# Several processes begin with the files that take longest. Written by `make seconds`; a test that is not here is quick.
"""


class Test:
    """The seconds of a test function: its own, all parameters together, and those of the fixtures that it shares."""

    def __init__(self) -> None:
        self.own = 0.0
        self.shared: dict[str, float] = {}

    @property
    def seconds(self) -> float:
        """Return the seconds that the test takes if it is the first to need its fixtures."""
        return self.own + sum(self.shared.values())


def seconds_of(report: Path) -> dict[str, Test]:
    """Return test_file.py::test_name -> seconds, as tests/support/parallel.py names and measures them."""
    tests: dict[str, Test] = defaultdict(Test)
    for case in ElementTree.parse(report).iter("testcase"):
        file = case.attrib["classname"].split(".")[-1]  # tests are functions, in no class
        name = re.sub(r"\[.*", "", case.attrib["name"], flags=re.DOTALL)
        test = tests[f"{file}.py::{name}"]
        for each in case.iter("property"):
            key, seconds = each.attrib["name"], float(each.attrib["value"])
            if key == "processor_seconds":
                test.own += seconds
            elif key.startswith("shared "):
                test.shared[key] = max(seconds, test.shared.get(key, 0.0))
    return tests


def nightly_tests(tests: dict[str, Test], budget: float) -> list[str]:
    """Return the names of the longest tests, in alphabetical order, without which the rest take at most `budget`.

    A shared fixture counts once for all the rest that use it.
    """
    users = Counter(key for test in tests.values() for key in test.shared)
    fixtures = {key: seconds for test in tests.values() for key, seconds in test.shared.items()}
    left, nightly = sum(test.own for test in tests.values()) + sum(fixtures.values()), []
    for name in sorted(tests.keys() - KEPT, key=lambda name: (-tests[name].seconds, name)):
        if left <= budget:
            break
        nightly.append(name)
        users.subtract(list(tests[name].shared))
        left -= tests[name].own + sum(fixtures[key] for key in tests[name].shared if not users[key])
    return sorted(nightly)


if __name__ == "__main__":
    found = seconds_of(Path(sys.argv[1]))
    nightly = set(nightly_tests(found, BUDGET))
    lines = "".join(
        f"{found[name].seconds:.2f} {name}{' nightly' if name in nightly else ''}\n"
        for name in sorted(found)
        if found[name].seconds >= LISTED or name in nightly
    )
    Path(sys.argv[2]).write_text(HEADER.format(BUDGET) + lines)
