"""Energies that users write as functions of torch."""

from __future__ import annotations

import keyword
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.owner import Owner
from ..._input.quantity import array_of, quantity, real_numbers
from ..._input.scalars import flag
from ..._input.selections import selection
from ..._input.tensors import require_torch
from ..bodies.bodies import Bodies, checked_body, on_body
from ..shells.shell import Shell
from ..solids.solid import Solid
from .group_function import GroupFunction

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

# Entries of all Hessians, of 8 bytes, beyond which a machine has no memory for them.
_MOST_ENTRIES = 5 * 10**8


class CustomEnergy(Owner):
    """An energy of groups of vertices that a function of torch computes, such as springs between points.

    function: the energy [J] of one group, a function of the positions (k, 3) [m] of its vertices and of the values, by
        name: `function(x, stiffness=...)`. Both are float64 tensors; it computes with operations of torch, without
        branches on numbers (torch.where), random numbers or detach. torch maps it over all groups (torch.func.vmap)
        and differentiates it.
    of: vertices of one group (k,), or of n groups of the same size, (n, k), such as `mesh.edges` or `mesh.faces`.
    values: {name: numbers}, in the units that the function expects: a number or an array (1, ...) for all groups, or an
        array (n, ...) with one number or row per group. A solve can replace them by others of the same shape,
        `values={energy: {name: ...}}`; they have gradients, and in ms.simulate they may change in time.
    body: the Shell or Solid whose vertices `of` counts. By default they are those of the scene, in the order of a
        result's positions, so that groups may lie on several bodies.
    name: of the energy in results; by default that of the function.
    is_load: whether the load factor scales it. By default it belongs to the structure, as a spring does.

    It acts in statics, paths, motions, linear theory and gradients as any other energy, with the Hessian by torch.
    Each energy, gradient and Hessian is one call of the function for all groups, under Python's lock: a solve calls it two
    to three times an iteration, about a millisecond each for small scenes. A term in C++ is faster (docs/adding/energy.md).

    A Scene raises ValueError if vertices are out of range, if the function does not return a number, is not finite at
    rest, changes its answer for the same input, or has derivatives that torch does not see. What the function raises reaches
    the caller. Where it is not finite at other positions, the solve turns back as from inverted elements; if that does not
    help, the error names it.

    A spring of 10 N/m and no length at rest pulls the tip of a strip towards the corner:

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> def spring(x, stiffness):
    ...     return 0.5 * stiffness * (x[1] - x[0]).square().sum()
    >>> ends = [mesh.nearest_vertex((0, 0, 0)), mesh.nearest_vertex((0.1, 0, 0))]
    >>> pull = ms.CustomEnergy(spring, of=ends, values={"stiffness": 10.0})
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[pull])
    >>> rest = ms.equilibrium(scene)
    >>> span = rest.positions[ends[1]] - rest.positions[ends[0]]
    >>> bool(abs(rest.energies["spring"] - 5.0 * (span @ span)) < 1e-12)
    True
    """

    _for_all = True

    def __init__(
        self,
        function: Callable[..., Any],
        *,
        of: Numbers,
        values: dict[str, Numbers] | None = None,
        body: Shell | Solid | None = None,
        name: str | None = None,
        is_load: bool = False,
    ):
        require_torch("CustomEnergy")
        if not callable(function):
            raise ValueError(
                f"function must be a function of positions (k, 3) [m] that returns J, got {type(function).__name__}"
            )
        self.function: Callable[..., Any] = function
        self.of: np.ndarray = _groups(of)
        self.body: Shell | Solid | None = checked_body(body)
        self.name: str = _name(name, function)
        self.is_load: bool = flag("is_load", is_load)
        if values is not None and not isinstance(values, dict):
            raise ValueError(f"values must be a dict {{name: numbers}}, got {type(values).__name__}")
        for each, numbers in (values or {}).items():
            _check_name(each)
            setattr(self, each, _value(each, numbers, len(self.of)))
        self._replaceable = self._in_time = tuple(values or {})

    @property
    def values(self) -> dict[str, np.ndarray]:
        """The values by name."""
        return {name: getattr(self, name) for name in self._replaceable}

    def replaced(self, **values: Any) -> CustomEnergy:
        """Returns the same energy with other values, of the same shapes."""
        options = {"of": self.of, "body": self.body, "name": self.name, "is_load": self.is_load}
        changed = CustomEnergy(self.function, values={**self.values, **values}, **options)
        for name, before in self.values.items():
            if (now := changed.values[name].shape) != before.shape:
                raise ValueError(f"{name} of {self!r} must keep its shape {before.shape}, got {now}")
        return changed

    def _unit(self, name: str) -> str:
        return "SI"

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        self.replaced(**{name: rows[0]})

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        return {name: gradient.value(label, name).reshape(each.shape) for name, each in self.values.items()}

    def _vertices(self, bodies: Bodies) -> np.ndarray:
        """Return the groups in the numbers of the scene, (n, k). Raises ValueError for a vertex that is not there."""
        first, count = 0, len(bodies.original)
        if self.body is not None:
            part = bodies.of(self)
            first, count = part.first_vertex, part.mesh.n_vertices
        if not (0 <= self.of.min() and self.of.max() < count):
            bad = self.of[(self.of < 0) | (self.of >= count)][0]
            whose = "the scene" if self.body is None else "the body"
            raise ValueError(
                f"{self!r}: of must hold vertices of {whose}, numbers in [0, {count}), got {bad}"
            )
        return self.of + first

    def _core_input(self, label: str, bodies: Bodies) -> dict[str, Any]:
        """Return the input of the core, after a check of the function at the rest shape."""
        vertices = self._vertices(bodies)
        shapes = {name: each.shape for name, each in self.values.items()}
        function = GroupFunction(self.name, self.function, *self.of.shape, shapes)
        numbers = np.concatenate([np.zeros(0), *(each.ravel() for each in self.values.values())])
        function.check(bodies.mesh.rest_positions[vertices].ravel(), numbers, bodies.extent)
        rows = {name: shape[0] if shape else 1 for name, shape in shapes.items()}
        return {
            "owner": label,
            "name": self.name,
            "vertices": vertices.ravel().tolist(),
            "group_size": self.of.shape[1],
            "values": [
                (name, rows[name], int(np.prod(shape[1:], dtype=int))) for name, shape in shapes.items()
            ],
            "is_load": self.is_load,
            "energy": _core.PythonGroupEnergy(function.sample, function.rate_by_values),
        }

    def __repr__(self) -> str:
        n, k = self.of.shape
        many = f"{n} groups" if n > 1 else "1 group"
        return f"CustomEnergy({self.name}, {many} of {k} {'vertices' if k > 1 else 'vertex'}{on_body(self.body)})"


