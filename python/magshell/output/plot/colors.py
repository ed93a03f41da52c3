"""The colours of a picture: fixed ones, three colour scales, and the scalars that can colour bodies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity, shape_of
from ..._input.tensors import detached
from ...model.shells.shell_stresses import ShellStresses
from ...model.solids.solid_stresses import SolidStates
from ..results.series import element_fields
from ..results.state import State
from ..results.units import LengthUnit, prefixed

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


def rgb(code: str) -> np.ndarray:
    """Convert a colour "#rrggbb" to its components, (3,) from 0 to 1."""
    return np.array([int(code[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0


SHEET = "#c3ccd6"
OUTLINE = "#3a4048"
REST = "#9aa3ad"
MAGNETIZATION = "#23272e"
FIELD = "#1b7f5c"
CONTACT = "#b3202c"
OBSTACLE = "#b59a76"
MAGNET = "#8d949e"
LINK = "#f0e6d2"
TENDON = "#8c1c3c"
SPRING = "#5b7f95"
CREASE = "#c2571a"
NO_VALUE = "#d9dbde"
# Colours of bodies that lie over each other in one picture and are not coloured by a scalar.
SERIES = ("#7fa8d1", "#e8b36a", "#8fbf9f", "#d58b8b", "#b3a2d0", "#9fa8b2")

# Equidistant anchors of each colour scale, with linear interpolation; all are light enough for dark arrows to be visible.
SCALES = {
    "sequential": ("#6c76b8", "#5b9ec4", "#62bdb0", "#a9d37f", "#f7e57a"),
    "diverging": ("#5b8fc9", "#aecbe8", "#f3f1ee", "#f3b9a2", "#d8705f"),
    "cyclic": ("#e0907f", "#e3c46f", "#93c78d", "#74b6d3", "#b199d4", "#e0907f"),
}


@dataclass(frozen=True)
class Scalar:
    """A scalar field on the faces or the vertices of each state, and its colour scale.

    values: one array per state; NaN is drawn grey. limits: the ends of the scale, in the unit of the values.
    inside: the values on a section, one array per state: (n_t,) of the tetrahedra of all bodies if `of_tetrahedra`,
        otherwise (n_v,).
    names: texts at values on the colour bar, instead of numbers, {value: text}.
    """

    label: str
    values: list[np.ndarray]
    limits: tuple[float, float]
    scale: str = "sequential"
    inside: list[np.ndarray] | None = None
    of_tetrahedra: bool = False
    names: tuple[tuple[float, str], ...] = ()

    def colors(self, state: int) -> np.ndarray:
        """Return the colours of the values in a state, (n, 3) from 0 to 1."""
        return scale_colors(self.scale, self.values[state], self.limits)


def scale_colors(scale: str, values: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Return the colours of values (n,) on a scale between two limits, (n, 3) from 0 to 1."""
    anchors = np.array([rgb(code) for code in SCALES[scale]])
    low, high = limits
    position = np.clip((values - low) / (high - low), 0.0, 1.0) * (len(anchors) - 1)
    numbers = np.arange(len(anchors))
    colors = np.stack([np.interp(position, numbers, channel) for channel in anchors.T], axis=1)
    colors[np.isnan(values)] = rgb(NO_VALUE)
    return colors


def scalar_of(
    states: list[State], color: Any, label: str | None, limits: Numbers, unit: LengthUnit, cut: bool = False
) -> Scalar | None:
    """Return the scalar that `color` names: None, "auto", a name, an array, or one array per state.

    cut: extend the colour scale to the values inside solids. Raises ValueError for an unknown name, a name whose data are
    missing, or an array of a wrong length.
    """
    if isinstance(color, str) and color == "auto":
        color = _automatic(states)
    if color is None:
        return None
    if isinstance(color, str):
        if color not in NAMED:
            raise ValueError(
                f"color must be None, 'auto', {', '.join(map(repr, NAMED))} or an array, got {color!r}"
            )
        scalar = NAMED[color](states, unit)
        own = _wider(scalar) if cut and scalar.of_tetrahedra else scalar.limits
        return replace(scalar, label=label or scalar.label, limits=_limits(limits, own))
    values = _given(states, color)
    at_vertices = all(len(each) == state.mesh.n_vertices for each, state in zip(values, states, strict=True))
    inside = values if at_vertices else None
    return Scalar(label or "", values, _limits(limits, _range(values)), inside=inside)


