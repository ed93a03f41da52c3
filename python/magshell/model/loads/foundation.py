"""Elastic foundations: faces on beds of springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.given_values import rest_tensor_of
from ..._input.selections import count_of, indices, selection
from ..._input.tensors import as_operand
from ..bodies.bodies import Bodies, checked_body, on_body
from ..shells.shell import Shell
from ..solids.solid import Solid
from .springs import Springs, SpringsResult, axes, numbers_of_springs, scene_vertices, unit_vector

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers, SolveResult
    from ..scene.values import Gradient, Values


class ElasticFoundation(Springs):
    """A bed of independent springs under faces (Winkler's foundation): a force k u per area against displacements u.

    stiffness: N/m3, a number, or one for each of `faces`, (k,).
    faces: those that it holds; by default all of the body.
    direction: "normal": it resists the displacement along the normals at rest only. A vector (3,): that along it. None: that
        along all three axes alike.
    damping: N s/m3 against the velocity likewise, in motions only; a number or (k,). None: no damper.
    body: the Shell or Solid that it holds, in a scene of several.

    The springs are at the vertices: each face gives a third of its area at rest to each of its three corners (a face of six
    nodes to those of its four triangles). Springs push and pull. The load factor does not scale them. Foundations are listed
    in Scene(loads=[...]), which needs `allow_rigid_motions=True` if nothing else holds the body.

    A solve can replace `stiffness` and `damping` by `values=`, with gradients. `result[foundation]` has the forces on the
    `vertices`, `.forces` (..., k, 3) N, and their sum `.total_force`.

    A sheet of 1 cm2 under a load of 10 Pa sinks by p / k = 1 mm into its bed:

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.01, 0.01, cells=(4, 4))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> bed = ms.ElasticFoundation(1e4)
    >>> scene = ms.Scene(sheet, loads=[bed, ms.AreaLoad((0, 0, -10.0))], allow_rigid_motions=True)
    >>> rest = ms.equilibrium(scene)
    >>> round(rest.displacements[:, 2].min().item(), 9), rest[bed].total_force.round(9)[2].item()
    (-0.001, 0.001)
    """

    def __init__(
        self,
        stiffness: Numbers,
        *,
        faces: Numbers | None = None,
        direction: Numbers | str | None = None,
        damping: Numbers | None = None,
        body: Shell | Solid | None = None,
    ):
        self.faces: np.ndarray | None = None if faces is None else selection("ElasticFoundation faces", faces)
        self.body: Shell | Solid | None = checked_body(body)
        count = None if self.faces is None else count_of(self.faces)
        self.stiffness: np.ndarray = numbers_of_springs("stiffness", "N/m3", stiffness, count, "face")
        self.damping: np.ndarray | None = (
            None if damping is None else numbers_of_springs("damping", "N s/m3", damping, count, "face")
        )
        if isinstance(direction, str) and direction != "normal":
            raise ValueError(f'direction must be "normal", a vector (3,) or None, got {direction!r}')
        self.direction: np.ndarray | str | None = (
            direction if isinstance(direction, str) else unit_vector("direction", direction)
        )
        self._replaceable = self._in_time = ("stiffness", *(("damping",) if damping is not None else ()))

    def _made(self, values: dict[str, Any]) -> ElasticFoundation:
        return self._check_shapes(
            ElasticFoundation(faces=self.faces, direction=self.direction, body=self.body, **values)
        )

    def _unit(self, name: str) -> str:
        return {"stiffness": "N/m3", "damping": "N s/m3"}[name]

    def _lumped(self, mesh: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return vertices (m,), areas (m,) m2, face numbers (m,) and normals (m, 3) of the springs on a mesh.

        Each corner of a face has one; with the same numbers for all faces, each vertex has one.
        """
        chosen = np.arange(mesh.n_faces)
        if self.faces is not None:
            chosen = indices("ElasticFoundation faces", self.faces, mesh.n_faces)
        for name in ("stiffness", "damping"):
            value = getattr(self, name)
            if value is not None and value.shape not in ((), (len(chosen),)):
                raise ValueError(
                    f"{name} [{self._unit(name)}] must be a number or have shape ({len(chosen)},), got {value.shape}"
                )
        faces = mesh.faces[chosen]
        third = _thirds(mesh, faces)
        vertices, numbers = faces.ravel(), np.repeat(np.arange(len(chosen)), 3)
        areas = np.linalg.norm(third, axis=1)
        if self._is_even:
            vertices, row_of = np.unique(vertices, return_inverse=True)
            areas, third = np.bincount(row_of, areas), _summed(third, row_of)
            numbers = np.zeros(len(vertices), dtype=np.int64)
        lengths = np.linalg.norm(third, axis=1)
        if isinstance(self.direction, str) and not lengths.min() > 1e-6 * areas.max():
            raise ValueError(
                f'an ElasticFoundation with direction="normal" finds no normal at vertex {vertices[np.argmin(lengths)]}, '
                "where those of its faces cancel: give a vector"
            )
        return vertices, areas, numbers, third / np.maximum(lengths, np.finfo(float).tiny)[:, None]

    def _lumped_at(self, rest: Any, mesh: Any) -> tuple[Any, Any]:
        """Return the areas (m,) and normals (m, 3) of the springs at rest positions that are a tensor, (n_v, 3) m."""
        chosen = (
            slice(None)
            if self.faces is None
            else indices("ElasticFoundation faces", self.faces, mesh.n_faces)
        )
        faces = mesh.faces[chosen]
        a, b, c = (rest[faces[:, k]] for k in range(3))
        third = ((b - a).cross(c - a, dim=-1) / 6.0).repeat_interleave(3, 0)
        areas = ((third**2).sum(-1) ** 0.5)[:, None].expand(-1, 3)
        if self._is_even:
            row_of = np.unique(faces, return_inverse=True)[1].ravel()
            areas, third = _summed(areas, row_of), _summed(third, row_of)
        lengths = (third**2).sum(-1, keepdim=True) ** 0.5
        return areas[:, 0], third / lengths.clamp(min=np.finfo(float).tiny)

    @property
    def _is_even(self) -> bool:
        """Return whether its numbers are the same for all faces, so that each vertex has one spring."""
        return self.stiffness.ndim == 0 and (self.damping is None or self.damping.ndim == 0)

    @property
    def _along(self) -> int:
        """The number of springs of each vertex or corner, one for each direction."""
        return 1 if isinstance(self.direction, str) else len(axes(self.direction))

    def _each_spring(self, mesh: Any) -> dict[str, np.ndarray]:
        """Return the directions (n, 3), ground points (n, 3) m and areas (n,) m2 of the n springs of the core."""
        vertices, areas, _, normals = self._lumped(mesh)
        own = None if isinstance(self.direction, str) else axes(self.direction)
        return {
            "directions": normals if own is None else np.tile(own, (len(vertices), 1)),
            "grounds": np.repeat(mesh.rest_positions[vertices], self._along, axis=0),
            "shares": np.repeat(areas, self._along),
        }

    def _add_numbers(self, label: str, values: Values, numbers: dict[Any, Any]) -> None:
        super()._add_numbers(label, values, numbers)
        if (label, "shares") in values.scene._value_layout:
            places = self._each_spring(values.scene._bodies.of(self).mesh)
            numbers |= {(label, name): rows for name, rows in places.items()}

    def _by_rest_positions(self, mesh: Any, label: str, gradient: Gradient) -> np.ndarray:
        """Return the gradient by the rest positions of its body, (n_v, 3), through ground points, areas and normals."""
        vertices, _, _, normals = self._lumped(mesh)
        found = np.zeros((mesh.n_vertices, 3))
        by = {name: gradient.value(label, name) for name in ("shares", "grounds", "directions")}
        np.add.at(found, vertices, by["grounds"].reshape(-1, self._along, 3).sum(axis=1))
        chosen = (
            slice(None)
            if self.faces is None
            else indices("ElasticFoundation faces", self.faces, mesh.n_faces)
        )
        faces = mesh.faces[chosen]
        third = _thirds(mesh, faces)
        row_of = np.unique(faces, return_inverse=True)[1].ravel() if self._is_even else np.arange(faces.size)
        by_areas = by["shares"].reshape(-1, self._along).sum(axis=1)[row_of]
        by_third = by_areas[:, None] * third / np.linalg.norm(third, axis=1, keepdims=True)
        if isinstance(self.direction, str):  # the normal of a spring is that of the sum of its thirds
            lengths = np.linalg.norm(_summed(third, row_of), axis=1, keepdims=True)
            by_normals = by["directions"]
            across = by_normals - normals * (normals * by_normals).sum(axis=1, keepdims=True)
            by_third = by_third + (across / lengths)[row_of]
        by_faces = by_third.reshape(-1, 3, 3).sum(axis=1) / 6.0
        a, b, c = np.moveaxis(mesh.rest_positions[faces], 1, 0)
        by_b, by_c = np.cross(c - a, by_faces), np.cross(by_faces, b - a)
        np.add.at(found, faces, np.stack([-by_b - by_c, by_b, by_c], axis=1))
        return found

    def _core_input(self, label: str, bodies: Bodies, follows: bool) -> dict[str, Any]:
        """Return the input of the core. follows: whether values that follow from rest positions are parameters there."""
        span, along = bodies.of(self), self._along
        vertices, _, numbers, _ = self._lumped(span.mesh)
        nodes = scene_vertices(bodies, self, vertices)
        places = self._each_spring(span.mesh)
        return {
            "owner": label,
            "points": [{"vertices": [node], "weights": [1.0]} for node in np.repeat(nodes, along).tolist()],
            **places,
            "shares": places["shares"].tolist(),
            "numbers": np.repeat(numbers, along).tolist(),
            "stiffness_unit": "N/m3",
            "damping_unit": "N s/m3",
            "has_places": follows,
            **{
                f"{name}_rows": self._rows(name) for name in ("stiffness", "rest_length", "damping", "ground")
            },
        }

    def _result_in(self, result: SolveResult) -> FoundationResult:
        return FoundationResult(result, self)

    def __repr__(self) -> str:
        where = "all faces" if self.faces is None else f"{count_of(self.faces)} faces"
        return (
            f"ElasticFoundation({where}, stiffness={float(self.stiffness.mean()):g} N/m3{on_body(self.body)})"
        )


