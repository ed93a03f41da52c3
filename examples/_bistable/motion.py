"""The motion of the beam: the two experiments, a pluck, and the quantities read from their curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, least_squares

import magshell as ms

from .model import HIGHEST_FIELD, NO_SNAP, RAMP, SHEAR_MODULUS, SHORTENING, Beam, beam, buckled

# The Maxwell branch that Stewart & Anand chose for this material; it is not fitted here.
MAXWELL_MODULUS = 500e3 / SHEAR_MODULUS  # over the elastic one
MAXWELL_TIME = 10e-3  # s
SNAPPED = 4e-3  # m: beyond this displacement the beam has snapped to the other side
PLUCK = 0.5e-3  # T, released


@dataclass(frozen=True)
class Motion:
    """A motion of the beam: times (n,) s, displacements of mid-span from the buckled state (n,) m, and the
    trajectory.
    """

    times: np.ndarray
    displacements: np.ndarray
    trajectory: ms.Trajectory

    @property
    def snap(self) -> float | None:
        """The time at which mid-span passes `SNAPPED` [s], interpolated between steps; None if it never does."""
        return passing(self.times, self.displacements)

    @property
    def last_third(self) -> float:
        """The mean displacement over the last third of the time, m."""
        return last_third(self.times, self.displacements)


def passing(times, displacements, level=SNAPPED) -> float | None:
    """Return the first time at which a curve passes a level [s], by linear interpolation; None if it never does."""
    above = displacements > level
    k = int(np.argmax(above))
    if not above[k]:
        return None
    return float(np.interp(level, displacements[k - 1 : k + 1], times[k - 1 : k + 1]))


def last_third(times, displacements) -> float:
    return float(displacements[times > times[-1] * 2 / 3].mean())


def move(
    sheet: Beam, start: ms.Equilibrium, field, duration, time_step, *, viscous=True, **options
) -> Motion:
    """Simulate the motion from an equilibrium.

    field [T]: along z, a number or a function of the time [s]. Displacements count from the buckled state, whatever
    the start.
    """
    flux_density = (lambda time: (0, 0, field(time))) if callable(field) else (0, 0, field)
    branch = {"maxwell_modulus": MAXWELL_MODULUS, "maxwell_time": MAXWELL_TIME} if viscous else {}
    found = ms.simulate(
        sheet.scene,
        steps=round(duration / time_step),
        time_step=time_step,
        start=start,
        **({"remanent_magnetization": sheet.remanent_magnetization} | options),
        applied_flux_density=flux_density,
        progress=False,
        **branch,
    )
    height = sheet.height(buckled(sheet).positions)
    return Motion(found.times, height - found.positions[:, sheet.middle, 2], found)


def ramp(sheet: Beam, time_step, duration=HIGHEST_FIELD / RAMP, **options) -> Motion:
    return move(sheet, buckled(sheet), lambda time: RAMP * time, duration, time_step, **options)


def step(sheet: Beam, time_step, duration=0.8, **options) -> Motion:
    return move(sheet, buckled(sheet), NO_SNAP, duration, time_step, **options)


def pluck(sheet: Beam, time_step, duration=0.6, **options) -> Motion:
    """Simulate the free vibration after a small field is switched off."""
    held = sheet.equilibrium(PLUCK, start=buckled(sheet))
    return move(sheet, held, 0.0, duration, time_step, **options)


@dataclass(frozen=True)
class Ringing:
    """A damped oscillation fitted to a curve.

    frequency: Hz; decay: rate of the amplitude, 1/s; misfit: rms, over the amplitude at the start.
    """

    frequency: float
    decay: float
    misfit: float


def ringing(times, displacements, guess=16.0) -> Ringing:
    """Fit a decaying cosine to a curve by least squares; for a given frequency and decay the other coefficients are
    linear.
    """

    def parts(parameters):
        frequency, decay = parameters
        wave = np.exp((2j * np.pi * frequency - decay) * times)
        basis = np.stack([np.ones_like(times), wave.real, wave.imag], axis=1)
        coefficients = np.linalg.lstsq(basis, displacements, rcond=None)[0]
        return coefficients, basis @ coefficients - displacements

    scale = np.std(displacements)
    best = min(
        (least_squares(lambda p: parts(p)[1] / scale, (guess * factor, 5.0)) for factor in (0.8, 1.0, 1.2)),
        key=lambda found: found.cost,
    )
    (_, *wave), residual = parts(best.x)
    return Ringing(abs(float(best.x[0])), float(best.x[1]), float(np.std(residual) / np.hypot(*wave)))


def variations(cells, time_step) -> list[tuple[str, float]]:
    """Return the time at which the ramp snaps [s], with one parameter changed at a time: rows of (change, time)."""
    given, longer = beam(cells), beam(cells, shortening=1.01 * SHORTENING)
    rows = [
        ("as given", given, {}),
        ("without the Maxwell branch", given, {"viscous": False}),
        ("shortening 1 % larger", longer, {}),
        ("halves of unequal length, by 5 mm", given, {"remanent_magnetization": shifted(given)}),
        ("drag, 0.2 of the momentum a second", given, {"damping": drag(given, 0.2)}),
        ("drag, 3 times the momentum a second", given, {"damping": drag(given, 3.0)}),
    ]
    return [(what, ramp(sheet, time_step, 1.15, **options).snap) for what, sheet, options in rows]


def shifted(sheet: Beam, distance=2.5e-3) -> np.ndarray:
    """Return the magnetization (n_f, 3) [A/m] with its change of sign moved along x, which makes the beam
    asymmetric.
    """
    mesh, magnetization = sheet.scene.mesh, sheet.remanent_magnetization
    x = mesh.face_barycenters[:, 0]
    middle = mesh.rest_positions[:, 0].max() / 2
    return np.abs(magnetization) * np.sign(x - middle - distance)[:, None]


def drag(sheet: Beam, rate) -> float:
    """Return the damping per vertex [N s/m] of a drag of `rate` [1/s] times the mass."""
    mesh = sheet.scene.mesh
    return rate * float(sheet.scene.shell.vertex_masses.sum()) / mesh.n_vertices


def shortening_for(displacement, cells) -> float:
    """Find the shortening [m] with which the beam in equilibrium at 5 mT has moved by a given displacement [m]."""

    def excess(factor):
        sheet = beam(cells, shortening=factor * SHORTENING)
        start = buckled(sheet)
        held = sheet.equilibrium(NO_SNAP, start=start)
        return sheet.height(start.positions) - sheet.height(held.positions) - displacement

    return SHORTENING * brentq(excess, 1.02, 1.8, xtol=1e-3)
