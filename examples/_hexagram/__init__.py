"""What examples/hexagram.py is made of: the sheet and its wanted shape, the design problem, the report."""
