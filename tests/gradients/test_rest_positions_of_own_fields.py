"""Forces of bodies on each other with their own magnetic field, and their derivatives by rest positions, at any state.

That gradients of equilibria and motions by rest positions are those of differences: test_every_gradient.py.
"""

import inspect

import numpy as np
import pytest
from gradient_kinds_own_field import stiff_pair, stiff_pair_magnetization
from gradient_scenes import OF_SMALL_SCENES
from gradient_world import EXACT

import magshell as ms
from magshell import _core
from magshell.model.scene.reshaped import neighbour, reshaped
from magshell.solve.statics.energies_at import _point

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

KEYWORDS = {
    name: each.default
    for name, each in inspect.signature(ms.energies).parameters.items()
    if each.kind is each.KEYWORD_ONLY and name not in ("edge_rotations", "body", "by")
}
RUBBER = ms.StableNeoHookean(young_modulus=1e6, poisson_ratio=0.3)
THICK = {"thickness": 1.5e-3, "young_modulus": 3e6, "poisson_ratio": 0.3, "mass_density": 1e3}


def away(scene, size):
    """Return rest positions of all vertices of a scene, away from those of its meshes, so that all lengths differ."""
    x = np.array(scene.mesh.rest_positions)
    return x + size * np.random.default_rng(6).standard_normal(x.shape)


def values_of(scene, x):
    rows = [scene._bodies.spans[k].vertices for k in range(len(scene.bodies))]
    return {body: {"rest_positions": x[part]} for body, part in zip(scene.bodies, rows, strict=True)}


def flaps(x, solve=ms.equilibrium, scene=None, **given):
    scene = stiff_pair() if scene is None else scene
    magnetization = stiff_pair_magnetization(scene)
    return solve(scene, remanent_magnetization=magnetization, values=values_of(scene, x), **given, **EXACT)


def block(element, law):
    box = ms.meshes.box((0.016, 0.012, 0.01), cells=(1, 1, 1)).transformed(translation=(0.011, 0.013, 0.0))
    magnetization = np.random.default_rng(1).uniform(-5e4, 5e4, (box.n_tetrahedra, 3))
    return ms.Solid(
        box, material=RUBBER, element=element, remanent_magnetization=magnetization, magnetization_law=law
    )


def coated(law):
    box = ms.meshes.box((0.015, 0.012, 0.01), cells=(1, 1, 1)).transformed(translation=(0.017, -0.009, 0.03))
    coat = ms.Skin(
        thickness=1e-3,
        faces=box.faces_at(z=0.03),
        mass_density=1e3,
        remanent_magnetization=(2e4, -3e4, 4e4),
        magnetization_law=law,
    )
    return ms.Solid(box, material=RUBBER, element="linear", mass_density=1e3, skin=coat)


def six_node_sheet(law):
    flat = ms.meshes.rectangle(0.015, 0.01, cells=(1, 1), order=2)
    arch = 6.0 * flat.rest_positions[:, :1] ** 2 * (0, 0, 1) + (0.012, 0.004, 0.018)
    magnetization = np.random.default_rng(2).uniform(-3e4, 3e4, (2, 3))
    mesh = ms.QuadraticTriangleMesh(flat.rest_positions + arch, flat.elements)
    return ms.Shell(mesh, remanent_magnetization=magnetization, magnetization_law=law, **THICK)


def with_magnets(law):
    """Return a sheet, a magnet that some of its vertices carry, and one beside them."""
    mesh = ms.meshes.rectangle(0.03, 0.012, cells=(3, 1)).transformed(translation=(0.0, 0.0, 0.05))
    magnetization = np.random.default_rng(3).uniform(-3e4, 3e4, (mesh.n_faces, 3))
    sheet = ms.Shell(mesh, remanent_magnetization=magnetization, magnetization_law=law, **THICK)
    carried = np.argsort(mesh.rest_positions @ (1.0, 0.1, 0.0))[-3:]
    center = mesh.rest_positions[carried].mean(axis=0) + np.array((5e-4, 1e-3, 2e-3))
    part = ms.RigidBody(
        carried, body=sheet, mass=2e-4, inertia=1e-8, center=center, magnetic_moment=(1e-3, 5e-4, 3e-3)
    )
    free = ms.RigidBody(
        mass=3e-4, inertia=1e-8, center=(0.045, 0.006, 0.045), magnetic_moment=(2e-2, 5e-3, -1e-2)
    )
    return [sheet, part, free]


