"""The parts of examples/bending_twisting.py: the strip, its energy balance, the report."""
