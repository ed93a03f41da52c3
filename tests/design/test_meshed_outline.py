"""Outlines whose control points move borders and slits, and that are meshed anew where the mesh is worn."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")
pytest.importorskip("gmsh")

P = ms.parametrize
SIZE = 1.5e-3
ARM = [(0, 0), (0.015, 0), (0.03, 0), (0.03, 0.008), (0.015, 0.008), (0, 0.008)]


def arm(**options) -> P.MeshedOutline:
    """Return an arm with a round hole and a slit along it."""
    borders = [P.Polygon(ARM), P.Circle((0.01, 0.004), 0.0018)]
    slits = [P.Slit([(0.017, 0.004), (0.026, 0.004)])]
    return P.MeshedOutline(borders, slits, size=SIZE, **options)


def start(outline) -> list:
    return [each.detach() for each in outline.controls()]


def narrowed(controls) -> list:
    """Return control numbers with a narrower waist, a larger hole and a longer slit."""
    corners, circle, slit = (each.clone() for each in controls)
    corners[1, 1] += 1e-3
    corners[4, 1] -= 1e-3
    circle[2] *= 1.4
    slit[0, 0] -= 1e-3
    return [corners, circle, slit]


def magnetization(mesh) -> torch.Tensor:
    angle = torch.tensor(40.0 * mesh.face_barycenters[:, 0])
    return 4e4 * torch.stack([angle.cos(), torch.zeros_like(angle), angle.sin()], dim=1)


def lift(outline, controls, values=None, on_mesh=None) -> torch.Tensor:
    """Return the height of the arm's end in a field."""
    positions = outline.positions(controls) if on_mesh is None else on_mesh
    sheet = ms.Shell(outline.mesh, thickness=0.3e-3, young_modulus=1e6)
    clamp = ms.Clamp(outline.mesh.edges_in("border 0 side 5"))
    scene = ms.Scene(sheet, supports=[clamp], field=ms.UniformField())
    values = magnetization(outline.first_mesh) if values is None else values
    given = {"rest_positions": positions, "remanent_magnetization": outline.transferred(values)}
    rest = ms.equilibrium(scene, applied_flux_density=(0, 0, 4e-3), values={sheet: given}, progress=False)
    return rest.displacements[outline.mesh.vertices_in("border 0 side 2"), 2].mean()


@pytest.mark.parametrize("most_stretch", [1.3, 2.0])
def test_objective_jumps_by_less_than_a_thousandth_where_the_sheet_is_meshed_anew(most_stretch):
    outline, kept = arm(most_stretch=most_stretch), arm(most_stretch=1e3)
    controls = start(outline)
    target = narrowed(controls)
    share = 0.0
    while (
        outline.n_meshes == 1
    ):  # until the first new mesh, whose faces are stretched little beyond the bound
        share += 0.05
        moved = [a + share * (b - a) for a, b in zip(controls, target, strict=True)]
        outline.positions(moved)
    assert kept.positions(moved).shape[0] == kept.first_mesh.n_vertices != outline.mesh.n_vertices
    before, after = float(lift(kept, moved)), float(lift(outline, moved))
    assert after == pytest.approx(before, rel=1e-3)
    assert abs(before / float(lift(kept, controls)) - 1.0) > 1e-3


def test_positions_are_those_of_the_new_mesh_at_the_control_numbers_it_was_made_at():
    outline = arm()
    moved = narrowed(start(outline))
    found = outline.positions(moved).numpy()
    assert outline.n_meshes > 1
    assert found == pytest.approx(outline.mesh.rest_positions, rel=0, abs=1e-17)
    radii = np.linalg.norm(
        outline.mesh.rest_positions[outline.mesh.vertices_in("border 1"), :2] - (0.01, 0.004), axis=1
    )
    assert radii == pytest.approx(1.4 * 1.8e-3, rel=0.03)
    ends = outline.mesh.rest_positions[outline.mesh.vertices_in("slit 0"), 0]
    assert (ends.min(), ends.max()) == pytest.approx((0.016, 0.026), abs=1e-12)


