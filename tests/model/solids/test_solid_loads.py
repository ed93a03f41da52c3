"""Consistent loads of solids: patch test, curved faces and elements, case T3 of the validation set."""

import numpy as np
import pytest

import magshell as ms
from magshell.mesh.tetrahedra.jacobian import shape_gradients, shape_values

E = 1e5
# T3: Poisson's ratio 0, E/4 (I1 - 3) - E/2 ln J. End load: traction over E, stretch; weight: rho g L / E, length over L.
END_LOAD = [
    (-0.5, 0.6180339887),
    (-0.2, 0.8198039027),
    (0.05, 1.05124922),
    (0.2, 1.219803903),
    (0.5, 1.618033989),
    (1.0, 2.414213562),
]
HANGING = [(0.1, 1.051664176), (0.5, 1.290228819), (1.0, 1.647793575), (2.0, 2.478942858)]
STANDING = [(0.1, 0.9516641756), (0.5, 0.7902288194), (1.0, 0.6477935747)]


def bar(cells, element="quadratic", diagonals="crossed") -> ms.Solid:
    mesh = ms.meshes.box((1.0, 0.1, 0.1), cells=cells, diagonals=diagonals)
    material = ms.NeoHookean(young_modulus=E, poisson_ratio=0.0)
    return ms.Solid(mesh, material=material, element=element, mass_density=1e3)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize(("load", "stretch"), END_LOAD)
def test_t3_end_load(load, stretch, element):
    solid = bar((8, 1, 1), element)
    end = np.flatnonzero(solid.mesh.face_barycenters[:, 0] > 1 - 1e-9)
    # At half its length it would rather buckle.
    aside = ms.Pin(np.setdiff1d(np.arange(solid.mesh.n_vertices), solid.mesh.vertices_at(x=0.0)), "yz")
    supports = [ms.Pin(solid.mesh.vertices_at(x=0.0)), *([aside] if load < 0 else [])]
    loads = [ms.AreaLoad((load * E, 0, 0), faces=end)]
    rest = ms.equilibrium(ms.Scene(solid, supports=supports, loads=loads))
    expected = solid.mesh.rest_positions * (stretch, 1, 1)
    assert np.allclose(rest.positions, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("load", "length"), HANGING)
def test_hanging_bar_has_the_length_of_t3(load, length):
    """Check all of the lower end to 1e-6, with 8 cells along up to a = 0.5 and 16 always.

    Cells all cut the same way would be 30 times worse: their asymmetry bends the end.
    """
    weighed = load * E / 1e3
    for cells in (8, 16) if load <= 0.5 else (16,):
        solid = bar((cells, 1, 1))
        root = [ms.Pin(solid.mesh.vertices_at(x=0.0))]
        rest = ms.equilibrium(ms.Scene(solid, supports=root, gravity=(weighed, 0, 0)))
        end = rest.positions[solid.mesh.vertices_at(x=1.0), 0]
        assert np.allclose(end, length, rtol=1e-6)


@pytest.mark.parametrize(("load", "length"), STANDING)
def test_standing_bar_has_the_length_of_t3(load, length):
    solid = bar((16, 1, 1))
    inside = np.setdiff1d(np.arange(solid.mesh.n_vertices), solid.mesh.vertices_at(x=0.0))
    supports = [ms.Pin(solid.mesh.vertices_at(x=0.0)), ms.Pin(inside, "yz")]
    rest = ms.equilibrium(ms.Scene(solid, supports=supports, gravity=(-load * E / 1e3, 0, 0)))
    assert np.allclose(rest.positions[solid.mesh.vertices_at(x=1.0), 0], length, rtol=2e-6)


