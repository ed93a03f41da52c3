"""ms.linear_response and ms.linear_buckling about an equilibrium: against nonlinear solves, and bad input."""

import numpy as np
import pytest

import magshell as ms

LENGTH, THICKNESS = 0.1, 5e-4
MESH = ms.meshes.rectangle(LENGTH, 0.01, cells=(20, 2))
EULER = np.pi**2 / 48 * 1e6 * THICKNESS**3 / LENGTH**2  # of a cantilever, N/m
LONGER = np.diag([1.2, 1.0, 1.0])  # not across, where the clamp would not let it
END = MESH.edges_at(x=LENGTH)


def shell(**options) -> ms.Shell:
    material = {"thickness": THICKNESS, "young_modulus": 1e6, "poisson_ratio": 0.0}
    return ms.Shell(MESH, **{**material, **options})


def held(sheet, load=None, **options) -> ms.Scene:
    loads = [] if load is None else [ms.EdgeLoad(END, load)]
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=loads, **options)


def curled() -> tuple[ms.Scene, dict]:
    return held(shell(rest_curvature=8.0, growth=1.1), (0.0, 0, 3e-4)), {"load_factor": 0.0}


def magnetic() -> tuple[ms.Scene, dict]:
    scene = held(shell(), (0, 1e-4, 3e-4), field=ms.UniformField())
    field = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": (0, 1e-4, 4e-3)}
    return scene, {**field, "load_factor": 1.0}


def turned_at_its_end() -> tuple[ms.Scene, dict]:
    ends = [
        ms.Clamp(MESH.edges_at(x=0.0)),
        ms.Clamp(END, displacement=(-0.02, 0, 0.01), rotation=(0, 1.0, 0)),
    ]
    return ms.Scene(shell(rest_curvature=5.0), supports=ends), {"support_factor": 0.5}


def breathing() -> tuple[ms.Scene, dict]:
    """Build a solid with cells, which couple all of their nodes: a low-rank stiffness added to the sparse one."""
    mesh = ms.meshes.box((0.02, 0.01, 0.01), cells=(4, 2, 2))
    body = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3))
    mesh = body.mesh  # of ten nodes
    load = ms.PointLoad(mesh.vertices_at(x=0.02), (0.0, 0.0, -0.01))
    scene = ms.Scene(
        body,
        supports=[ms.Pin(mesh.vertices_at(x=0.0))],
        loads=[load],
        actuators=[ms.PneumaticCells(body, stiffness=1e5)],
    )
    return scene, {"load_factor": 1.0}


@pytest.mark.parametrize("case", [curled, magnetic, turned_at_its_end, breathing])
def test_a_response_is_the_slope_of_equilibria(case) -> None:
    scene, at = case()
    about = ms.equilibrium(scene, progress=False, **at)
    fixed = {name: value for name, value in at.items() if name != "remanent_magnetization"}
    towards = {"load_factor": 2.0} if "support_factor" not in at else {"support_factor": 1.0}
    if "applied_flux_density" in at:
        towards["applied_flux_density"] = np.array([1e-4, 0, 5e-3])
    found = ms.linear_response(scene, about, **{**fixed, **towards})

    def state(t: float) -> ms.Equilibrium:
        between = {
            name: (1 - t) * np.array(fixed.get(name, 1.0)) + t * np.array(end)
            for name, end in towards.items()
        }
        return ms.equilibrium(scene, start=about, progress=False, **{**at, **between})

    small = 1e-3
    up, down = state(small), state(-small)
    for name, wanted in (("positions", found.displacements), ("edge_rotations", found.edge_rotations)):
        slope = (getattr(up, name) - getattr(down, name)) / (2 * small)
        np.testing.assert_allclose(wanted, slope, atol=1e-4 * np.abs(slope).max(initial=0.0))
    assert np.abs(found.displacements).max() > 1e-5
    np.testing.assert_array_equal(found.positions, about.positions + found.displacements)


def test_from_rest_it_is_what_it_is_without() -> None:
    scene = held(shell(), (0.0, 0, 1e-4))
    rest = ms.equilibrium(scene, load_factor=0.0)
    np.testing.assert_allclose(
        ms.linear_response(scene, rest).displacements,
        ms.linear_response(scene).displacements,
        rtol=1e-6,
        atol=1e-12,
    )
    column = held(shell(), (-EULER, 0, 0))
    about = ms.equilibrium(column, load_factor=0.0)
    assert ms.linear_buckling(column, about).factors == pytest.approx(
        ms.linear_buckling(column).factors, rel=1e-6
    )


