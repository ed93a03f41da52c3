"""Rigid bodies: a free top against Jacobi's elliptic functions, payloads of shells, and magnets in a field."""

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk, ellipkinc

import magshell as ms

torch = pytest.importorskip("torch")

INERTIA = np.array([1.0, 2.0, 3.0])
SPIN = np.array([0.1, 2.0, 0.2])
# Validation case K2a (bodies.json): orientations as quaternions w, x, y, z from an integration to 1e-13.
TURNED = {
    1: (0.5361366236, -0.03639607512, 0.8349852228, 0.1184589565),
    2: (-0.4044782218, -0.03801301864, 0.8361345999, 0.3685529939),
    5: (-0.006426496354, 0.1899556239, -0.03417186506, -0.9811767653),
    10: (-0.9231383298, 0.1088827616, 0.3679567157, 0.02383324738),
}
RATES = {  # in the body's axes, from Jacobi's elliptic functions
    1: (-0.3196596877, 1.976820094, 0.2659463078),
    10: (0.6280340131, 1.901466087, 0.4100515096),
}
PERIOD = 10.965969614837
G = 9.81


def top(**changed):
    return ms.RigidBody(**{"mass": 1.0, "inertia": INERTIA, "angular_velocity": SPIN, **changed})


def spinning(steps_a_second, seconds=10, integrator=None, part=None):
    part = part or top()
    scene = ms.Scene(part, allow_rigid_motions=True)
    motion = ms.simulate(
        scene, steps=seconds * steps_a_second, time_step=1.0 / steps_a_second, integrator=integrator
    )
    return motion, motion[part]


def errors(rotations, steps_a_second, times=tuple(TURNED)):
    exact = {t: Rotation.from_quat(np.roll(TURNED[t], -1)).as_matrix() for t in times}
    return np.array([np.abs(rotations[t * steps_a_second] - exact[t]).max() for t in times])


def jacobi(times):
    """Compute the rates in the body's axes in closed form, (n, 3) in rad/s.

    The formulas hold where momentum^2 > 2 energy * the middle inertia.
    """
    a, b, c = INERTIA
    momentum, energy = ((INERTIA * SPIN) ** 2).sum(), (INERTIA * SPIN**2).sum()  # squared; twice
    speed = np.sqrt((c - b) * (momentum - energy * a) / (a * b * c))
    m = (b - a) * (energy * c - momentum) / ((c - b) * (momentum - energy * a))
    low, high = energy * c - momentum, momentum - energy * a
    sizes = np.sqrt([low / (a * (c - a)), low / (b * (c - b)), high / (c * (c - a))])
    assert 4.0 * ellipk(m) / speed == pytest.approx(PERIOD, rel=1e-10)
    begin = ellipkinc(np.arcsin(SPIN[1] / sizes[1]), m)
    sn, cn, dn, _ = ellipj(speed * np.asarray(times) + begin, m)
    return sizes * np.stack([cn, sn, dn], axis=-1)


def test_table_of_rates_is_that_of_jacobi():
    assert jacobi([0.0])[0] == pytest.approx(SPIN, abs=1e-12)
    assert jacobi(list(RATES)) == pytest.approx(np.array(list(RATES.values())), abs=1e-8)


@pytest.mark.parametrize("method", [ms.TRBDF2(), ms.ImplicitEuler(), ms.SDIRK2(), ms.SDIRK3()])
def test_free_top_follows_jacobi_by_every_method(method):
    motion, part = spinning(40, integrator=method)
    assert errors(part.rotation, 40).max() < 1e-6
    rates = np.einsum("nij,ni->nj", part.rotation, part.angular_velocity)
    assert np.abs(rates - jacobi(motion.times)).max() < 1e-6


