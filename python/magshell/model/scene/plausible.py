"""Checks a scene when it is made, and warns of what is likely a mistake: above all sizes and material values that no soft
body has, most often a mistaken unit; once per scene and kind of value.

Nobody mistook a unit in a design that an optimizer tries. A mistaken unit is in every entry. If some faces are within
the limits and others beyond, as a fit of a modulus face by face tries on its way, or a design that thins faces out to
nothing, no unit is mistaken, and no warning is issued.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._runtime.tried_designs import is_tried_design
from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshQualityWarning, SusceptibilityWarning, UnitWarning
from ..contact.contacts_to_core import check_neighbours
from ..loads.custom_energy import CustomEnergy
from ..shells.shell import Shell
from ..solids.mean_volume import warn_of_thin_regions
from ..solids.solid import Solid
from .contact_state import compute_contact_state

if TYPE_CHECKING:
    from .scene import Scene
    from .values import Values

# The limits are far outside of all real bodies, so that models without units and limits of theory pass; fixed by
# test_usual_sizes_and_materials_are_not_warned_of and its neighbours.
MOST_OF_EXTENT = 3.0  # [-] thickness of a sheet over its extent: from 1 on it is no sheet
LEAST_OF_EXTENT = 1e-8  # [-] a layer of one atom on a metre has 1e-10
MOST_OF_EDGE = 100.0  # [-] thickness over the median edge
YOUNG_MODULUS = (0.1, 1e13)  # Pa: the softest gels have 10, diamond 1.2e12
MASS_DENSITY = (1e-7, 1e6)  # kg/m3: aerogel has 1, osmium 2.3e4; 1e-6 stands for zero under a RigidBody
MOST_MAGNETIZATION = 1e8  # A/m: iron saturates at 1.7e6
MOST_DEMAGNETIZATION = (
    0.1  # [-] susceptibility times thickness over extent: about the error of the magnetization
)
# Narrower limits apply to what is no model without units. Where a modulus is that of a soft body at least, a magnetization
# below the first limit is none of a composite. A sheet with the magnetization of a composite has its modulus, density and
# size.
SOFT_MODULUS = 1e3  # Pa: models without units have 1
LEAST_MAGNETIZATION = 1e3  # A/m: a silicone with 1 % of iron has 1e4
COMPOSITE_MODULUS = 100.0  # Pa: gels with particles have 1e3
COMPOSITE_DENSITY = 20.0  # kg/m3: foams with particles have 100
COMPOSITE_SIZE = 10.0  # m
MOST_GRAVITY = 2e3  # m/s2: centrifuges for robots have 1e3
MOST_FLUX_DENSITY = 30.0  # T: what moves soft robots has 0.1, the strongest magnets of hospitals 12


def warn_of_units(scene: Scene, values: Values) -> None:
    """Warn of bodies whose size, stiffness, density or magnetization is absurd; once per scene and kind of value."""
    for k, body in enumerate(values.deformable):
        whose = f" of body {k}" if len(values.deformable) > 1 else ""
        if isinstance(body, Shell):
            _warn_of_thickness(scene, body, whose)
            _warn_of_susceptibility(scene, body, whose)
        _warn_of_range(
            scene, "young_modulus", "Pa", _held(body, "young_modulus"), YOUNG_MODULUS, "kPa? MPa?", whose
        )
        density = _held(body, "mass_density")
        _warn_of_range(scene, "mass_density", "kg/m3", density, MASS_DENSITY, "t/mm3?", whose)
    magnetization = 0.0
    for label, name in scene._value_layout:
        if name == "remanent_magnetization":
            rows = scene._value_layout.of(values.numbers, label, name)
            _warn_of_most(scene, name, "A/m", rows, MOST_MAGNETIZATION, "multiplied by 1000 twice?")
            magnetization = max(magnetization, float(np.abs(rows).max(initial=0.0)))
    _warn_of_composites(scene, values, magnetization)


def _warn_of_composites(scene: Scene, values: Values, magnetization: float) -> None:
    """Warn of values that no magnetized soft body has, and of gravity in mm/s2. magnetization: A/m, the largest entry."""
    moduli = [
        np.max(held) for body in values.deformable if (held := _held(body, "young_modulus")) is not None
    ]
    if max(moduli, default=0.0) >= SOFT_MODULUS:
        if 0.0 < magnetization < LEAST_MAGNETIZATION:
            text = f"remanent_magnetization [A/m] has entries up to {magnetization:g}, and composites at least 1000"
            _warn(
                scene, "remanent_magnetization", text, "kA/m? T, as ms.magnetization_from_remanence converts?"
            )
        pull = float(np.linalg.norm(values.gravity))
        if pull > MOST_GRAVITY:
            _warn(
                scene,
                "gravity",
                f"gravity [m/s2] has a magnitude of {pull:g}, {pull / 9.81:.3g} times ours",
                "mm/s2?",
            )
    if magnetization < LEAST_MAGNETIZATION:
        return
    for k, body in enumerate(values.deformable):
        whose = f" of body {k}" if len(values.deformable) > 1 else ""
        of_composites = f", too little for a body with a magnetization of {magnetization:g} A/m"
        modulus, density = _held(body, "young_modulus"), _held(body, "mass_density")
        if modulus is not None and (stiffest := float(np.max(modulus))) < COMPOSITE_MODULUS:
            _warn(
                scene,
                "young_modulus",
                f"young_modulus [Pa]{whose} is {stiffest:g}{of_composites}",
                "kPa? MPa?",
            )
        if density is not None and 0.0 < (heaviest := float(np.max(density))) < COMPOSITE_DENSITY:
            _warn(
                scene, "mass_density", f"mass_density [kg/m3]{whose} is {heaviest:g}{of_composites}", "g/cm3?"
            )
        if body.mesh.size > COMPOSITE_SIZE:
            text = (
                f"the mesh{whose} has a size of {body.mesh.size:.3g} m, too large for a magnetized soft body"
            )
            _warn(scene, "size", text, "mm? mesh.scaled(1e-3) converts.")


def warn_of_field(scene: Scene, flux_density: np.ndarray) -> None:
    """Warn of an applied field (..., 3) T that is absurd, once a scene."""
    _warn_of_most(scene, "applied_flux_density", "T", flux_density, MOST_FLUX_DENSITY, "mT?")


def _warn_of_thickness(scene: Scene, shell: Shell, whose: str) -> None:
    thickest, thinnest = float(shell.thickness.max()), float(shell.thickness.min())
    extent, edge = shell.mesh.size, float(np.median(shell.mesh.edge_lengths))
    if thinnest > MOST_OF_EXTENT * extent or thickest < LEAST_OF_EXTENT * extent:
        worst = thickest if thinnest > MOST_OF_EXTENT * extent else thinnest
        _warn(
            scene,
            "thickness",
            f"thickness [m]{whose} is {worst:g}, {worst / extent:.3g} times the extent of the sheet, {extent:.3g} m",
            "mm?",
        )
    elif thinnest > MOST_OF_EDGE * edge:
        _warn(
            scene,
            "thickness",
            f"thickness [m]{whose} is {thickest:g}, {thickest / edge:.3g} times the usual edge of the mesh, {edge:.3g} m",
            "mm? A mesh this fine is for a Solid",
        )


def _warn_of_susceptibility(scene: Scene, shell: Shell, whose: str) -> None:
    kind = "susceptibility"
    if shell.susceptibility is None or kind in scene._warned_of_units:
        return
    most = float((shell.susceptibility * shell.thickness).max()) / shell.mesh.size
    if most > MOST_DEMAGNETIZATION:
        scene._warned_of_units.add(kind)
        warnings.warn(
            f"susceptibility [1]{whose} times the thickness is {most:.2g} of the extent of the sheet: its magnetization is "
            f"wrong by about as much, because the field that it makes in the sheet itself is neglected along the sheet "
            "(docs/theory.md). A smaller susceptibility, a thinner or a larger sheet is what the model is for",
            SusceptibilityWarning,
            stacklevel=callers_level(),
        )


def _held(body: Any, name: str) -> np.ndarray | None:
    """Return a value of a body; None if it or its material has no such value."""
    return getattr(body, name, None)


def _warn_of_range(
    scene: Scene, name: str, unit: str, rows: Any, limits: tuple[float, float], hint: str, whose: str
) -> None:
    if rows is None:
        return
    low, high = float(np.min(rows)), float(np.max(rows))
    if high < limits[0] or low > limits[1]:
        worst = low if high < limits[0] else high
        text = f"{name} [{unit}]{whose} is {worst:g}, outside of {limits[0]:g} to {limits[1]:g}, far beyond all matter"
        _warn(scene, name, text, hint)


def _warn_of_most(scene: Scene, name: str, unit: str, rows: np.ndarray, most: float, hint: str) -> None:
    largest = float(np.abs(rows).max(initial=0.0))
    if largest > most:
        _warn(
            scene,
            name,
            f"{name} [{unit}] has entries up to {largest:g}, beyond {most:g}, the most there is",
            hint,
        )


def _warn(scene: Scene, kind: str, what: str, hint: str) -> None:
    if kind in scene._warned_of_units or is_tried_design():
        return
    scene._warned_of_units.add(kind)
    warnings.warn(f"{what}: {hint} Units are SI", UnitWarning, stacklevel=callers_level())


def check_new_scene(scene: Scene) -> None:
    """Warn of contact between neighbours, of sizes that no body has, and of solids one cell thick.

    Raises ValueError in the cases of `check_neighbours`, and for a CustomEnergy with the name of another energy.
    """
    _check_names(scene)
    check_neighbours(scene, warns=True)
    warn_of_units(scene, scene._values)
    _warn_of_early_contact(scene)
    for span, body in zip(scene._bodies.spans, scene.bodies, strict=True):
        if isinstance(body, Solid) and body.mean_volume:
            warn_of_thin_regions(body.mesh, _held_vertices(scene)[span.vertices])


def _warn_of_early_contact(scene: Scene) -> None:
    """Warn of bodies that start within the distance at which their contact begins by default."""
    state = scene._model.rest_state()
    for contact in scene._body_contacts:
        if contact._reach_given or len(contact._sides) < 2 or scene._model.refusal(state):
            continue
        found = compute_contact_state(scene, scene._values, contact, state)
        if not len(found.pairs):
            continue
        gap = float(found.smallest_distance) - contact.min_distance
        names = " and ".join(
            f"body {scene._bodies.number(side)}" for side in contact._sides if side in scene.bodies
        )
        warnings.warn(
            f"{names or 'bodies'} start {gap:.3g} m apart, within the {contact.activation_distance:.3g} m at which their "
            f"contact begins by default, and push each other with {found.normal_force:.3g} N before they touch. Moved by "
            "supports they push too hard. Contact(..., activation_distance=...) of less than this gap does not.",
            MeshQualityWarning,
            stacklevel=callers_level(),
        )


def _check_names(scene: Scene) -> None:
    """Raise ValueError if two energies would have one name in results."""
    names = scene._model.term_names
    for load in scene.loads:
        if isinstance(load, CustomEnergy) and names.count(load.name) > 1:
            custom = [
                each for each in scene.loads if isinstance(each, CustomEnergy) and each.name == load.name
            ]
            other = "CustomEnergy" if len(custom) > 1 else "energy of the scene"
            raise ValueError(
                f"results list energies by name, but another {other} is called {load.name!r} as well: give {load!r} a name "
                "of its own, CustomEnergy(..., name=...)"
            )


def _held_vertices(scene: Scene) -> np.ndarray:
    """Return the projections onto the directions in which supports hold each vertex, (n_v, 3, 3)."""
    bodies, constraints = scene._bodies, scene._constraints
    found = np.zeros((len(bodies.original), 3, 3))
    of_vertices = constraints.held_nodes[:, 0] < len(found)
    nodes, counts = constraints.held_nodes[of_vertices, :2].T
    columns = constraints.held_frames[of_vertices] * (np.arange(3) < counts[:, None])[:, None, :]
    found[nodes] = columns @ np.swapaxes(columns, 1, 2)
    return found[bodies.original]
