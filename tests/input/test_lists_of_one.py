"""Where a list is wanted, one of its kind will do as well; what is neither is told by its name. And wrong keywords of what
scenes and designs are made of."""

import numpy as np
import pytest

import magshell as ms

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
HOLE = [(0.4, 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6)]
TRIANGLE = [(0.1, 0.1), (0.2, 0.1), (0.1, 0.2)]
SLIT = [(0.1, 0.7), (0.5, 0.8)]


@pytest.mark.parametrize("one", [HOLE, tuple(HOLE), np.array(HOLE)], ids=["list", "tuple", "array"])
def test_single_hole_and_slit_need_no_list(one) -> None:
    pytest.importorskip("gmsh")
    alone = ms.meshes.outline(SQUARE, holes=one, slits=SLIT, size=0.2)
    listed = ms.meshes.outline(SQUARE, holes=[one], slits=[SLIT], size=0.2)
    np.testing.assert_array_equal(alone.rest_positions, listed.rest_positions)
    assert len(alone.boundary_loops) == 3
    two = ms.meshes.outline(SQUARE, holes=[HOLE, TRIANGLE], size=0.2)  # of other lengths
    assert len(two.boundary_loops) == 3
    assert len(ms.meshes.outline(SQUARE, holes=None, slits=None, size=0.2).boundary_loops) == 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"holes": 3}, "holes must be one or a list of them, got 3"),
        ({"slits": 0.5}, r"slits must be one or a list of them, got 0\.5"),
        ({"holes": [HOLE, 3]}, r"hole 1 \[m\] must have shape \(n, 2\)"),
        ({"holes": HOLE[0]}, r"hole 0 \[m\] must have shape \(n, 2\)"),
    ],
)
def test_bad_lists_of_polygons_are_refused(given, message) -> None:
    with pytest.raises(ValueError, match=message):
        ms.meshes.outline(SQUARE, size=0.2, **given)


MESH = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))


def test_single_support_load_contact_field_and_case_need_no_list() -> None:
    load, floor = ms.EdgeLoad(MESH.edges_at(x=0.1), (0, 0, 0.01)), ms.obstacles.Plane(center=(0, 0, -0.05))
    field = ms.Dipoles([(0, 0, 1)], [(0, 0, 1)])
    scene = ms.Scene(SHEET, supports=CLAMP, loads=load, contacts=ms.Contact(floor), field=field)
    assert (scene.supports, scene.loads, scene.obstacles) == ((CLAMP,), (load,), (floor,))
    rest = ms.equilibrium(ms.Scene(SHEET, supports=CLAMP, loads=load))
    assert len(ms.EquilibriumSet(rest)) == 1 and ms.EquilibriumSet(rest)[0] is rest


def test_single_tensor_state_and_direction_need_no_list() -> None:
    torch = pytest.importorskip("torch")
    x = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    state = ms.WarmStart(ms.Scene(SHEET, supports=CLAMP))
    for optimizer in (ms.optim.LBFGS(x), ms.optim.MMA(x, lower=0, upper=1)):
        assert optimizer.parameters[0] is x
        found = ms.minimize(
            lambda x: ((x - 1) ** 2).sum(), x, optimizer, stateful=state, progress=False, max_iterations=3
        )
        assert found.objective < 3.0
    with pytest.raises(ValueError, match="stateful must be one or a list of them, got 3"):
        ms.minimize(lambda x: x.sum(), x, ms.optim.LBFGS(x), stateful=3, progress=False)
    with pytest.raises(ValueError, match="params must be one or a list of them, got 3"):
        ms.optim.LBFGS(3)
    ink = ms.PrintableSet(1.0, (1, 0, 0), levels=1)
    assert ink.levels == (1.0,) and ink.directions.tolist() == [[1, 0, 0]]
    line = ms.control.Polyline([(0, 0, 0), (1, 0, 0)])
    assert ms.control.Chain(line).length == 1.0
    with pytest.raises(ValueError, match="pieces must be"):
        ms.control.Chain(3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: ms.Clamp([0], displacment=(0, 0, 1)),
            r"Clamp\(\) has no keyword 'displacment'; .* displacement,",
        ),
        (
            lambda: ms.EdgeLoad([0], force=(0, 0, 1)),
            r"EdgeLoad\(\) has no keyword 'force'; .* force_per_length,",
        ),
        (
            lambda: ms.CylinderMagnet(0.1, 0.1, magnetization=(0, 0, 1)),
            r"CylinderMagnet\(\) .* 'magnetization'; .* remanent_magnetization,",
        ),
        (lambda: ms.Dipoles(position=[(0, 0, 1)]), r"Dipoles\(\) has no keyword 'position'; .* positions,"),
        (lambda: ms.obstacles.Sphere(radius=1, position=(0, 0, 1)), r"Sphere\(\) .* center"),
        (lambda: ms.Pressure(1.0, face=[0]), r"Pressure\(\) has no keyword 'face'; .* faces,"),
    ],
)
def test_a_wrong_keyword_is_told_with_those_that_there_are(make, message) -> None:
    with pytest.raises(TypeError, match=message):
        make()


