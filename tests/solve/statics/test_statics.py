"""Solves: stability, saddles, load steps, warm starts, counters, and several at once."""

import threading

import numpy as np
import pytest

import magshell as ms

LENGTH, WIDTH, THICKNESS, YOUNG = 0.1, 0.01, 1e-3, 1e6  # m, Pa
MAGNETIZATION = 4e4  # A/m
# Case C1-180: magnetized against the field, a cantilever is a column under the dead load h w M B on its tip.
CRITICAL = np.pi**2 * YOUNG * THICKNESS**2 / 12.0 / (4.0 * LENGTH**2) / MAGNETIZATION  # T


def strip(cells=(20, 2), **options):
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    return ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG, **{"poisson_ratio": 0.0, **options})


def end(shell, x):
    return shell.mesh.edges_at(x=x)


def compressed(shell, by):
    supports = [ms.Clamp(end(shell, 0.0)), ms.Clamp(end(shell, LENGTH), displacement=(-by, 0, 0))]
    return ms.Scene(shell, supports=supports)


def cantilever(shell):
    return ms.Scene(shell, supports=[ms.Clamp(end(shell, 0.0))], field=ms.UniformField())


def in_field(scene, flux_density, **options):
    return ms.equilibrium(
        scene,
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=flux_density,
        **options,
    )


# Stability


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_a_compressed_strip_leaves_the_saddle(bending):
    """Check a strip clamped at both ends, which buckles at a shortening of pi^2 h^2 / (3 L^2) of its length."""
    shell = strip(bending=bending)
    shortening = np.pi**2 * THICKNESS**2 / (3.0 * LENGTH)
    scene = compressed(shell, 4.0 * shortening)
    flat = ms.equilibrium(scene, require_stable=False)
    assert not flat.stable and flat.n_negative_eigenvalues > 0 and flat.saddles_escaped == 0
    assert np.abs(flat.positions[:, 2]).max() == 0.0
    buckled = ms.equilibrium(scene)
    assert buckled.stable and buckled.n_negative_eigenvalues == 0 and buckled.saddles_escaped >= 1
    assert buckled.energy < 0.7 * flat.energy
    # An inextensible strip: one full wave of height 2 sqrt(d L)/pi for an end that comes nearer by d.
    height = np.ptp(buckled.positions[:, 2])
    assert height == pytest.approx(2.0 * np.sqrt(3.0 * shortening * LENGTH) / np.pi, rel=0.05)
    assert "unstable" in repr(flat) and "stable" in repr(buckled)
    below = ms.equilibrium(compressed(shell, 0.9 * shortening))
    assert below.stable and np.abs(below.positions[:, 2]).max() == 0.0


@pytest.mark.parametrize("factor", [0.98, 1.05])
def test_an_opposed_field_buckles_the_strip_beyond_its_critical_value(factor):
    found = in_field(cantilever(strip((40, 2))), (-factor * CRITICAL, 0, 0))
    straight = np.abs(found.positions[:, 2]).max() < 1e-9 * LENGTH
    assert found.stable
    assert straight == (factor < 1.0)
    assert (found.saddles_escaped > 0) == (factor > 1.0)


def test_both_sides_of_a_saddle_cost_the_same():
    """Check both buckling directions of a strip; they are mirror images."""
    shell = strip()
    scene = cantilever(shell)
    found = in_field(scene, (-2.0 * CRITICAL, 0, 0))
    mirrored = in_field(scene, (-2.0 * CRITICAL, 0, 0), start=found.positions * (1, 1, -1))
    assert mirrored.energy == pytest.approx(found.energy, rel=1e-9)
    assert np.abs(mirrored.positions - found.positions * (1, 1, -1)).max() < 1e-7 * LENGTH


# How a solve gets there


