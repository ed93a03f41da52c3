"""Bounded effort of a search for an equilibrium: it gives up and reports its state and the likely cause."""

import numpy as np
import pytest

import magshell as ms
from benchmarks.statics import oblique_field
from magshell.solve.statics.diagnosis import strain_of_loads
from magshell.solve.statics.single_solve import inputs_of


def cantilever(young_modulus, density=1e3):
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=young_modulus, mass_density=density)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))


@pytest.mark.parametrize("solver", [ms.MixedNewton, ms.Newton])
def test_a_search_gives_up_at_its_number_of_factorizations_and_says_what_it_saw(solver):
    scene, load_parameters = oblique_field(150, 20.0)
    with pytest.raises(ms.NotConverged) as caught:
        ms.equilibrium(scene, **load_parameters, solver=solver(max_factorizations=6))
    text, last = str(caught.value), caught.value.last_good
    assert last.factorizations <= 6 + 2  # what was reached is made exact
    assert "it gave up after 6 factorizations (max_factorizations of the solver)" in text
    assert "Then the energy was" in text and "of the extent" in text
    assert "Start from a nearby equilibrium, or allow it more (max_factorizations of the solver)" in text


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_a_modulus_of_the_wrong_unit_is_told_as_the_likely_cause():
    """Use E = 1e-10 Pa under gravity, which used to take 10,842 iterations before advising more of them."""
    with pytest.raises(
        ms.NotConverged, match=r"would strain them by about \d\S*e\+1\d: is a modulus \[Pa\]"
    ) as caught:
        ms.equilibrium(cantilever(1e-10), solver=ms.MixedNewton(max_factorizations=200))
    assert caught.value.last_good.factorizations <= 202
    assert caught.value.last_good.iterations < 5000


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
@pytest.mark.parametrize(("young_modulus", "strain"), [(1e6, 1e-3), (1e3, 1.0), (1e-10, 1e13)])
def test_the_strain_of_a_load_is_that_of_a_bar_under_its_weight_in_order_of_magnitude(young_modulus, strain):
    """Compare with rho g L / E = 981 Pa / E; a flat sheet clamped at one end has a third to a tenth of that."""
    found = strain_of_loads(inputs_of(cantilever(young_modulus), {}))
    assert 0.02 * strain < found < strain


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_iterations_without_a_factorization_count_too():
    with pytest.raises(ms.NotConverged, match="it gave up after") as caught:
        ms.equilibrium(cantilever(1e-10), solver=ms.MixedNewton(max_factorizations=300))
    assert caught.value.last_good.factorizations < 300


def test_the_default_is_twice_what_the_dearest_hard_case_takes():
    """Check the default against the hardest known case.

    A strongly bent strip with a face of 1e-5 times its neighbours' size takes 2,531 factorizations.
    """
    assert ms.MixedNewton().max_factorizations == ms.Newton().max_factorizations == 5000


def blown_up(pressure):
    """Return a scene of a box of rubber, 1 cm, with a hollow in its middle that a pressure blows up."""
    box = ms.meshes.box((0.01, 0.01, 0.01), cells=(3, 3, 3))
    inside = (np.abs(box.tetrahedron_barycenters - 0.005) < 0.01 / 6).all(axis=1)
    used, tetrahedra = np.unique(box.tetrahedra[~inside], return_inverse=True)
    mesh = ms.TetMesh(box.rest_positions[used], tetrahedra.reshape(-1, 4))
    law = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.4)
    body = ms.Solid(mesh, material=law, element="linear")
    floor = ms.Pin(mesh.vertices_at(z=0.0))
    return ms.Scene(body, supports=[floor], actuators=[ms.Cavity(body, pressure=pressure)])


def test_beyond_a_limit_point_of_a_pressure_a_search_ends_soon_and_names_follow_path():
    """Check a pressure that no equilibrium nearby bears, below which there are some."""
    assert ms.equilibrium(blown_up(2e4)).stable
    with pytest.raises(
        ms.NotConverged, match=r"probably at a limit point, .*: ms\.follow_path, with the same"
    ) as caught:
        ms.equilibrium(blown_up(5e5))
    assert caught.value.last_good.factorizations <= 502


def test_a_lid_that_hangs_on_edges_of_a_solid_is_named():
    """Check a cup of rubber, whose cavity is closed by a lid without stiffness on its inner edges."""
    size, wall = 0.04, 0.01
    box = ms.meshes.box((size, size, 0.03), cells=(4, 4, 3))
    x = box.tetrahedron_barycenters
    inside = (np.abs(x[:, :2] - size / 2) < size / 2 - wall).all(axis=1) & (x[:, 2] > wall)
    used, tetrahedra = np.unique(box.tetrahedra[~inside], return_inverse=True)
    mesh = ms.TetMesh(box.rest_positions[used], tetrahedra.reshape(-1, 4))
    law = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.45)
    cup = ms.Solid(mesh, material=law, element="linear")
    middle = mesh.rest_positions[mesh.faces].mean(axis=1)
    faces = (np.abs(middle[:, :2] - size / 2) < size / 2 - wall + 1e-6).all(axis=1)
    faces &= (middle[:, 2] > wall - 1e-6) & (middle[:, 2] < 0.03 - 1e-6)
    cavity = ms.Cavity(cup, faces, pressure=2e5, close_rims=True)
    scene = ms.Scene(cup, supports=[ms.Pin(mesh.vertices_at(z=0.0))], actuators=[cavity])
    rim = cavity.rim_on_solids(scene._bodies)
    assert len(rim) == 8 and np.allclose(mesh.rest_positions[rim, 2], 0.03)
    with pytest.raises(
        ms.NotConverged, match=r"The lid of a cavity .* hangs on edges of a solid, at vertices"
    ):
        ms.equilibrium(scene)


@pytest.mark.parametrize("wrong", [0, -1, 2.5, True, 2**31])
def test_a_budget_that_is_no_positive_number_is_refused(wrong):
    with pytest.raises(ValueError, match="max_factorizations"):
        ms.MixedNewton(max_factorizations=wrong)
