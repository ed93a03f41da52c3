"""Shells, and their strains and stresses in results."""