def test_a_wrong_keyword_of_an_optimizer() -> None:
    torch = pytest.importorskip("torch")
    x = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    for make in (ms.optim.LBFGS, ms.optim.MMA, ms.optim.GCMMA):
        with pytest.raises(TypeError, match=r"MMA\(\)|LBFGS\(\) has no keyword 'lr'; it has"):
            make([x], lr=1.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: ms.Clamp(MESH.vertices_at(x=0.0)),
            r"Clamp edges were given as vertices: .* mesh.edges_between",
        ),
        (
            lambda: ms.EdgeLoad(MESH.vertices_where(lambda x: x[:, 0] > 0.09), (0, 0, 1)),
            "EdgeLoad edges were",
        ),
        (lambda: ms.Pin(MESH.edges_at(x=0.0)), "Pin vertices were given as edges: .* mesh.vertices_at"),
        (lambda: ms.PointLoad(MESH.faces_where(lambda x: x[:, 0] > 0.09), (0, 0, 1)), "given as faces"),
        (
            lambda: ms.AreaLoad((0, 0, 1), faces=MESH.vertices_at(x=0.0)[:2]),
            "AreaLoad faces were given as vert",
        ),
        (lambda: ms.Pressure(1.0, faces=BOX.tetrahedra_at(x=0.0)), "Pressure faces were given as tetrahedra"),
        (
            lambda: ms.Pressure(1.0, faces=CURVED.elements_where(lambda x: x[:, 0] > 0.05)),
            r"Pressure faces were given as elements of six nodes: .* of element k are 4 k to 4 k \+ 3",
        ),
        (
            lambda: ms.Fibres(BOX.vertices_at(x=0.0)[:1], [(1, 0, 0)]),
            "elements were given as vertices: select tetrahedra, as by mesh.tetrahedra_at",
        ),
        (
            lambda: ms.fibres_along([(0, 0, 0), (1, 1, 1)], BOX, reach=1.0, elements=BOX.faces_at(x=0.0)),
            "elements were given as faces: select tetrahedra",
        ),
        (
            lambda: ms.PneumaticCells(CUBE, [BOX.vertices_at(x=0.0)], stiffness=1.0),
            "PneumaticCells groups were given as vertices: select tetrahedra",
        ),
    ],
)
def test_vertices_are_not_taken_for_edges(make, message) -> None:
    """Check the refusal of vertex numbers where edges are expected; they used to select unrelated edges without a
    warning.
    """
    with pytest.raises(ValueError, match=message):
        make()


BOX = ms.meshes.box((1, 1, 1), cells=(1, 1, 1))
CUBE = ms.Solid(BOX, material=ms.NeoHookean(young_modulus=1.0, poisson_ratio=0.0), element="linear")
CURVED = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2), order=2)


def test_selections_are_arrays_otherwise() -> None:
    import pickle

    vertices, edges = MESH.vertices_at(x=0.0), MESH.edges_at(x=0.0)
    plain = np.array(vertices)
    assert repr(vertices) == repr(plain) and vertices.tolist() == plain.tolist()
    for made in (
        vertices + 1,
        vertices == 1,
        np.isin(np.arange(9), vertices),
        MESH.edges[edges],
        2 * vertices,
    ):
        assert type(made) is np.ndarray
    assert ms.Pin(np.setdiff1d(vertices, vertices[:1])).vertices.tolist() == plain[1:].tolist()
    assert ms.Clamp(MESH.edges_between(vertices)).edges.tolist() == edges.tolist()
    assert ms.Clamp(np.array(vertices)).edges.tolist() == plain.tolist()  # a plain array may be anything
    other = MESH.vertices_at(y=0.0)
    for joined in (
        np.concatenate([vertices, other]),
        np.union1d(vertices, other),
        np.append(vertices, other),
    ):
        with pytest.raises(ValueError, match="Clamp edges were given as vertices"):
            ms.Clamp(joined)
    for made in (
        np.concatenate([vertices, edges]),
        np.concatenate([vertices, [3]]),
        np.stack([vertices] * 2),
    ):
        assert type(made) is np.ndarray
    again = pickle.loads(pickle.dumps(vertices))
    assert again.tolist() == plain.tolist() and isinstance(again, np.ndarray)
    with pytest.raises(
        ValueError, match=r"field must hold fields of magshell .* ms.MagpylibField.*, got int"
    ):
        ms.Scene(SHEET, supports=CLAMP, field=3)