@pytest.mark.parametrize("method", [ms.SDIRK2(), ms.SDIRK3()])
def test_methods_that_fall_to_first_order_in_joints_are_refused(method):
    arm = ms.Link(mass=0.1, inertia=1e-4, center=(0.1, 0, 0))
    scene = ms.Scene(ms.Skeleton([arm], [ms.Revolute(arm, origin=(0, 0, 0), axis=(0, 1, 0))]))
    with pytest.raises(ValueError, match=r"first order where rigid parts with joints .*TRBDF2"):
        ms.simulate(scene, steps=1, time_step=0.1, integrator=method)


def test_rotation_stays_orthogonal_in_a_long_run():
    _, part = spinning(20, 300)
    off = part.rotation @ part.rotation.transpose(0, 2, 1) - np.eye(3)
    assert np.abs(off).max() < 1e-13


def test_the_frame_of_an_inertia_does_not_matter():
    turn = Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix()
    other = top(
        inertia=turn @ np.diag(INERTIA) @ turn.T, angular_velocity=turn @ SPIN, center=(1.0, -2.0, 3.0)
    )
    straight, turned = spinning(40, 3)[1].rotation, spinning(40, 3, part=other)[1].rotation
    assert turn @ straight @ turn.T == pytest.approx(turned, abs=1e-9)


def test_a_free_body_falls():
    part = top(velocity=(0.1, 0.0, 1.0))
    scene = ms.Scene(part, gravity=(0, 0, -G), allow_rigid_motions=True)
    motion = ms.simulate(scene, steps=20, time_step=0.02)
    times = motion.times[:, None]
    assert motion[part].center == pytest.approx(
        times * (0.1, 0, 1.0) - 0.5 * G * times**2 * (0, 0, 1), abs=1e-9
    )
    assert motion[part].velocity[-1] == pytest.approx((0.1, 0.0, 1.0 - 0.4 * G), abs=1e-9)
    with pytest.raises(ValueError, match="has no vertices"):
        _ = motion[part].positions


def test_a_needle_swings_in_a_field():
    moment, inertia, flux_density, swing = 2.0, 0.5, 0.3, 1e-3
    needle = ms.RigidBody(
        mass=1.0, inertia=inertia, magnetic_moment=moment * np.array([np.cos(swing), np.sin(swing), 0.0])
    )
    scene = ms.Scene(needle, field=ms.UniformField(), allow_rigid_motions=True)
    period = 2.0 * np.pi * np.sqrt(inertia / (moment * flux_density))
    motion = ms.simulate(scene, steps=200, time_step=period / 200, applied_flux_density=(flux_density, 0, 0))
    angle = swing + Rotation.from_matrix(motion[needle].rotation).as_rotvec()[:, 2]
    assert angle == pytest.approx(swing * np.cos(2.0 * np.pi * motion.times / period), abs=2e-3 * swing)


def test_a_magnet_is_pulled_along_the_gradient_of_its_field():
    source = ms.Dipoles([[0.0, 0.0, 0.3]], [[0.5, 0.0, 2.0]])
    moment, mass = np.array([0.1, 0.2, 0.4]), 2.0
    magnet = ms.RigidBody(mass=mass, inertia=1.0, magnetic_moment=moment)
    scene = ms.Scene(magnet, field=source, allow_rigid_motions=True)
    motion = ms.simulate(scene, steps=10, time_step=0.05)
    step = 1e-5 * np.eye(3)
    pull = (source.flux_density(step) - source.flux_density(-step)) @ moment / 2e-5
    assert motion[magnet].velocity[-1] * mass / motion.times[-1] == pytest.approx(pull, rel=1e-3)
    torque = np.cross(moment, source.flux_density(np.zeros((1, 3)))[0])
    turning = motion[magnet].angular_velocity[-1] / motion.times[-1]
    assert turning == pytest.approx(torque, abs=1e-4 * np.linalg.norm(torque))


MESH = ms.meshes.rectangle(0.1, 0.01, cells=(40, 4))
END = np.flatnonzero(MESH.rest_positions[:, 0] > 0.0899)
STIFFNESS = 1e6 * 0.01 * 1e-9 / 12.0  # E I, N m2