def _wider(scalar: Scalar) -> tuple[float, float]:
    """Return the limits extended to the values inside solids; those of a diverging scale stay symmetric."""
    low, high = scalar.limits
    inside = np.concatenate([*scalar.inside, (low, high)])
    least, most = float(inside.min()), float(inside.max())
    if scalar.scale == "diverging":
        middle = 0.5 * (low + high)
        bound = max(high - middle, most - middle, middle - least)
        return middle - bound, middle + bound
    return min(low, least), max(high, most)


def averaged_at_vertices(states: list[State], scalar: Scalar, keeps_limits: bool) -> Scalar:
    """Return the scalar with means at vertices in place of numbers on faces, weighted by the areas of the faces.

    keeps_limits: whether the colour scale stays as it is; else it has the range of the means. Faces without a number do not
    count. Raises ValueError for a cyclic scale.
    """
    if scalar.scale == "cyclic":
        raise ValueError(f"the color {scalar.label!r} has angles, which have no mean: leave averaged out")
    values = [
        each if len(each) == state.mesh.n_vertices else _vertex_means(state, each)
        for state, each in zip(states, scalar.values, strict=True)
    ]
    limits = scalar.limits
    if not keeps_limits:
        low, high = _range(values)
        if scalar.scale == "diverging":
            high = max(-low, high)
            low = -high
        limits = (0.0 if scalar.limits[0] == 0.0 else low, high)
    return replace(scalar, values=values, limits=limits)


def _vertex_means(state: State, of_faces: np.ndarray) -> np.ndarray:
    """Return the means at vertices of numbers on faces, NaN where no face has one, (n_v,)."""
    faces, n_vertices = state.mesh.faces, state.mesh.n_vertices
    a, b, c = np.moveaxis(state.positions[faces], 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) * np.isfinite(of_faces)
    weights = np.repeat(areas, 3)
    numbers = np.repeat(np.nan_to_num(of_faces), 3)
    total = np.bincount(faces.ravel(), weights, n_vertices)
    summed = np.bincount(faces.ravel(), weights * numbers, n_vertices)
    return np.where(total > 0.0, summed / np.where(total > 0.0, total, 1.0), np.nan)


def _automatic(states: list[State]) -> str | None:
    """Choose the magnetization if it varies, otherwise the displacement if there is one, otherwise nothing."""
    magnetizations = [s.remanent_magnetization for s in states if s.is_magnetized]
    if any(np.ptp(m, axis=0).any() for m in magnetizations):
        return "magnetization"
    return "displacement" if any(state.displacements.any() for state in states) else None


def _magnetization(states: list[State], _: LengthUnit) -> Scalar:
    """Return the scalar of the magnetization.

    It is the component along an axis to which all of it is parallel; else the angle in a plane that contains all of it, if
    the magnitude is uniform; else the magnitude.
    """
    if not any(state.is_magnetized for state in states):
        raise ValueError("color='magnetization' needs magnetized faces: give remanent_magnetization [A/m]")
    vectors = [
        np.zeros((s.mesh.n_faces, 3)) if s.remanent_magnetization is None else s.remanent_magnetization
        for s in states
    ]
    together = np.concatenate(vectors)
    _, singular_values, axes = np.linalg.svd(together, full_matrices=False)
    magnitudes = np.linalg.norm(together, axis=1)
    factor, unit = prefixed(magnitudes.max(), "A/m")
    if singular_values[1] <= 1e-6 * singular_values[0]:
        axis = axes[0] * np.sign(axes[0][np.argmax(np.abs(axes[0]))])
        values = [v @ axis / factor for v in vectors]
        bound = magnitudes.max() / factor
        return Scalar(f"$M_r$ along {_direction(axis)} [{unit}]", values, (-bound, bound), "diverging")
    uniform = np.ptp(magnitudes[magnitudes > 0]) <= 1e-6 * magnitudes.max()
    flat = np.flatnonzero(np.ptp(together, axis=0) + np.abs(together).max(axis=0) <= 1e-9 * magnitudes.max())
    if uniform and len(flat) == 1:
        first, second = (k for k in range(3) if k != flat[0])
        values = [np.degrees(np.arctan2(v[:, second], v[:, first])) % 360.0 for v in vectors]
        values = [np.where(v.any(axis=1), angle, np.nan) for v, angle in zip(vectors, values, strict=True)]
        label = f"$M_r$ at rest, from {'xyz'[first]} to {'xyz'[second]} [deg]"
        return Scalar(label, values, (0.0, 360.0), "cyclic")
    values = [np.linalg.norm(v, axis=1) / factor for v in vectors]
    return Scalar(f"$|M_r|$ [{unit}]", values, (0.0, magnitudes.max() / factor))


