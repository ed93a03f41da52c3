"""Random drops, throws and squeezes of small sheets and solids, and how each of them must end.

python contact_scenes.py FIRST COUNT        runs seeds FIRST to FIRST + COUNT - 1 and prints those that end wrongly
"""

from __future__ import annotations

import itertools
import signal
import sys
import time
import warnings
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import magshell as ms
from magshell import _core

KINDS = ("sheet on sheet", "ball on sheet", "block on block", "squeeze", "folding")
INTEGRATORS = (ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3())
TIME_LIMIT = 120.0  # s, of one scene
STEPS = 12
FASTEST = 2.0  # times the speed of waves
ENERGY_GROWTH = 0.02  # [-] of the available energy: kinetic, and the work that gravity can do


class TooLong(Exception):
    """Raised when a scene exceeds its time limit."""


@dataclass
class Drawn:
    """A scene and how it moves. size: m; put_in: J that gravity and speed hold."""

    kind: str
    scene: ms.Scene
    arguments: dict
    put_in: float
    words: str


def drawn(seed: int) -> Drawn:
    """Return the scene of a seed.

    Stiffness is 1e3 to 1e8 Pa, friction 0 to 1, time steps 1e-4 to 1e-2 s, sizes 1 cm to 1 m.
    """
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    size = 10.0 ** rng.uniform(-2.0, 0.0)
    modulus = 10.0 ** rng.uniform(3.0, 8.0)
    time_step = 10.0 ** rng.uniform(-4.0, -2.0)
    law = dict(
        friction_coefficient=None if rng.random() < 0.25 else rng.uniform(0.0, 1.0),
        lagged_friction=bool(rng.random() < 0.5),
    )
    bodies, supports, contacts, thrown = _BUILDERS[kind](rng, size, modulus, law)
    # The weight must not crush a body, nor the speed much exceed that of waves: no material model holds there.
    gravity = min(
        9.81 * (1e3 if kind == "squeeze" and rng.random() < 0.5 else 1.0), 0.2 * modulus / (1e3 * size)
    )
    alone = [body for body in bodies if not any(contact._sides == (body,) for contact in contacts)]
    contacts += [ms.SelfContact(body, **law) for body in alone]  # every pair that may meet gets a contact
    scene = ms.Scene(
        bodies, supports=supports, contacts=contacts, gravity=(0.0, 0.0, -gravity), allow_rigid_motions=True
    )
    speed = min(size * 10.0 ** rng.uniform(-1.0, 2.0), FASTEST * (modulus / 1e3) ** 0.5) * (kind != "squeeze")
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    for body, heading in thrown:
        velocities[scene._bodies.spans[bodies.index(body)].vertices] = speed * heading
    put_in = _energy_at_hand(bodies, velocities, scene, gravity, size)
    integrator = INTEGRATORS[int(rng.integers(len(INTEGRATORS)))]
    words = (
        f"{kind}, {size:.3g} m, {modulus:.2g} Pa, {time_step:.2g} s, {speed:.2g} m/s, friction {law['friction_coefficient']}"
        f"{' lagged' if law['lagged_friction'] else ''}, gravity {gravity:g}, {type(integrator).__name__}"
    )
    arguments = dict(
        steps=STEPS, time_step=time_step, velocities=velocities, integrator=integrator, progress=False
    )
    return Drawn(kind, scene, arguments, put_in, words)


def _energy_at_hand(bodies, velocities, scene, gravity, size) -> float:
    volume = sum(
        float(np.sum(b.mesh.face_areas * np.max(b.thickness))) if isinstance(b, ms.Shell) else b.mesh.volume
        for b in bodies
    )
    mass = 1e3 * volume
    return mass * (0.5 * float((velocities**2).sum(1).max()) + gravity * size)


def _sheet(rng, size, modulus, cells, move, thickness=0.02):
    mesh = ms.meshes.rectangle(size, size, cells=cells, irregular=rng.uniform(0.0, 0.25))
    rotation, shift = move
    middle = np.array([0.5 * size, 0.5 * size, 0.0])
    mesh = mesh.transformed(translation=-middle).transformed(rotation=rotation, translation=shift)
    return ms.Shell(
        mesh, thickness=thickness * size, young_modulus=modulus, poisson_ratio=0.3, mass_density=1e3
    )


