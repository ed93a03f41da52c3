"""Fields of any kind with a prescribed pose, which may change in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ... import _core as core
from ..._input.quantity import quantity
from .field import AppliedField, UniformField
from .magnets import Magnet

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class PlacedField(AppliedField):  # plain-words: ok
    """A field in a frame of its own that is moved and rotated: B(x) = R B_own(R^T (x - center)), R = exp(rotation).

    It is for fields without a pose: SampledField, CustomField, MagpylibField, and Dipoles that move as one. Its center
    and rotation may be replaced in a solve and differentiated by, and given over time in ms.simulate, and so may the
    field's own values. Derivatives come from those of the field; if these are differences, they have errors of about 1e-7.

    Args:
        field: a SampledField, CustomField, MagpylibField or Dipoles.
        center: (3,) m, the position of the origin of its own frame.
        rotation: rotation vector (3,) rad, about the center.

    Raises ValueError for a UniformField, which does not depend on the position, and for a magnet, which has a center.

    >>> from math import pi
    >>> from magshell import Dipoles
    >>> up = Dipoles(positions=[[0, 0, 0]], moments=[[0, 0, 1]])
    >>> PlacedField(up, center=(0, 0, 0.1), rotation=(pi, 0, 0)).flux_density([0, 0, 0.2]).round(6) + 0.0
    array([ 0.    ,  0.    , -0.0002])
    """

    _replaceable = _in_time = ("center", "rotation")

    def __init__(
        self, field: AppliedField, *, center: Numbers = (0.0, 0.0, 0.0), rotation: Numbers = (0.0, 0.0, 0.0)
    ) -> None:
        if not isinstance(field, AppliedField) or isinstance(field, UniformField | Magnet | PlacedField):
            raise ValueError(
                f"field must be a SampledField, CustomField, MagpylibField or Dipoles, got {type(field).__name__}"
            )
        if field._core is None:
            raise ValueError("field is an AppliedField without a value: use a CustomField")
        self.field = field
        self.center: np.ndarray = quantity("center", "m", center, (3,))
        self.rotation: np.ndarray = quantity("rotation", "rad", rotation, (3,))
        self._replaceable = (*field._replaceable, "center", "rotation")
        self._made_from = {"field": field, "center": self.center, "rotation": self.rotation}
        self._core = core.PlacedField(field._core, self.center, self.rotation)

    def __setstate__(self, arguments: dict[Any, Any]) -> None:
        self.__init__(arguments["field"], center=arguments["center"], rotation=arguments["rotation"])

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        self.field._add_numbers(label, values, numbers)
        numbers[label, "center"], numbers[label, "rotation"] = self.center, self.rotation

    def replaced(self, **values: Any) -> PlacedField:
        """Return the field with another pose, or with other values of its own."""
        pose = {name: values.pop(name, getattr(self, name)) for name in ("center", "rotation")}
        if unknown := sorted(set(values) - set(self._replaceable)):
            raise ValueError(
                f"{type(self.field).__name__} has no value {unknown[0]!r} to be replaced: it has "
                f"{', '.join(self._replaceable)}"
            )
        return PlacedField(self.field.replaced(**values) if values else self.field, **pose)

    def _in_magnets(self, points: np.ndarray) -> np.ndarray:
        to_own = scipy.spatial.transform.Rotation.from_rotvec(np.array(self.rotation)).inv()
        return self.field._in_magnets(to_own.apply(points - self.center))

    def _sphere_around_sources(self) -> tuple[np.ndarray, float] | None:
        own = self.field._sphere_around_sources()
        if own is None:
            return None
        turned = scipy.spatial.transform.Rotation.from_rotvec(np.array(self.rotation)).apply(own[0])
        return turned + self.center, own[1]

    def __repr__(self) -> str:
        parts = [repr(self.field)]
        if self.center.any():
            parts.append(f"center ({', '.join(f'{x:g}' for x in self.center)}) m")
        if self.rotation.any():
            parts.append(f"rotation ({', '.join(f'{x:g}' for x in self.rotation)}) rad")
        return f"PlacedField({', '.join(parts)})"
