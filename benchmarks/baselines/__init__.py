"""Searches with and without gradients, on the same simulator and counting the same simulations."""
