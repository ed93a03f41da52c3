"""What examples/humanoid.py is made of: the body, its four kinds of skeleton, measures, pictures."""
