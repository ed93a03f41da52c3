"""Reports of a minimization about designs that could not be evaluated: in its bar, its records and its errors."""

import numpy as np
import pytest
import torch

import magshell as ms
from magshell.design.minimum import Record, conflict, in_words, reason_of


def walled(kind=ms.EquilibriumJumped, wall=1.0, load_case=1):
    """Return a bowl-shaped objective whose minimum lies behind a barrier."""

    def objective(x):
        if x.item() > wall:
            raise kind(f"at {x.item():.3g}", load_case=load_case)
        return (x - 2.0) ** 2 + 1.0

    return objective


def run(objective, iterations=20, **options):
    x = torch.tensor(0.0, dtype=torch.float64, requires_grad=True)
    optimizer = ms.optim.MMA([x], lower=-4.0, upper=4.0)
    return ms.minimize(objective, [x], optimizer, max_iterations=iterations, **options)


def now_and_then(objective, period=3):
    """Return an objective that rejects every third design, wherever it is."""
    count = []

    def rejecting(x):
        count.append(0)
        if len(count) % period == 0:
            raise ms.EquilibriumJumped("here", load_case=0)
        return objective(x)

    return rejecting


def test_records_and_result_say_why():
    found = run(now_and_then(walled(wall=9.0)), progress=False)
    total = sum(record.rejected for record in found.history)
    assert [sum(each.rejections.values()) for each in found.history] == [r.rejected for r in found.history]
    assert found.rejections == {"jump in load case 0": total} and total > 5
    assert f"{found.history[-1].evaluations} evaluations" in repr(found)
    assert f"{total} rejected (jump in load case 0)" in repr(found)


def test_a_jump_in_the_way_is_named():
    found = run(walled(), progress=False)
    assert found.reason.startswith("the equilibrium jumps, however short the step: at ")
    assert "(7 designs were rejected)" in found.reason and found.rejections["jump in load case 1"] >= 7
    assert found.conflict in repr(found)
    assert "The last step was rejected at every length, for a jump in load case 1: lower" in found.conflict
    assert "what is asked of that load case may conflict with the rest" in found.conflict
    alone = run(walled(load_case=None), progress=False).conflict
    assert "for a jump: lower designs seem" in alone and "that load case" not in alone


def records(*rejections, falling=0.0):
    """Return one record for each of these reasons, after a first without; the objective falls by a fraction an
    iteration.
    """
    listed = [Record(0, 1.0, {}, 0.0, 1.0, 0.0, 1)]
    for k, reasons in enumerate(rejections, start=1):
        counted = dict.fromkeys(reasons, 2)
        numbers = (1.0 - falling) ** k, {}, 0.0, 1.0, 0.0, 3 * k
        listed.append(Record(k, *numbers, rejected=sum(counted.values()), rejections=counted))
    return listed


JUMP = "jump in load case 1"


def test_the_same_jump_again_and_again_is_called_a_conflict():
    told = conflict(records([], [JUMP], [JUMP, "other"], [JUMP], falling=1e-3), {}, False)
    assert "In each of the last 3 iterations designs were rejected for a jump in load case 1" in told
    assert "and the objective fell by 0.3 %" in told and "may conflict with the rest" in told
    assert "last 4 iterations" in conflict(records([JUMP], [JUMP], [JUMP], [JUMP]), {}, False)
    assert "last 3 iterations" in conflict(records([JUMP], [JUMP]), {JUMP: 1}, False)


@pytest.mark.parametrize(
    ("history", "lost", "stuck"),
    [
        ([], {}, False),
        (records([JUMP], [JUMP]), {}, False),  # too few
        (records([JUMP], [JUMP], [JUMP], []), {}, False),  # over
        (records([JUMP], ["jump in load case 0"], [JUMP]), {}, False),  # of two cases
        (records([JUMP], [JUMP], [JUMP], falling=0.1), {}, False),  # it gains
        (records(*[["no equilibrium found"]] * 5), {}, False),
        (records([]), {"no equilibrium found": 7}, False),
    ],
)
def test_conflict_is_empty_for_other_histories(history, lost, stuck):
    assert conflict(history, lost, stuck) == ""


@pytest.mark.parametrize("kind", [ms.NotConverged, ms.DesignRejected])
def test_rejections_before_an_error_are_reported(kind):
    with pytest.raises(ms.ObjectiveFailed, match="with 7 designs rejected: at") as caught:
        run(walled(kind), progress=False)
    best = caught.value.last_good
    assert sum(best.rejections.values()) >= 7 and best.conflict == "" and "rejected (" in repr(best)


def test_the_bar_says_why_while_an_iteration_goes_on(monkeypatch):
    shown = []
    monkeypatch.setattr("magshell.design.minimize._TIME_TO_READ", -1.0)
    monkeypatch.setattr("tqdm.tqdm.set_postfix_str", lambda bar, text, *_: shown.append(text))
    found = run(walled(), iterations=4)
    assert any(", 1 rejected (jump in load case 1)" in text for text in shown)
    last, evaluations = found.history[-1], found.history[-1].evaluations + 7
    told = in_words(found.rejections)
    assert shown[-1] == f"objective {last.objective:.6g}, {evaluations} evaluations, {told}"
    assert len(shown) >= evaluations  # not only once an iteration


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (ms.EquilibriumJumped("x"), "jump"),
        (ms.EquilibriumJumped("x", load_case=0), "jump in load case 0"),
        (ms.NotConverged("x", load_case=2), "no equilibrium found in load case 2"),
        (ms.DesignRejected("too thin\nat face 3"), "too thin"),
        (ms.DesignRejected(""), "DesignRejected"),
    ],
)
def test_reasons_of_errors(error, reason):
    assert reason_of(error) == reason


def test_reasons_are_counted_in_words():
    assert in_words({}) == "" and in_words({"jump": 3}) == "3 rejected (jump)"
    assert in_words({"a": 1, "jump": 3}) == "4 rejected (3 jump, 1 a)"


def test_solves_of_load_cases_name_theirs():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    fields = np.array([(0, 0, 0.0), (0, 0, 5e-2)])
    # rest takes no iteration, and what bends more than one, however short the load step
    solver = ms.MixedNewton(max_iterations=1, max_relaxation_steps=1)
    for solve in (
        ms.WarmStart(scene, solver=solver),
        lambda **design: ms.equilibrium(scene, solver=solver, **design),
    ):
        with pytest.raises(ms.NotConverged, match="load case 1 of 2") as caught:
            solve(remanent_magnetization=(4e4, 0, 0), applied_flux_density=fields)
        assert caught.value.load_case == 1 and len(caught.value.last_good) == 2
