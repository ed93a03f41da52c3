"""The parts of examples/bridges.py: shapes, the search, the identifiability of the moduli, pictures."""
