"""Magnetized solids against exact answers (validation/bodies.json M2, M3a), stiff skins, water on solids, bad input."""

import numpy as np
import pytest

import magshell as ms

SOFT = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)
PLATE = (1.0, 0.25, 0.02)
FLUX = (0.3, 0.5, 0.8)


def magnetic_energy(scene, positions):
    model, layout = scene._model, scene._load_parameter_layout
    load_parameters = layout.packed({("scene", "applied_flux_density"): np.array(FLUX)}, layout.zeros())
    rotations = np.zeros_like(model.edge_rotations(model.rest_state()))
    return model.energies(model.state(positions, rotations), load_parameters)["magnetic"]


def bent(points, curvature):
    """Return the points bent from one end on, with straight unit normals."""
    x, y, z = points.T
    angle = curvature * x
    return np.stack(
        [np.sin(angle) * (1 / curvature - z), y, (1 - np.cos(angle)) / curvature + z * np.cos(angle)], axis=1
    )


def twisted(points, twist):
    """Return the points twisted about the axis; lines across the plate stay perpendicular to it."""
    x, y, z = points.T
    cosine, sine = np.cos(twist * x), np.sin(twist * x)
    return np.stack([x, y * cosine - z * sine, y * sine + z * cosine], axis=1)


PI = 3.141592654
# M2 by deformation and its size, magnetization, cells along, four times those across: energies of the volume and of the
# shell. Rows of two and of six layers are the same.
LAYERS = {
    (bent, 1.0, "x", 32): (-0.003100997254, -0.003100997254),
    (bent, 1.0, "y", 32): (-0.0025, -0.0025),
    (bent, 1.0, "z", 32): (-0.002676119594, -0.002676446302),
    (bent, 1.0, "z", 64): (-0.002676282948, -0.002676364623),
    (bent, PI, "x", 32): (-0.002546479089, -0.002546479089),
    (bent, PI, "y", 32): (-0.0025, -0.0025),
    (bent, PI, "z", 32): (0.0009541625449, 0.0009553132616),
    (bent, PI, "z", 64): (0.0009547379033, 0.0009550255391),
    (twisted, 1.0, "x", 32): (-0.0015, -0.0015),
    (twisted, 1.0, "y", 32): (-0.003942147394, -0.003942147394),
    (twisted, 1.0, "z", 32): (-0.00221645931, -0.002210553146),
    (twisted, PI, "x", 32): (-0.0015, -0.0015),
    (twisted, PI, "y", 32): (-0.002544433453, -0.002544433453),
    (twisted, PI, "z", 32): (0.001590270908, 0.001551084985),
    (twisted, PI, "z", 64): (0.001591229839, 0.00155270535),
}


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
@pytest.mark.parametrize("case", LAYERS, ids=lambda case: "{} {} {} {}".format(case[0].__name__, *case[1:]))
def test_energy_of_a_deformed_plate_in_layers_and_as_a_shell(case):
    deform, size, axis, cells = case
    volume, shell = LAYERS[case]
    along = np.array([float(each == axis) for each in "xyz"])
    middle = np.array([0.0, PLATE[1] / 2, PLATE[2] / 2])
    for layers in (2, 6) if cells == 32 else (2,):
        mesh = ms.meshes.box(PLATE, cells=(cells, cells // 4, layers))
        solid = ms.Solid(mesh, material=SOFT, element="linear", remanent_magnetization=along)
        scene = ms.Scene(solid, field=ms.UniformField(), allow_rigid_motions=True)
        at = mesh.rest_positions - mesh.rest_positions.min(axis=0) - middle
        assert magnetic_energy(scene, deform(at, size)) == pytest.approx(volume, rel=2e-9)
    flat = ms.meshes.rectangle(*PLATE[:2], cells=(cells, cells // 4), diagonals="aligned")
    sheet = ms.Shell(flat, thickness=PLATE[2], young_modulus=1e5, remanent_magnetization=along)
    thin = ms.Scene(sheet, field=ms.UniformField(), allow_rigid_motions=True)
    at = flat.rest_positions - flat.rest_positions.min(axis=0) - middle * (1, 1, 0)
    assert magnetic_energy(thin, deform(at, size)) == pytest.approx(shell, rel=2e-9)


@pytest.mark.parametrize(
    ("g", "x", "y"), [(0.5, 0.9665630825, 0.2213158696), (2.0, 0.8323702576, 0.4709996116)]
)
def test_beam_with_opposite_skins(g, x, y):
    """Check case M3a: constant curvature; the tip of the beam's axis, within 2 % of its length."""
    length, side, modulus, thickness, flux = 0.1, 0.01, 1e5, 1e-4, 0.02
    mesh = ms.meshes.box((length, side, side), cells=(20, 2, 2))
    low, high = mesh.rest_positions.min(axis=0), mesh.rest_positions.max(axis=0)
    faces = np.concatenate([mesh.faces_at(z=high[2]), mesh.faces_at(z=low[2])])
    strength = g * modulus * side**3 / 12 / (flux * side * length * thickness)
    along = np.where(np.arange(len(faces)) < len(faces) // 2, strength, -strength)
    skin = ms.Skin(
        thickness=thickness, faces=faces, remanent_magnetization=along[:, None] * np.array([1.0, 0, 0])
    )
    solid = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=modulus, poisson_ratio=0.0), skin=skin)
    root = np.flatnonzero(solid.mesh.rest_positions[:, 0] < low[0] + 1e-9)
    scene = ms.Scene(solid, supports=[ms.Pin(root)], field=ms.UniformField())
    found = ms.equilibrium(scene, applied_flux_density=(flux, 0, 0))
    tip = np.argmin(np.linalg.norm(solid.mesh.rest_positions - [high[0], *(low + high)[1:] / 2], axis=1))
    place = (found.positions[tip] - [low[0], 0, (low + high)[2] / 2]) / length
    assert abs(place[0] - x) < 0.02
    assert abs(abs(place[2]) - y) < 0.02


def test_a_stiff_skin_is_a_shell_tied_to_the_surface():
    """Compare two stiff layers on a soft core with the deflection of a sandwich beam, EI + 2 E_s b t (H/2)^2."""
    length, side, thickness, stiff = 0.2, 0.01, 1e-4, 2e6
    mesh = ms.meshes.box((length, side, side), cells=(20, 1, 2))
    core = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.0))
    coat = ms.Shell(
        core.mesh.surface,
        thickness=np.where(np.abs(core.mesh.surface.face_normals[:, 2]) > 0.5, thickness, 1e-8),
        young_modulus=stiff,
        poisson_ratio=0.0,
    )
    x = core.mesh.rest_positions
    root, end = (np.flatnonzero(np.abs(x[:, 0] - at) < 1e-9) for at in (x[:, 0].min(), x[:, 0].max()))
    force = 1e-6
    scene = ms.Scene(
        [core, coat],
        ties=[ms.Tie(core, coat)],
        supports=[ms.Pin(root, body=core)],
        loads=[ms.PointLoad(end, force=(0, 0, force / len(end)), body=core)],
    )
    found = ms.equilibrium(scene)
    rigidity = 1e5 * side**4 / 12 + 2 * stiff * side * thickness * (side / 2) ** 2
    assert found[core].displacements[end, 2].mean() == pytest.approx(
        force * length**3 / (3 * rigidity), rel=0.03
    )


def test_water_on_a_solid_is_that_on_a_shell_around_it():
    """Compare a block in a stream with a closed sheet of the same faces."""
    mesh = ms.meshes.box((0.02, 0.02, 0.02), cells=(1, 1, 1))
    solid = ms.Solid(mesh, material=SOFT, element="linear", mass_density=1e3)
    water = ms.Water(1000.0, (0.3, 0.1, -0.2))
    forces = []
    for scene in (
        ms.Scene(solid, water=water, allow_rigid_motions=True),
        ms.Scene(
            ms.Shell(solid.mesh.surface, thickness=1e-3, young_modulus=1e5, mass_density=1e3),
            water=water,
            allow_rigid_motions=True,
        ),
    ):
        motion = ms.simulate(scene, steps=1, time_step=1e-6, integrator=ms.ImplicitEuler())
        forces.append((scene._values.vertex_masses[:, None] * motion.velocities[-1] / 1e-6).sum(axis=0))
    assert np.linalg.norm(forces[0]) > 1e-3
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-3)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_a_solid_on_a_floor_is_carried_by_it(element):
    """Check that the contact springs of the vertices on its underside carry its weight; inner vertices have no
    contact.
    """
    mesh = ms.meshes.box((0.02, 0.02, 0.02), cells=(2, 2, 2))
    stiff = ms.NeoHookean(young_modulus=1e9, poisson_ratio=0.3)
    solid = ms.Solid(mesh, material=stiff, mass_density=1e3, element=element)
    low = solid.mesh.rest_positions.min(axis=0)
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, low[2])), contact_stiffness=100.0)
    scene = ms.Scene(solid, contacts=[floor], gravity=(0, 0, -9.81), allow_rigid_motions=True)
    motion = ms.simulate(scene, steps=400, time_step=1e-3, integrator=ms.ImplicitEuler())
    bottom = np.flatnonzero(np.abs(solid.mesh.rest_positions[:, 2] - low[2]) < 1e-9)
    depths = low[2] - motion.positions[-1][bottom, 2]
    smoothing = floor._law(solid)[1]
    carried = 100.0 * np.where(depths > smoothing, depths - smoothing / 2, depths**2 / (2 * smoothing)).sum()
    assert carried == pytest.approx(8e-6 * 1e3 * 9.81, rel=1e-3)


