"""
The C++ core of magshell; use the functions of the package, not this module.
"""

from __future__ import annotations

import collections.abc
import typing

import numpy
import numpy.typing

__all__: list[str] = [
    "AppliedField",
    "Dipoles",
    "PythonField",
    "SampledField",
    "TriangleMesh",
    "sample_fields",
    "vacuum_permeability",
]

class AppliedField:
    @property
    def name(self) -> str: ...
    @property
    def needs_gil(self) -> bool: ...

class Dipoles(AppliedField):
    def __init__(
        self,
        positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        moments: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> None: ...

class SampledField(AppliedField):
    def __init__(
        self,
        origin: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        spacing: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"
        ],
        flux_density: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    ) -> None: ...
    def contains(self, points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> list[bool]: ...

class PythonField(AppliedField):
    def __init__(self, sampler: collections.abc.Callable) -> None: ...

class TriangleMesh:
    def __init__(
        self,
        rest_positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        faces: typing.Annotated[numpy.typing.ArrayLike, numpy.int64],
    ) -> None: ...
    @property
    def edge_faces(self) -> numpy.ndarray: ...
    @property
    def edges(self) -> numpy.ndarray: ...
    @property
    def face_edges(self) -> numpy.ndarray: ...
    @property
    def faces(self) -> numpy.ndarray: ...
    @property
    def rest_positions(self) -> numpy.ndarray: ...

def sample_fields(
    fields: collections.abc.Sequence[AppliedField],
    scales: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
    points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    moments: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    order: typing.SupportsInt | typing.SupportsIndex,
) -> tuple:
    """
    The sum of scale * field at the points (n, 3) [m]: flux density, gradient, and second derivative contracted with the moments (n, 3); empty beyond the order.
    """

__version__: str = "0.1.0"
vacuum_permeability: float = 1.25663706127e-06
