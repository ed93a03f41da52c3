"""Properties of solves and motions that hold for any sheet: random meshes, loads and scales (see test_invariance too)."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

import magshell as ms

BENDINGS = st.sampled_from(["midedge", "hinge"])
SEEDS = st.integers(0, 10_000)
TIGHT = ms.MixedNewton(tolerance=1e-13)
some = settings(max_examples=12)


def random_mesh(seed: int) -> ms.TriangleMesh:
    """Return a Delaunay triangulation of random points in a slightly curved unit square, without slivers."""
    rng = np.random.default_rng(seed)
    points = [np.array(corner, float) for corner in ((0, 0), (0, 0.5), (0, 1), (1, 0), (1, 1))]
    while len(points) < 24:
        point = rng.random(2) * (0.9, 1.0) + (0.1, 0.0)
        if min(np.linalg.norm(point - other) for other in points) > 0.1:
            points.append(point)
    flat = np.array(points)
    faces = Delaunay(flat).simplices
    a, b = flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    faces = np.where((area > 0)[:, None], faces, faces[:, [0, 2, 1]])[np.abs(area) > 0.01]
    used, faces = np.unique(faces, return_inverse=True)
    x, y = flat[used].T
    return ms.TriangleMesh(np.stack([x, y, 0.1 * x * x - 0.05 * x * y], axis=1), faces.reshape(-1, 3))


def clamp(mesh: ms.TriangleMesh) -> ms.Clamp:
    return ms.Clamp(mesh.edges_between(mesh.vertices_at(x=0.0)))


def sheet(mesh: ms.TriangleMesh, bending="midedge", **changes) -> ms.Shell:
    given = {"thickness": 0.02, "young_modulus": 1e6, "poisson_ratio": 0.3, "mass_density": 1e3, **changes}
    return ms.Shell(mesh, bending=bending, **given)


def loads(mesh: ms.TriangleMesh, seed: int, strength: float = 1e-3) -> np.ndarray:
    return strength * np.random.default_rng(seed).normal(size=(mesh.n_vertices, 3))


def everywhere(mesh: ms.TriangleMesh, forces: np.ndarray) -> ms.PointLoad:
    return ms.PointLoad(np.arange(mesh.n_vertices), forces)


def moving(scene: ms.Scene, steps=10, time_step=2e-3, **options) -> ms.Trajectory:
    return ms.simulate(scene, steps=steps, time_step=time_step, solver=TIGHT, progress=False, **options)


def assert_close(got, expected, rel) -> None:
    assert np.abs(got - expected).max() <= rel * np.abs(expected).max()


# Statics


@some
@given(seed=SEEDS, bending=BENDINGS, a=st.floats(-10, 10), b=st.floats(-10, 10))
def test_linear_responses_superpose(seed, bending, a, b):
    mesh = random_mesh(seed)
    forces = [loads(mesh, seed + k) for k in (1, 2)]

    def response(force):
        scene = ms.Scene(sheet(mesh, bending), supports=[clamp(mesh)], loads=[everywhere(mesh, force)])
        return ms.linear_response(scene).displacements

    first, second = response(forces[0]), response(forces[1])
    both = response(a * forces[0] + b * forces[1])
    scale = abs(a) * np.abs(first).max() + abs(b) * np.abs(second).max()
    assert np.abs(both - a * first - b * second).max() <= 1e-9 * max(scale, 1e-12)


@some
@given(seed=SEEDS, bending=BENDINGS)
def test_the_response_is_the_limit_of_small_loads(seed, bending):
    mesh = random_mesh(seed)
    scene = ms.Scene(
        sheet(mesh, bending), supports=[clamp(mesh)], loads=[everywhere(mesh, loads(mesh, seed))]
    )
    linear = ms.linear_response(scene).displacements
    off = [
        np.abs(ms.equilibrium(scene, load_factor=t, solver=TIGHT).displacements / t - linear).max()
        for t in (1e-2, 1e-3)
    ]
    assert off[1] < 0.15 * off[0] + 1e-7 * np.abs(linear).max()


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
@some
@given(
    seed=SEEDS,
    ratio=st.floats(-0.9, 0.5),
    gradient=st.lists(st.floats(-0.2, 0.2), min_size=4, max_size=4),
)
def test_an_affine_boundary_makes_an_affine_sheet(seed, ratio, gradient):
    """Check the patch test on any mesh at large strain: every uniform stretch is an equilibrium in the plane."""
    curved = random_mesh(seed)
    flat = ms.TriangleMesh(curved.rest_positions * (1, 1, 0), curved.faces)
    deformed = flat.rest_positions.copy()
    deformed[:, :2] += flat.rest_positions[:, :2] @ np.reshape(gradient, (2, 2))
    rim = flat.boundary_vertices
    supports = [ms.Pin(np.arange(flat.n_vertices), "z")]
    supports += [ms.Pin([v], "xy", displacement=(deformed - flat.rest_positions)[v]) for v in rim]
    scene = ms.Scene(sheet(flat, poisson_ratio=ratio), supports=supports)
    inside = np.setdiff1d(np.arange(flat.n_vertices), rim)
    start = deformed.copy()
    start[inside, :2] += 1e-3 * np.random.default_rng(seed).normal(size=(len(inside), 2))
    found = ms.equilibrium(scene, start=start, require_stable=False)
    assert np.abs(found.positions - deformed).max() < 1e-8


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
@some
@given(seed=SEEDS, exponent=st.integers(-6, 6))
def test_solution_depends_on_the_product_of_magnetization_and_field(seed, exponent):
    mesh = random_mesh(seed)
    scene = ms.Scene(sheet(mesh), supports=[clamp(mesh)], field=ms.UniformField())
    magnetization = np.random.default_rng(seed).normal(size=(mesh.n_faces, 3)) * 1e4
    field, scale = np.array((1e-4, -2e-4, 3e-4)), 4.0**exponent
    here, there = (
        ms.equilibrium(scene, remanent_magnetization=magnetization * s, applied_flux_density=field / s)
        for s in (1.0, scale)
    )
    assert_close(there.positions, here.positions, 1e-12)


@pytest.mark.parametrize(
    ("seed", "heights"), [(891, (0.8, -0.6)), (1, (2.0, -1.5)), (3, (2.0, -1.5)), (7, (2.0, -1.5))]
)
def test_forces_of_several_fields_add_up(seed, heights):
    """Compare the magnetic force of two dipoles with the sum of those of each.

    Which faces sample a field finely depends on all fields, so that the forces differ where that is not the same. Each of
    the three is right to 0.1 % of its size as field_sampling.py defines it: that is the bound. They differ by 0.003 to
    0.012 % of that; with one sample a face up to an error of 1 % they differed by 0.4 to 0.6 % at the larger heights.
    """
    mesh = random_mesh(seed)
    dipoles = [ms.Dipoles([(0.5, 0.5, z)], [(0.1, 0.2, 1.0)]) for z in heights]
    magnetization = np.random.default_rng(seed).normal(size=(mesh.n_faces, 3)) * 1e4
    moments = 0.02 * mesh.face_areas[:, None] * magnetization

    def force_and_size(fields):
        scene = ms.Scene(sheet(mesh), supports=[clamp(mesh)], field=fields)
        force = ms.forces(scene, mesh.rest_positions, remanent_magnetization=magnetization).on_vertices.sum(
            axis=0
        )
        gradient = sum(each.gradient(mesh.face_barycenters) for each in fields)
        flux = sum(each.flux_density(mesh.face_barycenters) for each in fields)
        on_faces = np.linalg.norm(np.einsum("fij,fi->fj", gradient, moments), axis=1).sum()
        couples = np.linalg.norm(np.cross(moments, flux), axis=1).sum()
        return force, max(np.linalg.norm(force), 0.1 * on_faces, couples / scene._bodies.extent)

    together, *alone = [force_and_size(fields) for fields in (dipoles, dipoles[:1], dipoles[1:])]
    off = np.linalg.norm(together[0] - sum(force for force, _ in alone))
    assert off < 1e-3 * (together[1] + sum(size for _, size in alone))


@some
@given(seed=SEEDS, order=st.permutations(range(3)))
def test_the_order_of_a_scenes_parts_does_not_matter(seed, order):
    mesh = random_mesh(seed)
    top = mesh.vertices_where(lambda x: x[:, 0] > 0.9)
    parts = [clamp(mesh), ms.Pin(top, "z", displacement=(0, 0, 0.05)), ms.Pin(top, "y")]
    pulls = [everywhere(mesh, loads(mesh, seed + k)) for k in range(3)]

    def found(numbers):
        scene = ms.Scene(sheet(mesh), supports=[parts[k] for k in numbers], loads=[pulls[k] for k in numbers])
        return ms.equilibrium(scene).positions

    assert_close(found(order), found(range(3)), 1e-9)


# Motions


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@some
@given(seed=SEEDS, bending=BENDINGS, speed=st.tuples(*[st.floats(-3, 3)] * 3))
def test_motion_of_a_free_body_is_the_same_in_every_inertial_frame(seed, bending, speed):
    mesh = random_mesh(seed)
    scene = ms.Scene(sheet(mesh, bending), allow_rigid_motions=True)
    own = 0.3 * np.random.default_rng(seed).normal(size=(mesh.n_vertices, 3))
    here, there = (moving(scene, velocities=own + shift) for shift in ((0, 0, 0), speed))
    carried = here.positions + here.times[:, None, None] * np.array(speed)
    assert_close(there.positions, carried, 1e-8)


@some
@given(seed=SEEDS, mirror=st.sampled_from([(-1, 1, 1), (1, 1, -1), (-1, -1, -1)]))
def test_a_mirrored_motion_is_the_motion_of_the_mirrored_scene(seed, mirror):
    mesh, flip = random_mesh(seed), np.diag(mirror).astype(float)
    force = loads(mesh, seed, 1.0)
    mirrored = mesh.transformed(flip)
    held = mesh.edges_between(mesh.vertices_at(x=0.0))
    here, there = (
        moving(
            ms.Scene(sheet(m), supports=[ms.Clamp(held)], loads=[everywhere(m, f)], gravity=g),
            damping=1e-3,
            stiffness_damping=1e-4,
        )
        for m, f, g in ((mesh, force, (0.0, 1.0, -9.0)), (mirrored, force @ flip, flip @ (0.0, 1.0, -9.0)))
    )
    assert_close(there.positions, here.positions @ flip, 1e-9)


@some
@given(seed=SEEDS)
def test_numbering_does_not_matter_to_a_motion(seed):
    mesh = random_mesh(seed)
    rng = np.random.default_rng(seed)
    vertices, faces = rng.permutation(mesh.n_vertices), rng.permutation(mesh.n_faces)
    shuffled = ms.TriangleMesh(mesh.rest_positions[vertices], np.argsort(vertices)[mesh.faces[faces]])
    thickness, force = rng.uniform(0.01, 0.03, mesh.n_faces), loads(mesh, seed, 1.0)
    here = moving(
        ms.Scene(sheet(mesh, thickness=thickness), supports=[clamp(mesh)], loads=[everywhere(mesh, force)])
    )
    there = moving(
        ms.Scene(
            sheet(shuffled, thickness=thickness[faces]),
            supports=[clamp(shuffled)],
            loads=[everywhere(shuffled, force[vertices])],
        )
    )
    assert_close(there.positions, here.positions[:, vertices], 1e-9)


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")  # densities and moduli of any unit
@some
@given(
    seed=SEEDS,
    length=st.floats(1e-4, 1e4),
    modulus=st.floats(1e-3, 1e12),
    density=st.floats(1e-3, 1e6),
)
def test_units_do_not_matter_to_a_motion(seed, length, modulus, density):
    """Check scaling: with lengths by L, stresses by E and densities by R, times scale by L sqrt(R / E).

    Forces scale by E L^2, damping by E L t.
    """
    mesh = random_mesh(seed)
    force = loads(mesh, seed, 1.0)
    time = length * np.sqrt(density / modulus)
    assume(2e-3 * time > 1e-11)  # s: simulate refuses steps of 1e-12 s

    def motion(size, stress, mass, tick):
        scaled = mesh.scaled(size)
        shell = sheet(scaled, thickness=0.02 * size, young_modulus=1e6 * stress, mass_density=1e3 * mass)
        scene = ms.Scene(
            shell, supports=[clamp(scaled)], loads=[everywhere(scaled, force * stress * size**2)]
        )
        return moving(
            scene, time_step=2e-3 * tick, damping=1e-2 * stress * size * tick, stiffness_damping=1e-4 * tick
        )

    here, there = motion(1.0, 1.0, 1.0, 1.0), motion(length, modulus, density, time)
    assert_close(there.positions / length, here.positions, 1e-8)
    assert_close(there.energy / (modulus * length**3), here.energy, 1e-6)


@some
@given(seed=SEEDS, bending=BENDINGS)
def test_a_motion_run_backwards_comes_back_as_steps_get_shorter(seed, bending):
    """Check reversibility, which the equations have exactly and the integrators up to their order."""
    mesh = random_mesh(seed)
    scene = ms.Scene(sheet(mesh, bending), supports=[clamp(mesh)])
    slow = ms.vibration_modes(scene, count=2).modes[1]

    def missed(steps):
        there = moving(scene, steps=steps, time_step=0.04 / steps, velocities=0.3 * slow, record_every=steps)
        back = moving(
            scene,
            steps=steps,
            time_step=0.04 / steps,
            start=there.positions[-1],
            velocities=-there.velocities[-1],
            record_every=steps,
        )
        return np.abs(back.positions[-1] - mesh.rest_positions).max() / np.abs(there.displacements).max()

    coarse, fine = missed(40), missed(80)
    assert fine < 0.02 and fine < 0.5 * coarse + 1e-4


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@some
@given(
    seed=SEEDS,
    integrator=st.sampled_from([ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()]),
    damping=st.floats(0, 1.0),
)
def test_a_motion_without_drive_gains_no_energy(seed, integrator, damping):
    mesh = random_mesh(seed)
    scene = ms.Scene(sheet(mesh), supports=[clamp(mesh)])
    velocities = 0.5 * np.random.default_rng(seed).normal(size=(mesh.n_vertices, 3))
    move = moving(scene, steps=40, velocities=velocities, integrator=integrator, damping=damping)
    # Second-order schemes may exceed the true energy by their error, about the loss of one or two steps.
    slack = 0.0 if isinstance(integrator, ms.ImplicitEuler) else 0.05
    assert (move.energy <= (1.0 + slack) * move.energy[0] + 1e-12).all()
    assert move.energy[-1] < move.energy[0]


# Arrays


@some
@given(
    seed=SEEDS,
    layout=st.sampled_from(["fortran", "strided", "reversed", "list", "big-endian", "read-only", "subclass"]),
)
def test_the_layout_of_arrays_does_not_matter(seed, layout):
    mesh = random_mesh(seed)
    scene = ms.Scene(sheet(mesh), supports=[clamp(mesh)], field=ms.UniformField())
    magnetization = np.random.default_rng(seed).normal(size=(mesh.n_faces, 3)) * 1e4
    laid_out = {
        "fortran": np.asfortranarray(magnetization),
        "strided": np.repeat(magnetization, 2, axis=0)[::2],
        "reversed": magnetization[::-1].copy()[::-1],
        "list": magnetization.tolist(),
        "big-endian": magnetization.astype(">f8"),
        "read-only": np.broadcast_to(magnetization, magnetization.shape),
        "subclass": magnetization.view(np.recarray),
    }[layout]
    here, there = (
        ms.equilibrium(scene, remanent_magnetization=m, applied_flux_density=(0, 0, 1e-3)).positions
        for m in (magnetization, laid_out)
    )
    np.testing.assert_array_equal(there, here)


@pytest.mark.parametrize("seed", range(20))
def test_random_meshes_are_meshes(seed):
    mesh = random_mesh(seed)
    assert mesh.n_components == 1 and mesh.n_faces > 15
