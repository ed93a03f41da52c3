"""What examples/bending_twisting.py is made of: the strip, its energy's balance, the report."""
