"""Gradients of frequencies about equilibria: against differences, and where there are none."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(16, 4))
EXACT = {"solver": ms.MixedNewton(tolerance=1e-13)}
ALONG = {"remanent_magnetization": (60e3, 0, 0), "applied_flux_density": (5e-3, 0, 0)}


def cantilever(**options):
    sheet = ms.Shell(
        MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3, bending="midedge"
    )
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField(), **options)


def number(value):
    return torch.tensor(value, dtype=torch.float64)


def zero():
    return torch.zeros((), dtype=torch.float64, requires_grad=True)


def slope(function, step=1e-3):
    """Return the derivative at 0 by differences of fourth order."""
    with torch.no_grad():
        pairs = [(8 / 12, 1), (-1 / 12, 2)]
        values = [c * (function(number(n * step)) - function(number(-n * step))) for c, n in pairs]
    return float(sum(values)) / step


@pytest.mark.parametrize("across", [0.0, 2e-3])
def test_frequencies_have_the_gradients_of_differences(across):
    scene = cantilever(gravity=(0, 0, -9.81))

    def first(x):
        flux_density = (5e-3, 0, across)
        rest = ms.equilibrium(
            scene,
            **EXACT,
            **{**ALONG, "applied_flux_density": flux_density},
            young_modulus=1e6 * torch.exp(x),
        )
        return ms.vibration_modes(scene, rest, count=1).frequencies[0]

    x = zero()
    (by,) = torch.autograd.grad(first(x), x)
    assert by.item() == pytest.approx(slope(first), rel=1e-7)


def test_a_bent_state_counts_in_the_gradient():
    scene = cantilever()

    def first(x):
        field = 2e-2 * (1.0 + x) * number([0.3, 0.0, 1.0])
        given = {"remanent_magnetization": ALONG["remanent_magnetization"], "applied_flux_density": field}
        rest = ms.equilibrium(scene, **given, **EXACT)
        return ms.vibration_modes(scene, rest, count=2).squares[1]

    x = zero()
    (by,) = torch.autograd.grad(first(x), x)
    assert by.item() == pytest.approx(slope(first), rel=1e-6)
    tangent = torch.func.jvp(first, (torch.zeros((), dtype=torch.float64),), (torch.ones(()).double(),))[1]
    assert tangent.item() == pytest.approx(by.item(), rel=1e-12)


def test_first_frequency_of_a_strip_in_a_field_across_it_changes_with_its_modulus_as_known():
    """Check a strip of 40 x 10 x 1 mm of 1 MPa, 2000 kg/m3 and Poisson's ratio 0.45, 60 kA/m along it, without weight."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.45, mass_density=2e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
    given = {"remanent_magnetization": (60e3, 0, 0), "applied_flux_density": (0, 0, 5e-3)}

    def first(x):
        rest = ms.equilibrium(scene, **given, young_modulus=1e6 * torch.exp(x), **EXACT)
        return ms.vibration_modes(scene, rest, count=1).frequencies[0]

    x = zero()
    (by,) = torch.autograd.grad(first(x), x)
    assert by.item() == pytest.approx(slope(first), rel=1e-6)
    assert by.item() == pytest.approx(0.63990, rel=1e-4)  # Hz


def test_frequencies_of_a_cantilever_grow_as_thickness_and_root_of_modulus():
    scene = cantilever()
    sheet = scene.bodies[0]
    thickness, modulus, density = (
        torch.tensor(each, requires_grad=True, dtype=torch.float64) for each in (1e-3, 1e6, 1e3)
    )
    values = {sheet: {"thickness": thickness, "young_modulus": modulus, "mass_density": density}}
    first = ms.vibration_modes(scene, values=values, count=1).frequencies[0]
    by = torch.autograd.grad(first.log(), (thickness, modulus, density))
    powers = [float(g * value.detach()) for g, value in zip(by, (thickness, modulus, density), strict=True)]
    assert powers == pytest.approx([1.0, 0.5, -0.5], rel=1e-8)


def test_frequencies_of_tensors_without_gradient_are_tensors():
    scene = cantilever()
    rest = ms.equilibrium(scene, **ALONG, young_modulus=torch.tensor(1e6, dtype=torch.float64))
    modes = ms.vibration_modes(scene, rest, count=2)
    assert torch.is_tensor(modes.frequencies) and not modes.frequencies.requires_grad
    plain = ms.vibration_modes(scene, ms.equilibrium(scene, **ALONG), count=2)
    np.testing.assert_allclose(modes.frequencies.numpy(), plain.frequencies, rtol=1e-12)


def test_double_frequencies_have_no_gradient():
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(4, 4), diagonals="crossed")
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Pin(mesh.boundary_vertices)])
    modulus = torch.tensor(1e6, dtype=torch.float64, requires_grad=True)
    modes = ms.vibration_modes(scene, values={sheet: {"young_modulus": modulus}}, count=3)
    squares = modes.squares.detach().numpy()
    assert squares[1] == pytest.approx(squares[2], rel=1e-9)
    (by,) = torch.autograd.grad(modes.squares[0], modulus, retain_graph=True)
    assert by.item() == pytest.approx(squares[0] / 1e6, rel=1e-8)
    with pytest.raises(
        ms.NoGradient, match=r"square of frequency 1: it equals the square of frequency 2.*mix"
    ):
        torch.autograd.grad(modes.squares[1], modulus, retain_graph=True)
    two = ms.vibration_modes(scene, values={sheet: {"young_modulus": modulus}}, count=2)
    with pytest.raises(ms.NoGradient, match="frequency 1: it equals the square of frequency 2"):
        torch.autograd.grad(two.squares[1], modulus)


def test_frequencies_of_zero_have_no_gradient_but_leave_the_others_theirs():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(5, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Pin(mesh.vertices_at(x=0.0))], allow_rigid_motions=True)
    modulus = torch.tensor(1e6, dtype=torch.float64, requires_grad=True)
    modes = ms.vibration_modes(scene, values={sheet: {"young_modulus": modulus}}, count=2)
    assert modes.squares[0] == 0.0
    (by,) = torch.autograd.grad(modes.frequencies[1], modulus, retain_graph=True)
    assert by.item() == pytest.approx(modes.frequencies[1].item() / 2e6, rel=1e-7)
    with pytest.raises(ms.NoGradient, match="frequency 0, which is zero"):
        torch.autograd.grad(modes.frequencies[0], modulus)


def test_consistent_masses_and_rigid_bodies_refuse_by_name():
    scene = cantilever()
    modulus = torch.tensor(1e6, dtype=torch.float64, requires_grad=True)
    rest = ms.equilibrium(scene, **ALONG, young_modulus=modulus)
    with pytest.raises(ms.NoGradient, match="lumped"):
        ms.vibration_modes(scene, rest, count=1, mass="consistent").squares.sum().backward()
    sheet = scene.bodies[0]
    end = ms.RigidBody(
        np.flatnonzero(MESH.rest_positions[:, 0] > 0.036), mass=1e-3, inertia=1e-8, center=(0.045, 0.005, 0.0)
    )
    welded = ms.Scene([sheet, end], supports=[ms.Clamp(MESH.edges_at(x=0.0))])
    with pytest.raises(ms.NoGradient, match="rigid bodies"):
        ms.vibration_modes(
            welded, values={sheet: {"young_modulus": modulus}}, count=1
        ).squares.sum().backward()
