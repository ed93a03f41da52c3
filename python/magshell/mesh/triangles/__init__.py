"""Meshes of triangles with three and with six nodes."""
