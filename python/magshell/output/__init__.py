"""Writes results to files and draws them."""
