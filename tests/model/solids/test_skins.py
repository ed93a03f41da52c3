"""Magnetized solids, in their skin and throughout: energies and forces against separate formulas, exact cases."""

import numpy as np
import pytest
import torch
from adjoint_scenes import DIPOLES

import magshell as ms
from magshell.model.scene.values import Values

SOFT = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.45)
RNG = np.random.default_rng(3)
FLUX = np.array([4e-3, -7e-3, 2e-2])
MU_0 = 4e-7 * np.pi
# Barycentric coordinates of the points of integration; the ends of the edges with middle nodes.
NEAR, FAR = (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20
ENDS = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))


def block(element, *, skin=None, magnetization=None, material=SOFT):
    mesh = ms.meshes.box((0.06, 0.02, 0.02), cells=(2, 1, 1))
    return ms.Solid(
        mesh,
        material=material,
        element=element,
        skin=skin,
        remanent_magnetization=magnetization,
        mass_density=1e3,
    )


def rows(count, size=3e4):
    return RNG.uniform(-size, size, (count, 3))


def in_field(solid, *sources, **more):
    return ms.Scene(solid, field=[ms.UniformField(), *sources], allow_rigid_motions=True, **more)


def load_parameters_of(scene, flux=FLUX, factor=0.8):
    given = {("scene", "applied_flux_density"): flux, ("scene", "field_factor"): factor}
    return scene._load_parameter_layout.packed(given, scene._load_parameter_layout.zeros())


def bent(scene):
    rest = scene.mesh.rest_positions
    positions = rest + 0.1 * np.sin(40.0 * rest[:, [1, 2, 0]]) * 0.02 + 2e-4 * RNG.standard_normal(rest.shape)
    return scene._model.state(
        positions, np.zeros(scene._model.edge_rotations(scene._model.rest_state()).shape)
    )


def flux_at(points):
    """Compute the flux density of the uniform field and the dipoles at points, (n, 3) in T."""
    total = torch.tensor(FLUX).expand_as(points)
    for place, moment in zip(DIPOLES.positions, DIPOLES.moments, strict=True):
        r = points - torch.tensor(np.array(place))
        m, d = torch.tensor(np.array(moment)), r.norm(dim=-1, keepdim=True)
        total = total + 0.8 * MU_0 / (4 * np.pi) * (3 * (r @ m)[:, None] * r / d**5 - m / d**3)
    return total


def energy_of_skin(solid, x):
    rest, faces = (
        torch.tensor(np.array(solid.mesh.rest_positions)),
        solid.mesh.faces[solid.skin.faces].astype(int),
    )

    def frame(at):
        a, b = at[faces[:, 1]] - at[faces[:, 0]], at[faces[:, 2]] - at[faces[:, 0]]
        n = torch.linalg.cross(a, b)
        return torch.stack([a, b, n / n.norm(dim=1, keepdim=True)], dim=2), 0.5 * n.norm(dim=1)

    (now, _), (before, area) = frame(x), frame(rest)
    f = now @ torch.linalg.inv(before)
    m = (f @ torch.tensor(np.array(solid.skin.remanent_magnetization))[:, :, None])[:, :, 0]
    volume = area * torch.tensor(np.array(solid.skin.thickness))
    return -(volume * (m * flux_at(x[faces].mean(dim=1))).sum(dim=1)).sum()


def shapes(at):
    """Compute the shape functions of ten nodes at barycentric coordinates (n, 4)."""
    corners = [at[:, i] * (2 * at[:, i] - 1) for i in range(4)]
    return torch.stack(corners + [4 * at[:, i] * at[:, j] for i, j in ENDS], dim=1)


def energy_of_volume(solid, x):
    """Compute the magnetic energy of a solid, with F from automatic differentiation of the shape functions."""
    rest, nodes = torch.tensor(np.array(solid.mesh.rest_positions)), solid.mesh.tetrahedra.astype(int)
    if solid.element == "linear":
        places, weight, shape = torch.full((1, 4), 0.25, dtype=torch.float64), 1 / 6, lambda at: at
    else:
        places, weight, shape = torch.full((4, 4), FAR, dtype=torch.float64), 1 / 24, shapes
        places.fill_diagonal_(NEAR)
    total = 0.0
    inner = torch.tensor(np.vstack([-np.ones(3), np.eye(3)]))  # barycentric by three of them
    for at in places:
        by = torch.func.jacrev(lambda where: shape(where[None])[0])(at) @ inner
        rest_by, now_by = (torch.einsum("tkc,kj->tcj", y[nodes], by) for y in (rest, x))
        f = now_by @ torch.linalg.inv(rest_by)
        m = (f @ torch.tensor(np.array(solid.remanent_magnetization))[:, :, None])[:, :, 0]
        point = torch.einsum("tkc,k->tc", x[nodes], shape(at[None])[0])
        total = total - (weight * torch.linalg.det(rest_by) * (m * flux_at(point)).sum(dim=1)).sum()
    return total


