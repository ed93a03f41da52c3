"""Defines meshes of tetrahedra with four and with ten nodes."""
