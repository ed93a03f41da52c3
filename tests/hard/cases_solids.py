"""Solids: nearly incompressible, crushed, inverted, of slivers, of one element, free, with holes."""

from __future__ import annotations

import numpy as np
from answers import above, at_rest, below, both, holds, near, refused
from registry import case

import magshell as ms
from benchmarks.solid_scaling import costs, exponents
from magshell.model.solids.solid_stresses import states_of

TINY = 1e-9
MODULI = {"young_modulus": 1e5, "poisson_ratio": 0.4}
STABLE = {
    "StableNeoHookean with its barrier": ms.StableNeoHookean(log_barrier=True, **MODULI),
    "Corotated": ms.Corotated(**MODULI),
}


def bar(cells=(6, 2, 2), material=None, element="quadratic", size=(3.0, 1.0, 1.0), **options) -> ms.Solid:
    mesh = ms.meshes.box(size, cells=cells)
    return ms.Solid(mesh, material=material or ms.NeoHookean(**MODULI), element=element, **options)


def ends(solid: ms.Solid) -> tuple[np.ndarray, np.ndarray]:
    x = solid.mesh.rest_positions[:, 0]
    near_end, far_end = x < x.min() + TINY * np.ptp(x), x > x.max() - TINY * np.ptp(x)
    return np.flatnonzero(near_end), np.flatnonzero(far_end)


def held(solid: ms.Solid, **options) -> ms.Scene:
    return ms.Scene(solid, supports=[ms.Pin(ends(solid)[0])], **options)


def end_force(solid: ms.Solid, force) -> ms.PointLoad:
    end = ends(solid)[1]
    return ms.PointLoad(end, np.asarray(force) / len(end))


def stretched(solid: ms.Solid, factor: float) -> ms.Equilibrium:
    left, right = ends(solid)
    move = (float(np.ptp(solid.mesh.rest_positions[:, 0])) * (factor - 1.0), 0, 0)
    return ms.equilibrium(ms.Scene(solid, supports=[ms.Pin(left), ms.Pin(right, displacement=move)]))


@case("Poisson's ratio 0.4999, bent to half its length in one call")
def hardly_compressible():
    """Compare Poisson's ratio 0.4999 with 0.499, whose deflection in the validation set is 4.905.

    Two cells through the thickness are 2.5 % too soft.
    """
    found = []
    for poisson_ratio in (0.499, 0.4999):
        material = ms.NeoHookean("isochoric", young_modulus=1e5, poisson_ratio=poisson_ratio)
        solid = bar((10, 2, 2), material, size=(10.0, 1.0, 1.0))
        found.append(ms.equilibrium(held(solid, loads=[end_force(solid, (0, 0, 2e5 / 1200))])))
    moved = [each.displacements[:, 2].max() for each in found]
    return both(
        near("deflection", moved[1], moved[0], rel=5e-3),
        at_rest(found[1]),
        holds("at most 20 iterations", found[1].iterations <= 20, f"{found[1].iterations}"),
    )


@case("pressed to {:g} of its length in one call, its ends glued", over=(0.7, 0.5))
def crushed(factor):
    solid = bar((2, 2, 2), size=(1.0, 1.0, 1.0))
    found = stretched(solid, factor)
    least = states_of(found.scene, solid, found._state).volume_ratios.min()
    return both(at_rest(found), above("least J", least, 0.2))


@case("pulled to twice its length in one call, {}", over=("ln J", "J", "isochoric"))
def pulled_far(volume):
    found = stretched(bar(material=ms.NeoHookean(volume, **MODULI)), 2.0)
    return both(
        at_rest(found),
        near("load steps", found.load_steps, 1, rel=0.0),
        near("length", np.ptp(found.positions[:, 0]), 6.0, rel=1e-12),
    )


def starts(x: np.ndarray) -> dict[str, np.ndarray]:
    middle = x.mean(axis=0)
    return {
        "inverted": 2.0 * middle * (0, 0, 1) + x * (1, 1, -1),
        "flattened": x * (1, 1, 0) + middle * (0, 0, 1),
        "random": np.random.default_rng(3).uniform(x.min(axis=0), x.max(axis=0), size=x.shape),
    }


# An inverted Corotated solid is missing: it has stable crumpled shapes as well, see below.
BAD_STARTS = [
    f"{start}, {name}"
    for name in STABLE
    for start in ("inverted", "flattened")
    if (start, name) != ("inverted", "Corotated")
]


