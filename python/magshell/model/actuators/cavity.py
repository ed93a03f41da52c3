"""Closed cavities with a pressure, a gas or a liquid inside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..._input.selections import indices, selection
from ..._input.tensors import as_operand
from ..bodies.bodies import BODIES, Bodies, on_body
from ..shells.shell import Shell
from ..solids.solid import Solid
from .actuator import Actuator, number
from .actuator_results import CavityResult
from .closed_surface import ClosedSurface, of_faces, rim_vertices

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers
    from ..scene.scene import Scene


ATMOSPHERE = 101325.0  # [Pa] default outside pressure
WATER = 2.2e9  # [Pa] bulk modulus of water, the default of a liquid
_LAWS = {
    "pressure": ("pressure",),
    "gas": ("gas_pressure", "outside_pressure"),
    "liquid": ("volume", "bulk_modulus"),
}


class Cavity(Actuator):
    """A closed surface with a fluid inside, whose pressure is uniform and follows the surface.

    body: a Shell or a Solid, or several as [(body, faces), ...], with faces (k,) or None each.
    faces: (k,), those around the cavity, if it has one body. By default all of a shell, and those around the only hollow of
        a solid. Normals of a solid's faces point into the cavity; those of a shell's faces must point out of it.
    The fluid is given by one of pressure, gas_pressure and volume:

    pressure: Pa, relative to the outside, at any volume. Negative: suction.
    gas_pressure: Pa, absolute pressure at the rest volume of a gas at constant temperature; it gives the amount of gas,
        n R T over that volume. 0 is a vacuum.
        outside_pressure: Pa, that of the surroundings, by default one atmosphere.
    volume: m3, of a liquid, whose pressure follows from its compression.
        bulk_modulus: Pa, by default that of water. As the constraint is a penalty without a multiplier, the pressure
        loses a factor bulk_modulus / pressure of the precision of a double. The load factor interpolates from the rest
        volume to this volume, so load steps can reach a volume far from rest.

    close_rims: close open rims by lids without stiffness, fans of triangles from one vertex of each rim, flat if the rim
        is flat. The pressure on them acts on the rim, of a solid as a load on its edges, near which strains grow without
        limit where the mesh is refined: hold such a rim by a support.

    All of its values may change in time, and have gradients. Results: `result[cavity].volume` (m3) and `.pressure` (Pa,
    relative to the outside). States in which a cavity has no volume are refused, as those with inverted elements are.

    The rest volume is `cavity.rest_volume(scene)`.

    Raises ValueError, in ms.Scene, if the surface is not closed (naming the open edges) or inside out.

    A box of a soft sheet, first under a pressure, then filled with the volume of liquid that this pressure made room for:

    >>> import magshell as ms
    >>> box = ms.meshes.box((0.1, 0.1, 0.1), cells=(2, 2, 1))
    >>> sheet = ms.Shell(ms.TriangleMesh(box.rest_positions, box.faces), thickness=5e-3, young_modulus=1e6)
    >>> floor = ms.Pin(sheet.mesh.vertices_at(z=0.0))
    >>> air = ms.Cavity(sheet, pressure=200.0)
    >>> blown = ms.equilibrium(ms.Scene(sheet, supports=[floor], actuators=[air]))
    >>> water = ms.Cavity(sheet, volume=blown[air].volume, bulk_modulus=1e9)
    >>> filled = ms.equilibrium(ms.Scene(sheet, supports=[floor], actuators=[water]))
    >>> round(float(filled[water].pressure))
    200
    """

    _units: ClassVar[dict[str, str]] = {
        "pressure": "Pa",
        "gas_pressure": "Pa",
        "outside_pressure": "Pa",
        "volume": "m3",
        "bulk_modulus": "Pa",
    }

    def __init__(
        self,
        body: Shell | Solid | Sequence[Any],
        faces: Numbers | None = None,
        *,
        pressure: Numbers | None = None,
        gas_pressure: Numbers | None = None,
        outside_pressure: Numbers | None = None,
        volume: Numbers | None = None,
        bulk_modulus: Numbers | None = None,
        close_rims: bool = False,
    ):
        self._parts = _parts(body, faces)
        self.bodies: tuple[Any, ...] = tuple(each for each, _ in self._parts)
        if not isinstance(close_rims, bool):
            raise ValueError(f"close_rims must be True or False, got {close_rims!r:.60}")
        self.close_rims = close_rims
        given = {"pressure": pressure, "gas_pressure": gas_pressure, "volume": volume}
        chosen = [name for name, value in given.items() if value is not None]
        if len(chosen) != 1:
            raise ValueError(
                "a Cavity takes one of pressure [Pa], gas_pressure [Pa] (a gas) and volume [m3] (a liquid), got "
                + (" and ".join(chosen) or "none")
            )
        self.law: str = {"pressure": "pressure", "gas_pressure": "gas", "volume": "liquid"}[chosen[0]]
        for name, value, law in (
            ("outside_pressure", outside_pressure, "gas"),
            ("bulk_modulus", bulk_modulus, "liquid"),
        ):
            if value is not None and self.law != law:
                raise ValueError(
                    f"{name} is that of a {law}, which a Cavity with a {chosen[0]} does not hold"
                )
        self._replaceable = self._in_time = _LAWS[self.law]
        if self.law == "pressure":
            self.pressure: np.ndarray = number("pressure", "Pa", pressure)
            self._is_spring = False
        elif self.law == "gas":
            self.gas_pressure: np.ndarray = number("gas_pressure", "Pa", gas_pressure, 0.0)
            outside = ATMOSPHERE if outside_pressure is None else outside_pressure
            self.outside_pressure: np.ndarray = number("outside_pressure", "Pa", outside, 0.0)
        else:
            self.volume: np.ndarray = number("volume", "m3", volume, 0.0, above=True)
            self.bulk_modulus: np.ndarray = number(
                "bulk_modulus", "Pa", WATER if bulk_modulus is None else bulk_modulus, 0.0, above=True
            )

    _replaceable = _in_time = tuple(name for names in _LAWS.values() for name in names)

    def replaced(self, **values: Any) -> Cavity:
        """Return the same cavity with other values of its fluid."""
        now = {name: getattr(self, name) for name in self._replaceable} | values
        return self._check_shapes(Cavity(self._parts, close_rims=self.close_rims, **now))

    def surface(self, bodies: Bodies) -> ClosedSurface:
        """Return the closed surface among a scene's bodies. Raises ValueError if it is not closed."""
        return of_faces(
            bodies, [(body, _chosen(body, faces)) for body, faces in self._parts], self.close_rims
        )

    def rim_on_solids(self, bodies: Bodies) -> np.ndarray:
        """Return the vertices of the scene from which a lid hangs on edges of solids, (k,)."""
        if not self.close_rims:
            return np.zeros(0, dtype=int)
        rim = rim_vertices(bodies, [(body, _chosen(body, faces)) for body, faces in self._parts])
        solids = [bodies.spans[bodies.number(body)] for body in self.bodies if isinstance(body, Solid)]
        numbers = [bodies.original[span.vertices] for span in solids]
        return rim[np.isin(rim, np.concatenate([np.zeros(0, dtype=int), *numbers]))]

    def rest_volume(self, scene: Scene) -> float:
        """Return the volume in the rest shape of a scene, m3."""
        return float(self.surface(scene._bodies).volume(scene.mesh.rest_positions))

    def _filling(self, scene: Scene) -> float:
        if self.law != "liquid":
            return 0.0
        return abs(self.volume / self.rest_volume(scene) - 1.0)

    def _pressure_at(self, volume: Computed, rest_volume: Computed, load_factor: Computed) -> Computed:
        """Return the pressure relative to the outside at a volume [m3], Pa. The values of the fluid may be tensors."""
        rest, now = (
            as_operand(rest_volume, volume),
            {name: as_operand(getattr(self, name), volume) for name in _LAWS[self.law]},
        )
        if self.law == "pressure":
            return load_factor * now["pressure"] + 0.0 * volume
        if self.law == "gas":
            return load_factor * (now["gas_pressure"] * rest / volume - now["outside_pressure"])
        target = rest + load_factor * (now["volume"] - rest)
        return -now["bulk_modulus"] * (volume - target) / rest

    def _core_input(self, label: str, bodies: Bodies) -> dict[Any, Any]:
        return {
            "owner": label,
            "law": self.law,
            "stays_open": True,
            "coupled": False,
            "surfaces": [self.surface(bodies).core_input],
        }

    def _result_in(self, result) -> CavityResult:
        return CavityResult(result, self)

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={float(getattr(self, name)):g}" for name in self._replaceable)
        return f"Cavity({values}{on_body(self.body)})"


def _parts(body, faces) -> list[tuple[Shell | Solid, np.ndarray | None]]:
    if isinstance(body, BODIES):
        return [(body, None if faces is None else selection("Cavity faces", faces))]
    if faces is not None:
        raise ValueError("faces are those of one body: of several give [(body, faces), ...]")
    wanted = "a Cavity takes a Shell or a Solid, or several as [(body, faces), ...]"
    if not isinstance(body, list | tuple) or not body:
        raise ValueError(f"{wanted}, got {body!r:.60}")
    parts = []
    for each in body:
        pair = (each, None) if isinstance(each, BODIES) else each
        if not isinstance(pair, list | tuple) or len(pair) != 2 or not isinstance(pair[0], BODIES):
            raise ValueError(f"{wanted}, got {each!r:.60} among them")
        one, own = pair
        if any(one is before for before, _ in parts):
            raise ValueError(f"a Cavity names each body once, but twice {one!r:.60}")
        parts.append((one, None if own is None else selection("Cavity faces", own)))
    return parts


def _chosen(body, faces: np.ndarray | None) -> np.ndarray | None:
    return None if faces is None else indices("Cavity faces", faces, body.mesh.n_faces)
