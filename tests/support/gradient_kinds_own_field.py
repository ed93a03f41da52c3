"""Kinds of scene in which bodies act on each other with their own magnetic field, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import MESH
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms

SHIFT = (4e-3, 3e-3, 0.012)  # [m] of the upper sheet: no edge lies above another


def own_field(moves: bool) -> Kind:
    """Build two sheets above each other, of both laws: oblique at rest, in a uniform field too, or tangential in motion."""
    rng = np.random.default_rng(11)
    meshes = [MESH, MESH.transformed(translation=SHIFT)]
    sheets = [
        ms.Shell(
            each,
            thickness=thickness,
            young_modulus=3e6,
            poisson_ratio=0.3,
            mass_density=1e3,
            magnetization_law=law,
        )
        for each, thickness, law in zip(meshes, (1e-3, 1.2e-3), ("stretches", "rotates"), strict=True)
    ]
    supports = [
        ms.Clamp(mesh.edges_at(x=mesh.rest_positions[:, 0].min()), body=sheet)
        for mesh, sheet in zip(meshes, sheets, strict=True)
    ]
    magnetization = rng.uniform(-1.0, 1.0, (2 * MESH.n_faces, 3)) * 4e4 + np.array([3e4, 0.0, 2e4])
    inputs = {"remanent_magnetization": magnetization}
    if moves:
        inputs["remanent_magnetization"] = magnetization * np.array([1.0, 1.0, 0.0])
        scene = ms.Scene(sheets, supports=supports, own_field=ms.OwnField())
        fixed = {"steps": 3, "integrator": ms.TRBDF2(), "progress": False, **EXACT}
        return Kind(scene, {"time_step": 2e-3, **inputs}, ms.simulate, fixed=fixed, step=1e-4, reach=REACH)
    scene = ms.Scene(sheets, supports=supports, own_field=ms.OwnField(), field=ms.UniformField())
    inputs["applied_flux_density"] = np.array([1e-4, -2e-4, 3e-4])
    return Kind(scene, inputs, fixed=EXACT, reach=REACH)


def bodies_with_own_field(moves: bool) -> Kind:
    """Build a magnetized solid, a solid with a skin, a sheet that carries a magnet and, at rest, a curved six-node sheet.

    They are small and apart, so that few pairs are near. At rest they are stiff: sheets of 1 mm and 3 MPa, 0.1 m long, found
    no rest. In motion the solids are so soft, the skin so heavy and the magnets so strong that every input shows in the
    positions; another magnet flies beside them.
    """
    rng = np.random.default_rng(31)
    rubber = ms.StableNeoHookean(young_modulus=2e4 if moves else 1e6, poisson_ratio=0.3)
    heavy = {"mass_density": 1.1e3, "element": "linear", "material": rubber}
    thick = {"thickness": 1.5e-3, "young_modulus": 3e6, "poisson_ratio": 0.3, "mass_density": 1e3}
    carrier = ms.meshes.rectangle(0.03, 0.012, cells=(3, 1)).transformed(translation=(0.0, 0.0, 0.03))
    carried = np.argsort(carrier.rest_positions @ (1.0, 0.1, 0.0))[-3:]
    sheet = ms.Shell(
        carrier,
        magnetization_law="rotates",
        remanent_magnetization=rng.uniform(-3e4, 3e4, (carrier.n_faces, 3)),
        **thick,
    )
    box = ms.meshes.box((0.016, 0.012, 0.01), cells=(1, 1, 1)).transformed(translation=(0.011, 0.013, 0.0))
    block = ms.Solid(box, **heavy, remanent_magnetization=rng.uniform(-5e4, 5e4, (box.n_tetrahedra, 3)))
    upper = ms.meshes.box((0.015, 0.012, 0.01), cells=(1, 1, 1)).transformed(
        translation=(0.017, -0.009, 0.055)
    )
    coat = ms.Skin(
        thickness=1e-3,
        mass_density=6e3 if moves else 1e3,
        faces=upper.faces_at(z=0.055),
        remanent_magnetization=(2e4, -3e4, 4e4),
    )
    coated = ms.Solid(upper, **heavy, skin=coat)
    flat = ms.QuadraticTriangleMesh.from_triangles(ms.meshes.rectangle(0.015, 0.01, cells=(1, 1)))
    arched = flat.rest_positions + 6.0 * flat.rest_positions[:, :1] ** 2 * (0, 0, 1) + (0.02, -0.03, 0.02)
    lower = ms.Shell(
        ms.QuadraticTriangleMesh(arched, flat.elements),
        remanent_magnetization=rng.uniform(-3e4, 3e4, (2, 3)),
        **thick,
    )
    magnet = ms.RigidBody(
        carried,
        body=sheet,
        mass=2e-4,
        inertia=np.array([1.2e-8, 0.9e-8, 1.5e-8]),
        center=carrier.rest_positions[carried].mean(axis=0) + np.array([5e-4, 1e-3, 2e-3]),
        magnetic_moment=(5e-3, 2.5e-3, 1.5e-2) if moves else (1e-3, 5e-4, 3e-3),
    )
    supports = [
        ms.Clamp(carrier.edges_at(x=0.0), body=sheet),
        ms.Pin(box.vertices_at(x=box.rest_positions[:, 0].min()), body=block),
        ms.Pin(upper.vertices_at(x=upper.rest_positions[:, 0].min()), body=coated),
        ms.Clamp(lower.mesh.edges_at(x=arched[:, 0].min()), body=lower),
    ]
    bodies = [sheet, block, coated, lower, magnet]
    if moves:  # as much again would take too long
        bodies.remove(lower)
        supports.pop()
        place = {"center": (0.045, 0.006, 0.045), "magnetic_moment": (2e-2, 5e-3, -1e-2)}
        bodies.append(ms.RigidBody(mass=3e-4, inertia=(0.7e-8, 1.0e-8, 1.4e-8), **place))
    scene = ms.Scene(
        bodies,
        supports=supports,
        field=ms.UniformField(),
        own_field=ms.OwnField(),
        gravity=(2.0, 1.0, -9.8) if moves else (0.2, 0.1, -2.0),
        allow_rigid_motions=moves,
    )
    inputs = {"applied_flux_density": np.array([1e-3, -2e-3, 3e-3])}
    if not moves:
        # Over shorter steps some inputs move these stiff bodies so little that one iteration of Newton's method is enough,
        # and what it leaves is more than the round-off of others.
        return Kind(scene, inputs, fixed=EXACT, step=1e-3, reach=REACH)
    fixed = {"steps": 2, "integrator": ms.ImplicitEuler(), "progress": False, **EXACT}
    return Kind(scene, {"time_step": 4e-3, **inputs}, ms.simulate, fixed=fixed, reach=REACH)


def stiff_pair(tip_load=(0.0, 0.0, 0.0), cells=(3, 1), law="stretches") -> ms.Scene:
    """Build two clamped flaps above each other, of few degrees of freedom, so that eigenvalue problems take little time.

    tip_load: N/m on the free end of each. law: of the magnetizations.
    """
    mesh = ms.meshes.rectangle(0.02, 0.006, cells=cells)
    meshes = [mesh, mesh.transformed(translation=(1e-3, 5e-4, 4e-3))]
    flaps = [
        ms.Shell(
            each,
            thickness=4e-4,
            young_modulus=modulus,
            poisson_ratio=0.3,
            mass_density=2e3,
            magnetization_law=law,
        )
        for each, modulus in zip(meshes, (4e8, 5e8), strict=True)
    ]
    supports = [
        ms.Clamp(each.edges_at(x=each.rest_positions[:, 0].min()), body=flap)
        for each, flap in zip(meshes, flaps, strict=True)
    ]
    loads = [
        ms.EdgeLoad(each.edges_at(x=each.rest_positions[:, 0].max()), tip_load, body=flap)
        for each, flap in zip(meshes, flaps, strict=True)
        if np.any(tip_load)
    ]
    return ms.Scene(flaps, supports=supports, loads=loads, own_field=ms.OwnField())


def stiff_pair_magnetization(scene) -> np.ndarray:
    return 4e4 * np.random.default_rng(4).uniform(0.5, 1.5, (scene.mesh.n_faces, 3)) * (1.0, 0.5, 1.0)


def closing_flaps() -> ms.Scene:
    """Build two clamped flaps above each other that attract, of different stiffness, so that one limit point is simple."""
    mesh = ms.meshes.rectangle(0.02, 0.006, cells=(2, 1))
    meshes = [mesh, mesh.transformed(translation=(2e-4, 1e-4, 3e-3))]
    flaps = [
        ms.Shell(each, thickness=4e-4, young_modulus=modulus, poisson_ratio=0.3, mass_density=2e3)
        for each, modulus in zip(meshes, (1.5e7, 1.7e7), strict=True)
    ]
    supports = [
        ms.Clamp(each.edges_at(x=each.rest_positions[:, 0].min()), body=flap)
        for each, flap in zip(meshes, flaps, strict=True)
    ]
    return ms.Scene(flaps, supports=supports, own_field=ms.OwnField(), field=ms.UniformField())