def skinned(element):
    solid = block(element)
    count = solid.mesh.n_faces
    chosen = RNG.permutation(count)[: count // 2]
    mesh = solid.mesh
    skin = ms.Skin(
        thickness=RNG.uniform(1e-3, 2e-3, len(chosen)), faces=chosen, remanent_magnetization=rows(len(chosen))
    )
    return ms.Solid(mesh, material=SOFT, element=element, skin=skin), energy_of_skin


def magnetized(element):
    return block(element, magnetization=rows(block(element).mesh.n_tetrahedra)), energy_of_volume


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("make", [skinned, magnetized])
def test_energy_and_forces_are_those_of_a_formula_in_torch(make, element):
    solid, formula = make(element)
    scene = in_field(solid, DIPOLES)
    model, q, load_parameters = scene._model, bent(scene), load_parameters_of(scene)
    x = torch.tensor(model.positions(q), requires_grad=True)
    energy = formula(solid, x)
    energy.backward()
    idle = load_parameters_of(scene, np.zeros(3), 0.0)
    force = model.positions(model.gradient(q, load_parameters) - model.gradient(q, idle))
    assert model.energies(q, load_parameters)["magnetic"] == pytest.approx(float(energy.detach()), rel=1e-12)
    np.testing.assert_allclose(force, x.grad.numpy(), atol=1e-9 * np.abs(force).max())


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("make", [skinned, magnetized])
def test_the_hessian_is_the_derivative_of_the_forces(make, element):
    scene = in_field(make(element)[0], DIPOLES)
    model, q = scene._model, bent(scene)
    load_parameters, idle = load_parameters_of(scene), load_parameters_of(scene, np.zeros(3), 0.0)

    def magnetic(at):
        return model.gradient(at, load_parameters) - model.gradient(at, idle)

    def matrix(at_controls):
        size, starts, indices, values = model.hessian(q, at_controls, False)
        full = np.zeros((size, size))
        full[indices, np.repeat(np.arange(size), np.diff(starts))] = values
        return full + np.tril(full, -1).T

    along = RNG.standard_normal(len(q))
    step = 1e-5
    fourth = [magnetic(q + k * step * along) for k in (-2, -1, 1, 2)]
    expected = (fourth[0] - 8 * fourth[1] + 8 * fourth[2] - fourth[3]) / (12 * step)
    found = (matrix(load_parameters) - matrix(idle)) @ along
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_uniform_magnetization_pushes_only_at_the_boundary(element):
    """Check validation case M1 on any mesh and in any state.

    -int (F M).B dV = -sum over the boundary of (M.N) B.u.
    """
    solid = block(element, magnetization=(2e4, 1e4, -3e4))
    scene = in_field(solid)
    model, q = scene._model, bent(scene)
    load_parameters, idle = load_parameters_of(scene), load_parameters_of(scene, np.zeros(3))
    force = model.positions(model.gradient(q, load_parameters) - model.gradient(q, idle))
    mesh = solid.mesh.first_order() if element == "quadratic" else solid.mesh
    x, wanted = solid.mesh.rest_positions, np.zeros_like(force)
    for face, area, normal in zip(mesh.faces, mesh.face_areas, mesh.face_normals, strict=True):
        pull = -area * (normal @ (2e4, 1e4, -3e4)) * FLUX / 3
        ends = mesh.rest_positions[face]
        # A third each: at the corners of linear elements, at the edge midpoints of quadratic ones.
        places = ends if element == "linear" else 0.5 * (ends + np.roll(ends, 1, axis=0))
        for place in places:
            wanted[np.argmin(np.linalg.norm(x - place, axis=1))] += pull
    np.testing.assert_allclose(force, wanted, atol=1e-10 * np.abs(wanted).max())


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_same_bits_on_any_number_of_threads(element):
    mesh = ms.meshes.box((0.1, 0.04, 0.04), cells=(9, 4, 4))
    solid = ms.Solid(
        mesh,
        material=SOFT,
        element=element,
        skin=ms.Skin(thickness=1e-3, remanent_magnetization=rows(mesh.n_faces, 1e4)),
        remanent_magnetization=rows(mesh.n_tetrahedra, 1e3),
    )
    scene = in_field(solid, DIPOLES, loads=[ms.SurfaceTension(0.5)])
    model, q, load_parameters = scene._model, bent(scene), load_parameters_of(scene)
    before, found = ms.num_threads(), []
    try:
        for threads in (1, 2, 4):
            ms.set_num_threads(threads)
            found.append((model.gradient(q, load_parameters), model.hessian(q, load_parameters, False)[3]))
    finally:
        ms.set_num_threads(before)
    for other in found[1:]:
        for a, b in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_a_skin_with_mass_weighs_and_is_inert(element):
    """Check that a skin adds thickness times density on each face to the solid's masses."""
    mesh = ms.meshes.box((0.06, 0.02, 0.02), cells=(2, 1, 1))
    rows = np.linspace(1e3, 2e3, mesh.n_faces)
    heavy, light = (
        block(element, skin=ms.Skin(thickness=1e-3, mass_density=density, remanent_magnetization=(1, 0, 0)))
        for density in (rows, None)
    )
    more = heavy.vertex_masses - light.vertex_masses
    assert more.sum() == pytest.approx(1e-3 * mesh.face_areas @ rows)
    on_surface = np.isin(np.arange(len(more)), heavy.mesh.boundary_vertices)
    assert (more[on_surface] > 0).all() and not more[~on_surface].any()
    assert np.allclose(heavy._weighed_masses - light._weighed_masses, more)
    scene = in_field(heavy, gravity=(0, 0, -9.81))
    values = {heavy.skin: {"thickness": 2e-3}}
    for given, factor in (({}, 1.0), (values, 2.0)):
        now = Values(scene, given)
        assert now.vertex_masses.sum() == pytest.approx(light.vertex_masses.sum() + factor * more.sum())
    assert "mass_density 1000 to 2000 kg/m3" in repr(heavy.skin)
    with pytest.raises(ValueError, match=r"mass_density \[kg/m3\] of a Skin must be positive"):
        ms.Skin(thickness=1e-3, mass_density=0.0)
    with pytest.raises(
        ValueError, match=r"mass_density \[kg/m3\] of a Skin must be a number or have shape \(k,\)"
    ):
        block(element, skin=ms.Skin(thickness=1e-3, mass_density=np.ones(3)))


def test_a_skin_that_only_weighs_needs_no_field():
    mesh = ms.meshes.box((0.04, 0.01, 0.01), cells=(4, 1, 1))
    soft = ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3)
    skin = ms.Skin(thickness=1e-3, faces=mesh.faces_at(z=0.01), mass_density=5e3)
    bodies = [ms.Solid(mesh, material=soft, mass_density=1e3, skin=each) for each in (None, skin)]
    scenes = [
        ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(x=0.0))], gravity=(0, 0, -9.81))
        for body in bodies
    ]
    bare, coated = (ms.equilibrium(scene) for scene in scenes)
    held = coated.reaction(scenes[1].supports[0]).force[2] - bare.reaction(scenes[0].supports[0]).force[2]
    assert held == pytest.approx(9.81 * 5e3 * 1e-3 * 0.04 * 0.01, rel=1e-9)
    torch = pytest.importorskip("torch")
    own = bodies[1].skin
    thickness = torch.full((len(own.faces),), 1e-3, dtype=torch.float64, requires_grad=True)

    def end(values):
        return ms.equilibrium(scenes[1], values={own: {"thickness": values}}).positions[-1, 2]

    end(thickness).backward()
    step = 1e-6
    difference = (end(thickness.detach() + step) - end(thickness.detach() - step)) / (2 * step)
    assert float(thickness.grad.sum()) == pytest.approx(float(difference), rel=1e-6)
    idle = ms.Solid(mesh, material=soft, skin=ms.Skin(thickness=1e-3))
    with pytest.raises(ValueError, match="has a skin, but the scene has no field"):
        ms.Scene(idle, allow_rigid_motions=True)