def grown_column() -> tuple[ms.Scene, dict, dict]:
    return held(shell(growth=LONGER), (-EULER, 0, 0)), {"load_factor": 0.0}, {"load_factor": 2.0}


def compressed_further() -> tuple[ms.Scene, dict, dict]:
    return held(shell(), (-EULER, 0, 0)), {"load_factor": 0.5}, {"load_factor": 2.0}


def held_up_by_a_field() -> tuple[ms.Scene, dict, dict]:
    along = {"remanent_magnetization": (1e5, 0, 0), "applied_flux_density": (1e-4, 0, 0)}
    scene = held(shell(), (-EULER, 0, 0), field=ms.UniformField())
    return scene, {**along, "load_factor": 0.0}, {"load_factor": 4.0, "applied_flux_density": (1e-4, 0, 0)}


@pytest.mark.parametrize("case", [grown_column, compressed_further, held_up_by_a_field])
def test_buckling_is_where_the_path_branches(case) -> None:
    scene, at, towards = case()
    about = ms.equilibrium(scene, **at)
    magnetization = {name: at[name] for name in at if name == "remanent_magnetization"}
    branch = ms.follow_path(scene, start=about, progress=False, **magnetization, **towards).critical[0]
    assert branch.kind == "bifurcation"
    found = ms.linear_buckling(scene, about, **towards)
    assert found.factors[0] == pytest.approx(branch.parameter, rel=2e-3)
    assert 0.05 < found.factors[0] < 0.95 and "of the way to the new load parameters" in repr(found)
    along = np.vdot(found.modes[0], branch.mode)
    assert abs(along) == pytest.approx(np.linalg.norm(found.modes[0]) * np.linalg.norm(branch.mode), rel=1e-3)


def test_tensors_in_tensors_out_with_gradients() -> None:
    torch = pytest.importorskip("torch")
    scene = held(shell(growth=LONGER), (0, 0, 1e-4))
    factor = torch.tensor(0.5, dtype=torch.float64)
    about = ms.equilibrium(scene, load_factor=factor)
    found = ms.linear_response(scene, about)
    assert isinstance(found.displacements, torch.Tensor)
    np.testing.assert_array_equal(found.positions, about.positions + found.displacements)
    wanted = ms.equilibrium(scene, load_factor=factor.requires_grad_())
    before = torch.autograd.grad(ms.linear_response(scene, wanted).displacements.sum(), factor)[0]
    after = torch.autograd.grad(
        ms.linear_response(scene, about, load_factor=factor + 0.1).displacements.sum(), factor
    )[0]
    assert before * after < 0.0  # loads act on the way from the one to the other


@pytest.mark.parametrize("function", [ms.linear_response, ms.linear_buckling])
def test_bad_input_is_refused(function) -> None:
    sheet = shell(growth=LONGER)
    scene = held(sheet, (-EULER, 0, 0))
    about = ms.equilibrium(scene, load_factor=0.5)
    with pytest.raises(ValueError, match="equilibrium must be an Equilibrium, got str"):
        function(scene, "here")
    with pytest.raises(ValueError, match="scene must be a Scene, got Equilibrium"):
        function(about, about)
    with pytest.raises(ValueError, match="of another scene"):
        function(held(sheet, (-EULER, 0, 0)), about)
    with pytest.raises(ValueError, match="values are those of the equilibrium: give them to"):
        function(scene, about, values={sheet: {"growth": 1.1}})
    with pytest.raises(ValueError, match="remanent_magnetization is that of the equilibrium: give it to"):
        function(scene, about, remanent_magnetization=(1e4, 0, 0))
    with pytest.raises(
        ValueError, match="load parameters are those of the equilibrium, so that nothing changes"
    ):
        function(scene, about, load_factor=0.5)
    with pytest.raises(ValueError, match="no UniformField"):
        function(scene, about, applied_flux_density=(0, 0, 1.0))
    column = held(shell(), (-EULER, 0, 0))
    straight = ms.equilibrium(column, load_factor=1.5, require_stable=False)
    with pytest.raises(ValueError, match="is not stable"):
        function(column, straight, load_factor=2.0)


def test_buckling_with_unsuitable_loads_is_refused() -> None:
    scene, _ = breathing()
    about = ms.equilibrium(scene, load_factor=0.1)
    with pytest.raises(ValueError, match="is a spring"):
        ms.linear_buckling(scene, about)
    column = held(shell(), (EULER, 0, 0))
    with pytest.raises(ValueError, match="nothing buckles under these load parameters"):
        ms.linear_buckling(column, ms.equilibrium(column, load_factor=0.5))
