"""Gradients of critical points of paths: against differences of whole paths, and where there are none."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

EXACT = {"solver": ms.MixedNewton(tolerance=1e-13)}
LENGTH, WIDTH = 0.12047, 0.02
THICKNESS, MODULUS, MAGNETIZATION, FIELD = 2.5e-3, 4.2e6, 5.4e4, 8e-3
ZERO = torch.zeros(3, dtype=torch.float64)


def beam(cells=(16, 4), *, end=0.47e-3, rotation=None, **options):
    """Build the beam of Tan et al. between clamps that compress it, and one of which may turn; halves are magnetized against
    each other.
    """
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=MODULUS, poisson_ratio=0.5)
    clamps = [
        ms.Clamp(mesh.edges_at(x=0.0)),
        ms.Clamp(mesh.edges_at(x=LENGTH), displacement=(-end, 0, 0), rotation=rotation),
    ]
    return ms.Scene(sheet, supports=clamps, field=ms.UniformField(), **options)


BEAM = beam()
SHEET = BEAM.bodies[0]
MIDDLE = SHEET.mesh.nearest_vertex((LENGTH / 2, WIDTH / 2, 0))
HALVES = torch.tensor(
    np.sign(SHEET.mesh.face_barycenters[:, :1] - LENGTH / 2) * np.array([MAGNETIZATION, 0, 0])
)


def number(value):
    return torch.tensor(value, dtype=torch.float64)


def design(x):
    """Return thickness, modulus and magnetization, scaled by exponentials of x (3,)."""
    values = {SHEET: {"thickness": THICKNESS * torch.exp(x[0]), "young_modulus": MODULUS * torch.exp(x[1])}}
    return {"values": values, "remanent_magnetization": HALVES * torch.exp(x[2])}


def snap(x, max_step=0.02, **start):
    """Return the path over which the field pushes the beam through, from the side that it was pushed to."""
    given = design(x)
    with torch.no_grad():
        pushed = ms.equilibrium(BEAM, applied_flux_density=(0, 0, -1e-3), **given)
        rest = ms.equilibrium(BEAM, applied_flux_density=(0, 0, 0), start=pushed, **given, **EXACT)
    return ms.follow_path(
        BEAM,
        **given,
        **{"start": rest, **start},
        applied_flux_density=(0, 0, FIELD),
        max_step=max_step,
        until=lambda _, positions: positions[MIDDLE, 2] < 0.3 * rest.positions[MIDDLE, 2].item(),
        progress=False,
        **EXACT,
    )


def point_of(path, kind):
    return next(each for each in path.critical if each.kind == kind)


def weighted(positions):
    some = np.random.default_rng(3).standard_normal(tuple(positions.shape))
    return (torch.from_numpy(some) * positions).sum()


def slope(function, at, direction, step=1e-3):
    """Return the derivative along a direction by differences of fourth order."""
    with torch.no_grad():
        pairs = [(8 / 12, 1), (-1 / 12, 2)]
        ways = [
            c * (function(at + n * step * direction) - function(at - n * step * direction)) for c, n in pairs
        ]
    return float(sum(ways)) / step


def test_critical_fields_have_the_gradients_of_differences_of_whole_paths():
    def field(x):
        return point_of(snap(x), "limit").parameter

    x = ZERO.clone().requires_grad_()
    (by,) = torch.autograd.grad(field(x), x)
    critical = field(ZERO).item()
    assert by[1:].tolist() == pytest.approx([critical, -critical], rel=1e-7)  # B M scales as E
    for along in torch.eye(3, dtype=torch.float64):
        assert float(by @ along) == pytest.approx(slope(field, ZERO, along), rel=1e-6)
    forward = torch.func.jacfwd(field)(ZERO)
    torch.testing.assert_close(forward, by, rtol=1e-8, atol=0.0)


def test_positions_at_limit_points_have_the_gradients_of_differences():
    def weighted_positions(x):
        return weighted(point_of(snap(x), "limit").positions)

    x = ZERO.clone().requires_grad_()
    (by,) = torch.autograd.grad(weighted_positions(x), x)
    thicker = torch.eye(3, dtype=torch.float64)[0]
    assert float(by @ thicker) == pytest.approx(slope(weighted_positions, ZERO, thicker), rel=1e-6)
    torch.testing.assert_close(torch.func.jacfwd(weighted_positions)(ZERO)[0], by[0], rtol=1e-7, atol=0.0)
    assert by[1:].abs().max() < 1e-8 * by[0].abs()  # E and M scale the field alone


def test_critical_points_are_located_to_eight_digits():
    coarse, fine = (snap(ZERO, max_step=step) for step in (0.02, 0.003))
    for kind in ("limit", "bifurcation"):
        one, other = point_of(coarse, kind), point_of(fine, kind)
        assert one.parameter.item() == pytest.approx(other.parameter.item(), rel=1e-9)
        np.testing.assert_allclose(one.positions, other.positions, rtol=0.0, atol=1e-9 * LENGTH)


COLUMN_MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))


def column():
    sheet = ms.Shell(COLUMN_MESH, thickness=1e-3, young_modulus=1e6)
    load = ms.EdgeLoad(COLUMN_MESH.edges_at(x=0.1), (-0.4, 0, 0))
    return ms.Scene(sheet, supports=[ms.Clamp(COLUMN_MESH.edges_at(x=0.0))], loads=[load])


def buckled_column(scene, x):
    sheet = scene.bodies[0]
    values = {sheet: {"thickness": 1e-3 * torch.exp(x[0]), "young_modulus": 1e6 * torch.exp(x[1])}}
    load_factor = torch.exp(x[2])
    return ms.follow_path(scene, values=values, load_factor=load_factor, progress=False, **EXACT).critical[0]


def test_symmetric_bifurcations_have_the_gradients_of_differences():
    scene = column()
    for part in (lambda point: point.parameter, lambda point: weighted(point.positions)):

        def result(x, part=part):
            return part(buckled_column(scene, x))

        x = ZERO.clone().requires_grad_()
        (by,) = torch.autograd.grad(result(x), x)
        for along in torch.eye(3, dtype=torch.float64)[:2]:
            assert float(by @ along) == pytest.approx(slope(result, ZERO, along), rel=1e-6)
        torch.testing.assert_close(torch.func.jacfwd(result)(ZERO), by, rtol=1e-8, atol=1e-12)
    point = buckled_column(scene, x)
    (by,) = torch.autograd.grad(point.parameter.log(), x)
    assert point.kind == "bifurcation"
    assert float(by[2]) == pytest.approx(-1.0, rel=1e-8)  # twice the load buckles at half of the way


def test_inputs_that_break_the_symmetry_of_a_bifurcation_have_no_gradient():
    x = ZERO.clone().requires_grad_()
    with pytest.raises(ms.NoGradient, match=r"by remanent_magnetization.*dissolves.*forward mode"):
        point_of(snap(x), "bifurcation").parameter.backward()

    def field(x):
        return point_of(snap(x), "bifurcation").parameter

    by = torch.func.jacfwd(field)(ZERO)  # through arrays that keep the symmetry
    critical = field(ZERO).item()
    assert by[1:].tolist() == pytest.approx([critical, -critical], rel=1e-7)
    uneven = torch.zeros_like(HALVES)
    uneven[:, 0] = 1.0  # one half more than the other

    given = design(ZERO)
    with torch.no_grad():
        pushed = ms.equilibrium(BEAM, applied_flux_density=(0, 0, -1e-3), **given)
        rest = ms.equilibrium(BEAM, applied_flux_density=(0, 0, 0), start=pushed, **given, **EXACT)

    def shifted(t):
        magnetization = {"remanent_magnetization": HALVES + t * uneven}
        field = {"applied_flux_density": (0, 0, FIELD), "max_step": 0.02, "progress": False}
        return point_of(
            ms.follow_path(BEAM, start=rest, **{**given, **magnetization, **field}), "bifurcation"
        ).parameter

    with pytest.raises(ms.NoGradient, match="along this change"):
        torch.func.jvp(shifted, (number(0.0),), (number(1.0),))


def test_load_parameters_of_the_start_and_of_the_end_have_gradients():
    given = design(ZERO)
    with torch.no_grad():
        pushed = ms.equilibrium(BEAM, applied_flux_density=(0, 0, -1e-3), **given)

    def parameter(begin, end):
        at = [torch.stack([0 * each, 0 * each, 1e-3 * each]) for each in (begin, end)]
        rest = ms.equilibrium(BEAM, applied_flux_density=at[0], start=pushed, **given, **EXACT)
        path = ms.follow_path(
            BEAM, start=rest, applied_flux_density=at[1], max_step=0.02, progress=False, **given, **EXACT
        )
        return point_of(path, "limit").parameter

    begin, end = (torch.tensor(each, dtype=torch.float64, requires_grad=True) for each in (0.5, 8.0))
    found = parameter(begin, end)
    by_begin, by_end = torch.autograd.grad(found, (begin, end))
    s = found.item()  # B = begin + s (end - begin) stays
    assert by_begin.item() == pytest.approx(-(1.0 - s) / 7.5, rel=1e-7)
    assert by_end.item() == pytest.approx(-s / 7.5, rel=1e-7)


def test_points_of_a_path_between_critical_ones_stay_arrays():
    x = ZERO.clone().requires_grad_()
    path = snap(x)
    assert torch.is_tensor(path.critical[0].parameter) and path.critical[0].parameter.requires_grad
    assert path.critical[0].parameter.shape == snap(ZERO).critical[0].parameter.shape == ()
    assert isinstance(path.events[0].parameter, float)
    assert isinstance(path.parameters, np.ndarray) and isinstance(path.remanent_magnetization, np.ndarray)
    there = path.equilibrium(3)
    assert isinstance(there.positions, np.ndarray)
    assert there.applied_flux_density[2] == pytest.approx(FIELD * path.parameters[3])
    assert "limit at" in repr(path)


def test_paths_along_which_values_move_refuse_by_name():
    scene = column()
    sheet, clamp = scene.bodies[0], scene.supports[0]
    moved = ms.Scene(sheet, supports=[ms.Clamp(clamp.edges, displacement=(0, 0, 0))], loads=scene.loads)
    support, modulus = moved.supports[0], torch.tensor(1e6, dtype=torch.float64, requires_grad=True)
    start = ms.equilibrium(moved, load_factor=0.0, values={sheet: {"young_modulus": 1e6}})
    values = {sheet: {"young_modulus": modulus}, support: {"displacement": (1e-3, 0, 0)}}
    path = ms.follow_path(moved, start=start, values=values, progress=False)
    with pytest.raises(ms.NoGradient, match="values of the scene change along the path"):
        path.critical[0].parameter.backward()