def test_t3_linear_elements_hang_to_1e_3_with_32_cells():
    solid = bar((32, 1, 1), "linear")
    root = [ms.Pin(solid.mesh.vertices_at(x=0.0))]
    rest = ms.equilibrium(ms.Scene(solid, supports=root, gravity=(0.5 * E / 1e3, 0, 0)))
    assert np.allclose(rest.positions[solid.mesh.vertices_at(x=1.0), 0], 1.290228819, rtol=1e-3)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_patch_under_tractions_all_around(element):
    """Check an irregular block under the nominal tractions of a homogeneous state, one per face, to 1e-10."""
    mesh = ms.meshes.box((1.0, 1.0, 1.0), cells=(2, 2, 2))
    x = np.array(mesh.rest_positions)
    inside = np.setdiff1d(np.arange(mesh.n_vertices), mesh.surface_vertices)
    x[inside] += np.random.default_rng(3).uniform(-0.12, 0.12, (len(inside), 3))
    law = {"young_modulus": E, "poisson_ratio": 0.3}
    patch = ms.TetMesh(x, mesh.tetrahedra)
    solid = ms.Solid(patch, material=ms.StVenantKirchhoff(**law), element=element)
    to = np.array([[1.15, 0.1, 0.0], [0.0, 1.05, -0.08], [0.06, 0.0, 1.1]])
    green = 0.5 * (to.T @ to - np.eye(3))
    shear, lame = E / 2.6, E * 0.3 / (1.3 * 0.4)
    nominal = to @ (2 * shear * green + lame * np.trace(green) * np.eye(3))
    tractions = ms.AreaLoad(solid.mesh.face_normals @ nominal.T)
    low = solid.mesh.rest_positions.min(axis=0)
    corners = [int(solid.mesh.nearest_vertex(low + p)) for p in ((0, 0, 0), (1, 0, 0), (0, 1, 0))]
    ends = solid.mesh.rest_positions @ to.T
    pins = [
        ms.Pin([corner], components, displacement=np.where([c in components for c in "xyz"], move, 0.0))
        for corner, components in zip(corners, ("xyz", "yz", "z"), strict=True)
        for move in [(ends - solid.mesh.rest_positions)[corner]]
    ]
    rest = ms.equilibrium(ms.Scene(solid, supports=pins, loads=[tractions]))
    assert np.allclose(rest.positions, ends, rtol=0, atol=1e-10)


def curved_tube(cells=(2, 4, 1)) -> ms.Solid:
    mesh = ms.meshes.tube(1.0, 2.0, 0.5, np.pi / 2, cells=cells, order=2)
    return ms.Solid(mesh, material=ms.NeoHookean(young_modulus=E, poisson_ratio=0.3), mass_density=2.0)


def test_area_loads_on_curved_faces():
    """Check that area and moment of area of a cylinder converge with the third power at least."""
    errors = []
    for n in (2, 4):
        solid = curved_tube((2, n, 1))
        mesh = solid.mesh
        outer = np.flatnonzero((np.hypot(*mesh.rest_positions[mesh.faces][..., :2].T) > 2 - 1e-9).all(axis=0))
        scene = ms.Scene(solid, loads=[ms.AreaLoad((0, 0, 3.0), faces=outer)], allow_rigid_motions=True)
        forces = 3.0 * _load_per_vertex(scene)
        errors.append(
            [
                forces.sum() / (3.0 * np.pi * 0.5) - 1,
                forces @ mesh.rest_positions[:, 0] / (3.0 * 2.0 * 2.0 * 0.5) - 1,
            ]
        )
    coarse, fine = np.abs(errors)
    assert (fine < 1e-3).all() and (coarse / fine > 7.0).all()


def _load_per_vertex(scene) -> np.ndarray:
    """Return the area that each vertex carries of a load of 1 N/m2 along z, in m2."""
    layout, model = scene._load_parameter_layout, scene._model
    on = layout.packed({("scene", "load_factor"): 1.0}, layout.zeros())
    state = model.rest_state()
    by_load = model.gradient(state, layout.zeros()) - model.gradient(state, on)
    return model.positions(by_load)[:, 2] / float(scene.loads[0].force_per_area[2])


