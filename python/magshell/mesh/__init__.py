"""Defines meshes of triangles and of tetrahedra, makes them, reads and writes them."""
