"""Tensors of every kind: taken with all that is in them, or refused by the argument's name with a way out."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

from torch.autograd import forward_ad  # noqa: E402

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(3, 1))
FIELD = (0.0, 0.0, 1e-3)
STRENGTH = torch.tensor((4e3, 0.0, 256.0), dtype=torch.float64)  # exact in bfloat16, but for 4e3


@pytest.fixture(scope="module")
def scene():
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())


def equilibrium(scene, magnetization, field=FIELD, **options):
    inputs = {"remanent_magnetization": magnetization, "applied_flux_density": field, **options}
    return ms.equilibrium(scene, **inputs).positions


def motion(scene, magnetization, field=FIELD, **options):
    inputs = {"remanent_magnetization": magnetization, "applied_flux_density": field, **options}
    return ms.simulate(scene, steps=2, time_step=1e-3, progress=False, **inputs).positions


def linear(scene, magnetization, field=FIELD):
    inputs = {"remanent_magnetization": magnetization, "applied_flux_density": field}
    return ms.linear_response(scene, **inputs).displacements


SOLVES = pytest.mark.parametrize("solve", [equilibrium, motion, linear], ids=lambda f: f.__name__)


@SOLVES
@pytest.mark.parametrize("dtype", [torch.float64, torch.float32, torch.bfloat16, torch.float16], ids=str)
def test_results_have_the_dtype_of_the_design(scene, solve, dtype):
    given = STRENGTH.to(dtype)
    found = solve(scene, given)
    assert found.dtype == dtype
    exact = solve(scene, given.double())
    assert torch.equal(found, exact.to(dtype))


@SOLVES
def test_integers_are_no_dtype_for_results(scene, solve):
    """Check that integer tensors give float64 results; positions used to come back as integers, all zero."""
    found = solve(scene, STRENGTH.long())
    assert found.dtype == torch.float64 and found.abs().max() > 0
    assert torch.equal(found, solve(scene, STRENGTH))
    assert solve(scene, STRENGTH.long(), torch.tensor(FIELD, dtype=torch.float32)).dtype == torch.float32


@SOLVES
def test_a_gradient_beside_integers_and_in_bfloat16(scene, solve):
    field = torch.tensor(FIELD, dtype=torch.float64, requires_grad=True)
    solve(scene, STRENGTH.long(), field).pow(2).sum().backward()
    exact, field.grad = field.grad, None
    solve(scene, STRENGTH, field).pow(2).sum().backward()
    assert torch.equal(field.grad, exact)
    coarse = torch.tensor(FIELD, dtype=torch.bfloat16, requires_grad=True)
    solve(scene, STRENGTH, coarse).pow(2).sum().backward()
    assert coarse.grad.dtype == torch.bfloat16
    assert torch.allclose(coarse.grad.double(), exact, rtol=2e-2, atol=1e-2 * exact.abs().max())


def nested(tensor):
    return torch.nested.nested_tensor([tensor, tensor])


def fake(tensor):
    from torch._subclasses.fake_tensor import FakeTensorMode

    with FakeTensorMode() as mode:
        return mode.from_tensor(tensor)


KINDS = {
    "sparse": (lambda t: t.to_sparse(), r"is sparse \(torch.sparse_coo\): hand over \.to_dense\(\)"),
    "meta": (lambda t: t.to("meta"), "has a shape but no numbers"),
    "fake": (fake, "has a shape but no numbers"),
    "nested": (nested, "is a nested tensor"),
    "quantized": (
        lambda t: torch.quantize_per_tensor(t.float(), 1.0, 0, torch.qint8),
        r"is quantized \(torch.qint8\): hand over \.dequantize\(\)",
    ),
    "float8": (lambda t: t.to(torch.float8_e4m3fn), r"torch.float8_e4m3fn.*hand over \.to\(torch.float64\)"),
    "complex": (lambda t: t.to(torch.complex128), "real numbers, got dtype complex128"),
    "conjugate": (lambda t: torch.complex(t, t).conj(), "real numbers, got dtype complex128"),
    "truths": (lambda t: t > 0, "real numbers, got dtype bool"),
    "list": (lambda t: [t.clone().requires_grad_()] * MESH.n_faces, "would be lost: torch.stack them"),
    "list of bfloat16": (lambda t: [t.to(torch.bfloat16)] * MESH.n_faces, "bfloat16: torch.stack them"),
    "list of meta": (lambda t: [t.to("meta")] * MESH.n_faces, "a tensor in it has a shape but no numbers"),
}


@SOLVES
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.filterwarnings("ignore:The PyTorch API of nested", "ignore:Sparse", "ignore:.*quantize")
def test_kinds_that_hold_no_numbers(scene, solve, kind):
    make, message = KINDS[kind]
    with pytest.raises(ValueError, match=rf"remanent_magnetization \[A/m\] .*{message}"):
        solve(scene, make(STRENGTH))


def test_views_whose_sign_is_pending_are_taken(scene):
    negative = torch.complex(STRENGTH, -STRENGTH).conj().imag
    assert torch.equal(equilibrium(scene, negative), equilibrium(scene, STRENGTH))


def warm_start(scene, magnetization):
    return ms.WarmStart(scene)(remanent_magnetization=magnetization, applied_flux_density=FIELD).positions


@pytest.mark.parametrize("solve", [motion, warm_start])
def test_batches_of_designs_are_refused_by_name(scene, solve):
    with pytest.raises(ValueError, match=r"remanent_magnetization \[A/m\] is inside torch\.vmap.*loop"):
        torch.vmap(lambda magnetization: solve(scene, magnetization))(STRENGTH.repeat(2, 1))


@pytest.mark.parametrize("name", ["thickness", "young_modulus"])
def test_batches_of_values_are_refused_by_name(scene, name):
    (sheet,) = scene.bodies
    given = torch.full((2,), float(np.mean(getattr(sheet, name))))
    field = {"remanent_magnetization": (1e4, 0, 0), "applied_flux_density": (0, 0, 1e-3)}
    steps = {"steps": 1, "time_step": 1e-3}
    with pytest.raises(ValueError, match=rf"{name} of Shell.* is inside torch\.vmap.*loop"):
        torch.vmap(lambda value: ms.simulate(scene, values={sheet: {name: value}}, **field, **steps))(given)


@SOLVES
def test_transforms_of_torch_agree_along_a_direction(scene, solve):
    def total(magnetization):
        return (1e3 * solve(scene, magnetization)).pow(2).sum()

    slope = (torch.func.grad(total)(STRENGTH) * STRENGTH).sum()
    torch.testing.assert_close(torch.func.jvp(total, (STRENGTH,), (STRENGTH,))[1], slope, rtol=1e-7, atol=0.0)
    with forward_ad.dual_level():
        tangent = forward_ad.unpack_dual(total(forward_ad.make_dual(STRENGTH, STRENGTH))).tangent
    torch.testing.assert_close(tangent, slope, rtol=1e-7, atol=0.0)


@SOLVES
def test_gradients_come_one_at_a_time(scene, solve):
    given = STRENGTH.clone().requires_grad_()
    found = solve(scene, given)
    both = torch.ones(2, *found.shape, dtype=torch.float64)
    with pytest.raises(ms.NoGradient, match=r"is_grads_batched.*one at a time"):
        torch.autograd.grad(found, given, both, is_grads_batched=True, retain_graph=True)
    assert torch.autograd.grad(found, given, both[0])[0].abs().max() > 0


def with_gradient(*shape):
    return torch.ones(shape, requires_grad=True)


ARGUMENTS = {
    "applied_flux_density": lambda s: equilibrium(s, STRENGTH, [0.0, 0.0, with_gradient()]),
    "load_factor": lambda s: equilibrium(s, STRENGTH, load_factor=[with_gradient(), 1.0]),
    "control": lambda s: motion(s, STRENGTH, [with_gradient(3), with_gradient(3)]),
    "function": lambda s: motion(s, STRENGTH, lambda time: [0.0, 0.0, with_gradient()]),
    "damping": lambda s: motion(s, STRENGTH, damping=[with_gradient()] * MESH.n_vertices),
    "velocities": lambda s: motion(s, STRENGTH, velocities=[with_gradient()] * 3),
    "start": lambda s: motion(s, STRENGTH, start=[with_gradient(3)] * MESH.n_vertices),
    "young_modulus": lambda s: ms.Shell(MESH, thickness=1e-3, young_modulus=[with_gradient()] * MESH.n_faces),
    "times": lambda s: ms.control.spline([with_gradient()] * 3, torch.ones(5, 3), 1.0),
}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_no_list_of_tensors_loses_its_gradients(scene, name):
    called = {"control": "applied_flux_density", "function": "applied_flux_density at 0 s"}.get(name, name)
    with pytest.raises(ValueError, match=rf"{called}.*is a list of tensors.*torch.stack them"):
        ARGUMENTS[name](scene)


@pytest.mark.parametrize(
    "call",
    [
        lambda t: ms.PointLoad(t, (0, 0, 1)),
        lambda t: MESH.edges_between(t),
        lambda t: ms.control.track(torch.ones(2, 4, 3), t),
        lambda t: ms.meshes.rectangle(1.0, 1.0, cells=t),
    ],
)
def test_indices_without_numbers(call):
    with pytest.raises(ValueError, match="has a shape but no numbers"):
        call(torch.ones(2, dtype=torch.int64, device="meta"))


def test_files_take_bfloat16(tmp_path):
    values = torch.linspace(0, 1, MESH.n_vertices).to(torch.bfloat16)
    ms.write_mesh(tmp_path / "a.ply", MESH, vertex_fields={"u": values})
    np.testing.assert_array_equal(ms.read_fields(tmp_path / "a.ply").vertex["u"], values.double())
    with pytest.raises(ValueError, match="vertex field 'u' has a shape but no numbers"):
        ms.write_mesh(tmp_path / "a.ply", MESH, vertex_fields={"u": values.to("meta")})


@SOLVES
def test_compiled_code_runs_solves_as_they_are(scene, solve):
    """Check torch.compile, which used to end in an AssertionError inside torch."""

    def tip(magnetization):
        return 2 * solve(scene, magnetization * 1.5)[..., -1, :].pow(2).sum()

    plain, compiled = (STRENGTH.clone().requires_grad_() for _ in range(2))
    found = torch.compile(tip, backend="eager")(compiled)  # the graphs around it need no compiler to show it
    assert torch.equal(found, tip(plain))
    found.backward()
    tip(plain).backward()
    assert torch.equal(compiled.grad, plain.grad)


def test_results_have_the_dtype_to_which_torch_promotes_the_inputs():
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())

    def dtype(of_magnetization, of_field):
        return ms.equilibrium(
            scene,
            remanent_magnetization=torch.tensor([4e4, 0, 0], dtype=of_magnetization),
            applied_flux_density=torch.tensor([0, 0, 1e-3], dtype=of_field),
        ).positions.dtype

    for pair in (
        (torch.float32, torch.float64),
        (torch.float64, torch.float32),
        (torch.float32, torch.float32),
    ):
        assert dtype(*pair) == torch.promote_types(*pair)
