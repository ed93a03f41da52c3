"""Runs one optimization from many starts in parallel processes."""