@pytest.mark.parametrize("remeshed", [False, True])
def test_positions_have_the_gradient_by_control_numbers(remeshed):
    spline = P.ClosedSpline([(0, 0), (0.02, 0), (0.025, 0.01), (0.01, 0.015), (0, 0.01)])
    outline = P.MeshedOutline(
        [spline, P.Circle((0.009, 0.006), 2.5e-3)], [P.Slit([(0.013, 0.004), (0.018, 0.005)])], size=2e-3
    )
    controls = start(outline)
    if remeshed:
        controls[1][2] *= 1.3
        controls[2][0, 0] -= 1e-3
        outline.positions(controls)
    assert (outline.n_meshes > 1) == remeshed
    assert torch.autograd.gradcheck(lambda *c: outline.positions(c), [c.requires_grad_() for c in controls])


def test_gradient_of_a_solve_by_the_ends_of_a_slit_agrees_with_differences():
    outline = arm(most_stretch=3.0)
    controls = outline.controls()
    by_controls = torch.autograd.grad(lift(outline, controls), controls)
    rng = np.random.default_rng(1)
    for k, size in ((0, 1e-5), (1, 1e-5), (2, 1e-5)):
        along = torch.tensor(rng.standard_normal(controls[k].shape))
        ends = []
        for sign in (1.0, -1.0):
            moved = [each.detach().clone() for each in controls]
            moved[k] += sign * size * along
            ends.append(lift(outline, moved))
        assert outline.n_meshes == 1
        expected = float(ends[0] - ends[1]) / (2.0 * size)
        assert float((by_controls[k] * along).sum()) == pytest.approx(expected, rel=2e-4)


def test_a_search_goes_on_over_new_meshes_with_the_state_of_its_optimizer():
    pictures, outline = [], None
    outline = arm(most_stretch=1.3, on_remesh=lambda before, after: pictures.append((before, after)))
    fixed, _, _ = start(outline)
    values = magnetization(outline.first_mesh)
    circle, slit = (each.clone().requires_grad_() for each in start(outline)[1:])
    tilt = torch.zeros(outline.first_mesh.n_faces, 3, dtype=torch.float64, requires_grad=True)

    def objective(circle, slit, tilt):
        return -1e3 * lift(outline, [fixed, circle, slit], values + 1e4 * tilt) + 1e-2 * (tilt**2).sum()

    free = [circle, slit, tilt]
    lower = [torch.tensor([0.007, 0.003, 0.0016]), torch.tensor([[0.014, 0.002]] * 2), -1.0]
    upper = [torch.tensor([0.012, 0.005, 0.0028]), torch.tensor([[0.028, 0.006]] * 2), 1.0]
    optimizer = ms.optim.MMA(free, lower=lower, upper=upper, move=0.2)
    found = ms.minimize(objective, free, optimizer, max_iterations=8, progress=False)
    assert outline.n_meshes > 1 and len(pictures) >= 1
    assert all(isinstance(each, ms.TriangleMesh) for pair in pictures for each in pair)
    assert pictures[-1][1] is outline.mesh
    heights = [-record.objective for record in found.history]
    assert heights[-1] > heights[0] + 0.5  # mm
    assert np.diff(heights).min() > -0.02 * heights[0]
    assert optimizer.state_dict()["run"]  # its asymptotes


