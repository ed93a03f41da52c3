"""Measures how accurate and how fast magshell is: python -m benchmarks PART, in the folder of the sources."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "examples"))  # robots, and what `benchmarks paper` runs