def _solid(mesh, modulus):
    material = ms.NeoHookean(young_modulus=modulus, poisson_ratio=0.3)
    return ms.Solid(mesh, material=material, mass_density=1e3)


def _anyhow(rng):
    return Rotation.random(random_state=int(rng.integers(2**31)))


def _floor(rng, size, modulus):
    cells = tuple(rng.integers(2, 5, 2))
    floor = _sheet(rng, size, modulus, cells, (None, np.zeros(3)))
    return floor, ms.Pin(floor.mesh.boundary_vertices, body=floor)


def _heading(rng):
    way = np.array([*0.5 * rng.standard_normal(2), -1.0])
    return way / np.linalg.norm(way)


def _sheet_on_sheet(rng, size, modulus, law):
    floor, held = _floor(rng, size, modulus)
    rotation = _anyhow(rng) if rng.random() < 0.5 else Rotation.from_rotvec([0.0, 0.0, rng.uniform(0.0, 6.0)])
    sheet = _sheet(rng, 0.6 * size, modulus, (3, 3), (rotation, np.array([0.0, 0.0, 0.05 * size])))
    return _above(floor, held, sheet, law, size, rng)


def _ball_on_sheet(rng, size, modulus, law):
    floor, held = _floor(rng, size, modulus)
    ball = ms.meshes.ball(0.25 * size, cells=int(rng.integers(1, 3))).transformed(rotation=_anyhow(rng))
    return _above(floor, held, _solid(ball, modulus), law, size, rng)


def _above(floor, held, body, law, size, rng):
    """Return a scene's parts with the second body raised to just above the first."""
    gap = size * (0.03 + 0.1 * rng.random())
    up = gap - body.mesh.rest_positions[:, 2].min() + floor.mesh.rest_positions[:, 2].max()
    body = _raised(body, [*0.2 * size * rng.uniform(-1.0, 1.0, 2), up])
    return [floor, body], [held], [ms.Contact(floor, body, **law)], [(body, _heading(rng))]


def _raised(body, shift):
    mesh = body.mesh.transformed(translation=np.asarray(shift))
    if isinstance(body, ms.Shell):
        return ms.Shell(
            mesh,
            thickness=body.thickness,
            young_modulus=body.young_modulus,
            poisson_ratio=body.poisson_ratio,
            mass_density=body.mass_density,
        )
    return ms.Solid(mesh, material=body.material, mass_density=body.mass_density)


def _block(rng, size, modulus, shift=(0.0, 0.0, 0.0), rotation=None):
    mesh = ms.meshes.box((size, 0.7 * size, 0.5 * size), cells=tuple(rng.integers(1, 3, 3)))
    mesh = mesh.transformed(rotation=rotation, translation=np.asarray(shift))
    return _solid(mesh, modulus)


def _block_on_block(rng, size, modulus, law):
    lower = _block(rng, size, modulus)
    held = ms.Pin(lower.mesh.vertices_at(z=lower.mesh.rest_positions[:, 2].min()), body=lower)
    return _above(lower, held, _block(rng, 0.5 * size, modulus, rotation=_anyhow(rng)), law, size, rng)


def _squeeze(rng, size, modulus, law):
    """Return a soft block between two others, all of them heavy."""
    lower = _block(rng, size, modulus)
    held = ms.Pin(lower.mesh.vertices_at(z=lower.mesh.rest_positions[:, 2].min()), body=lower)
    layers, top = [lower], lower.mesh.rest_positions[:, 2].max()
    for stiffer in (0.1, 1.0):
        block = _block(rng, 0.8 * size, stiffer * modulus)
        up = top + rng.uniform(0.01, 0.05) * size - block.mesh.rest_positions[:, 2].min()
        layers.append(_raised(block, [0.1 * size * rng.random(), 0.0, up]))
        top = layers[-1].mesh.rest_positions[:, 2].max()
    contacts = [ms.Contact(a, b, **law) for a, b in itertools.combinations(layers, 2)]
    return layers, [held], contacts, []


