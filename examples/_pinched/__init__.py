"""The parts of examples/pinched_cylinder.py."""
