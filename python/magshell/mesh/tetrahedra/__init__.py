"""Meshes of tetrahedra with four and with ten nodes."""
