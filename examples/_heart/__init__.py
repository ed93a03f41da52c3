"""The parts of examples/beating_heart.py: the shape, the task, the design, the beating, pictures."""
