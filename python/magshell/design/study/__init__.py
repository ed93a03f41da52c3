"""Evaluates a function at many points of its parameters, and collects a table."""
