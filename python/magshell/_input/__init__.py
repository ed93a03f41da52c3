"""Checks and converts what a user passes in: numbers with units, indices, tensors."""