class FoundationResult(SpringsResult):
    """The forces of an ElasticFoundation in a result."""

    _springs: ElasticFoundation

    @property
    def vertices(self) -> np.ndarray:
        """The vertices of the body that it holds, (k,)."""
        return np.unique(self._springs._lumped(self._span.mesh)[0])

    @property
    def forces(self) -> Computed:
        """The forces on `vertices`, with those of the dampers in motions, (..., k, 3) N."""
        vertices, areas, numbers, normals = self._springs._lumped(self._span.mesh)
        ground: Any = self._span.mesh.rest_positions
        rest = rest_tensor_of(self._result)
        if rest is not None:
            ground = rest[self._span.vertices]
            areas, normals = self._springs._lumped_at(ground, self._span.mesh)
        at = np.arange(len(self._result.scene._bodies.original))[self._span.vertices][vertices]
        positions = self._result.positions[..., at, :]
        moved = positions - as_operand(ground[vertices], positions)
        velocities = self._velocities()
        rates = 0.0 * moved if velocities is None else velocities[..., at, :]
        row_of = np.unique(vertices, return_inverse=True)[1]
        return self._in_each_state(
            lambda bed, u, v: _summed(_forces(bed, u, v, areas, numbers, normals), row_of), moved, rates
        )

    @property
    def total_force(self) -> Computed:
        """The sum of the forces, (..., 3) N."""
        return self.forces.sum(-2)

    @property
    def _span(self) -> Any:
        return self._result.scene._bodies.of(self._springs)


