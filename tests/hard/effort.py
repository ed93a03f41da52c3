"""Cost of equilibria, family by family: factorizations of every call of ms.equilibrium, and final energies.

python tests/hard/effort.py [WORDS ...] [--out FILE] [--against FILE]

--against compares with those of an earlier run.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
from registry import all_cases
from soft_solids import thick_tube, ventricle

import magshell as ms
from benchmarks.cases import magnetic_strip, rolled_strip
from benchmarks.statics import CASES, oblique_field, semi_cylinder, strongly_bent

_SAME = 1e-6  # [-] relative difference below which energies are equal


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Factorizations and energies of equilibria.")
    parser.add_argument("words", nargs="*", help="run only what has all of them in its name")
    parser.add_argument("--out", type=Path, help="where to keep the numbers")
    parser.add_argument("--against", type=Path, help="the numbers of an earlier run")
    parser.add_argument("--known", type=Path, help="compare these numbers, run nothing")
    options = parser.parse_args(arguments)
    sys.path.append(
        str(Path(__file__).parents[1] / "support")
    )  # helpers that the hard cases share with other tests
    earlier = json.loads(options.against.read_text()) if options.against else {}
    if options.known:
        found = json.loads(options.known.read_text())
    else:
        found = measured(all_named(), options.words, earlier)
        if options.out:
            options.out.write_text(json.dumps(found, indent=1))
    _print_families(found, earlier)
    return 0


def measured(cases: Iterable[tuple[str, Callable]], words: list[str], earlier: dict) -> dict:
    """Run the cases whose name holds all words; return what each call of ms.equilibrium took and how it ended."""
    calls: list[dict] = []
    solve = ms.equilibrium

    def counted(*args, **keywords):
        try:
            state = solve(*args, **keywords)
        except ms.NotConverged as error:
            state = error.last_good
            spent = [getattr(state, name, 0) for name in ("factorizations", "iterations")]
            calls.append({"factorizations": spent[0], "iterations": spent[1], "failed": str(error)[:200]})
            raise
        calls.append(
            {
                "factorizations": state.factorizations,
                "iterations": state.iterations,
                "energy": state.energy,
                "stable": bool(state.stable),
                "steps": [state.load_steps, state.relaxation_steps, state.saddles_escaped],
            }
        )
        return state

    found = {}
    ms.equilibrium = counted
    try:
        for name, run in cases:
            if not all(word in name for word in words):
                continue
            calls.clear()
            began = time.process_time()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                try:
                    right = run()
                except Exception as error:
                    right = f"{type(error).__name__}: {error}"[:200]
            if calls:
                seconds = round(time.process_time() - began, 3)
                found[name] = {"right": right, "seconds": seconds, "calls": list(calls)}
                print(row_of(name, found[name], earlier.get(name)), flush=True)
    finally:
        ms.equilibrium = solve
    return found


def all_named() -> Iterator[tuple[str, Callable]]:
    for faces in (512, 2048, 8192):
        yield f"strongly bent/{faces} faces", lambda n=faces: _solved(*strongly_bent(n))
    for angle in (30, 60, 90, 120, 150, 170):
        for beta in (2.0, 5.0, 10.0, 20.0, 35.0, 50.0, 100.0):
            for cells in ((10, 1), (40, 4)):
                yield (
                    f"C1/{angle}/{cells[0]}x{cells[1]}/{beta:g}",
                    lambda a=angle, b=beta, c=cells: _solved(*oblique_field(a, b, c)),
                )
    for cells in (8, 12, 16, 24):
        for force in (250.0, 1000.0, 2000.0, 4000.0, -250.0, -1000.0, -2000.0, -4000.0):
            side = "pulled" if force > 0 else "pushed"
            yield (
                f"A8 {side}/{cells}x{cells}/{force:g}",
                lambda n=cells, f=force: _solved(semi_cylinder(n, f)),
            )
    for cells in (8, 12, 16):
        for force in (300.0, 600.0, 1500.0, 3000.0):
            yield f"A6/{cells}x{cells}/{force:g}", lambda n=cells, f=force: _solved(pinched(n, f))
    for ratio in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        for cells in ((40, 2), (25, 1), (60, 6)):
            for degrees in (90, 200, 324):
                yield (
                    f"rolled/{degrees}/{cells[0]}x{cells[1]}/{ratio:g}",
                    lambda r=ratio, c=cells, a=degrees: _solved(rolled(r, c, a)),
                )
    for name, (build, load_parameters, _) in CASES.items():
        for bending in ("midedge", "hinge"):
            yield f"easy/{name}/{bending}", lambda b=build, c=load_parameters, d=bending: _solved(b(d), c)
    for load in (0.1, 0.5, 0.9):
        mesh = ms.meshes.rectangle(rolled_strip.LENGTH, rolled_strip.WIDTH, (48, 4))
        yield (
            f"easy/A2/{load:g}",
            lambda m=mesh, x=load: _solved(rolled_strip.scene(m, "midedge"), {"load_factor": x}),
        )
    for beta in (0.5, 2.0, 5.0):
        for angle in (45, 90):
            yield (
                f"easy/C1-{angle}, 60x6, beta {beta:g}",
                lambda a=angle, b=beta: _solved(*oblique_field(a, b, (60, 6))),
            )
    for cells, layers in ((2, 1), (4, 1)):
        yield f"ventricle/{cells}x{layers} cells", lambda c=cells, n=layers: _solved(ventricle(c, n))
    for pressure in (3e3, 6e3, 9e3):
        yield f"thick tube/{pressure:g} Pa", lambda p=pressure: _solved(thick_tube(p))
    for each in all_cases():
        yield f"hard {each.family}/{each.name}", lambda c=each: bool(c.run().right)


def _solved(scene: ms.Scene, load_parameters: dict | None = None) -> bool:
    return bool(ms.equilibrium(scene, **(load_parameters or {})).stable)


def pinched(
    cells: int | tuple[int, int],
    force: float,
    *,
    half: float = 100.0,
    thickness: float = 1.0,
    nu: float = 0.3,
) -> ms.Scene:
    """Return A6: an eighth of a cylinder on rigid diaphragms, under two opposite forces [N] (Sze, Liu, Lo 2004)."""
    radius = 100.0
    cells = (cells, cells) if isinstance(cells, int) else cells
    mesh = ms.meshes.cylinder(radius, half, (0.0, np.pi / 2), cells=cells)
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=30e3, poisson_ratio=nu)
    supports = [ms.SymmetryPlane(normal) for normal in np.eye(3)]
    supports.append(ms.Pin(mesh.vertices_at(y=half), "xz"))
    top = mesh.nearest_vertex((0.0, 0.0, radius))
    return ms.Scene(sheet, supports=supports, loads=[ms.PointLoad(top, (0.0, 0.0, -force / 4))])


def rolled(
    ratio: float, cells: tuple[int, int], degrees: float, *, width: float = 0.1, young_modulus: float = 1e6
) -> ms.Scene:
    """Return a strip of thickness over length `ratio` and width over length `width`, rolled up by a moment at its end."""
    length = magnetic_strip.LENGTH
    mesh = ms.meshes.rectangle(length, width * length, cells=cells)
    sheet = ms.Shell(mesh, thickness=ratio * length, young_modulus=young_modulus, poisson_ratio=0.0)
    couple = -np.radians(degrees) * young_modulus * (ratio * length) ** 3 / 12.0 / length
    return ms.Scene(
        sheet,
        supports=[ms.Clamp(mesh.edges_at(x=0.0))],
        loads=[ms.EdgeCouple(mesh.edges_at(x=length), couple)],
    )


def count_of(row: dict) -> int:
    return sum(call["factorizations"] for call in row["calls"])


def ends(row: dict, before: dict) -> tuple[int, int, float]:
    """Count the calls that end higher and lower, and sum up the relative changes of their energies."""
    higher = lower = 0
    change = 0.0
    for new, old in zip(row["calls"], before["calls"], strict=False):
        if "energy" not in new or "energy" not in old:
            continue
        share = (new["energy"] - old["energy"]) / max(abs(new["energy"]), abs(old["energy"]), 1e-300)
        if abs(share) > _SAME:
            higher += share > 0
            lower += share < 0
            change += share
    return higher, lower, change


def row_of(name: str, row: dict, before: dict | None) -> str:
    text = f"{name:60s} {count_of(row):6d}"
    if row["right"] is not True:
        text += f"  {row['right']}"
    if len(row["calls"]) == 1 and "energy" in row["calls"][0]:
        call = row["calls"][0]
        text += f"  E {call['energy']:.7g} steps {call['steps']}"
    if before:
        higher, lower, change = ends(row, before)
        text += f"  before {count_of(before)}" + (
            f", energies {higher} higher, {lower} lower ({change:+.2g})" if higher or lower else ""
        )
    return text


def _print_families(found: dict, earlier: dict) -> None:
    families: dict[str, list[str]] = {}
    for name in found:
        families.setdefault(name.split("/")[0], []).append(name)
        if not name.startswith(("hard", "easy")):
            families.setdefault("/".join(name.split("/")[:2]), []).append(name)
    print(
        f"\n{'family':34s} {'cases':>5s} {'sum':>7s} {'most':>5s}   before: sum  most   ends higher, lower, change"
    )
    for family, names in families.items():
        counts = [count_of(found[name]) for name in names]
        text = f"{family:34s} {len(names):5d} {sum(counts):7d} {max(counts):5d}"
        known = [name for name in names if name in earlier]
        if known:
            old = [count_of(earlier[name]) for name in known]
            changes_of = [ends(found[name], earlier[name]) for name in known]
            higher, lower, change = (sum(column) for column in zip(*changes_of, strict=True))
            text += f"   {sum(old):11d} {max(old):5d}   {higher:3d} {lower:3d} {change:+.3g}"
        wrong = [name for name in names if found[name]["right"] is not True]
        print(text + (f"   NOT RIGHT: {wrong}" if wrong else ""))


if __name__ == "__main__":
    sys.exit(main())
