"""Solids, their materials and skins, and their strains and stresses in results."""