def skinned(**skin):
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(2, 1, 1))
    return ms.Solid(mesh, material=SOFT, skin=ms.Skin(**{"thickness": 1e-3, **skin}))


def solved(solid, values=None, field=True, **given):
    held = ms.Pin(np.flatnonzero(solid.mesh.rest_positions[:, 0] < 1e-9))
    scene = ms.Scene(solid, supports=[held], field=ms.UniformField() if field else None)
    return ms.equilibrium(
        scene, applied_flux_density=(0, 0, 1e-3), values=None if values is None else values(solid), **given
    )


ALONG = (1e4, 0.0, 0.0)


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: skinned(faces=[20]), "on faces of the solid's surface, which are 0 to 19, got 20"),
        (lambda: skinned(faces=[-1]), "on faces of the solid's surface"),
        (lambda: skinned(faces=[1, 1]), "must not repeat"),
        (lambda: skinned(thickness=-1e-3), "must be positive"),
        (lambda: skinned(thickness=[1e-3] * 3), r"\(k,\) = \(20,\)"),
        (lambda: skinned(faces=[0, 2], remanent_magnetization=np.zeros((3, 3))), r"\(n_f, 3\) = \(2, 3\)"),
        (lambda: solved(skinned()), "of its skin, .* is needed"),
        (
            lambda: solved(skinned(remanent_magnetization=ALONG), field=False),
            "has a skin, but the scene has no field",
        ),
        (
            lambda: solved(skinned(faces=[0]), remanent_magnetization=np.ones((80, 3))),
            "face 4 must be zero: it is of a Solid that has no skin there",
        ),
        (
            lambda: solved(ms.Solid(skinned().mesh, material=SOFT), remanent_magnetization=ALONG),
            "no Shell, and no Solid with a skin",
        ),
        (
            lambda: solved(skinned(), lambda s: {s: {"remanent_magnetization": ALONG}}),
            "Solid has no value 'remanent_magnetization'",
        ),
        (
            lambda: ms.Solid(skinned().mesh, material=SOFT, remanent_magnetization=np.zeros((2, 3))),
            r"must have shape \(n_t, 3\)",
        ),
        (lambda: ms.Solid(skinned().mesh, material=SOFT, skin=1e-3), "skin must be a Skin"),
    ],
)
def test_bad_input_is_refused(act, words):
    with pytest.raises(ValueError, match=words):
        act()


def test_magnetization_of_all_faces_equals_that_of_the_skin():
    solid = skinned(faces=[3, 5])
    by_skin = solved(solid, lambda s: {s.skin: {"remanent_magnetization": ALONG}})
    of_faces = np.zeros((solid.mesh.n_faces, 3))
    of_faces[solid.skin.faces] = ALONG
    by_faces = solved(solid, remanent_magnetization=of_faces)
    own = solved(skinned(faces=[3, 5], remanent_magnetization=ALONG))
    for other in (by_faces, own):
        np.testing.assert_array_equal(by_skin.positions, other.positions)
        np.testing.assert_array_equal(other.remanent_magnetization, of_faces)
    assert np.abs(by_skin.displacements).max() > 0
