"""Connects the gradients of the core with torch."""
