"""What examples/gesturing_hand.py is made of: the shape, the gestures, the designs, the report."""
