"""The parts of examples/humanoid.py: the body, its four kinds of skeleton, measures, pictures."""
