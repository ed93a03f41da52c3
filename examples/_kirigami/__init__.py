"""What examples/kirigami_tower.py is made of: the model, the design of its magnetization, the report."""
