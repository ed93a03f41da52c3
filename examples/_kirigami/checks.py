"""Checks of a tower: bounds, disturbances, the rise as the field grows, a finer mesh."""

from __future__ import annotations

import numpy as np
import torch
from scipy.spatial import cKDTree

import magshell as ms

from .design import FIELD, LIMIT
from .model import Kirigami, kirigami


def checks(sheet: Kirigami, found: dict, trials: int = 30) -> dict:
    """Check the result of a search. Lengths in m, energies in J."""
    magnetization = found["remanent_magnetization"]
    rest = solve(sheet, magnetization, start=found["positions"])
    volumes = sheet.scene.shell.face_volumes
    lifted = np.linalg.norm(magnetization, axis=1) * np.linalg.norm(FIELD) @ volumes
    return {
        "stable": rest.stable,
        "moved": float(np.abs(rest.positions - found["positions"]).max()),
        "lowest": float(rest.positions[:, 2].min()),
        "off_axis": float(np.linalg.norm(rest.positions[sheet.center, :2])),
        "largest_magnetization": float(np.linalg.norm(magnetization, axis=1).max()),
        "longest_path": sheet.longest_path(),
        "energies": rest.energies,
        "magnetic_at_most": float(lifted),
        "switched_on": switched_on(magnetization),
        "disturbed": disturbed(sheet, rest, magnetization, trials),
        "first_order": {
            "start": to_first_order(sheet, np.zeros_like(magnetization)),
            "tower": to_first_order(sheet, magnetization, rest),
        },
        "finer": finer(sheet, magnetization),
    }


def solve(sheet: Kirigami, magnetization, fraction: float = 1.0, **options) -> ms.Equilibrium:
    """Find the equilibrium in a fraction of the field."""
    field = fraction * np.array(FIELD)
    return ms.equilibrium(
        sheet.scene,
        remanent_magnetization=magnetization,
        applied_flux_density=field,
        solver=ms.Newton(),
        **options,
    )


def switched_on(magnetization: np.ndarray) -> dict:
    """Raise the field over the sheet that lies on the floor, with contact between its rings and with the floor."""
    sheet = kirigami(with_contact=True)
    floor, own = sheet.scene.contacts
    fields, rest = np.linspace(0.0, 1.0, 21), None
    heights, lowest, on_floor, on_itself = [], [], [], []
    for share in fields:
        rest = solve(sheet, magnetization, share, start=rest)
        heights.append(float(sheet.height(rest.positions)))
        lowest.append(float(rest.positions[:, 2].min()))
        on_floor.append(rest.contact_state(floor).normal_force)
        on_itself.append(rest.contact_state(own).normal_force)
    return {
        "fields": fields * FIELD[2],
        "heights": np.array(heights),
        "height": heights[-1],
        "lowest": np.array(lowest),
        "on_floor": np.array(on_floor),
        "on_itself": np.array(on_itself),
        "crossings": len(rest.self_intersections()),
        "stable": rest.stable,
        "mesh": sheet.mesh,
        "positions": rest.positions,
    }


def disturbed(
    sheet: Kirigami, rest, magnetization: np.ndarray, trials: int, size: float = 0.02
) -> np.ndarray:
    """Return how much random changes of every magnetization raise the center, (trials,) m.

    size: standard deviation of the changes, over the limit.
    """
    rng, gains = np.random.default_rng(4), []
    for _ in range(trials):
        moved = magnetization + size * LIMIT * rng.standard_normal(magnetization.shape)
        within = ms.parametrize.clip_to_limit(torch.from_numpy(moved), LIMIT).numpy()
        there = solve(sheet, within, start=rest)
        gains.append(float(sheet.height(there.positions) - sheet.height(rest.positions)))
    return np.array(gains)


def to_first_order(sheet: Kirigami, magnetization: np.ndarray, start=None) -> float:
    """Return how much the best magnetization within the limit would raise the center if its height were linear [m]."""
    values = torch.from_numpy(magnetization).requires_grad_()
    sheet.height(solve(sheet, values, start=start).positions).backward()
    gradient = values.grad.numpy()
    return float((LIMIT * np.linalg.norm(gradient, axis=1) - (gradient * magnetization).sum(axis=1)).sum())


def finer(sheet: Kirigami, magnetization: np.ndarray) -> dict:
    """Compute the height of the same design on a mesh of four times as many faces."""
    fine = kirigami(refined=2)
    nearest = cKDTree(sheet.mesh.face_barycenters).query(fine.mesh.face_barycenters)[1]
    rest = solve(fine, magnetization[nearest])
    return {"faces": fine.mesh.n_faces, "height": float(fine.height(rest.positions))}