def test_a_search_over_new_meshes_resumes_with_the_same_bits(tmp_path):
    def search(iterations, path, resume):
        outline = arm(most_stretch=1.2)
        fixed, circle, slit = start(outline)
        circle.requires_grad_()

        def objective(circle):
            return -1e3 * lift(outline, [fixed, circle, slit])

        bounds = {
            "lower": torch.tensor([0.008, 0.0038, 0.0016]),
            "upper": torch.tensor([0.012, 0.0042, 0.003]),
        }
        found = ms.minimize(
            objective,
            [circle],
            ms.optim.MMA([circle], **bounds, move=0.1),
            max_iterations=iterations,
            stateful=[outline],
            checkpoint=path,
            resume=resume,
            progress=False,
        )
        return found.objective, outline

    whole, outline = search(4, tmp_path / "whole.pt", False)
    assert outline.n_meshes > 1
    search(3, tmp_path / "parts.pt", False)
    again, resumed = search(4, tmp_path / "parts.pt", True)
    assert again == whole
    np.testing.assert_array_equal(resumed.mesh.rest_positions, outline.mesh.rest_positions)
    np.testing.assert_array_equal(resumed.reference_positions, outline.reference_positions)


def test_values_of_faces_are_means_over_the_same_material():
    outline = arm()
    values = torch.tensor(outline.first_mesh.face_barycenters, requires_grad=True)
    assert (outline.transferred(values) == values).all()
    outline.positions(narrowed(start(outline)))
    found = outline.transferred(values)
    there = outline.reference_positions[outline.mesh.faces].mean(axis=1)
    assert found.detach().numpy() == pytest.approx(there, rel=0, abs=0.4 * SIZE)
    assert outline.transferred(torch.ones(outline.first_mesh.n_faces)).numpy() == pytest.approx(
        1.0, rel=1e-12
    )
    (by_values,) = torch.autograd.grad((found**2).sum(), values)
    assert torch.autograd.gradcheck(outline.transferred, values)
    assert by_values.shape == values.shape


def test_material_keeps_its_reference_positions_where_the_sheet_is_stretched_evenly():
    outline = P.MeshedOutline(P.Polygon([(0, 0), (1, 0), (1, 1), (0, 1)]), size=0.15)
    twice = [torch.tensor([[0, 0], [3.0, 0], [3, 1], [0, 1]])]
    outline.positions(twice)
    assert outline.n_meshes == 2
    wanted = outline.mesh.rest_positions / (3.0, 1.0, 1.0)
    assert outline.reference_positions == pytest.approx(wanted, rel=0, abs=1e-13)


