"""ms.find_equilibria: the equilibria of one scene at the same load parameters."""

import numpy as np
import pytest

import magshell as ms

LENGTH, WIDTH = 0.12, 0.02


def beam(cells=(24, 2), shortening=0.5e-3) -> ms.Scene:
    """Build a bistable strip between clamps that are pushed together."""
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    sheet = ms.Shell(mesh, thickness=2.5e-3, young_modulus=4.2e6, poisson_ratio=0.5)
    supports = [
        ms.Clamp(mesh.edges_at(x=0.0)),
        ms.Clamp(mesh.edges_at(x=LENGTH), displacement=(-shortening, 0, 0)),
    ]
    return ms.Scene(sheet, supports=supports, field=ms.UniformField())


def outwards(mesh) -> np.ndarray:
    """Return the magnetization that points outwards from the middle, A/m."""
    magnetization = np.zeros((mesh.n_faces, 3))
    magnetization[:, 0] = 5e4 * np.sign(mesh.face_barycenters[:, 0] - LENGTH / 2)
    return magnetization


def height(found) -> float:
    mesh = found.scene.mesh
    return float(found.positions[mesh.nearest_vertex((LENGTH / 2, WIDTH / 2, 0)), 2])


def field(scene, strength=0.0) -> dict:
    return {"remanent_magnetization": outwards(scene.mesh), "applied_flux_density": (0, 0, strength)}


def test_both_wells_of_a_bistable_beam():
    scene = beam()
    found = ms.find_equilibria(scene, **field(scene), attempts=6)
    assert len(found) == 2 and found.stable
    up, down = sorted((height(each) for each in found), reverse=True)
    assert up == pytest.approx(-down, rel=1e-6) and up > 3e-3
    assert found.energy[0] == pytest.approx(found.energy[1], rel=1e-9)
    assert repr(found).startswith("Equilibria: 2\n")


def test_saddles_are_found_with_include_unstable():
    """Check the straight saddle and the one with two waves, each with the unstable directions of theory."""
    scene = beam()
    found = ms.find_equilibria(scene, **field(scene), include_unstable=True)
    assert (np.diff(found.energy) >= 0).all()
    assert [each.n_negative_eigenvalues for each in found] == [0, 0, 1, 1, 2]
    waves, straight = found[2], found[4]
    assert max(abs(height(waves)), abs(height(straight))) < 1e-9
    assert np.abs(waves.positions[:, 2]).max() > 1e-3
    assert np.abs(straight.positions[:, 2]).max() < 1e-12
    for each in found:
        assert each.residual < 1e-9 and each.load_fraction == 1.0


def test_a_field_takes_one_well_away():
    """Check that only one equilibrium remains above the field of the snap."""
    scene = beam()
    weak = ms.find_equilibria(scene, **field(scene, 2e-3), attempts=6)
    assert len(weak) == 2
    assert weak.energy[0] < weak.energy[1]
    strong = ms.find_equilibria(scene, **field(scene, 2e-2), attempts=6)
    assert len(strong) == 1


def test_gradients_through_each():
    torch = pytest.importorskip("torch")
    scene = beam()
    strength = torch.tensor(2e-3, dtype=torch.float64, requires_grad=True)

    def heights(value) -> list:
        flux_density = value * torch.tensor((0.0, 0.0, 1.0), dtype=torch.float64)
        found = ms.find_equilibria(
            scene,
            remanent_magnetization=outwards(scene.mesh),
            applied_flux_density=flux_density,
            attempts=12,
            include_unstable=True,
        )
        middle = scene.mesh.nearest_vertex((LENGTH / 2, WIDTH / 2, 0))
        return [(each, each.positions[middle, 2]) for each in found]

    found = heights(strength)
    stable = [at for each, at in found if each.stable]
    slopes = [torch.autograd.grad(at, strength, retain_graph=True)[0].item() for at in stable]
    with torch.no_grad():
        above, below = (
            [at.item() for each, at in heights(strength + d) if each.stable] for d in (1e-5, -1e-5)
        )
    assert len(stable) == len(above) == len(below) == 2
    np.testing.assert_allclose(slopes, (np.array(above) - below) / 2e-5, rtol=1e-4)
    saddle = next(at for each, at in found if not each.stable)
    with pytest.raises(ms.NoGradient):
        torch.autograd.grad(saddle, strength)


def test_single_equilibrium_is_found_once():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    load_parameters = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": (0, 0, 2e-3)}
    found = ms.find_equilibria(scene, **load_parameters, attempts=8)
    assert len(found) == 1
    np.testing.assert_allclose(
        found[0].positions, ms.equilibrium(scene, **load_parameters).positions, atol=1e-9
    )


