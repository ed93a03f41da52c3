"""Defines meshes of triangles with three and with six nodes."""
