"""The parts of examples/hexagram.py: the sheet and its target shape, the design problem, the report."""
