"""Richardson extrapolation from nested meshes or from steps of a motion: ms.richardson_extrapolation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from ..._input.quantity import real_numbers
from ..._input.scalars import positive
from ..._input.tensor_kinds import is_tensor
from ..._input.tensors import detached
from ..._runtime.frozen import immutable
from ...errors import NotConverged
from ...mesh.nesting import Nesting, nesting
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh

_USUAL_ORDER, _OF_SIX_NODES = 2.0, 4.0
_LEAST_ORDER = 0.5  # of three values that converge at all
_PLURALS = {"mesh": "meshes", "step": "time steps"}
_FINEST = {"mesh": "finest mesh", "step": "shortest step"}
_ROUND_OFF = 1e-12  # of the values: differences below tell no order


@immutable
@dataclass(frozen=True)
class Extrapolation:
    """An estimate of the exact solution from nested meshes, or from steps that are halved; each attribute is of the
    kind that `solve` returned.

    value: extrapolated to infinitely fine meshes or short steps. Where values are by vertex, at the vertices of the
        coarsest mesh; of six-node elements at their corners, mesh.corner_vertices.
    error: how far the finest mesh's own value is from it. That of `value` itself is smaller, by one or two powers of the
        mesh width where that is fine enough. Of steps, at least the difference of the last two values: an error bar.
    order: the power of the mesh width or the step with which errors fall: the one assumed, or found from three values.
    values: of each mesh or step, the coarsest first.
    """

    _as_given: ClassVar = ("values",)

    value: Any
    error: Any
    order: Any
    values: tuple[Any, ...]
    _of: str = field(repr=False, default="mesh")

    def __repr__(self) -> str:
        if isinstance(self.value, dict):
            told = [
                f"{name}: {_description(self.value[name], self.error[name], self.order[name], self._of)}"
                for name in self.value
            ]
            return "\n  ".join([f"Extrapolation of {len(self.values)} {_PLURALS[self._of]}", *told])
        told = _description(self.value, self.error, self.order, self._of)
        return f"Extrapolation of {len(self.values)} {_PLURALS[self._of]}: {told}"


def richardson_extrapolation(
    solve: Callable[..., Any],
    meshes: Sequence[Any] | None = None,
    *,
    time_step: float | None = None,
    order: float | None = None,
) -> Extrapolation:
    """Estimate the limit of `solve` for ever finer meshes or shorter steps, and the error of the finest.

    With f at mesh width or step h, c at r h, and errors that fall as h^p (Richardson 1911):

        value = f + (f - c) / (r^p - 1),     error = |value - f|

    solve: called with each mesh, or with each time step [s]; returns a number, an array, a tensor, or a dict of
        these, in whatever units: deflections, reactions, energies, frequencies, critical fields, positions. Arrays
        have one shape on all meshes, or a row for each vertex of the mesh: (n_v, ...). Gradients go back through
        tensors.
    meshes: two or three TriangleMeshes, SixNodeMeshes or TetMeshes, the coarsest first, each dividing the cells of the one
        before it alike: by mesh.refined(), or by a generator with twice its cells (never with irregular=...). refined() of
        curved elements stays on their surface, and so does the limit; a generator's meshes come nearer to the true one.
    time_step: s, in place of meshes: `solve` is called with it, with half and with a quarter of it. It simulates a
        motion in such steps and returns what is wanted of it, such as a way or a period.
    order: p. By default 2 with two meshes, of six-node elements 4; with three what their values say, of an array by the
        norms of its differences: p = log(|m - c| / |f - m|) / log r.

    Works where errors are smooth in h: not beside cracks, reentrant corners and point supports that the mesh resolves
    badly, nor where meshes find different equilibria. Three meshes tell. Six-node elements reach their order only
    where the solution is smooth: under a point force it is 2 to 3, and two meshes that assume 4 then find `error` up to
    five times too small, so take three. Of a motion the order found should be that of the integrator, and 1 where
    contacts open and close; the error is at least the difference of the last two values, because another order may be
    found by chance.

    Raises ValueError where the meshes are not nested, or what solve returns differs in shape; NotConverged where the
    values of three meshes do not converge, with an Extrapolation in `last_good` that has the finest mesh's value and the
    largest difference. So it does for time steps that are not in the range of convergence.

    >>> import magshell as ms
    >>> def tip(mesh):
    ...     sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    ...     scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    ...     rest = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=(0, 0, 2e-3))
    ...     return rest.positions[mesh.nearest_vertex((0.1, 0.01, 0)), 2]
    >>> coarse = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> found = ms.richardson_extrapolation(tip, [coarse, coarse.refined()])
    >>> bool(found.error < 0.01 * found.value)
    True
    """
    if (meshes is None) == (time_step is None):
        raise ValueError("give meshes or a time_step, one of them")
    if not callable(solve):
        kind = "mesh" if time_step is None else "time step"
        raise ValueError(f"solve must be a function of a {kind}, got {solve!r:.60}")
    if time_step is not None:
        return _over_steps(solve, positive("time_step", "s", time_step), order)
    meshes = _checked_meshes(meshes)
    given = None if order is None else positive("order", "", order)
    if given is None and len(meshes) == 2:
        given = _OF_SIX_NODES if isinstance(meshes[0], QuadraticTriangleMesh) else _USUAL_ORDER
    names = [f"meshes[{k}]" for k in range(len(meshes))]
    nests = [
        nesting(coarse, fine, (names[k], names[k + 1]))
        for k, (coarse, fine) in enumerate(itertools.pairwise(meshes))
    ]
    if len({nest.ratio for nest in nests}) > 1:
        raise ValueError(
            f"meshes must be refined alike, got edges divided by {nests[0].ratio}, then by {nests[1].ratio}"
        )
    returned = [solve(mesh) for mesh in meshes]
    kept = _stored_values(returned, names)
    found = {}
    for name in kept[0]:
        values = _at_same_points(name, [each[name] for each in kept], meshes, nests)
        found[name] = _extrapolated(values, nests[0].ratio, given)
    result = _result(found, returned, "mesh")
    for name, (*_, why) in found.items():
        if why:
            raise NotConverged(
                f"{_the(name)} does not converge with the mesh: {why}, which tells no limit. Take finer meshes, or see "
                "whether all find the same equilibrium; `error.last_good` has the values.",
                result,
            )
    return result


def _over_steps(solve: Callable[..., Any], time_step: float, order: Any) -> Extrapolation:
    given = None if order is None else positive("order", "", order)
    steps = [time_step / 2**k for k in range(3)]
    returned = [solve(step) for step in steps]
    kept = _stored_values(returned, [f"a time step of {step:.4g} s" for step in steps])
    found = {}
    for name in kept[0]:
        values = [each[name] for each in kept]
        if len({np.shape(detached(value)) for value in values}) > 1:
            shapes = ", ".join(str(np.shape(detached(value))) for value in values)
            raise ValueError(f"{_the(name)} must have one shape for all time steps, got {shapes}")
        value, error, seen, why = _extrapolated(values, 2, given)
        last = abs(values[-1] - values[-2])
        larger = error if why else 0.5 * (error + last + abs(error - last))  # the maximum, of tensors too
        found[name] = value, larger, seen, why
    result = _result(found, returned, "step")
    for name, (*_, why) in found.items():
        if why:
            raise NotConverged(
                f"{_the(name)} is not in the range of convergence: from a time step of {time_step:.4g} s to half and a "
                f"quarter of it, {why}, so its error cannot be told. Take shorter steps, or ms.Adaptive with a smaller "
                "tolerance; `error.last_good` has the values.",
                result,
            )
    return result


def _stored_values(returned: list[Any], names: list[str]) -> list[dict[Any, Any]]:
    """Return the checked values of each call by name. Raises ValueError if calls returned others."""
    kept = [{name: _checked(name, value) for name, value in _named(each).items()} for each in returned]
    for each, called_with in zip(kept[1:], names[1:], strict=True):
        if each.keys() != kept[0].keys():
            raise ValueError(
                f"solve returned {sorted(each)} for {called_with}, but {sorted(kept[0])} for {names[0]}"
            )
    return kept


def _result(found: dict[Any, tuple[Any, ...]], returned: list[Any], of: str) -> Extrapolation:
    plain = not isinstance(returned[0], dict)
    value, error, orders = (
        found[""][k] if plain else {name: each[k] for name, each in found.items()} for k in range(3)
    )
    return Extrapolation(value, error, orders, tuple(returned), of)


def _extrapolated(values: list[Any], ratio: int, order: float | None) -> tuple[Any, ...]:
    """Return value, error and order of one quantity, and how it changes, in words, if it does not converge."""
    fine = values[-1]
    differences = [after - before for before, after in itertools.pairwise(values)]
    if _norm(differences[-1]) <= _ROUND_OFF * _norm(fine):
        return fine, abs(differences[-1]), math.nan if order is None else order, ""
    if order is None:
        order, why = _found_order(differences, ratio)
        if why:
            return fine, abs(max(differences, key=_norm)), order, why
    change = differences[-1] / (ratio**order - 1.0)
    return fine + change, abs(change), order, ""


def _found_order(differences: list[Any], ratio: int) -> tuple[float, str]:
    """Return the order, and how the values change, in words, if they do not converge."""
    first, last = (_norm(each) for each in differences)
    order = math.log(first / last) / math.log(ratio) if first > 0.0 else -math.inf
    along = np.vdot(*(np.asarray(detached(each)) for each in differences))
    if along > 0.0 and order >= _LEAST_ORDER:
        return order, ""
    back = " and turns back" if along < 0.0 else ""
    return order, f"it changes by {first:.3g} and then by {last:.3g}{back}"


def _at_same_points(name: str, values: list[Any], meshes: list[Any], nests: list[Nesting]) -> list[Any]:
    shapes = [tuple(value.shape) for value in values]
    if len(set(shapes)) == 1:
        return values
    by_vertex = all(shape[:1] == (mesh.n_vertices,) for shape, mesh in zip(shapes, meshes, strict=True))
    if not by_vertex or len({shape[1:] for shape in shapes}) > 1:
        raise ValueError(
            f"{_the(name)} must have one shape on all meshes, or a row for each vertex, got {', '.join(map(str, shapes))}"
        )
    rows = np.flatnonzero(nests[0].vertices >= 0)
    at_coarse = [values[0][rows]]
    for value, nest in zip(values[1:], nests, strict=True):
        rows = nest.vertices[rows]
        at_coarse.append(value[rows])
    return at_coarse


def _checked_meshes(meshes) -> list[Any]:
    listed = list(meshes) if isinstance(meshes, Sequence) else [meshes]
    for k, mesh in enumerate(listed):
        if not isinstance(mesh, TriangleMesh | QuadraticTriangleMesh | TetMesh):
            raise ValueError(
                f"meshes[{k}] must be a TriangleMesh, a QuadraticTriangleMesh or a TetMesh, got {type(mesh).__name__}"
            )
    if len(listed) not in (2, 3):
        raise ValueError(f"meshes must be two or three, the coarsest first, got {len(listed)}")
    return listed


def _named(returned) -> dict[Any, Any]:
    return returned if isinstance(returned, dict) else {"": returned}


def _checked(name: str, value):
    numbers = real_numbers(_the(name), detached(value))
    if not np.isfinite(numbers).all():
        raise ValueError(f"{_the(name)} is not finite")
    return value if is_tensor(value) else numbers[()]  # a number stays one


def _the(name) -> str:
    return f"what solve returns as {name!r}" if name != "" else "what solve returns"


def _norm(value) -> float:
    return float(np.linalg.norm(np.asarray(detached(value)).ravel()))


def _description(value, error, order: float, of: str) -> str:
    finest = _FINEST[of]
    if np.ndim(detached(value)):
        off = f"the {finest} is off by at most {float(np.max(np.asarray(detached(error)))):.2g}"
        return f"{tuple(value.shape)}, {off}, order {order:.3g}"
    return f"{float(value):.8g}, the {finest} is off by {float(error):.2g}, order {order:.3g}"