def test_a_near_start_takes_fewer_iterations():
    scene = cantilever(strip())
    first = in_field(scene, (0, 0, 20.0 * CRITICAL))
    again = in_field(scene, (0, 0, 20.2 * CRITICAL), start=first)
    afresh = in_field(scene, (0, 0, 20.2 * CRITICAL))
    assert again.iterations < afresh.iterations
    assert np.abs(again.positions - afresh.positions).max() < 1e-8 * LENGTH
    there = in_field(scene, (0, 0, 20.0 * CRITICAL), start=first)
    assert there.iterations <= 1 and np.abs(there.positions - first.positions).max() < 1e-10 * LENGTH


def test_a_start_with_another_magnetization_is_no_equilibrium_but_a_start():
    scene = cantilever(strip())
    first = in_field(scene, (0, 0, 5.0 * CRITICAL))
    options = {
        "remanent_magnetization": (0.5 * MAGNETIZATION, 0, 0),
        "applied_flux_density": (0, 0, 5.0 * CRITICAL),
    }
    warm, cold = ms.equilibrium(scene, start=first, **options), ms.equilibrium(scene, **options)
    assert np.abs(warm.positions - cold.positions).max() < 1e-8 * LENGTH


@pytest.mark.parametrize(
    "solver", [ms.MixedNewton(), ms.MixedNewton(first_load_step=0.125), ms.Newton()], ids=repr
)
def test_an_end_turned_by_180_degrees_twists_the_strip(solver):
    shell = strip()
    turned = ms.Clamp(end(shell, LENGTH), rotation=(np.pi, 0, 0))
    guided = ms.Scene(shell, supports=[ms.Clamp(end(shell, 0.0)), turned])
    found = ms.equilibrium(guided, solver=solver)
    mesh = shell.mesh
    tip = mesh.vertices_at(x=LENGTH)
    expected = mesh.rest_positions[tip] * (1, -1, -1) + (0, WIDTH, 0)
    np.testing.assert_allclose(found.positions[tip], expected, atol=1e-12)
    middle = mesh.vertices_at(x=LENGTH / 2)
    upright = found.positions[middle] - found.positions[middle].mean(axis=0)
    assert np.abs(upright[:, :2]).max() < 0.05 * WIDTH and np.ptp(upright[:, 2]) > 0.95 * WIDTH
    assert found.stable and found.load_fraction == 1.0
    if solver.first_load_step < 1.0:
        assert found.load_steps > 1


def test_newton_and_mixed_newton_find_the_same_state():
    scene = cantilever(strip())
    mixed, plain = (
        in_field(scene, (0, 0, 4.0 * CRITICAL), solver=s) for s in (ms.MixedNewton(), ms.Newton())
    )
    assert np.abs(mixed.positions - plain.positions).max() < 1e-8 * LENGTH
    assert mixed.energy == pytest.approx(plain.energy, rel=1e-9)
    assert mixed.iterations < plain.iterations


# Contents of a result


def test_the_counters_make_sense():
    scene = cantilever(strip())
    found = in_field(scene, (0, 0, 5.0 * CRITICAL))
    assert found.iterations >= 3 and found.load_steps >= 1
    # At most one an iteration, as the last ones may share one; and one to judge stability.
    assert 3 <= found.factorizations <= found.iterations + 1
    assert found.failed_factorizations == 0 and found.relaxation_steps == 0 and found.saddles_escaped == 0
    assert found.residual <= ms.MixedNewton().tolerance
    assert found.wall_time > 0.0 and found.memory > 1e4 and found.load_fraction == 1.0
    assert found.energy == sum(found.energies.values()) and found.energies["magnetic"] < 0.0
    np.testing.assert_array_equal(found.applied_flux_density, (0, 0, 5.0 * CRITICAL))
    assert str(found.iterations) in repr(found)