def test_starts_of_ones_own():
    scene = beam()
    up = ms.equilibrium(scene, **field(scene))
    mirrored = up.positions * (1, 1, -1)
    found = ms.find_equilibria(scene, **field(scene), start=[up, mirrored], attempts=1)
    assert len(found) == 2
    again = ms.find_equilibria(scene, **field(scene), start=found, attempts=1)
    assert len(again) == 2
    assert len(ms.find_equilibria(scene, **field(scene), start=mirrored.tolist(), attempts=1)) == 1


def test_distinct_tolerance_merges_equilibria():
    scene = beam()
    assert len(ms.find_equilibria(scene, **field(scene), attempts=6, distinct_tolerance=0.1)) == 1


def test_far_beyond_its_first_instability_a_sheet_has_many():
    """Check a slit ring lifted by ten times its usual load: four routes ended in four equilibria."""
    strip = ms.meshes.rectangle(1.0, 1.0, cells=(16, 2))
    angle, radius = 2.0 * np.pi * strip.rest_positions[:, 0], 6.0 + 4.0 * strip.rest_positions[:, 1]
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)
    mesh = ms.TriangleMesh(points, strip.faces)
    sheet = ms.Shell(mesh, thickness=0.03, young_modulus=21e6, poisson_ratio=0.0)
    held, lifted = (np.flatnonzero(np.abs(strip.edge_midpoints[:, 0] - x) < 1e-9) for x in (0.0, 1.0))
    scene = ms.Scene(sheet, supports=[ms.Clamp(held)], loads=[ms.EdgeLoad(lifted, (0, 0, 8.0))])
    found = ms.find_equilibria(scene, attempts=8)
    assert len(found) >= 2 and found.stable
    assert (np.diff(found.energy) >= 0).all() and np.ptp(found.energy) > 1e-3 * abs(found.energy[0])


def test_interrupted_it_hands_back_what_it_has():
    scene = beam()
    calls = []

    def watch(fraction, residual):
        calls.append(fraction)
        if fraction > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(ms.Interrupted, match="after 3 equilibria were found, saddles counted") as caught:
        ms.find_equilibria(scene, **field(scene), attempts=10, progress=watch)
    assert len(caught.value.last_good) == 2
    assert min(calls) == 0.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"attempts": 0}, "attempts must be an integer of at least 1"),
        ({"include_unstable": 1}, "include_unstable must be True or False"),
        ({"distinct_tolerance": -1.0}, r"distinct_tolerance \[m\] must be positive"),
        ({"seed": -1}, "seed must be an integer"),
        ({"start": "x"}, "start"),
        ({"start": [np.zeros((3, 3))]}, r"start \[m\] must have shape"),
        ({"applied_flux_density": np.zeros((2, 3))}, r"applied_flux_density \[T\] must have shape"),
    ],
)
def test_bad_input_is_refused(options, message):
    scene = beam((4, 1))
    with pytest.raises(ValueError, match=message):
        ms.find_equilibria(scene, **{**field(scene), **options})


def test_a_start_that_looks_like_a_saddle_finds_it():
    """Use a strongly compressed strip, whose S shape is too far from both wells for deflation from them to find it."""
    mesh = ms.meshes.rectangle(0.04, 0.005, cells=(24, 3))
    sheet = ms.Shell(mesh, thickness=0.4e-3, young_modulus=1e6, poisson_ratio=0.45)
    ends = [
        ms.Clamp(mesh.edges_at(x=0.0)),
        ms.Clamp(mesh.edges_at(x=0.04), displacement=(-1.5e-3, 0, 0)),
    ]
    u = mesh.rest_positions[:, 0] / 0.04
    guess = mesh.rest_positions - np.outer(u, (1.5e-3, 0, 0))
    guess[:, 2] = 3e-3 * np.sin(2 * np.pi * u) * np.sin(np.pi * u)
    found = ms.find_equilibria(
        ms.Scene(sheet, supports=ends), start=guess, include_unstable=True, attempts=16, progress=False
    )
    kinds = [each.n_negative_eigenvalues for each in found]
    assert kinds[:2] == [0, 0] and 1 in kinds  # down both sides of it are the wells
    saddle = found[kinds.index(1)]
    assert saddle.energy > 1.5 * found[0].energy
    middle = mesh.vertices_at(x=0.02)
    assert abs(saddle.positions[middle, 2]).max() < 1e-5 < abs(found[0].positions[middle, 2]).min()
    alone = ms.find_equilibria(ms.Scene(sheet, supports=ends), start=guess, attempts=4, progress=False)
    assert all(each.stable for each in alone)
