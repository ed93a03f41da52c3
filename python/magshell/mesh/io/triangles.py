"""The content of a file of triangles, before a mesh is made of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .named_groups import (
    Named,
    drop_group_fields,
    groups_of_face_fields,
    groups_of_vertex_fields,
    merged_names,
)


@dataclass
class TriangleContent:
    """The content of a file of triangles: points (n, 2 or 3), faces (n_f, 3 or 6), fields and named groups."""

    points: np.ndarray
    faces: np.ndarray
    vertex_fields: dict[Any, Any]
    face_fields: dict[Any, Any]
    named: Named = field(default_factory=Named)

    def take_groups(self) -> None:
        """Turn the fields that stand for groups into groups."""
        self.named.groups = merged_names(
            self.named.groups,
            groups_of_vertex_fields(self.vertex_fields),
            groups_of_face_fields(self.face_fields, self.faces),
        )
        self.face_fields = drop_group_fields(self.face_fields)
