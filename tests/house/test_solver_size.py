"""The solver of statics keeps few constants."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts" / "solver_size.py"


def test_the_solver_of_statics_has_at_most_a_dozen_constants():
    """Check that a rule takes its number from step_rules.h, or stands in the table of docs/statics-rules.md."""
    said = subprocess.run([sys.executable, SCRIPT], capture_output=True, text=True, check=True).stdout
    constants = int(said.split(";")[1].split()[0])
    assert 0 < constants <= 12