def test_displacements_of_the_last_mesh_keep_the_two_sides_of_a_slit_apart():
    outline = P.MeshedOutline(
        P.Polygon([(0, 0), (1, 0), (1, 1), (0, 1)]), [P.Slit([(0.3, 0.5), (0.7, 0.5)])], size=0.1
    )
    old = outline.mesh
    side = np.zeros(old.n_vertices)  # +1 at vertices of faces above the slit's line only, -1 below
    above = old.face_barycenters[:, 1] > 0.5
    side[old.faces[above]] += 1.0
    side[old.faces[~above]] = np.where(side[old.faces[~above]] > 0.0, 0.0, -1.0)
    controls = start(outline)
    controls[1][0, 0] -= 0.15
    outline.positions(controls)
    assert outline.n_meshes > 1
    found = outline.from_last_mesh(side)
    x, y, _ = outline.mesh.rest_positions.T
    on_slit = (np.abs(y - 0.5) < 1e-9) & (x > 0.4) & (x < 0.6)
    assert on_slit.sum() >= 2
    assert np.sort(found[on_slit]) == pytest.approx(np.repeat([-1.0, 1.0], on_slit.sum() // 2), abs=0.1)


def test_designs_far_apart_are_reached_over_several_meshes():
    outline = arm()
    controls = start(outline)
    corners, circle, slit = controls
    circle[0], slit[:, 0] = 0.005, slit[:, 0] - 0.004
    outline.positions(controls)
    assert outline.n_meshes > 3
    far = [corners, circle.clone(), slit]
    far[1][0] = 0.014  # into the slit
    with pytest.raises(ms.DesignRejected, match="slit 0"):
        outline.positions(far)
    assert outline.positions(controls).numpy() == pytest.approx(outline.mesh.rest_positions, abs=1e-17)


def test_a_design_that_is_rejected_leaves_the_mesh_as_before():
    outline = arm()
    corners, circle, slit = start(outline)
    before = outline.mesh
    crossed = corners.clone()
    crossed[1, 1] = 0.009
    with pytest.raises(
        ms.DesignRejected, match=r"side 0 of border 0 and side [34] of border 0 cross or touch"
    ):
        outline.positions([crossed, circle, slit])
    assert outline.mesh is before and outline.n_meshes == 1


def test_borders_that_nearly_touch_are_rejected():
    outline = arm()
    corners, circle, slit = start(outline)
    circle[1] = circle[2] + 5e-5
    with pytest.raises(ms.DesignRejected, match=r"an angle of .* degrees at \(0\.0\d+, .*\) m"):
        outline.positions([corners, circle, slit])


def test_outlines_that_no_sheet_has_are_refused_with_their_names():
    square = P.Polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    cases = [
        (
            [P.Polygon([(0, 0), (1, 0), (0, 1), (1, 1)])],
            [],
            "side 1 of border 0 and side 3 of border 0 cross",
        ),
        (
            [P.Polygon([(0, 0), (1, 0), (0.5, 0), (0, 1)])],
            [],
            "side 0 of border 0 and side 1 of border 0 cross",
        ),
        (
            [P.ClosedSpline([(0, 0), (1, 1), (1, 0), (0, 1)])],
            [],
            "side . of border 0 and side . of border 0 cross",
        ),
        (
            [square, P.Circle((0.5, 0.5), 0.05)],
            [],
            "border 1 has the radius 0.05 m, below the size of a face, 0.1 m",
        ),
        ([square, P.Circle((0.9, 0.5), 0.2)], [], "side 1 of border 0 and chord . of border 1 cross"),
        ([square, P.Circle((3.0, 0.5), 0.2)], [], "border 1 lies outside of border 0"),
        ([square, P.Circle((0.5, 0.5), 0.3), P.Circle((0.5, 0.5), 0.1)], [], "border 2 lies inside border 1"),
        ([square], [P.Slit([(0.5, 0.5), (0.6, 0.5)])], "slit 0 is 0.1 m long"),
        (
            [square],
            [P.Slit([(0.5, 0.5), (1.0, 0.5)])],
            "side 1 of border 0 and side 0 of slit 0 cross or touch",
        ),
    ]
    for borders, slits, message in cases:
        with pytest.raises(ValueError, match=message):
            P.MeshedOutline(borders, slits, size=0.1)
    with pytest.raises(ValueError, match="borders must"):
        P.MeshedOutline([P.Slit([(0.5, 0.5), (0.9, 0.5)])], size=0.1)
    with pytest.raises(ValueError, match="at least the outer one"):
        P.MeshedOutline([], size=0.1)
    with pytest.raises(ValueError, match="most_stretch must be above 1"):
        P.MeshedOutline(square, size=0.1, most_stretch=1.0)
    outline = P.MeshedOutline(square, size=0.3)
    with pytest.raises(ValueError, match=r"controls of border 0 .* must have shape"):
        outline.positions([torch.zeros(3, 2)])
    with pytest.raises(ValueError, match="controls must be a list of 1"):
        outline.positions([*outline.controls(), torch.zeros(3)])
    with pytest.raises(ValueError, match="values must have shape"):
        outline.transferred(torch.zeros(3))
    with pytest.raises(ValueError, match="one mesh so far"):
        outline.from_last_mesh(np.zeros(3))


def test_the_state_of_an_outline_of_another_size_is_refused():
    def square(side):
        corners = [(0, 0), (side, 0), (side, side), (0, side)]
        return ms.parametrize.MeshedOutline([ms.parametrize.Polygon(corners)], size=side / 4)

    small, large = square(0.01), square(0.02)
    assert np.array_equal(small.first_mesh.faces, large.first_mesh.faces)
    with pytest.raises(ValueError, match="another MeshedOutline"):
        large.load_state_dict(small.state_dict())