def flaps_apart(gap, law):
    scene = stiff_pair(law=law)
    magnetization = np.split(stiff_pair_magnetization(scene), 2)
    lower, upper = (
        body.replaced(remanent_magnetization=m) for body, m in zip(scene.bodies, magnetization, strict=True)
    )
    shift = np.array((0.0, 0.0, gap - 4e-3))
    return [lower, upper.replaced(rest_positions=upper.rest_positions + shift)]


BODIES = {
    "near flaps": lambda law: flaps_apart(4e-3, law),
    "flaps between near and far": lambda law: flaps_apart(8e-3, law),
    "a linear solid": lambda law: [block("linear", law)],
    "a quadratic solid": lambda law: [block("quadratic", law)],
    "a solid with a skin": lambda law: [coated(law)],
    "a six-node sheet": lambda law: [six_node_sheet(law)],
    "a sheet and magnets": with_magnets,
    "all": lambda law: [block("quadratic", law), coated(law), six_node_sheet(law), *with_magnets(law)],
}


def check_forces(bodies, shift):
    """Compare w . dg/dX, g the derivatives of the own field's energy at a state that stays, with central differences.

    shift: m, how far rest positions are from those of the meshes. The errors of the differences fall as the square of the
        step: up to 2e-7 of the gradient, then 2e-9.
    """
    given = ms.Scene(bodies, own_field=ms.OwnField(), allow_rigid_motions=True)
    x = away(given, shift)
    first, _ = reshaped(given, values_of(given, x))
    rng = np.random.default_rng(3)
    positions = x + 3e-4 * rng.standard_normal(x.shape)

    def at(rest):
        scene = neighbour(
            first, {body: each["rest_positions"] for body, each in values_of(first, rest).items()}
        )
        return scene._model, _point("energies", scene, positions, None, KEYWORDS).adjoint

    model, found = at(x)
    layout, load = first._load_parameter_layout, np.array(found.inputs.load_parameters)
    without = load - layout.packed({("scene", "own_field_factor"): 1.0}, layout.zeros())
    with found.inputs.in_core():
        state = found.state(load)
        weights = rng.standard_normal(state.size)
        by_nodes = [_core.vjp(model, state, each, weights, True)[2] for each in (load, without)]
    by = _core.at_nodes(model, by_nodes[0] - by_nodes[1])[0]

    def power(rest):
        there, of = at(rest)
        with of.inputs.in_core():
            return weights @ there.term_gradient("own field", state, load)

    assert np.linalg.norm(by) > 0.1
    for way in (by, rng.standard_normal(by.shape)):
        along = way / np.linalg.norm(way)
        for step, tolerance in ((3e-6, 1e-6), (3e-7, 1e-8)):
            difference = (power(x + step * along) - power(x - step * along)) / (2.0 * step)
            assert difference == pytest.approx((by * along).sum(), rel=0, abs=tolerance * np.linalg.norm(by))


@pytest.mark.parametrize("law", ["stretches", "rotates"])
@pytest.mark.parametrize("name", BODIES)
def test_own_field_forces_by_rest_positions_agree_with_differences_at_any_state(name, law):
    check_forces(BODIES[name](law), 2e-4)


def test_own_field_forces_on_an_even_mesh_have_the_mean_of_the_derivatives_on_both_sides():
    """Check edges of one length, whose larger one is either."""
    check_forces(flaps_apart(8e-3, "stretches"), 0.0)


@pytest.mark.parametrize("named", [False, True], ids=["all bodies", "named bodies"])
@pytest.mark.parametrize("law", ["stretches", "rotates"])
def test_scenes_with_an_own_field_at_other_rest_positions_are_those_made_so(named, law):
    """Compare positions: solves of one equilibrium from several starts differ by up to 5e-13 m of 1.3e-5 m."""
    scene = stiff_pair(law=law)
    if named:
        scene = ms.Scene(scene.bodies, supports=scene.supports, own_field=ms.OwnField(bodies=scene.bodies))
    x = away(scene, 2e-4)
    spans = scene._bodies.spans
    made = [
        each.replaced(rest_positions=x[span.vertices]) for each, span in zip(scene.bodies, spans, strict=True)
    ]
    held = [ms.Clamp(each.edges, body=body) for each, body in zip(scene.supports, made, strict=True)]
    same = ms.Scene(made, supports=held, own_field=ms.OwnField(bodies=made if named else None))
    magnetization = stiff_pair_magnetization(scene)
    for solve, given in ((ms.equilibrium, {}), (ms.simulate, {"steps": 3, "time_step": 1e-3})):
        found = flaps(x, solve, scene, **given)
        expected = solve(same, remanent_magnetization=magnetization, **given, **EXACT)
        far = np.abs(np.asarray(expected.displacements)).max()
        assert np.abs(np.asarray(found.positions - expected.positions)).max() < 1e-6 * far