def _displacement(states: list[State], unit: LengthUnit) -> Scalar:
    values = [np.linalg.norm(state.displacements, axis=1) / unit.meters for state in states]
    return Scalar(f"displacement [{unit.name}]", values, (0.0, _range(values)[1]), inside=values)


def _magnetic_energy(states: list[State], _: LengthUnit) -> Scalar:
    """Compute the magnetic energy per reference volume, - M . B at the barycenters, [Chen22] (24)."""
    densities = []
    for state in states:
        if not state.is_magnetized or (state.flux_density is None and not state.has_sources):
            raise ValueError("color='magnetic_energy' needs magnetized faces in a field, in every state")
        densities.append(
            -np.einsum("fi,fi->f", state.magnetization, state.flux_density_at(state.barycenters))
        )
    factor, unit = prefixed(max(float(np.nanmax(np.abs(d))) for d in densities), "J/m$^3$")
    values = [density / factor for density in densities]
    return Scalar(f"magnetic energy [{unit}]", values, _range(values))


def _volume_ratio(states: list[State], _: LengthUnit) -> Scalar:
    """Return the scalar of the volume ratio J, with limits symmetric about 1."""
    values, inside = _of_elements(
        states, "volume_ratio", lambda found: found.mean(found.volume_ratios), SolidStates
    )
    bound = max(float(np.nanmax(np.abs(each - 1.0))) for each in values) or 1.0
    return Scalar("$J$", values, (1.0 - bound, 1.0 + bound), "diverging", inside, True)


def _von_mises(states: list[State], _: LengthUnit) -> Scalar:
    values, inside = _of_elements(
        states, "von_mises_stress", lambda found: element_fields(found)["von_mises_stress"]
    )
    factor, unit = prefixed(max(map(np.nanmax, values)), "Pa")
    values, inside = ([each / factor for each in some] for some in (values, inside))
    limits = (0.0, _range(values)[1])
    return Scalar(f"von Mises stress [{unit}]", values, limits, inside=inside, of_tetrahedra=True)


def _of_muscles(name: str):
    """Return the function that makes the scalar of a muscle quantity on tetrahedra with fibres.

    The limits of the activation and tension begin at 0, or are symmetric about 0 if there are negative values; those of the
    stretch are symmetric about 1. The tension is in Pa.
    """

    def rows(found: SolidStates) -> np.ndarray:
        return np.full(len(found.volumes), np.nan) if found.muscles is None else found.muscles[name]

    def scalar(states: list[State], _: LengthUnit) -> Scalar:
        values, inside = _of_elements(states, name, rows, SolidStates)
        low, high = _range(values)
        label, limits, scale = name.replace("_", " "), (0.0, max(high, 1e-300)), "sequential"
        if name == "fibre_stretch":
            bound = max(high - 1.0, 1.0 - low)
            limits, scale = (1.0 - bound, 1.0 + bound), "diverging"
        elif low < 0:
            bound = max(high, -low)
            limits, scale = (-bound, bound), "diverging"
        if name == "fibre_tension":
            factor, unit = prefixed(limits[1], "Pa")
            values, inside = ([each / factor for each in some] for some in (values, inside))
            label, limits = f"{label} [{unit}]", (limits[0] / factor, limits[1] / factor)
        return Scalar(label, values, limits, scale, inside, True)

    return scalar


def _contact_pressure(states: list[State], _: LengthUnit) -> Scalar:
    found = [state.contact_pressures for state in states]
    if any(each is None for each in found):
        raise ValueError("color='contact_pressure' is of a result of a scene with contacts: there is none")
    largest = max(float(each.max(initial=0.0)) for each in found)
    factor, unit = prefixed(largest, "Pa") if largest > 0.0 else (1.0, "Pa")
    values = [each / factor for each in found]
    return Scalar(f"contact pressure [{unit}]", values, (0.0, _range(values)[1]), inside=values)


