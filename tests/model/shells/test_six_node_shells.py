"""Shells of six-node elements: everything that shells do, and refused input."""

import numpy as np
import pytest

import magshell as ms

LENGTH, WIDTH, THICKNESS, MODULUS = 0.1, 0.02, 1e-3, 1e6


def strip(cells=(4, 1), nu=0.0, **values):
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells, order=2)
    return ms.Shell(mesh, thickness=THICKNESS, young_modulus=MODULUS, poisson_ratio=nu, **values)


def arch(**values):
    mesh = ms.meshes.cylinder(0.05, 0.02, angle=1.2, cells=(4, 2), irregular=0.2, order=2)
    return ms.Shell(mesh, thickness=THICKNESS, young_modulus=MODULUS, poisson_ratio=0.3, **values)


def clamped(sheet, **more):
    return ms.Scene(sheet, supports=[ms.Clamp(sheet.mesh.edges_at(x=0.0))], **more)


def rotation(vector):
    x, y, z = vector
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = np.linalg.norm(vector)
    return np.eye(3) + np.sin(a) / a * k + (1 - np.cos(a)) / a**2 * k @ k


def test_bending_follows_from_the_mesh_by_default():
    sheet = strip()
    assert sheet.bending == "midedge2" and "8 six-node elements" in repr(sheet)
    assert ms.Shell(sheet.mesh.first_order(), thickness=1e-3, young_modulus=1e6).bending == "midedge"


def test_rigid_motions_have_no_energy():
    sheet = arch()
    scene = ms.Scene(sheet, allow_rigid_motions=True)
    moved = sheet.mesh.rest_positions @ rotation((0.4, -1.0, 0.7)).T + (1.0, 2.0, 3.0)
    scale = MODULUS * THICKNESS * sheet.mesh.element_areas.sum()
    assert sum(ms.energies(scene, positions=moved).values()) < 1e-14 * scale


def test_constant_strain_is_exact_on_irregular_meshes():
    """Check the patch test: linear displacements and the energy of their Green strain."""
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(3, 3), irregular=0.25, order=2)
    sheet = ms.Shell(mesh, thickness=0.1, young_modulus=2.0, poisson_ratio=0.3)
    gradient = np.array([[1.1, 0.05, 0], [-0.02, 0.95, 0], [0, 0, 1.0]])
    at_border = mesh.boundary_vertices
    pulled = mesh.rest_positions @ gradient.T
    border = [ms.Pin([v], displacement=pulled[v] - mesh.rest_positions[v]) for v in at_border]
    found = ms.equilibrium(ms.Scene(sheet, supports=border))
    assert found.positions == pytest.approx(pulled, abs=1e-10)
    strain = 0.5 * (gradient.T @ gradient - np.eye(3))[:2, :2]
    law = 2.0 / (1 - 0.09) * (0.7 * strain + 0.3 * np.trace(strain) * np.eye(2))
    assert found.energies["membrane"] == pytest.approx(0.5 * 0.1 * np.sum(law * strain), rel=1e-10)
    strains = found.strains()
    assert strains.membrane == pytest.approx(
        np.tile(np.linalg.eigvalsh(strain)[::-1], (mesh.n_faces, 1)), abs=1e-9
    )
    assert np.abs(strains.bending).max() < 1e-9


def test_values_may_be_given_per_element():
    """Compare a strip whose one half is twice as thick with beam theory."""
    mesh = strip((8, 1)).mesh
    thick = mesh.element_centers[:, 0] < 0.5 * LENGTH
    sheet = ms.Shell(
        mesh,
        thickness=np.where(thick, 2e-3, 1e-3),
        young_modulus=MODULUS,
        poisson_ratio=0.0,
        mass_density=1e3,
    )
    force = 1e-6
    scene = clamped(sheet, loads=[ms.EdgeLoad(mesh.edges_at(x=LENGTH), (0, 0, force / WIDTH))])
    end = ms.linear_response(scene).displacements[mesh.vertices_at(x=LENGTH), 2].mean()
    stiffness = MODULUS * WIDTH * THICKNESS**3 / 12
    half = LENGTH / 2
    beam = force / stiffness * (half**3 / 3 + (LENGTH**3 - half**3) / 3 / 8)
    assert end == pytest.approx(beam, rel=1e-6)
    assert sheet.vertex_masses.sum() == pytest.approx(1e3 * WIDTH * half * 3e-3)
    assert sheet._weighed_masses.sum() == pytest.approx(sheet.vertex_masses.sum())
    assert (sheet.vertex_masses > 0).all()
    _, masses = sheet.element_masses
    assert masses.sum() == pytest.approx(sheet.vertex_masses.sum())