def strip(**changed):
    properties = {"thickness": 1e-3, "young_modulus": 1e6, "poisson_ratio": 0.0, "mass_density": 1e3}
    return ms.Shell(MESH, **{**properties, **changed})


def carrying(part, sheet=None, **scene):
    return ms.Scene([sheet or strip(), part], supports=[ms.Clamp(MESH.edges_at(x=0.0))], **scene)


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_a_payload_bends_a_strip_as_in_beam_theory():
    """Compare with a force and a moment at 0.09 m, where the body begins, from a center beyond the strip's end."""
    mass, weight = 1e-6, 1e-2
    part = ms.RigidBody(END, mass=mass, inertia=1e-12, center=(0.12, 0.005, 0.0))
    light = strip(mass_density=1e-6)
    rest = ms.equilibrium(carrying(part, light, gravity=(0, 0, -weight / mass)), gravity_factor=1e-3)
    force, length, arm = 1e-3 * weight, 0.09, 0.03
    slope = force * length**2 / (2 * STIFFNESS) + force * arm * length / STIFFNESS
    assert rest[part].rotation[2, 0] == pytest.approx(-slope, rel=2e-2)
    drop = force * length**3 / (3 * STIFFNESS) + force * arm * length**2 / (2 * STIFFNESS)
    border = MESH.vertices_at(x=0.09)
    assert rest.displacements[border, 2] == pytest.approx(-drop, rel=2e-2)


def test_a_magnet_glued_on_turns_the_end():
    moment, flux_density = 1e-4, 1e-4
    part = ms.RigidBody(END, magnetic_moment=(moment, 0, 0))
    scene = carrying(part, field=ms.UniformField())
    rest = ms.equilibrium(scene, remanent_magnetization=(0, 0, 0), applied_flux_density=(0, 0, flux_density))
    turned = Rotation.from_matrix(rest[part].rotation).as_rotvec()
    assert turned == pytest.approx((0, -moment * flux_density * 0.09 / STIFFNESS, 0), rel=2e-2, abs=1e-12)
    assert rest.energies["moments"] == pytest.approx(
        -moment * flux_density * (rest[part].rotation @ (1, 0, 0))[2], rel=1e-12
    )


@pytest.mark.parametrize("solve", ["at rest", "in motion"])
def test_a_frame_keeps_its_distances(solve):
    part = ms.RigidBody(END)
    scene = carrying(part, gravity=(0.3, 0.5, -G))
    if solve == "at rest":
        found = ms.equilibrium(scene)
        positions = found[part].positions
    else:
        found = ms.simulate(scene, steps=100, time_step=2e-3)
        positions = found[part].positions[-1]
    assert np.abs(pdist(positions) - pdist(MESH.rest_positions[END])).max() < 1e-12 * MESH.size
    assert np.abs(positions - MESH.rest_positions[END]).max() > 0.01


def test_rigid_body_is_the_limit_of_a_stiff_region():
    """Compare faces so stiff that they hardly strain with the same faces made rigid as well."""
    within = np.isin(MESH.faces, END).all(axis=1)
    stiff = strip(young_modulus=np.where(within, 1e11, 1e6))
    supports = {"supports": [ms.Clamp(MESH.edges_at(x=0.0))], "gravity": (0, 0.2, -1.0)}
    alone, part = ms.Scene(stiff, **supports), ms.RigidBody(END)
    both = ms.Scene([stiff, part], **supports)
    assert ms.equilibrium(both).positions == pytest.approx(ms.equilibrium(alone).positions, abs=1e-7)
    modes = [ms.vibration_modes(scene, ms.equilibrium(scene), count=3).frequencies for scene in (alone, both)]
    assert modes[1] == pytest.approx(modes[0], rel=1e-4)
    motions = [ms.simulate(scene, steps=10, time_step=2e-3).positions[-1] for scene in (alone, both)]
    assert motions[1] == pytest.approx(motions[0], abs=1e-6)
    linear = [ms.linear_response(scene).displacements for scene in (alone, both)]
    assert linear[1] == pytest.approx(linear[0], rel=1e-4, abs=1e-9)