@case("started {}: back to rest", over=BAD_STARTS)
def comes_back(which):
    start, name = which.split(", ")
    solid = bar((3, 1, 1), STABLE[name], "linear")
    x = solid.mesh.rest_positions
    found = ms.equilibrium(held(solid), start=starts(x)[start])
    return both(at_rest(found), near("positions", found.positions, x, rel=1e-6, scale=3.0))


@case("started at random, {}: at rest or in another stable shape, all elements turned right", over=STABLE)
def comes_to_rest(name):
    """Check stability by a second solve, from the shape found and a push of a hundredth of the length.

    Of sixty random starts some forty come back to rest, and the others end in shapes that bend the solid back on itself.
    """
    solid = bar((3, 1, 1), STABLE[name], "linear")
    x = solid.mesh.rest_positions
    draw = np.random.default_rng(3)
    found = ms.equilibrium(held(solid), start=starts(x)["random"])
    free = np.setdiff1d(np.arange(len(x)), ends(solid)[0])
    pushed = found.positions.copy()
    pushed[free] += draw.uniform(-0.03, 0.03, size=(len(free), 3))
    again = ms.equilibrium(held(solid), start=pushed)
    least = states_of(found.scene, solid, found._state).volume_ratios.min()
    return both(
        at_rest(found),
        above("least J", least, 0.0),
        near("positions after a push", again.positions, found.positions, rel=1e-6, scale=3.0),
    )


@case("started inverted, Corotated: crumpled at its support, all elements turned right")
def crumples():
    solid = bar((3, 1, 1), STABLE["Corotated"], "linear")
    found = ms.equilibrium(held(solid), start=starts(solid.mesh.rest_positions)["inverted"])
    least = states_of(found.scene, solid, found._state).volume_ratios.min()
    return both(at_rest(found), above("least J", least, 0.0))


@case("started {}, of a material that has no energy there", over=("inverted", "flattened", "random"))
def refuses(start):
    solid = bar((3, 1, 1))
    x = solid.mesh.rest_positions
    return refused(
        lambda: ms.equilibrium(held(solid), start=starts(x)[start]),
        r"element \d+ of body 0 is turned",
        ms.NotConverged,
    )


@case("slivers a thousandth as high as wide: an even stretch is an equilibrium of any mesh")
def slivers():
    mesh = ms.meshes.box((1, 1, 1), cells=(2, 2, 2), diagonals="crossed")
    x = np.array(mesh.rest_positions)
    inside = np.flatnonzero((np.abs(x - 0.5) < 0.499).all(axis=1))
    x[inside, 2] -= 0.998 * np.where(np.isclose(x[inside, 2], 0.25), 0.25, 0.0)
    solid = ms.Solid(ms.TetMesh(x, mesh.tetrahedra), material=ms.NeoHookean(**MODULI), element="linear")
    outside = np.setdiff1d(np.arange(len(x)), inside)
    pins = [
        ms.Pin(outside[x[outside, 0] == at], displacement=(0.3 * at, 0, 0)) for at in np.unique(x[outside, 0])
    ]
    found = ms.equilibrium(ms.Scene(solid, supports=pins))
    return both(at_rest(found), near("positions", found.positions, x * (1.3, 1, 1), rel=1e-7))


@case("one tetrahedron, {}", over=("linear", "quadratic"))
def one_tetrahedron(element):
    """Compare the top of a linear tetrahedron with F = E A u / (3 h); a quadratic one deforms more.

    Its base is held, and Poisson's ratio is 0.
    """
    mesh = ms.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2]], [[0, 1, 2, 3]])
    material = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.0)
    solid = ms.Solid(mesh, material=material, element=element)
    base = np.flatnonzero(solid.mesh.rest_positions[:, 2] == 0.0)
    scene = ms.Scene(solid, supports=[ms.Pin(base)], loads=[ms.PointLoad([3], (0, 0, 1.0))])
    moved = ms.linear_response(scene).displacements[3, 2]
    stiff = 3 * 2.0 / (1e5 * 0.5)
    if element == "linear":
        return near("top", moved, stiff, rel=1e-9)
    return both(at_rest(ms.equilibrium(scene)), holds(f"top > {stiff:.3g}", moved > stiff, f"{moved:.3g}"))


