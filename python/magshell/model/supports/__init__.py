"""Defines supports and the constraints that they make."""
