"""Generators of meshes: sheets, rings, shells of revolution, and any planar outline."""

from .annuli import annulus, sector
from .cuts import cut
from .cylinders import cylinder
from .disks import disk
from .outlines import outline
from .rectangles import rectangle
from .spherical_caps import spherical_cap

__all__ = ["annulus", "cut", "cylinder", "disk", "outline", "rectangle", "sector", "spherical_cap"]
