"""Simulates motions."""
