"""Gradients of buckling factors of linear theory: against scaling laws and differences, and where there are none."""

import pytest

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))


def column(**options):
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    press = ms.EdgeLoad(MESH.edges_at(x=0.1), (-0.04, 0, 0))
    supports = options.pop("supports", [ms.Clamp(MESH.edges_at(x=0.0))])
    return ms.Scene(sheet, supports=supports, loads=[press], **options)


def number(value):
    return torch.tensor(value, dtype=torch.float64, requires_grad=True)


def test_factors_of_a_column_scale_as_modulus_and_cube_of_thickness():
    scene = column()
    thickness, modulus, load_factor = number(1e-3), number(1e6), number(1.0)
    values = {scene.bodies[0]: {"thickness": thickness, "young_modulus": modulus}}
    factors = ms.linear_buckling(scene, values=values, load_factor=load_factor, modes=2).factors
    for factor in factors.log():
        by = torch.autograd.grad(factor, (thickness, modulus, load_factor), retain_graph=True)
        powers = [float(each) * size for each, size in zip(by, (1e-3, 1e6, 1.0), strict=True)]
        assert powers[0] == pytest.approx(3.0, rel=1e-3)  # up to the strain at which it buckles
        assert powers[1:] == pytest.approx([1.0, -1.0], rel=1e-7)


@pytest.mark.filterwarnings("ignore::magshell.LinearTheoryWarning")
@pytest.mark.parametrize("bent", [False, True])
def test_factors_have_the_gradients_of_differences(bent):
    scene = column(gravity=(0, 0, -0.05))

    def factor(x):
        values = {scene.bodies[0]: {"thickness": 1e-3 * torch.exp(x), "young_modulus": 1e6 * torch.exp(x)}}
        if not bent:
            return ms.linear_buckling(scene, values=values, load_factor=1.0 + x, gravity_factor=0.0).factors[
                0
            ]
        rest = ms.equilibrium(
            scene, values=values, load_factor=0.2 * (1.0 + x), solver=ms.MixedNewton(tolerance=1e-13)
        )
        return ms.linear_buckling(scene, rest, load_factor=1.0 - x).factors[0]

    x = number(0.0)
    (by,) = torch.autograd.grad(factor(x), x)
    with torch.no_grad():
        step = 4e-3
        pairs = ((8 / 12, 1), (-1 / 12, 2))
        ways = [c * (factor(x + n * step) - factor(x - n * step)) for c, n in pairs]
    assert by.item() == pytest.approx(float(sum(ways)) / step, rel=1e-6)
    tangent = torch.func.jvp(factor, (x.detach(),), (torch.ones_like(x.detach()),))[1]
    assert tangent.item() == pytest.approx(by.item(), rel=1e-12)


def test_loads_with_which_supports_move_refuse_by_name():
    pushed = ms.Clamp(MESH.edges_at(x=0.1), displacement=(-1e-3, 0, 0))
    scene = column(supports=[ms.Clamp(MESH.edges_at(x=0.0)), pushed])
    modulus = number(1e6)
    values = {scene.bodies[0]: {"young_modulus": modulus}}
    with pytest.raises(ms.NoGradient, match="supports move with the loads"):
        ms.linear_buckling(scene, values=values).factors[0].backward()


def test_double_factors_have_no_gradient():
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(4, 4), diagonals="crossed")
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3)
    other = ms.Shell(
        mesh.transformed(translation=(0, 0, 0.1)), thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3
    )
    supports, loads = [], []
    for body in (sheet, other):
        supports.append(ms.Clamp(body.mesh.edges_at(x=0.0), body=body))
        loads.append(ms.EdgeLoad(body.mesh.edges_at(x=0.1), (-0.1, 0, 0), body=body))
    scene = ms.Scene([sheet, other], supports=supports, loads=loads)
    values = {sheet: {"young_modulus": number(1e6)}}
    with pytest.raises(ms.NoGradient, match="factor 0: it equals factor 1"):
        ms.linear_buckling(scene, values=values).factors[0].backward()