def _thirds(mesh: Any, faces: np.ndarray) -> np.ndarray:
    """Return a third of the area of each face times its normal, for each of its corners, (3 k, 3) m2."""
    a, b, c = np.moveaxis(mesh.rest_positions[faces], 1, 0)
    return np.repeat(np.cross(b - a, c - a) / 6.0, 3, axis=0)


def _forces(bed: ElasticFoundation, moved: Any, rates: Any, areas: Any, numbers: Any, normals: Any) -> Any:
    """Return the forces of springs whose ends moved, (m, 3) N."""

    def each(value: Any) -> Any:
        of_springs = as_operand(value[numbers] if value.ndim else value, moved)
        return (as_operand(areas, moved) * of_springs)[:, None]

    found = -each(bed.stiffness) * moved
    if bed.damping is not None:
        found = found - each(bed.damping) * rates
    if bed.direction is None:
        return found
    along = as_operand(normals if isinstance(bed.direction, str) else bed.direction, moved)
    return (found * along).sum(-1)[:, None] * along


def _summed(forces: Any, row_of: np.ndarray) -> Any:
    """Return the sums of the rows of forces (m, 3) that have the same row in the result, row_of (m,)."""
    count = int(row_of.max()) + 1
    if count == len(row_of):
        return forces
    if isinstance(forces, np.ndarray):
        return np.stack([np.bincount(row_of, forces[:, axis]) for axis in range(3)], axis=1)
    return forces.new_zeros((count, 3)).index_add(0, forces.new_tensor(row_of).long(), forces)