def _groups(of: Any) -> np.ndarray:
    """Return the vertices of all groups, (n, k), from those of one or of several. Raises ValueError."""
    array = array_of("of", of, "be vertices (k,) or groups of vertices (n, k)")
    if array.ndim not in (1, 2) or not np.issubdtype(array.dtype, np.integer):
        raise ValueError(
            f"of must be vertices (k,) or groups of vertices (n, k), integers, got {array.dtype} of shape {array.shape}"
        )
    selection("of", of if array.ndim == 1 else array.ravel(), "vertices")
    groups = np.array(np.atleast_2d(array), dtype=np.int64)
    if groups.size * 9 * groups.shape[1] > _MOST_ENTRIES:
        raise ValueError(
            f"of has {groups.shape[0]} groups of {groups.shape[1]} vertices, whose Hessians have "
            f"{groups.size * 9 * groups.shape[1]:.2g} entries, more than {_MOST_ENTRIES:.0g}: use smaller groups"
        )
    ascending = np.sort(groups, axis=1)
    twice = np.argwhere(ascending[:, 1:] == ascending[:, :-1])
    if twice.size:
        group, place = twice[0]
        raise ValueError(
            f"of must not repeat a vertex in a group, but group {group} has {ascending[group, place]} twice"
        )
    return groups


def _name(name: Any, function: Any) -> str:
    if name is None:
        own = getattr(function, "__name__", "")
        return own if own.isidentifier() else "custom"
    if not isinstance(name, str) or not name.strip():
        raise ValueError(f"name must be the name of the energy in results, got {name!r:.60}")
    return name


def _check_name(name: Any) -> None:
    """Raise ValueError if a name cannot be that of a value, an attribute and an argument."""
    if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
        raise ValueError(f"values must have names that are identifiers, got {name!r:.60}")
    taken = {"function", "of", "body", "name", "is_load", "x", *dir(CustomEnergy)}
    if name in taken or name.startswith("_"):
        raise ValueError(
            f"a value cannot be called {name!r}, which is the name of something else here: choose another"
        )


def _value(name: str, numbers: Any, groups: int) -> np.ndarray:
    """Return the numbers of one value. Raises ValueError if they are neither for all groups nor one row per group."""
    array = real_numbers(name, numbers)
    if array.ndim and len(array) not in (1, groups):
        raise ValueError(
            f"{name} must be a number, have shape (1, ...) for all groups or ({groups}, ...) with one row per group, got "
            f"{array.shape}"
        )
    if array.size == 0:
        raise ValueError(f"{name} is empty: it has shape {array.shape}")
    return quantity(name, "", array, array.shape)
