"""The parts of examples/bistable_beam.py: the model, the studies of its numbers, the report."""
