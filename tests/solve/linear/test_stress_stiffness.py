"""Linear buckling by the stiffness of stresses: loads that bend the body, against closed forms and CalculiX."""

import warnings

import numpy as np
import pytest

import magshell as ms

LENGTH, WIDTH, THICKNESS, YOUNG_MODULUS = 0.1, 0.01, 1e-3, 1e6
EULER = np.pi**2 / 4 * YOUNG_MODULUS * THICKNESS**3 / 12 / LENGTH**2  # N/m, 0.02056


def column(lateral, kind="six-node"):
    """Build a clamped column that 1 N/m press along it, and a part of that bends to one side."""
    force = np.array([-1.0, 0.0, lateral])
    if kind == "solid":
        mesh = ms.meshes.box((LENGTH, WIDTH, THICKNESS), cells=(20, 2, 1))
        material = ms.StVenantKirchhoff(young_modulus=YOUNG_MODULUS, poisson_ratio=0.0)
        body = ms.Solid(mesh, material=material, mass_density=1e3)
        load = ms.AreaLoad(force / THICKNESS, faces=body.mesh.faces_at(x=LENGTH))
        return ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(x=0.0))], loads=[load])
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=(20, 2), order=2 if kind == "six-node" else 1)
    more = {} if kind == "six-node" else {"bending": kind}
    body = ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0, **more)
    load = ms.EdgeLoad(mesh.edges_at(x=LENGTH), force)
    return ms.Scene(body, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])


@pytest.mark.parametrize("kind", ["hinge", "midedge", "six-node", "solid"])
def test_lateral_loads_do_not_change_the_factor_of_a_column(kind):
    with warnings.catch_warnings():
        warnings.simplefilter("error", ms.LinearTheoryWarning)
        straight, nearly = (ms.linear_buckling(column(each, kind)).factors[0] for each in (0.0, 1e-4))
    assert straight == pytest.approx(EULER, rel=0.02)
    assert nearly == pytest.approx(straight, rel=1e-6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ms.LinearTheoryWarning)
        bent = ms.linear_buckling(column(1e-2, kind)).factors[0]
    assert bent == pytest.approx(straight, rel=1e-3)


def test_buckling_warns_where_the_response_is_no_small_displacement():
    with pytest.warns(ms.LinearTheoryWarning, match=r"a shell bends so far.*ms\.follow_path"):
        ms.linear_buckling(column(1e-2))
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=(20, 2))
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0)
    # A couple turns the end by 0.2 rad where the axial force buckles the strip.
    axial = ms.EdgeLoad(mesh.edges_at(x=LENGTH), (-EULER, 0, 0))
    couple = ms.EdgeCouple(mesh.edges_at(x=LENGTH), 0.2 * YOUNG_MODULUS * THICKNESS**3 / 12 / LENGTH)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[axial, couple])
    with pytest.warns(ms.LinearTheoryWarning, match=r"bodies rotate by 0\.(19|2) rad"):
        ms.linear_buckling(scene)


def test_a_plate_under_pressure_does_not_buckle():
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(6, 6), order=2)
    plate = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3)
    scene = ms.Scene(plate, supports=[ms.Clamp(mesh.boundary_edges)], loads=[ms.AreaLoad((0, 0, 1.0))])
    with pytest.raises(ValueError, match="nothing buckles"):
        ms.linear_buckling(scene)


def test_stiffness_of_stresses_about_an_equilibrium_is_that_of_the_remaining_load():
    """Check buckling from half of the load on: the way to the whole one buckles after 2 EULER - 1 of it."""
    scene = column(0.0)
    half = ms.equilibrium(scene, load_factor=0.5 * EULER)
    found = ms.linear_buckling(scene, half, load_factor=EULER).factors[0]
    assert found == pytest.approx(2.0 * ms.linear_buckling(scene).factors[0] / EULER - 1.0, rel=1e-3)


@pytest.mark.filterwarnings("ignore::magshell.LinearTheoryWarning")
@pytest.mark.parametrize(
    ("ratio", "materials"),
    [
        (0.3, (ms.NeoHookean, ms.StVenantKirchhoff, ms.Corotated, ms.StableNeoHookean)),
        (0.45, (ms.NeoHookean, ms.StVenantKirchhoff)),  # of the mean volume of each element
    ],
)
def test_materials_that_are_equal_at_rest_buckle_at_the_same_load(ratio, materials):
    def factor(make):
        mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(6, 2, 2))
        block = ms.Solid(mesh, material=make(young_modulus=1e6, poisson_ratio=ratio), mass_density=1e3)
        load = ms.AreaLoad((-100.0, 0, 10.0), faces=block.mesh.faces_at(x=0.1))
        return ms.linear_buckling(
            ms.Scene(block, supports=[ms.Pin(block.mesh.vertices_at(x=0.0))], loads=[load])
        ).factors[0]

    first, *others = [factor(make) for make in materials]
    assert others == pytest.approx([first] * len(others), rel=1e-8)


def test_a_tube_in_axial_compression_buckles_as_in_calculix():
    """Compare with S8R elements of CalculiX 2.20 on a mesh of the same corners, clamped at one end, held round at the other.

    Finer meshes go to 3.704 N here, to 3.670 N there: S8R shears through its thickness, a fiftieth of the radius.
    """
    radius, length = 0.05, 0.08
    flat = ms.meshes.rectangle(2 * np.pi * radius, length, cells=(36, 14), order=2)
    around, along = flat.rest_positions[:, 0] / radius, flat.rest_positions[:, 1]
    bent = np.stack([radius * np.cos(around), radius * np.sin(around), along], axis=1)
    _, first, joined = np.unique(np.rint(bent / 1e-7), axis=0, return_index=True, return_inverse=True)
    mesh = ms.QuadraticTriangleMesh(bent[first], joined.reshape(-1)[flat.elements])
    tube = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3)
    ends = [
        np.flatnonzero((np.abs(mesh.rest_positions[mesh.nodes_of_edges, 2] - z) < 1e-9).all(axis=1))
        for z in (0.0, length)
    ]
    supports = [ms.Clamp(ends[0]), ms.Pin(np.unique(mesh.nodes_of_edges[ends[1]]), components="xy")]
    load = ms.EdgeLoad(ends[1], (0, 0, -1 / (2 * np.pi * radius)))  # 1 N in all
    found = ms.linear_buckling(ms.Scene(tube, supports=supports, loads=[load]), modes=1)
    assert found.factors[0] == pytest.approx(3.70106, rel=5e-3)
