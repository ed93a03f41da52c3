"""Puts a model together, translates it for the core, and checks the inputs of a solve."""