def test_weight_and_area_loads_are_the_same():
    """Compare weight with an area load, and the deflection of a cantilever with q L^4 / (8 EI)."""
    sheet = strip(mass_density=1e3)
    heavy = ms.linear_response(clamped(sheet, gravity=(0, 0, -1e-3)))
    loaded = ms.linear_response(clamped(sheet, loads=[ms.AreaLoad((0, 0, -1e-3 * 1e3 * THICKNESS))]))
    assert heavy.displacements == pytest.approx(loaded.displacements, abs=1e-15)
    end = heavy.displacements[sheet.mesh.vertices_at(x=LENGTH), 2]
    assert end == pytest.approx(
        -1e-3 * LENGTH**4 * 1e3 * THICKNESS / (8 * MODULUS * THICKNESS**3 / 12), rel=1e-3
    )


def test_cantilever_has_the_frequencies_of_beam_theory():
    """Compare with 3.516 and 22.03 sqrt(EI / m L^4)."""
    unit = np.sqrt(MODULUS * THICKNESS**2 / (12 * 1e3)) / (2 * np.pi * LENGTH**2)
    for mass, precision in (("consistent", 2e-3), ("lumped", 4e-3)):
        found = ms.vibration_modes(clamped(strip((10, 1), mass_density=1e3)), count=2, mass=mass)
        assert found.frequencies[:2] == pytest.approx(np.array([3.516, 22.03]) * unit, rel=precision)
        assert found.edge_rotations.shape == (2, 2 * found.scene.mesh.n_edges)


def test_motion_keeps_its_energy():
    sheet = strip(mass_density=1e3)
    n_v = sheet.mesh.n_vertices
    scene = clamped(sheet)
    first = ms.vibration_modes(scene, count=1)
    speed = 0.01 * first.modes[0]
    assert speed.shape == (n_v, 3)
    period = 1.0 / first.frequencies[0]
    motion = ms.simulate(
        scene, time_step=period / 80, steps=60, velocities=speed, integrator=ms.TRBDF2(), progress=False
    )
    total = motion.kinetic_energy + sum(motion.energies.values())
    assert total[0] * 0.99 < total[-1] <= total[0] * (1 + 1e-6)
    assert motion.energies["bending"].max() > 0.5 * total[0]


def test_magnetization_may_be_given_per_element():
    """Check that a field bends only the magnetized half: its moments are dead, as forces in pairs."""
    sheet = strip((4, 1))
    mesh = sheet.mesh
    moment = np.where(mesh.element_centers[:, :1] > 0.5 * LENGTH, 1e5, 0.0) * (1, 0, 0)
    scene = clamped(sheet, field=ms.UniformField())
    found = ms.equilibrium(scene, remanent_magnetization=moment, applied_flux_density=(0, 0, 1e-4))
    pull = 1e5 * 1e-4 * THICKNESS
    middle = mesh.edges_at(x=0.5 * LENGTH)
    loads = [
        ms.EdgeLoad(mesh.edges_at(x=LENGTH), (0, 0, pull)),
        ms.EdgeLoad(middle, (0, 0, -pull)),
    ]
    forced = ms.equilibrium(clamped(sheet, loads=loads))
    assert found.positions == pytest.approx(forced.positions, abs=1e-12)
    assert found[sheet].remanent_magnetization.shape == (mesh.n_elements, 3)
    with pytest.raises(ValueError, match=r"\(8, 3\)"):
        ms.equilibrium(scene, remanent_magnetization=np.ones((32, 3)), applied_flux_density=(0, 0, 1e-4))


