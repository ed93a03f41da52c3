"""What examples/beating_heart.py is made of: the shape, the task, the design, the beating, pictures."""