def test_a_payload_lowers_the_frequency_as_rayleigh_says():
    """Compare with 3 E I / (m L^3) of a point mass far heavier than the strip."""
    part = ms.RigidBody(END, mass=0.1, inertia=1e-9, center=(0.09, 0.005, 0.0))
    square = ms.vibration_modes(carrying(part), count=1).squares[0]
    assert square == pytest.approx(3.0 * STIFFNESS / (0.1 * 0.09**3), rel=3e-2)


def test_a_magnet_against_the_field_buckles_the_strip():
    """Check the balance of the magnet's moment m B theta and the strip's E I theta / L.

    The former is in the Hessian only through the curvature of rotations.
    """
    moment = 1e-3
    critical = STIFFNESS / (0.09 * moment)  # T
    part = ms.RigidBody(END, magnetic_moment=(-moment, 0, 0))
    scene = carrying(part, field=ms.UniformField(), gravity=(1e-3, 0, 0))  # which moves it, and hardly pulls
    no = {"remanent_magnetization": (0, 0, 0)}
    path = ms.follow_path(scene, **no, applied_flux_density=(1.5 * critical, 0, 0))
    assert [each.kind for each in path.critical] == ["bifurcation"]
    assert 1.5 * path.critical[0].parameter == pytest.approx(1.0, rel=2e-2)
    assert path.n_negative_eigenvalues[0] == 0 and path.n_negative_eigenvalues[-1] == 1
    beyond = {**no, "applied_flux_density": (1.5 * critical, 0, 0)}
    straight = ms.equilibrium(scene, **beyond, require_stable=False)
    assert not straight.stable and straight.n_negative_eigenvalues == 1
    bent = ms.equilibrium(scene, **beyond)
    assert bent.stable and np.abs(bent.displacements).max() > 0.02
    turned = np.linalg.norm(Rotation.from_matrix(bent[part].rotation).as_rotvec())
    assert 1.5 * np.sin(turned) == pytest.approx(
        turned, rel=2e-2
    )  # pure bending: theta = m B sin(theta) L / E I
    growing = ms.vibration_modes(scene, straight, count=1)
    assert growing.unstable == 1


def test_continued_motion_of_a_rigid_body_has_the_same_bits():
    part, free = ms.RigidBody(END, mass=1e-3, inertia=1e-8), top(center=(0, 0, 1.0))
    scene = ms.Scene([strip(), part, free], gravity=(0, 0, -1.0), allow_rigid_motions=True)
    whole = ms.simulate(scene, steps=8, time_step=1e-3)
    first = ms.simulate(scene, steps=5, time_step=1e-3)
    rest = ms.simulate(scene, steps=3, time_step=1e-3, start=first)
    for body in (part, free):
        assert np.array_equal(whole[body].rotation[-1], rest[body].rotation[-1])
        assert np.array_equal(whole[body].velocity[-1], rest[body].velocity[-1])
    assert np.array_equal(whole.positions[-1], rest.positions[-1])


def test_a_frame_can_be_thrown():
    """Check that momenta of a free sheet with a payload are conserved, and that vertex velocities start the body."""
    part = ms.RigidBody(END, mass=2e-3, inertia=(1e-8, 2e-8, 2.5e-8))
    scene = ms.Scene([strip(), part], allow_rigid_motions=True)
    turning = np.array([0.0, 3.0, 1.0])
    start = np.array([0.1, 0, 0]) + np.cross(turning, MESH.rest_positions)
    motion = ms.simulate(scene, steps=40, time_step=1e-3, velocities=start)
    assert motion[part].angular_velocity[0] == pytest.approx(turning)
    masses = scene.shell.vertex_masses
    momenta = np.einsum("v,nvc->nc", masses, motion.velocities) + 2e-3 * motion[part].velocity
    assert momenta == pytest.approx(
        np.broadcast_to(momenta[0], momenta.shape), abs=1e-6 * np.abs(momenta).max()
    )
    assert motion.energy == pytest.approx(motion.energy[0], rel=1e-2)


