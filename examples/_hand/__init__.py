"""The parts of examples/gesturing_hand.py: the shape, the gestures, the designs, the report."""
