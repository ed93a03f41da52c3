"""Defines solids, their materials and skins, and what results say of them."""