def test_the_energies_are_those_of_the_state():
    scene = cantilever(strip())
    found = in_field(scene, (0, 0, 5.0 * CRITICAL))
    volume = THICKNESS * scene.mesh.face_areas
    # F_0 M of a tangential magnetization along x: M dx/dX, the mean of the strip's direction over the face.
    x = found.positions[scene.mesh.faces]
    rest = scene.mesh.rest_positions[scene.mesh.faces]
    gradient = np.linalg.solve((rest[:, 1:, :2] - rest[:, :1, :2]), x[:, 1:] - x[:, :1])
    expected = -np.sum(volume * MAGNETIZATION * gradient[:, 0, 2] * 5.0 * CRITICAL)
    assert found.energies["magnetic"] == pytest.approx(expected, rel=1e-12)


def test_progress_is_called():
    calls = []
    in_field(
        cantilever(strip()), (0, 0, 10.0 * CRITICAL), progress=lambda *arguments: calls.append(arguments)
    )
    assert calls
    assert all(0.0 <= progress <= 1.0 and residual >= 0.0 for progress, residual in calls)


def test_exception_in_progress_ends_the_solve():
    class Enough(Exception):
        pass

    def stop(progress, residual):
        raise Enough

    scene = cantilever(strip())
    with pytest.raises(Enough):
        in_field(scene, (0, 0, 10.0 * CRITICAL), progress=stop)
    assert in_field(scene, (0, 0, 10.0 * CRITICAL)).stable


def test_tensors_come_back_as_tensors():
    torch = pytest.importorskip("torch")
    scene = cantilever(strip())
    magnetization = torch.tensor([MAGNETIZATION, 0.0, 0.0], dtype=torch.float32)
    found = ms.equilibrium(
        scene, remanent_magnetization=magnetization, applied_flux_density=(0, 0, 5 * CRITICAL)
    )
    expected = in_field(scene, (0, 0, 5 * CRITICAL))
    assert found.positions.dtype == torch.float32 and not found.positions.requires_grad
    np.testing.assert_array_equal(found.positions.numpy(), expected.positions.astype(np.float32))
    assert "largest displacement" in repr(found)


# Several at once


def in_threads(jobs):
    """Runs the functions at the same time; their results, or what they raised."""
    results = [None] * len(jobs)

    def run(k):
        try:
            results[k] = jobs[k]()
        except BaseException as error:
            results[k] = error

    threads = [threading.Thread(target=run, args=(k,), daemon=True) for k in range(len(jobs))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60.0)
    assert not any(thread.is_alive() for thread in threads), "a solve hangs"
    return results


@pytest.mark.parametrize("shared", [False, True], ids=["a scene each", "one scene"])
def test_solves_at_the_same_time_give_what_they_give_alone(shared):
    """Run solves on one scene, where they wait for one another, and on several; each has its own magnetization."""
    shell = strip((60, 8))
    scenes = [cantilever(shell)] * 3 if shared else [cantilever(shell) for _ in range(3)]

    def job(k):
        magnetization = ((k + 1) * 1e4, 0, 0)
        return [
            ms.equilibrium(
                scenes[k], remanent_magnetization=magnetization, applied_flux_density=(0, 0, b)
            ).positions
            for b in (1e-3, 2e-3)
        ]

    alone = [job(k) for k in range(3)]
    together = in_threads([lambda k=k: job(k) for k in range(3)])
    for expected, found in zip(alone, together, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_python_fields_are_called_from_any_thread():
    shell = strip()
    field = ms.CustomField(lambda x: np.tile((0.0, 0.0, 5.0 * CRITICAL), (len(x), 1)), length_scale=LENGTH)
    scene = ms.Scene(shell, supports=[ms.Clamp(end(shell, 0.0))], field=field)
    expected = in_field(cantilever(shell), (0, 0, 5.0 * CRITICAL)).positions
    jobs = [lambda: ms.equilibrium(scene, remanent_magnetization=(MAGNETIZATION, 0, 0)).positions] * 2
    for found in in_threads(jobs):
        assert np.abs(found - expected).max() < 1e-8 * LENGTH
