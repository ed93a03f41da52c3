"""Generators of meshes: sheets, rings, shells of revolution, and any planar outline."""

from .annulus import annulus, sector
from .cylinder import cylinder
from .disk import disk
from .rectangle import rectangle
from .spherical_cap import spherical_cap

__all__ = ["annulus", "cylinder", "disk", "rectangle", "sector", "spherical_cap"]