def _resultant(name: str, text: str, unit: str, of_faces: str):
    """Return the function that makes the scalar of a stress resultant of shells.

    It is the principal value of larger magnitude, with limits symmetric about 0. of_faces: the attribute of ShellStresses
    with the two principal values.
    """

    def scalar(states: list[State], _: LengthUnit) -> Scalar:
        def largest(found):
            pair = getattr(found, of_faces)
            return np.where(np.abs(pair[:, 0]) >= np.abs(pair[:, 1]), pair[:, 0], pair[:, 1])

        values, _ = _of_elements(states, name, largest, ShellStresses)
        bound = max(float(np.nanmax(np.abs(each))) for each in values) or 1.0
        factor, prefixed_unit = prefixed(bound, unit)
        bound /= factor
        label = f"largest {text} [{prefixed_unit}]"
        return Scalar(label, [each / factor for each in values], (-bound, bound), "diverging")

    return scalar


def _of_elements(states: list[State], name: str, of_element, kind=(SolidStates, ShellStresses)):
    """Evaluate a quantity of elements in each state.

    of_element: the function that returns it from SolidStates or ShellStresses; kind: which of them it is for.
    Returns the values on faces, those of the tetrahedron behind a face of a solid, NaN on bodies of another kind; and the
    values of all tetrahedra. Both are lists with one array per state.
    """
    bodies = {SolidStates: "solids", ShellStresses: "shells"}.get(kind, "bodies")
    wrong = f"color={name!r} is of the {bodies} of a result"
    found: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    for state in states:
        if state.elements is None:
            raise ValueError(f"{wrong}: there is none with its own positions")
        values, inside = np.full(state.mesh.n_faces, np.nan), [np.zeros(0)]
        for first, mesh, elements in state.elements():
            if not isinstance(elements, kind):
                continue
            rows = of_element(elements)
            if isinstance(elements, SolidStates):
                inside.append(rows)
                rows = rows[mesh.face_tetrahedra]
            values[first : first + mesh.n_faces] = rows
        if np.isnan(values).all():
            raise ValueError(f"{wrong}, which has none")
        found[0].append(values)
        found[1].append(np.concatenate(inside))
    return found


NAMED = {
    "magnetization": _magnetization,
    "displacement": _displacement,
    "magnetic_energy": _magnetic_energy,
    "contact_pressure": _contact_pressure,
    "volume_ratio": _volume_ratio,
    "von_mises_stress": _von_mises,
    **{name: _of_muscles(name) for name in ("activation", "fibre_stretch", "fibre_tension")},
    "membrane_force": _resultant(
        "membrane_force", "principal membrane force", "N/m", "principal_membrane_forces"
    ),
    "bending_moment": _resultant(
        "bending_moment", "principal bending moment", "N", "principal_bending_moments"
    ),
}


def _given(states: list[State], color) -> list[np.ndarray]:
    """Return the caller's numbers as one array per state, (n_f,) or (n_v,). Raises ValueError for another length."""
    if not hasattr(color, "__len__"):
        raise ValueError(f"color must be None, a name or an array, got {color!r}")
    several = len(states) > 1 and len(color) == len(states) and len(shape_of("color", color[0])) == 1
    arrays = list(color) if several else [color] * len(states)
    values = []
    for state, given in zip(states, arrays, strict=True):
        array = quantity("color", "the caller's unit", detached(given), ("n",))
        if len(array) not in (state.mesh.n_faces, state.mesh.n_vertices):
            raise ValueError(
                f"color must hold a number a face, ({state.mesh.n_faces},), or a vertex, "
                f"({state.mesh.n_vertices},), got {array.shape}"
            )
        values.append(array)
    return values


def _range(values: list[np.ndarray]) -> tuple[float, float]:
    low, high = min(map(np.nanmin, values)), max(map(np.nanmax, values))
    return (float(low), float(high)) if high > low else (float(low), float(low) + (abs(float(low)) or 1.0))


def _limits(given, default: tuple[float, float]) -> tuple[float, float]:
    if given is None:
        return default
    low, high = quantity("the range of a color", "its unit", given, (2,)).tolist()
    if low >= high:
        raise ValueError(f"the range of a color must rise, got ({low:g}, {high:g})")
    return low, high


def _direction(axis: np.ndarray) -> str:
    largest = int(np.argmax(np.abs(axis)))
    if abs(axis[largest]) > 1 - 1e-9:
        return "xyz"[largest]
    return "(" + ", ".join(f"{value:.2g}" for value in axis + 0.0) + ")"
