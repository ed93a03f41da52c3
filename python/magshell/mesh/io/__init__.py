"""Reads and writes files of meshes."""
