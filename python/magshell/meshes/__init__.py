"""Generators of meshes: sheets, rings, shells of revolution, and any planar outline."""

from .annulus import annulus, sector
from .cut import cut
from .cylinder import cylinder
from .disk import disk
from .outline import outline
from .rectangle import rectangle
from .spherical_cap import spherical_cap

__all__ = ["annulus", "cut", "cylinder", "disk", "outline", "rectangle", "sector", "spherical_cap"]
