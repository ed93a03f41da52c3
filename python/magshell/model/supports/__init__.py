"""Supports, and the constraints that they impose."""