def test_rigid_bodies_with_common_faces_and_an_oblique_support():
    """Check matrix blocks between bodies, and beside nodes with local frames, through gradients of statics."""
    turn = Rotation.from_rotvec([0.4, -0.3, 0.7]).as_matrix()
    mesh = ms.TriangleMesh(MESH.rest_positions @ turn.T, MESH.faces)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    x, y = MESH.rest_positions[:, 0], MESH.rest_positions[:, 1]
    ids = [
        np.flatnonzero((np.abs(x - middle) < 0.0051) & (y > 0.0)) for middle in (0.05, 0.0625)
    ]  # columns 18 to 22, 23 to 27
    parts = [ms.RigidBody(each, mass=1e-4) for each in ids]
    held = [ms.Clamp(mesh.edges_where(lambda p: (p @ turn)[:, 0] < 1e-9)), ms.SymmetryPlane(turn[:, 1])]
    scene = ms.Scene([sheet, *parts], supports=held, gravity=turn @ [0.1, 0, -1.0])
    assert np.isin(mesh.faces, ids[0]).any(axis=1)[np.isin(mesh.faces, ids[1]).any(axis=1)].any()
    rest = ms.equilibrium(scene)
    small = ms.equilibrium(scene, gravity_factor=1e-4).displacements
    linear = ms.linear_response(scene, gravity_factor=1e-4).displacements
    assert linear == pytest.approx(small, abs=2e-4 * np.abs(small).max())
    assert rest.stable
    step = 1e-4
    mass = torch.tensor(1e-4, dtype=torch.float64, requires_grad=True)
    exact = {"solver": ms.MixedNewton(tolerance=1e-13)}
    (ms.equilibrium(scene, values={parts[1]: {"mass": mass}}, **exact).positions ** 2).sum().backward()
    above, below = (
        (
            ms.equilibrium(scene, values={parts[1]: {"mass": 1e-4 * (1 + sign * step)}}, **exact).positions
            ** 2
        ).sum()
        for sign in (1, -1)
    )
    assert (above - below) / (2 * step) == pytest.approx(1e-4 * float(mass.grad), rel=1e-6)


def test_a_part_of_a_solid():
    """Check that the rigid end keeps its shape and bends the bar as a force and a moment there do."""
    mesh = ms.meshes.box((0.1, 0.01, 0.01), cells=(10, 2, 2))
    bar = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3), mass_density=1.0)
    end = bar.mesh.vertices_where(lambda x: x[:, 0] > 0.0799)
    weight = ms.RigidBody(end, mass=1e-3, center=(0.09, 0.005, 0.005), body=bar)
    held = ms.Pin(bar.mesh.vertices_at(x=0.0))
    rest = ms.equilibrium(ms.Scene([bar, weight], supports=[held], gravity=(0, 0, -1.0)))
    before, after = bar.mesh.rest_positions[end], rest[bar].positions[end]
    assert np.allclose(pdist(after), pdist(before), rtol=0, atol=1e-15)
    force, arm, stiffness = (
        1e-3,
        0.08,
        1e6 * 0.01**4 / 12,
    )  # a beam up to the part, whose center is 0.01 beyond its end
    deflection = force * (arm**3 / 3 + 0.01 * arm**2 / 2) / stiffness
    edge = bar.mesh.nearest_vertex((0.08, 0.005, 0.005))
    assert -rest[bar].displacements[edge, 2] == pytest.approx(deflection, rel=0.04)
