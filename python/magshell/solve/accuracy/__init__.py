"""Discretization errors of results, and meshes refined until these are small enough."""