def test_a_curved_magnet_in_its_own_field():
    """Compare the force on a normal magnetization in a nonuniform field with differences of the energy."""
    sheet = arch(remanent_magnetization=(1e4, 2e4, -1e4))
    source = ms.Dipoles([[0.02, 0.0, 0.12]], [[0.3, -0.4, 0.5]])
    scene = ms.Scene(sheet, field=source, allow_rigid_motions=True)
    rng = np.random.default_rng(1)
    at = sheet.mesh.rest_positions + 1e-3 * rng.standard_normal(sheet.mesh.rest_positions.shape)
    along = rng.standard_normal(at.shape)
    model, load_parameters = scene._model, _with_field(scene)

    def state(positions):
        return model.state(positions, np.zeros(scene._bodies.n_rotations))

    # The core's energy has the points of its force; that of ms.energies may be sampled finely.
    step = 1e-7
    above, below = (model.energy(state(at + s * step * along), load_parameters) for s in (1, -1))
    slope = (above - below) / (2 * step)
    assert model.gradient(state(at), load_parameters) @ model.full_vector(along) == pytest.approx(
        slope, rel=1e-6
    )


def _with_field(scene):
    load_parameters = scene._load_parameter_layout.zeros()
    return scene._load_parameter_layout.packed({("scene", "field_factor"): 1.0}, load_parameters)


def test_stress_of_a_bent_strip():
    """Check a strip whose clamps are rotated into an arc: M = EI kappa and no membrane force everywhere."""
    sheet, angle = strip((6, 1)), 0.5
    far = ms.Clamp(
        sheet.mesh.edges_at(x=LENGTH),
        rotation=(0, angle, 0),
        center=(LENGTH, WIDTH / 2, 0),
        displacement=(
            LENGTH * (np.sin(angle) / angle - 1),
            0,
            -LENGTH * (1 - np.cos(angle)) / angle,
        ),
    )
    bent = ms.equilibrium(ms.Scene(sheet, supports=[ms.Clamp(sheet.mesh.edges_at(x=0.0)), far]))
    stresses = bent[sheet].stresses()
    moment = MODULUS * THICKNESS**3 / 12 * angle / LENGTH
    assert stresses.bending_moments.shape == (sheet.mesh.n_faces, 2, 2)
    assert stresses.principal_bending_moments == pytest.approx(
        np.tile((0.0, -moment), (sheet.mesh.n_faces, 1)), abs=3e-3 * moment
    )
    assert bent[sheet].strains().bending.min() == pytest.approx(-0.5 * THICKNESS * angle / LENGTH, rel=3e-3)
    work = 0.5 * moment * angle * WIDTH
    assert bent.energies["bending"] == pytest.approx(work, rel=1e-3)


def test_scene_with_a_sheet_of_three_nodes_has_both_results():
    """Check that each body has its own rows, whatever its order in the scene."""
    six, flat = (
        strip(mass_density=1e3),
        ms.Shell(
            ms.meshes.rectangle(LENGTH, WIDTH, cells=(4, 1)).transformed(translation=(0, 0, 0.05)),
            thickness=THICKNESS,
            young_modulus=MODULUS,
            poisson_ratio=0.0,
            mass_density=1e3,
        ),
    )
    supports = [ms.Clamp(body.mesh.edges_at(x=0.0), body=body) for body in (six, flat)]
    couple = [ms.EdgeCouple(body.mesh.edges_at(x=LENGTH), (0, 1e-5, 0), body=body) for body in (six, flat)]
    both = ms.equilibrium(ms.Scene([six, flat], supports=supports, loads=couple, gravity=(0, 0, -0.1)))
    for body, support, load in zip((six, flat), supports, couple, strict=True):
        alone = ms.equilibrium(
            ms.Scene(
                body,
                supports=[ms.Clamp(support.edges)],
                loads=[ms.EdgeCouple(load.edges, (0, 1e-5, 0))],
                gravity=(0, 0, -0.1),
            )
        )
        assert both[body].positions == pytest.approx(alone.positions, abs=1e-10)
        assert both[body].edge_rotations == pytest.approx(alone.edge_rotations, abs=1e-8)
        assert both[body].strains().bending == pytest.approx(alone.strains().bending, abs=1e-9)
        assert both[body].stresses().bending_moments == pytest.approx(
            alone[body].stresses().bending_moments, abs=1e-9
        )


