"""Scenes on which no solver was tuned: twenty of each family, their numbers drawn from a fixed seed."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cases_cavities as cavities
import cases_fields as fields
import cases_saddles as saddles
import cases_snaps as snaps
import cases_starts as starts
import cases_topology as topology
import costs
import effort
import numpy as np
import sheets
import soft_solids
from answers import Answer, at_rest, below, both, holds, near
from sheets import LENGTH, WIDTH
from theory import buckle_height, elastica, stretch

import magshell as ms
from benchmarks.cases import cylinder_roof, magnetic_strip
from benchmarks.statics import semi_cylinder
from magshell.model.supports.supports import rotation_matrix

SCENES, SEED = 20, 31
Numbers = dict[str, object]  # the drawn arguments of a family's `solve`


class Draw:
    """Numbers of one scene, to four digits, so that they do not hang on rounding. k: which of its family."""

    def __init__(self, seed: int, family: str, k: int):
        self.k = k
        self._rng = np.random.default_rng([seed, zlib.crc32(family.encode()), k])

    def flat(self, low: float, high: float) -> float:
        return float(f"{self._rng.uniform(low, high):.4g}")

    def log(self, low: float, high: float) -> float:
        return float(f"{np.exp(self._rng.uniform(np.log(low), np.log(high))):.4g}")

    def integer(self, low: int, high: int) -> int:
        return int(self._rng.integers(low, high + 1))

    def cells(self, along: tuple[int, int], across: tuple[int, int]) -> tuple[int, int]:
        return self.integer(*along), self.integer(*across)

    def one(self, choices: tuple):
        return choices[self._rng.integers(len(choices))]


@dataclass(frozen=True)
class Family:
    """A family of scenes. tuned: how the names of its tuned cases begin in effort.py."""

    draw: Callable[[Draw], Numbers]
    solve: Callable[..., Answer]
    tuned: tuple[str, ...]


def bent_sheet_numbers(draw: Draw) -> Numbers:
    return {
        "cells": draw.cells((10, 40), (10, 40)),
        "width": draw.flat(0.05, 0.2),
        "thickness": draw.log(5e-4, 2e-3),
        "young_modulus": draw.log(1e5, 1e7),
        "nu": draw.flat(0.0, 0.49),
        "angle": draw.flat(60.0, 120.0),
        "beta": draw.log(4.0, 40.0),
        "bending": draw.one(("midedge", "hinge")),
        "irregular": draw.one((None, 0.25)),
    }


def bent_sheet(cells, width, thickness, young_modulus, nu, angle, beta, bending, irregular) -> Answer:
    mesh = ms.meshes.rectangle(LENGTH, width, cells=cells, irregular=irregular)
    sheet = ms.Shell(
        mesh, thickness=thickness, young_modulus=young_modulus, poisson_ratio=nu, bending=bending
    )
    return at_rest(_in_field(sheet, angle, beta, ms.Clamp(mesh.edges_at(x=0.0))))


def _in_field(sheet: ms.Shell, angle: float, beta: float, *supports) -> ms.Equilibrium:
    """Solve for a sheet magnetized along x in a field at an angle [degrees], beta = 12 M B L^2 / (E h^2)."""
    magnetization = 5e4
    stiffness = sheet.young_modulus[0] * sheet.thickness[0] ** 2
    flux_density = beta * stiffness / (12.0 * magnetization * LENGTH**2)
    direction = np.array([np.cos(np.radians(angle)), 0.0, np.sin(np.radians(angle))])
    return ms.equilibrium(
        ms.Scene(sheet, supports=supports, field=ms.UniformField()),
        remanent_magnetization=(magnetization, 0.0, 0.0),
        applied_flux_density=flux_density * direction,
    )


def oblique_numbers(low: float, high: float) -> Callable[[Draw], Numbers]:
    return lambda draw: {
        "angle": draw.flat(low, high),
        "beta": draw.log(2.0, 100.0),
        "cells": draw.cells((10, 40), (1, 4)),
        "width": draw.log(3e-3, 3e-2),
        "thickness": draw.log(1e-4, 1e-3),
        "young_modulus": draw.log(1e5, 1e8),
        "nu": draw.one((0.0, 0.3, 0.45)),
        "bending": draw.one(("midedge", "hinge")),
        "irregular": draw.one((None, 0.25)),
    }


def shell_numbers(draw: Draw) -> Numbers:
    return {"cells": draw.cells((8, 20), (8, 20)), "nu": draw.flat(0.0, 0.45)}


def semi_cylinder_numbers(sign: float) -> Callable[[Draw], Numbers]:
    return lambda draw: {
        **shell_numbers(draw),
        "thickness": draw.log(0.015, 0.05),
        "length": draw.flat(1.5, 4.5),
        "load": sign * draw.log(0.45, 7.3),
    }


def bent_cylinder(cells, nu, thickness, length, load) -> Answer:
    """Solve A8 under a force of `load` E h^3 / R."""
    force = load * 2.0685e7 * thickness**3 / 1.016
    return at_rest(
        ms.equilibrium(semi_cylinder(cells, force, length=length, thickness=thickness, poisson_ratio=nu))
    )


def pinched_numbers(draw: Draw) -> Numbers:
    return {
        **shell_numbers(draw),
        "thickness": draw.log(0.5, 2.0),
        "half": draw.flat(50.0, 150.0),
        "load": draw.log(1.0, 10.0),
    }


def pinched_cylinder(cells, nu, thickness, half, load) -> Answer:
    """Solve A6 under a force of `load` E h^3 / R."""
    force = load * 30e3 * thickness**3 / 100.0
    return at_rest(ms.equilibrium(effort.pinched(cells, force, half=half, thickness=thickness, nu=nu)))


def rolled_numbers(draw: Draw) -> Numbers:
    return {
        "ratio": draw.log(1e-6, 1e-2),
        "cells": draw.cells((25, 60), (1, 4)),
        "degrees": draw.flat(60.0, 330.0),
        "width": draw.log(0.03, 0.3),
        "young_modulus": draw.log(1e4, 1e8),
    }


def rolled_strip(ratio, cells, degrees, width, young_modulus) -> Answer:
    """Compute a strip rolled up, and compare it with a circle."""
    found = ms.equilibrium(effort.rolled(ratio, cells, degrees, width=width, young_modulus=young_modulus))
    mesh, angle = found.scene.mesh, np.radians(degrees)
    end = sheets.end_position(mesh, found.positions)[[0, 2]] / magnetic_strip.LENGTH
    circle = np.array([np.sin(angle), 1.0 - np.cos(angle)]) / angle
    return both(near("end x, z", end, circle, rel=1e-2, scale=1.0), at_rest(found))


def cavity_numbers(draw: Draw) -> Numbers:
    kind = ("filled", "gas", "grown")[draw.k % 3]
    if kind == "grown":
        return {
            "kind": kind,
            "times": draw.log(0.3, 3.0),
            "cells": draw.one(((15, 2, 2), (15, 4, 4), (30, 2, 2), (15, 2, 4))),
            "nu": draw.flat(0.1, 0.45),
            "stiffness": draw.log(1e4, 1e6),
        }
    return {
        "kind": kind,
        "times": draw.log(1.5, 8.0) if kind == "filled" else draw.log(0.05, 30.0),
        "hollow": draw.flat(0.3, 0.7),
        "axes": (1.0, draw.flat(0.7, 1.4), draw.flat(0.7, 1.4)),
        "nu": draw.flat(0.3, 0.49),
        "volume": draw.one(("isochoric", "ln J", "J")),
        "element": draw.one(("linear", "quadratic")),
        "outside": draw.log(0.05, 0.5),
    }


def cavity(kind, times, nu, *, cells=None, stiffness=0.0, outside=0.0, volume="", **shape) -> Answer:
    if kind == "grown":
        found, groups = cavities.swollen(times, cells, poisson_ratio=nu, stiffness=stiffness)
        median = float(np.median(found[groups].volume_ratios))
        between = min(1.0, times) <= median <= max(1.0, times)
        return both(at_rest(found), holds("ratio between 1 and the wanted one", between, f"{median:.4g}"))
    body = cavities.hollow_ball(material=ms.NeoHookean(volume, young_modulus=3.0, poisson_ratio=nu), **shape)
    rest = ms.Cavity(body, pressure=0.0).rest_volume(cavities.scene_of(body))
    if kind == "filled":
        inside = ms.Cavity(body, volume=times * rest, bulk_modulus=1e4)
        found = ms.equilibrium(cavities.scene_of(body, inside))
        return both(at_rest(found), near("volume", float(found[inside].volume), times * rest, rel=2e-3))
    inside = ms.Cavity(body, gas_pressure=times * outside, outside_pressure=outside)
    found = ms.equilibrium(cavities.scene_of(body, inside))
    state = (float(found[inside].pressure) + outside) * float(found[inside].volume)
    return both(at_rest(found), near("p V + p_o V", state, times * outside * rest, rel=1e-8))


def snap_numbers(draw: Draw) -> Numbers:
    kind = ("truss", "truss and back", "roof", "roof and back")[draw.k % 4]
    if kind.startswith("truss"):
        factor = draw.log(0.3, 20.0) if kind == "truss" else draw.log(1.05, 20.0)
        return {
            "kind": kind,
            "factor": factor,
            "rise": draw.flat(0.1, 0.4),
            "thickness": draw.log(3e-4, 1e-3),
        }
    return {
        "kind": kind,
        "factor": draw.log(0.3, 2.0),
        "thickness": draw.log(5.0, 20.0),
        "cells": draw.cells((6, 14), (6, 14)),
        "nu": draw.flat(0.0, 0.45),
    }


def snap(kind, factor, thickness, *, rise=0.0, cells=(), nu=0.0) -> Answer:
    """Solve a truss or a roof under a load, and again without it where the kind says so."""
    if kind.startswith("truss"):
        scene, ridge = snaps.toggle(rise, thickness)
        height = snaps.heights(factor, rise)[-1]
    else:
        scene = snaps.roof(
            thickness,
            factor * cylinder_roof.FULL_LOAD * (thickness / cylinder_roof.THICKNESS) ** 2.5,
            cells,
            nu,
        )
        factor = 1.0
    found = ms.equilibrium(scene, load_factor=factor)
    if kind.endswith("back"):
        loaded, height = at_rest(found), -rise
        found = ms.equilibrium(scene, load_factor=0.0, start=found)
        if kind == "roof and back":
            return both(loaded, at_rest(found))
    if kind == "roof":
        return at_rest(found)
    return both(
        near("height", found.positions[ridge, 2].mean(), height, rel=1e-3, scale=rise), at_rest(found)
    )


def topology_numbers(draw: Draw) -> Numbers:
    kind = ("ball joint", "square tube", "two pieces", "ring", "annulus", "hole")[draw.k % 6]
    return {"kind": kind} | {
        "ball joint": lambda: {"thickness": draw.log(3e-3, 3e-2), "load": draw.log(3e-4, 3e-2)},
        "square tube": lambda: {
            "load": draw.log(1e-3, 0.3),
            "cells": draw.cells((3, 5), (8, 16)),
            "length": draw.flat(0.3, 0.6),
            "thickness": draw.log(5e-4, 3e-3),
        },
        "two pieces": lambda: {
            "stiffer": draw.log(1.0, 1e6),
            "load": draw.log(0.5, 8.0),
            "cells": draw.cells((10, 30), (1, 3)),
        },
        "ring": lambda: {
            "load": draw.log(0.2, 4.0),
            "cells": (4 * draw.integer(6, 16), draw.integer(1, 2)),
            "thickness": draw.log(1e-3, 3e-2),
        },
        "annulus": lambda: {
            "load": draw.log(2.0, 30.0),
            "cells": draw.cells((4, 8), (16, 36)),
            "thickness": draw.log(3e-4, 3e-3),
            "length": draw.flat(0.2, 0.6),
        },
        "hole": lambda: {
            "load": draw.log(0.5, 8.0),
            "cells": draw.cells((12, 30), (5, 9)),
            "thickness": draw.log(1e-4, 2e-3),
            "length": draw.flat(0.2, 0.6),
        },
    }[kind]()


def unusual_topology(kind, load, *, cells=(), thickness=0.0, length=0.0, stiffer=1.0) -> Answer:
    """Solve a joint, a tube, two pieces, a ring, or a sheet with a hole whose size over its own is `length`."""
    if kind == "two pieces":
        return topology.two_pieces(stiffer, load, cells)
    if kind == "ball joint":
        scene = topology.joined_at_a_vertex(ms.Pin([5], "y"), thickness=thickness, gravity=load)
    elif kind == "square tube":
        scene = topology.twisted_tube(load, cells, length, thickness)
    elif kind == "ring":
        scene = topology.ring(load * 1e6 * thickness**3 / 12.0, cells, thickness)
    elif kind == "annulus":
        mesh = ms.meshes.annulus(length * LENGTH, LENGTH, cells=cells)
        inner = np.linalg.norm(mesh.edge_midpoints, axis=1) < (length + 1e-6) * LENGTH
        sheet = sheets.shell(mesh, thickness=thickness, poisson_ratio=0.3)
        return at_rest(_in_field(sheet, 90.0, load, ms.Clamp(np.flatnonzero(inner))))
    else:
        sheet = sheets.shell(_with_a_hole(cells, length), thickness=thickness)
        scene = sheets.cantilever(sheet, (0, 0, sheets.force_for(load, sheet, LENGTH)))
    return at_rest(ms.equilibrium(scene))


def _with_a_hole(cells: tuple[int, int], size: float) -> ms.TriangleMesh:
    """Return a rectangle whose faces within an ellipse of `size` times its length and width are missing."""
    whole = sheets.strip(cells, width=LENGTH / 2)
    from_middle = whole.face_barycenters[:, :2] / (LENGTH, LENGTH / 2) - 0.5
    kept = whole.faces[np.hypot(*from_middle.T) > size / 2]
    used, numbered = np.unique(kept, return_inverse=True)
    return ms.TriangleMesh(whole.rest_positions[used], numbered.reshape(-1, 3))


def thickness_numbers(draw: Draw) -> Numbers:
    return {
        "kind": ("even", "stepped", "spotted")[draw.k % 3],
        "ratio": draw.log(1e-5, 1e-1),
        "load": draw.log(0.5, 10.0),
        "cells": draw.cells((20, 48), (1, 4)),
        "step": draw.log(1.0, 100.0),
        "at": draw.flat(0.2, 0.8),
    }


def bent_strip(kind, ratio, load, cells, step, at) -> Answer:
    """Compute a strip bent by a force; its outer part, or half of its faces at random, are thinner by `step`."""
    mesh = sheets.strip(cells)
    even = sheets.shell(mesh, thickness=ratio * LENGTH)
    force = sheets.force_for(load, even, LENGTH)
    if kind == "even":
        found = ms.equilibrium(sheets.cantilever(even, (0, 0, force)))
        end = sheets.end_position(mesh, found.positions)[[0, 2]] / LENGTH
        exact = near("end x, z", end, elastica(load), rel=4e-3 + load * ratio**2, scale=1.0)
        return both(exact, at_rest(found))
    x = mesh.face_barycenters[:, 0]
    thin = x > at * LENGTH if kind == "stepped" else np.random.default_rng(0).random(len(x)) < 0.5
    sheet = sheets.shell(mesh, thickness=ratio * LENGTH * np.where(thin, 1.0 / step, 1.0))
    return at_rest(ms.equilibrium(sheets.cantilever(sheet, (0, 0, force / step**3))))


def saddle_numbers(draw: Draw) -> Numbers:
    kind = ("clamped strip", "against the field", "needle", "plate", "tube")[draw.k % 5]
    return {"kind": kind} | {
        "clamped strip": lambda: {
            "ratio": draw.log(5e-4, 1e-2),
            "times": draw.log(0.01, 0.3),
            "cells": draw.cells((20, 40), (1, 3)),
        },
        "against the field": lambda: {
            "times": draw.log(1.05, 40.0),
            "cells": draw.cells((40, 80), (1, 2)),
            "ratio": draw.log(5e-4, 5e-3),
        },
        "needle": lambda: {
            "times": draw.log(1e-5, 1e-3),
            "cells": draw.cells((3, 10), (1, 4)),
            "ratio": draw.log(1e-2, 5e-2),
        },
        "plate": lambda: {
            "times": draw.log(4.0, 30.0),
            "cells": draw.integer(6, 12),
            "width": draw.flat(0.6, 1.6),
            "thickness": draw.log(5e-3, 2e-2),
            "nu": draw.flat(0.0, 0.45),
        },
        "tube": lambda: {
            "times": draw.flat(1.5, 2.5),
            "cells": draw.cells((24, 32), (6, 10)),
            "length": draw.flat(0.4, 0.9),
            "thickness": draw.log(0.04, 0.08),
        },
    }[kind]()


def saddle(kind, times, cells, *, ratio=0.0, **sizes) -> Answer:
    if kind == "against the field":
        return saddles.against_the_field(times, cells, ratio=ratio, rel=2e-2)
    if kind == "needle":
        return saddles.needle(times, cells, ratio)
    if kind == "plate":
        return saddles.compressed_plate(times, cells, at_most=0.98, **sizes)
    if kind == "tube":
        straight, found = saddles.compressed_tube(times, cells, **sizes)
        share = found.energy / straight.energy  # 1 where the first solve has left the straight tube, too
        return both(below("energy over that of the first solve", share, 1.0 + 1e-9), at_rest(found))
    found = ms.equilibrium(saddles.shortened(ratio, times, cells))
    height = np.ptp(found.positions[:, 2])
    return both(near("height", height, LENGTH * buckle_height(times), rel=3e-2), at_rest(found))


def field_numbers(draw: Draw) -> Numbers:
    kind = ("strong", "guided", "hanging", "dipole")[draw.k % 4]
    return {"kind": kind} | {
        "strong": lambda: {
            "load": draw.log(1e2, 1e4),
            "angle": draw.flat(60.0, 165.0),
            "cells": draw.cells((40, 80), (1, 2)),
            "ratio": draw.log(5e-5, 3e-4),
        },
        "guided": lambda: {
            "load": draw.one((-1.0, 1.0)) * draw.log(1.0, 100.0),
            "cells": draw.cells((4, 16), (1, 4)),
        },
        "hanging": lambda: {
            "load": draw.log(1e2, 1e4),
            "cells": draw.cells((40, 80), (1, 2)),
            "ratio": draw.log(5e-5, 3e-4),
        },
        "dipole": lambda: {
            "load": draw.log(5.0, 50.0),
            "height": draw.flat(0.015, 0.04),
            "cells": (2 * draw.integer(6, 14), 2),
        },
    }[kind]()


def strong_field(kind, load, cells, *, angle=0.0, ratio=0.0, height=0.0) -> Answer:
    if kind == "strong":
        return fields.in_field(load, np.radians(angle), 1e-2, cells, ratio)
    if kind == "hanging":
        return fields.hanging_strip(load, 1e-2, cells, ratio)
    if kind == "dipole":
        return fields.above_a_guided_strip(height, load, cells)
    found = fields.guided(load, cells)
    end = sheets.end_position(found.scene.mesh, found.positions)[0] / LENGTH
    return both(near("end x / L", end, np.sign(load) * stretch(abs(load)), rel=1e-8), at_rest(found))


def start_numbers(draw: Draw) -> Numbers:
    kind = ("noise", "turned", "size", "scroll")[draw.k % 4]
    much = {
        "noise": lambda: draw.flat(0.1, 0.33),  # of a cell
        "turned": lambda: draw.flat(30.0, 150.0),  # degrees
        "size": lambda: draw.log(0.6, 100.0),
        "scroll": lambda: draw.flat(0.3, 2.0),  # turns
    }[kind]()
    return {
        "kind": kind,
        "much": much,
        "cells": draw.cells((10, 24), (1, 2)),
        "thickness": draw.log(5e-4, 3e-3),
        "seed": draw.integer(0, 999),
    }


def far_start(kind, much, cells, thickness, seed) -> Answer:
    """Check that a strip returns to rest."""

    def noise(x):
        return x + much * LENGTH / cells[0] * np.random.default_rng(seed).normal(size=x.shape)

    def turned(x):
        rotation = rotation_matrix(np.array([np.radians(much), 0, 0]))
        return (x - (0, WIDTH / 2, 0)) @ rotation.T + (0, WIDTH / 2, 0)

    def scroll(x):
        angle = 2.0 * np.pi * much * x[:, 0] / LENGTH
        radius = LENGTH / (2.0 * np.pi * much) * (1.0 + 0.3 * x[:, 0] / LENGTH)
        return np.stack([radius * np.sin(angle), x[:, 1], radius * (1.0 - np.cos(angle))], axis=1)

    start = {"noise": noise, "turned": turned, "size": lambda x: much * x, "scroll": scroll}[kind]
    return starts.found_again(start, cells=cells, thickness=thickness)


def ventricle_numbers(draw: Draw) -> Numbers:
    quarter = draw.k % 2 == 0
    direction = draw.flat(0.0, 180.0)
    return {
        "quarter": quarter,
        "cells": (2, draw.integer(1, 2)) if quarter else (draw.integer(2, 3), 1),
        "pressure": draw.log(2e3, 15e3),
        "wall": draw.flat(2e-3, 5e-3),
        "stiffness": draw.log(5e3, 20e3),
        "fibre_exponent": draw.log(0.5, 4.0),
        "cross_fibre_exponent": draw.log(0.5, 2.0),
        "fibre_shear_exponent": draw.log(0.5, 2.0),
        "bulk_modulus": draw.log(3e5, 1e7),
        "fibres": (
            float(np.cos(np.radians(direction)).round(6)),
            0.0,
            float(np.sin(np.radians(direction)).round(6)),
        ),
    }


def ventricle(quarter, cells, pressure, wall, **material) -> Answer:
    if quarter:
        scene = soft_solids.ventricle(*cells, pressure=pressure, wall=wall, **material)
    else:
        scene = costs.ventricle(cells, full=pressure, wall=wall, **material)[0]
    return at_rest(ms.equilibrium(scene))


FAMILIES = {
    "strongly bent": Family(bent_sheet_numbers, bent_sheet, ("strongly bent/",)),
    "C1 30 to 90": Family(
        oblique_numbers(30.0, 90.0), bent_sheet, tuple(f"C1/{angle}/" for angle in (30, 60, 90))
    ),
    "C1 120 to 170": Family(
        oblique_numbers(120.0, 170.0), bent_sheet, tuple(f"C1/{angle}/" for angle in (120, 150, 170))
    ),
    "A8 pulled": Family(semi_cylinder_numbers(1.0), bent_cylinder, ("A8 pulled/",)),
    "A8 pushed": Family(semi_cylinder_numbers(-1.0), bent_cylinder, ("A8 pushed/",)),
    "A6": Family(pinched_numbers, pinched_cylinder, ("A6/",)),
    "rolled": Family(rolled_numbers, rolled_strip, ("rolled/",)),
    "cavities": Family(cavity_numbers, cavity, ("hard cavities/",)),
    "snaps": Family(snap_numbers, snap, ("hard snaps/",)),
    "topology": Family(topology_numbers, unusual_topology, ("hard topology/",)),
    "thickness": Family(thickness_numbers, bent_strip, ("hard thickness/",)),
    "saddles": Family(saddle_numbers, saddle, ("hard saddles/",)),
    "fields": Family(field_numbers, strong_field, ("hard fields/",)),
    "starts": Family(start_numbers, far_start, ("hard starts/",)),
    "ventricle": Family(ventricle_numbers, ventricle, ("ventricle/",)),
}

# The fastest five of each family among those that take at least its median number of factorizations.
COUNTED = {
    "strongly bent": (1, 4, 12, 17, 19),
    "C1 30 to 90": (8, 10, 13, 16, 18),
    "C1 120 to 170": (0, 6, 10, 12, 17),
    "A8 pulled": (2, 3, 8, 12, 16),
    "A8 pushed": (2, 4, 6, 12, 19),
    "A6": (0, 5, 8, 16, 19),
    "rolled": (4, 5, 10, 11, 15),
    "cavities": (3, 6, 9, 15, 18),
    "snaps": (1, 5, 9, 13, 16),
    "topology": (0, 6, 8, 12, 18),
    "thickness": (4, 7, 8, 13, 17),
    "saddles": (0, 5, 6, 10, 11),
    "fields": (0, 1, 8, 12, 16),
    "starts": (3, 4, 11, 12, 15),
    "ventricle": (3, 10, 11, 15, 19),
}


def drawn(family: str, seed: int = SEED) -> list[Numbers]:
    """Return the numbers of the scenes of a family."""
    return [FAMILIES[family].draw(Draw(seed, family, k)) for k in range(SCENES)]


def all_named() -> Iterator[tuple[str, Callable[[], bool | str]]]:
    """Yield name and call of every scene; the call returns True, or what is not right."""
    for family in FAMILIES:
        for k, numbers in enumerate(drawn(family)):
            yield f"{family}/{k:02d}", lambda f=family, n=numbers: _verdict(FAMILIES[f].solve(**n))


def counted() -> Iterator[tuple[str, str, Callable[[], bool | str]]]:
    """Yield family, case and call of the scenes whose counts are kept."""
    calls = dict(all_named())
    for family, numbers in COUNTED.items():
        for k in numbers:
            yield f"untuned {family}", f"{k:02d}", calls[f"{family}/{k:02d}"]


def _verdict(answer: Answer) -> bool | str:
    return answer.right or f"expected {answer.expected}; got {answer.got}"