@case("blocks of moduli 1 to 1e6 in turn, pulled, {}", over=("linear", "quadratic"))
def blocks_in_series(element):
    mesh = ms.meshes.box((10, 1, 1), cells=(20, 2, 2))
    stiff = np.floor(mesh.tetrahedron_barycenters[:, 0]).astype(int) % 2 == 1
    material = ms.NeoHookean(young_modulus=np.where(stiff, 1e11, 1e5), poisson_ratio=0.0)
    solid = ms.Solid(mesh, material=material, element=element)
    x, (left, right) = solid.mesh.rest_positions, ends(solid)
    pulled = ms.Pin(right, components="x", displacement=(1e-3, 0, 0))
    scene = ms.Scene(solid, supports=[ms.Pin(left), pulled])
    found = ms.equilibrium(scene)
    at = [found.displacements[np.abs(x[:, 0] - k) < TINY, 0].mean() for k in range(11)]
    soft = 1e-3 / (5 + 5e-6)
    expected = np.cumsum([0.0] + [soft * (1.0 if k % 2 == 0 else 1e-6) for k in range(10)])
    return both(near("positions of the joints", at, expected, rel=1e-3), at_rest(found))


@case("{:g} m long: the same shape at every size", over=(1e-3, 1e3))
def sizes(length):
    shapes = []
    for size in (1.0, length):
        solid = bar((6, 2, 2), size=tuple(np.array((1.0, 0.2, 0.2)) * size), mass_density=1e3)
        found = ms.equilibrium(held(solid, gravity=(0, 0, -3.0 / size)))
        shapes.append(found.positions / size)
    return both(near("shape", shapes[1], shapes[0], rel=1e-9), at_rest(found))


@case("nothing holds it and it falls, thrown and spinning, for 1 s, {}", over=("linear", "quadratic"))
def free_fall(element):
    solid = bar(
        (3, 1, 1),
        element=element,
        mass_density=1e3,
        material=ms.NeoHookean(young_modulus=1e7, poisson_ratio=0.3),
    )
    scene = ms.Scene(solid, allow_rigid_motions=True, gravity=(0, 0, -9.81))
    masses = solid.vertex_masses / solid.vertex_masses.sum()
    x = solid.mesh.rest_positions - masses @ solid.mesh.rest_positions
    velocities = np.cross((0.0, 0.0, 2.0), x) + np.array((1.0, 0.5, 3.0))
    motion = ms.simulate(scene, steps=50, time_step=0.02, velocities=velocities, progress=False)
    moved = np.einsum("v,tvi->ti", masses, motion.displacements)
    t = motion.times[:, None]
    expected = t * (1.0, 0.5, 3.0) - 0.5 * 9.81 * t**2 * (0, 0, 1.0)
    about = np.cross(
        motion.positions - (masses @ solid.mesh.rest_positions + moved)[:, None], motion.velocities
    )
    turning = np.einsum("v,tvi->ti", masses, about)[:, 2]
    return both(
        near("center", moved, expected, rel=1e-8),
        near("angular momentum", turning / turning[0], np.ones(len(turning)), rel=1e-2),
    )


@case("a block with a hole through it, twisted by 60 degrees")
def twisted_tube():
    mesh = ms.meshes.tube(0.4, 1.0, 2.0, cells=(2, 12, 4))
    solid = ms.Solid(mesh, material=ms.NeoHookean(**MODULI))
    z = solid.mesh.rest_positions[:, 2]
    pins = [
        ms.Pin(np.flatnonzero(z < TINY)),
        ms.Pin(np.flatnonzero(z > 2 - TINY), rotation=(0, 0, np.pi / 3)),
    ]
    found = ms.equilibrium(ms.Scene(solid, supports=pins))
    middle = np.abs(z - 1.0) < TINY
    x, y = solid.mesh.rest_positions[middle, :2].T
    flat = found.positions[middle]
    angle = np.arctan2(x * flat[:, 1] - y * flat[:, 0], x * flat[:, 0] + y * flat[:, 1])
    return both(at_rest(found), near("turn half way", angle.mean(), np.pi / 6, rel=1e-3))


@case("time and memory in proportion to the elements, from 648 to 24,000")
def scaling():
    """Check the exponents that `python -m benchmarks scaling` measures up to 500,000 elements.

    Assembly grows with the number of elements, the entries of L with its power 4/3.
    """
    small, large = (costs(cells, rounds=1) for cells in ((12, 3, 3), (40, 10, 10)))
    grown = exponents([small, large])
    return both(
        below("exponent of the assembly", grown["assembly"], 1.35),
        below("of the model's memory", grown["model"], 1.05),
        below("of the entries of L", grown["entries"], 1.5),
        below("of an iteration's time", grown["iteration"], 2.0),
    )