def test_flat_quarters_of_a_side_carry_a_quarter_each():
    """Check sum and moment of a load on each quarter; its forces reach beyond the side's middle nodes."""
    solid = bar((2, 1, 1))
    mesh = solid.mesh
    for face in range(4):
        load = ms.AreaLoad((0, 0, 1.0), faces=[face])
        scene = ms.Scene(solid, loads=[load], allow_rigid_motions=True)
        shares = _load_per_vertex(scene)
        assert shares.sum() == pytest.approx(mesh.face_areas[face], rel=1e-12)
        assert np.allclose(shares @ mesh.rest_positions, mesh.face_areas[face] * mesh.face_barycenters[face])


def test_weight_of_curved_elements_has_exact_sum_and_moments():
    """Compare sum and moments of the weight with integrals by many points.

    Shape functions of second degree have both exactly.
    """
    solid = curved_tube()
    mesh, weights = solid.mesh, solid._weighed_masses
    points, lengths = np.polynomial.legendre.leggauss(6)
    grid = np.stack([each.ravel() for each in np.meshgrid(points, points, points)], axis=1) / 2 + 0.5
    a, b, c = grid.T
    weight = np.einsum("i,j,k->ijk", lengths, lengths, lengths).ravel() / 8 * (1 - a) ** 2 * (1 - b)
    y, z = b * (1 - a), c * (1 - a) * (1 - b)
    natural = np.stack([1 - a - y - z, a, y, z], axis=1)
    at = np.einsum("pn,tni->tpi", shape_values(natural), mesh.rest_positions[mesh.tetrahedra])
    slopes = np.einsum("pna,tni->tpia", shape_gradients(natural), mesh.rest_positions[mesh.tetrahedra])
    masses = 2.0 * np.linalg.det(slopes) * weight
    assert weights.sum() == pytest.approx(masses.sum(), rel=1e-12)
    assert np.allclose(weights @ mesh.rest_positions, np.einsum("tp,tpi->i", masses, at), rtol=1e-12)


@pytest.mark.parametrize(
    "load",
    [
        lambda faces: ms.AreaLoad((1.0, 0, 0), faces),
        lambda faces: ms.Pressure(1.0, faces=faces),
        lambda faces: ms.ElasticFoundation(1e3, faces=faces),
    ],
)
def test_faces_selected_on_the_mesh_of_four_node_tetrahedra_are_refused_on_a_quadratic_solid(load):
    """Check that a load does not act elsewhere: faces of the given mesh have other numbers in that of the solid."""
    mesh = ms.meshes.box((0.2, 0.1, 0.1), cells=(2, 1, 1))
    solid = ms.Solid(mesh, material=ms.StableNeoHookean(young_modulus=1e6, poisson_ratio=0.3))
    held = ms.Pin(solid.mesh.vertices_at(x=0.0))
    selections = (
        lambda mesh: mesh.faces_at(x=0.2),
        lambda mesh: mesh.faces_where(lambda x: x[:, 0] > 0.19),
        lambda mesh: mesh.faces_between(mesh.vertices_at(x=0.2)),
        lambda mesh: mesh.faces_at(x=0.2)[::-1],
        lambda mesh: np.concatenate([mesh.faces_at(x=0.2), mesh.faces_at(y=0.0)]),
    )
    for select in selections:
        with pytest.raises(
            ValueError, match=r"has 20 faces, and the mesh of the body has 80: select on that"
        ):
            ms.Scene(solid, supports=held, loads=load(select(mesh)))
        ms.Scene(solid, supports=held, loads=load(select(solid.mesh)))
    linear = ms.Solid(mesh, material=solid.material, element="linear")
    ms.Scene(linear, supports=ms.Pin(mesh.vertices_at(x=0.0)), loads=load(mesh.faces_at(x=0.2)))
