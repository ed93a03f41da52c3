"""The parts of examples/kirigami_tower.py: the model, the design of its magnetization, the report."""
