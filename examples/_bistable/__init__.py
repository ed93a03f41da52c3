"""What examples/bistable_beam.py is made of: the model, the studies of its numbers, the report."""
