"""What a scene that was just made is warned of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..surroundings.contact_inputs import check_neighbours
from .plausible import warn_of_units

if TYPE_CHECKING:
    from .scene import Scene


def look_at(scene: Scene) -> None:
    """Warn of contact between neighbours and of sizes that no body has. Raises ValueError as `check_neighbours`."""
    check_neighbours(scene, warns=True)
    warn_of_units(scene, scene._values)