def test_welded_halves_stretch_as_one_strip():
    """Compare two welded halves of a stretched strip with one strip."""
    halves = [
        ms.Shell(
            ms.meshes.rectangle(0.5 * LENGTH, WIDTH, cells=(2, 1), order=2).transformed(
                translation=(0.5 * LENGTH * k, 0, 0)
            ),
            thickness=THICKNESS,
            young_modulus=MODULUS,
            poisson_ratio=0.3,
        )
        for k in range(2)
    ]
    a, b = halves
    supports = [
        ms.Pin(a.mesh.vertices_at(x=0.0), body=a),
        ms.Pin(b.mesh.vertices_at(x=LENGTH), displacement=(1e-3, 0, 0), body=b),
    ]
    tied = ms.equilibrium(ms.Scene(halves, ties=[ms.Tie(a, b)], supports=supports))
    whole = strip(nu=0.3)
    ends = [
        ms.Pin(whole.mesh.vertices_at(x=0.0)),
        ms.Pin(whole.mesh.vertices_at(x=LENGTH), displacement=(1e-3, 0, 0)),
    ]
    one = ms.equilibrium(ms.Scene(whole, supports=ends))
    assert tied.energies["membrane"] == pytest.approx(one.energies["membrane"], rel=1e-10)


def test_six_node_sheet_rests_on_a_floor():
    """Check that contact with a floor carries the full weight."""
    sheet = strip(mass_density=1e3)
    floor = ms.Contact(ms.obstacles.Plane((0, 0, 1), center=(0, 0, -2e-3)), contact_stiffness=1.0)
    side = ms.Pin(sheet.mesh.vertices_at(x=0.0), "xy")
    rest = ms.equilibrium(
        ms.Scene(sheet, supports=[side], contacts=[floor], gravity=(0, 0, -9.81), allow_rigid_motions=True)
    )
    assert rest.positions[:, 2].max() < -1.5e-3


def test_pictures_and_files(tmp_path):
    pytest.importorskip("meshio")
    sheet = strip(mass_density=1e3, remanent_magnetization=(1e4, 0, 0))
    rest = ms.equilibrium(clamped(sheet, field=ms.UniformField()), applied_flux_density=(0, 0, 1e-4))
    ms.plot(rest, color="von_mises_stress").save(tmp_path / "a.png")
    ms.write_series(tmp_path / "a.pvd", rest)
    written = ms.read_mesh(next((tmp_path / "a").glob("*.vtu")))
    assert written.n_faces == sheet.mesh.n_faces
    ms.write_page(rest, tmp_path / "a.html")


REFUSED = [
    ("needs a mesh of six-node elements", lambda flat, six: ms.Shell(flat, bending="midedge2", **STUFF)),
    ("is for meshes of flat faces", lambda flat, six: ms.Shell(six, bending="hinge", **STUFF)),
    ("is for meshes of flat faces", lambda flat, six: ms.Shell(six, bending="midedge", **STUFF)),
    ("curvature_scale", lambda flat, six: ms.Shell(six, curvature_scale=2.0, **STUFF)),
    (
        r"thickness \[m\] must be a number or have shape \(n,\) = \(8,\)",
        lambda flat, six: ms.Shell(six, thickness=np.ones(32), young_modulus=1e6),
    ),
    (
        "hold the ends of 4 edges of six-node elements",
        lambda flat, six: ms.Scene(ms.Shell(six, **STUFF), supports=[ms.Pin(flat.vertices_at(y=0.0))]),
    ),
]
STUFF = {"thickness": 1e-3, "young_modulus": 1e6}


@pytest.mark.parametrize("message, make", REFUSED)
def test_bad_six_node_shells_are_refused(message, make):
    flat = ms.meshes.rectangle(LENGTH, WIDTH, cells=(4, 1))
    with pytest.raises(ValueError, match=message):
        make(flat, strip().mesh)


def test_curvature_scale_is_no_value_of_six_node_shells():
    scene = clamped(strip(), loads=[ms.AreaLoad((0, 0, 1e-3))])
    with pytest.raises(ValueError, match="curvature_scale"):
        ms.equilibrium(scene, curvature_scale=2.0)