def _folding(rng, size, modulus, law):
    """Return a strip of which one half is thrown onto the other."""
    mesh = ms.meshes.rectangle(size, 0.25 * size, cells=(8, 2), irregular=rng.uniform(0.0, 0.2))
    angle = np.clip((mesh.rest_positions[:, 0] / size - 0.4) / 0.2, 0.0, 1.0) * np.pi * 0.8
    places = np.array(mesh.rest_positions)
    order = np.argsort(places[:, 0])
    along = places[order, 0]
    turned = np.c_[np.cos(angle[order]), np.sin(angle[order])]
    path = np.zeros((len(order), 2))
    path[1:] = np.cumsum(np.diff(along)[:, None] * 0.5 * (turned[1:] + turned[:-1]), axis=0)
    places[order, 0], places[order, 2] = path[:, 0], path[:, 1]
    folded = ms.TriangleMesh(places, mesh.faces)
    strip = ms.Shell(
        folded, thickness=0.005 * size, young_modulus=modulus, poisson_ratio=0.3, mass_density=1e3
    )
    held = ms.Pin(np.flatnonzero(mesh.rest_positions[:, 0] < 0.15 * size), body=strip)
    return [strip], [held], [ms.SelfContact(strip, **law)], [(strip, np.array([0.0, 0.0, -1.0]))]


_BUILDERS = {
    "sheet on sheet": _sheet_on_sheet,
    "ball on sheet": _ball_on_sheet,
    "block on block": _block_on_block,
    "squeeze": _squeeze,
    "folding": _folding,
}


def surfaces_of(scene) -> list[np.ndarray]:
    """Return the faces of every body, in the scene's vertices."""
    return [
        span.first_vertex + body.mesh.faces
        for body, span in zip(scene.bodies, scene._bodies.spans, strict=True)
    ]


class Watch:
    """Whether anything passes through anything, by ipctk where it is installed and by ourselves."""

    def __init__(self, scene: ms.Scene):
        self.surfaces = surfaces_of(scene)
        pairs = list(itertools.combinations_with_replacement(range(len(self.surfaces)), 2))
        rest = np.asarray(scene.mesh.rest_positions)
        self.search = _core.BroadPhase(rest, [each.tolist() for each in self.surfaces], pairs)
        try:
            import ipctk
        except ImportError:
            self.oracle = None
            return
        faces = np.concatenate(self.surfaces)
        self.oracle, self.ipctk = ipctk.CollisionMesh(rest, ipctk.edges(faces), faces), ipctk

    def complaint(self, positions) -> str | None:
        if not np.isfinite(positions).all():
            return "not finite"
        if len(self.search.crossings(positions)["contact"]):
            return "passes through"
        if self.oracle is not None and self.ipctk.has_intersections(self.oracle, positions):
            return "passes through, says ipctk"
        return None


def verdict(seed: int, integrator=None) -> str | None:
    """Return None, or a sentence about what went wrong with the scene of this seed; by its own integrator or a given one."""
    each = drawn(seed)
    if integrator is not None:
        each.arguments["integrator"] = integrator

    def too_long(*_):
        raise TooLong

    before = signal.signal(signal.SIGALRM, too_long)
    signal.setitimer(signal.ITIMER_REAL, TIME_LIMIT)
    failed = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", ms.LargeStrainWarning
            )  # some of them are squashed beyond all models
            motion = ms.simulate(each.scene, **each.arguments)
    except TooLong:
        return f"{seed}: longer than {TIME_LIMIT} s ({each.words})"
    except ms.NotConverged as error:
        motion, failed = error.last_good, f"{seed}: {str(error).splitlines()[0]} ({each.words})"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    watch = Watch(each.scene)
    for k, positions in enumerate(motion.positions):
        if complaint := watch.complaint(positions):
            return f"{seed}: {complaint} after step {k} ({each.words})"
    growth = np.max(motion.energy - motion.energy[0]) / each.put_in
    if not growth <= ENERGY_GROWTH:
        return f"{seed}: energy grows by {growth:.2g} of what there was ({each.words})"
    return failed


def main(first: int, count: int) -> None:
    wrong, began = 0, time.perf_counter()
    for seed in range(first, first + count):
        start = time.perf_counter()
        if told := verdict(seed):
            wrong += 1
            print(f"{told} [{time.perf_counter() - start:.1f} s]", flush=True)
    print(f"{count} scenes, {wrong} end wrongly, {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
