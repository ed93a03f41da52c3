"""Mesh generators: rectangles, rings, surfaces of revolution and planar outlines of triangles, and solids of tetrahedra."""

from .balls import ball
from .boxes import box
from .extrusions import extruded, solid_cylinder
from .filled import tetrahedralize
from .flat import disk, rectangle
from .outlines import cut, outline
from .stuffed import from_distance
from .surfaces_of_revolution import annulus, cylinder, sector, spherical_cap
from .tubes import tube

__all__ = [
    "annulus",
    "ball",
    "box",
    "cut",
    "cylinder",
    "disk",
    "extruded",
    "from_distance",
    "outline",
    "rectangle",
    "sector",
    "solid_cylinder",
    "spherical_cap",
    "tetrahedralize",
    "tube",
]


def __dir__() -> list[str]:
    """Return the public names, for tab completion."""
    return sorted(__all__)
