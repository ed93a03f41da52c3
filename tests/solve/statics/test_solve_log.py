"""The log of a solve: its steps, what they cost, and how it is printed, saved and told on failure."""

import numpy as np
import pytest

import magshell as ms


def strip() -> ms.Scene:
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(12, 3))
    sheet = ms.Shell(
        mesh, thickness=1e-4, young_modulus=1e6, mass_density=1e3, remanent_magnetization=(60e3, 0, 0)
    )
    return ms.Scene(
        sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField(), gravity=(0, 0, -9.81)
    )


def compressed(**loads) -> ms.Scene:
    """Return a strip between clamps, one of which moves toward the other: it buckles."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(12, 3))
    sheet = ms.Shell(mesh, thickness=1e-4, young_modulus=1e6, mass_density=1e3)
    moved = ms.Clamp(mesh.edges_at(x=0.04), displacement=(-1e-5, 0, 0))
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0)), moved], **loads)


def assert_sums(result: ms.Equilibrium) -> None:
    assert sum(step.factorizations for step in result.log) == result.factorizations
    assert sum(step.iterations for step in result.log) == result.iterations


def test_load_steps_are_listed_with_their_energies() -> None:
    result = ms.equilibrium(strip(), applied_flux_density=(0, 0, 5e-3))
    assert_sums(result)
    steps = [step for step in result.log if step.method == "load step" and not step.failure]
    assert len(steps) == result.load_steps
    assert steps[-1].load_fraction == 1.0 and steps[-1].negative_pivots == 0
    assert steps[-1].energy == pytest.approx(result.energy, rel=1e-9)


def test_displacement_of_a_load_step_is_the_largest_of_a_vertex() -> None:
    result = ms.equilibrium(strip(), applied_flux_density=(0, 0, 0), gravity_factor=1e-3)
    (step,) = (step for step in result.log if step.method == "load step" and not step.failure)
    assert step.displacement == pytest.approx(np.abs(result.displacements).max(), rel=1e-12)


def test_a_strip_that_buckles_is_seen_to_leave_a_saddle() -> None:
    result = ms.equilibrium(compressed())
    assert_sums(result)
    methods = [step.method for step in result.log]
    assert result.saddles_escaped == methods.count("along the lowest mode of a saddle") >= 1
    descent = [step.energy for step in result.log if step.load_fraction == 1.0 and np.isfinite(step.energy)]
    assert descent[-1] == pytest.approx(result.energy, rel=1e-9)
    assert descent[-1] < descent[0]


def test_the_table_has_a_line_for_each_step() -> None:
    result = ms.equilibrium(compressed())
    lines = repr(result.log).splitlines()
    assert len(lines) == len(result.log) + 1
    assert lines[0].split()[:2] == ["load", "method"]
    assert result.log.summary() in repr(result)


def test_a_start_at_rest_takes_no_load_step() -> None:
    rest = ms.equilibrium(strip(), applied_flux_density=(0, 0, 0))
    again = ms.equilibrium(strip(), start=rest.positions, applied_flux_density=(0, 0, 0))
    assert_sums(again)
    same = ms.equilibrium(rest.scene, start=rest, applied_flux_density=(0, 0, 0))
    assert_sums(same)
    assert [step.method for step in same.log] == ["stability"]


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_a_failure_says_which_methods_were_tried() -> None:
    with pytest.raises(ms.NotConverged, match=r"Steps taken: load step \d+ \(\d+ failed\)") as caught:
        ms.equilibrium(
            strip(),
            applied_flux_density=(0, 0, 1e3),
            solver=ms.MixedNewton(max_iterations=2, max_relaxation_steps=1),
        )
    log = caught.value.last_good.log
    assert any(step.failure for step in log)
    assert_sums(caught.value.last_good)


def test_a_spent_budget_is_the_last_line() -> None:
    with pytest.raises(ms.NotConverged, match="max_factorizations") as caught:
        ms.equilibrium(compressed(), solver=ms.MixedNewton(max_factorizations=12))
    assert_sums(caught.value.last_good)
    assert any("it gave up after" in step.failure for step in caught.value.last_good.log)


def test_a_saved_result_keeps_its_log(tmp_path) -> None:
    scene = compressed()
    result = ms.equilibrium(scene)
    result.save(tmp_path / "rest.npz")
    again = ms.load(tmp_path / "rest.npz", scene)
    assert repr(again.log) == repr(result.log)
    assert len(again.log) == len(result.log)


def test_an_empty_log_says_so() -> None:
    assert repr(ms.SolveLog()) == "SolveLog: no steps"


def test_a_descent_that_fails_is_not_tried_again_from_the_same_state() -> None:
    box = ms.meshes.box((0.03, 0.03, 0.03), cells=(2, 2, 1))
    mesh = ms.TriangleMesh(box.rest_positions, box.faces)
    sheet = ms.Shell(mesh, thickness=2e-4, young_modulus=1e4)
    vacuum = ms.Cavity(sheet, gas_pressure=0.0)
    scene = ms.Scene(sheet, supports=[ms.Pin(mesh.vertices_at(z=0.0))], actuators=[vacuum])
    with pytest.raises(ms.NotConverged) as caught:
        ms.equilibrium(scene)
    log = caught.value.last_good.log
    assert_sums(caught.value.last_good)
    assert [step.method for step in log].count("descent") == 1
    # A saddle is left to states with an energy only, so no iteration begins at a cavity of negative volume.
    assert not any(step.failure.startswith("a cavity") for step in log)
