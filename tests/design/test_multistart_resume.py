"""Tests of a multistart's folder: the results that a second call reuses, its refusals, and its files."""

import os
import pickle
import threading
from dataclasses import dataclass
from functools import partial

import multistart_runs as runs
import numpy as np
import pytest
import torch
from multistart_runs import STARTS, bits, quiet

import magshell as ms
from magshell.design.content_hash import content_hash
from magshell.design.minimum import Record


def logged(folder, start):
    """Return the sum of a start, after writing a file; start 2 fails until there are four files."""
    (folder / f"{start['seed']}-{len(os.listdir(folder))}").touch()
    if start["seed"] == 2 and len(os.listdir(folder)) < 4:
        raise RuntimeError("not yet")
    return start["x"].sum()


def test_a_second_call_does_only_the_rest(here, tmp_path):
    log, kept = tmp_path / "log", tmp_path / "a" / "b"
    log.mkdir()
    run = partial(logged, log)
    starts = [{"seed": seed, "x": np.full(2, float(seed))} for seed in (3, 2, 1)]
    first = quiet(run, starts, here, checkpoint=kept)
    assert len(first) == 2 and len(first.failed) == 1 and first.resumed == ()
    starts.append({"seed": 0, "x": np.zeros(2)})
    second = quiet(run, starts, here, checkpoint=kept, resume=True)
    assert second.objectives.tolist() == [0.0, 2.0, 4.0, 6.0] and second.resumed == (0, 2)
    third = quiet(run, starts, here, checkpoint=kept, resume=True)
    assert third.objectives.tolist() == [0, 2, 4, 6] and third.resumed == (0, 1, 2, 3)
    begun = sorted(os.listdir(log), key=lambda name: int(name.split("-")[1]))
    assert [int(name.split("-")[0]) for name in begun] == [3, 2, 1, 2, 0]
    assert sorted(path.name for path in kept.iterdir()) == [f"start-000{number}.npz" for number in range(4)]


def test_resumed_starts_are_reported(here, tmp_path, capsys):
    quiet(runs.square, [1.0, 2.0], here, checkpoint=tmp_path)
    found = ms.multistart(runs.square, [1.0, 2.0, 3.0], here, checkpoint=tmp_path, resume=True)
    assert "3 of 3 starts finished" in repr(found) and "2 of them earlier (from the checkpoint)" in repr(
        found
    )
    assert f"2 from {tmp_path}" in capsys.readouterr().err
    ms.multistart(runs.square, [1.0, 2.0], here, checkpoint=tmp_path, resume=True)
    assert f"2 from {tmp_path}" in capsys.readouterr().err  # also where nothing is left to do


def test_resumed_gives_the_same_bits(here, tmp_path):
    whole = quiet(runs.valley, STARTS, here)
    quiet(runs.valley, STARTS[:2], here, checkpoint=tmp_path)
    again = quiet(runs.valley, STARTS, here, checkpoint=tmp_path, resume=True)
    assert bits(again) == bits(whole)
    for one, other in zip(again, whole, strict=True):
        mine, theirs = one.result, other.result
        assert type(mine) is ms.MinimizeResult and mine.reason == theirs.reason
        assert [vars(r) | {"seconds": 0} for r in mine.history] == [
            vars(r) | {"seconds": 0} for r in theirs.history
        ]


RESULTS = {
    "plain": (1.5, None, True, 3, "words \ud800", b"bytes", 2j, [1, (2, [])], {"a": 1, (1, 2): {3: "c"}}),
    "not finite": (np.inf, -0.0, float("nan")),
    "arrays": (
        1.0,
        np.arange(6.0).reshape(2, 3).T,
        np.float32(2.5),
        np.zeros((0, 3), int),
        np.array(["a", "bc"]),
    ),
    "tensors": (
        torch.tensor(1.0),
        torch.arange(6).reshape(2, 3),
        torch.tensor([1.5, 2.5], dtype=torch.bfloat16),
        torch.tensor([1j]),
        torch.zeros(0, 2, requires_grad=True),
        torch.tensor([True]),
    ),
    "records": (
        ms.MinimizeResult([torch.ones(2)], 1.0, 0.0, [Record(0, 1.0, {"a": 1.0}, 0.0, 1.0, 0.1, 1)], "why"),
        1,
    ),
}


@pytest.mark.parametrize("kind", RESULTS)
def test_results_come_back_as_they_were(kind, here, tmp_path):
    run = partial(returned, RESULTS[kind])
    quiet(run, [0], here, checkpoint=tmp_path)
    found = quiet(run, [0], here, checkpoint=tmp_path, resume=True)
    assert found.resumed == (0,) and content_hash(found.best.result) == content_hash(RESULTS[kind])
    gradients = [t.requires_grad for t in found.best.result if isinstance(t, torch.Tensor)]
    assert gradients == [t.requires_grad for t in RESULTS[kind] if isinstance(t, torch.Tensor)]


def returned(result, start):
    return result


@dataclass
class Mine:
    objective: float


@pytest.mark.parametrize(
    "result", [Mine(1.0), (1.0, {1, 2}), (1.0, [np.array([None])]), (1.0, torch.nn.Linear(1, 1))]
)
def test_a_result_that_is_not_data_is_refused_at_the_first(result, here, tmp_path):
    # With threads it may be another's that comes first, or with others.
    message = r"stopped after \d of 3 starts: TypeError: the result of start \d.* is a .* hold data only: return numbers"
    with pytest.raises(ms.MultistartFailed, match=message) as caught:
        quiet(partial(returned, result), [0, 1, 2], here, checkpoint=tmp_path)
    assert caught.value.last_good.best.result is result and list(tmp_path.iterdir()) == []
    assert quiet(partial(returned, result), [0], here).best.result is result  # without a folder


# Another run, another start


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (np.array([1.0, 2.0]), np.array([1.0, 2.5])),
        (np.array([1.0, 2.0]), np.array([1.0, 2.0], dtype=np.float32)),
        (torch.tensor([1.0]), torch.tensor([-1.0])),
        ({"x": [1.0, np.zeros(2)]}, {"x": [1.0, np.ones(2)]}),
        ((1, 2), [1, 2]),
        (1, 2),
        (0.0, -0.0),
        (Mine(1.0), Mine(2.0)),
    ],
)
def test_resuming_with_another_start_is_refused(before, after, here, tmp_path):
    quiet(lambda start: 1.0, [0, before], here, checkpoint=tmp_path)
    with pytest.raises(ValueError, match=r"start-0001\.npz was begun at another start than number 1"):
        quiet(lambda start: 1.0, [0, after], here, checkpoint=tmp_path, resume=True)


THICKNESS = 5e-4


def module_run(start):
    return start + helped()


def helped():
    return THICKNESS


def of_thickness(start, thickness=5e-4, other=None):
    return start * thickness


class Model:
    def __init__(self, thickness):
        self.thickness = thickness

    def __call__(self, start):
        return start * self.thickness

    def run(self, start):
        return self(start)


def holding(thickness):
    return lambda start: start * thickness


def strip(thickness):
    sheet = ms.Shell(ms.meshes.rectangle(0.1, 0.02, cells=(4, 1)), thickness=thickness, young_modulus=1e6)
    return ms.Scene(sheet, supports=[ms.Clamp(sheet.mesh.edges_at(x=0.0))], field=ms.UniformField())


def first_of(scene, start):
    return float(start)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        (
            partial(of_thickness, thickness=5e-4),
            partial(of_thickness, thickness=4e-4),
            "thickness was 0.0005 and is 0.0004",
        ),
        (of_thickness, partial(of_thickness, thickness=5e-4), "thickness was not there and is 0.0005"),
        (
            partial(of_thickness, other=np.zeros(3)),
            partial(of_thickness, other=np.array([0, 0, 1e-9])),
            r"other was a ndarray of shape \(3,\) with digest \w+ and is a ndarray",
        ),
        (
            partial(first_of, strip(1e-3)),
            partial(first_of, strip(2e-3)),
            "argument 0 was a Scene with digest",
        ),
        (holding(5e-4), holding(4e-4), "thickness around it was 0.0005 and is 0.0004"),
        (Model(5e-4), Model(4e-4), "its object was a Model with digest"),
        (Model(5e-4).run, Model(4e-4).run, "its object was a Model with digest"),
        (lambda start: start + 1.0, lambda start: start + 2.0, "its code was a code with digest"),
        (
            of_thickness,
            module_run,
            r"written by test_multistart_resume\.of_thickness, and this one is .*module_run",
        ),
    ],
)
def test_resuming_with_another_run_is_refused(before, after, words, here, tmp_path):
    quiet(before, [1.0], here, checkpoint=tmp_path)
    with pytest.raises(ValueError, match=rf"start-0000\.npz is the result of another run: .*{words}"):
        quiet(after, [1.0], here, checkpoint=tmp_path, resume=True)
    assert quiet(before, [1.0], here, checkpoint=tmp_path, resume=True).resumed == (0,)


def test_globals_of_a_run_are_part_of_its_digest(here, tmp_path, monkeypatch):
    quiet(module_run, [1.0], here, checkpoint=tmp_path)
    monkeypatch.setitem(globals(), "THICKNESS", 4e-4)
    with pytest.raises(ValueError, match="the module's helped was a function with digest"):
        quiet(module_run, [1.0], here, checkpoint=tmp_path, resume=True)


def test_runs_without_a_digest_are_refused_before_any_work(here, tmp_path):
    lock = threading.Lock()
    with pytest.raises(ValueError, match="cannot for lock around it: a lock has no digest"):
        quiet(lambda start: start if lock else 0, [1.0], here, checkpoint=tmp_path)
    with pytest.raises(ValueError, match="cannot for start 1: a lock has no digest"):
        quiet(runs.square, [1.0, lock], here, checkpoint=tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_digest_is_of_what_a_value_is():
    one, other = strip(1e-3), strip(1e-3)
    ms.equilibrium(one, remanent_magnetization=(1e4, 0, 0), applied_flux_density=(0, 0, 1e-3))
    assert content_hash(one) == content_hash(other) != content_hash(strip(2e-3))
    looped = [1]
    looped.append(looped)
    assert content_hash(looped) == content_hash(looped) and content_hash({"a": 1, "b": 2}) == content_hash(
        {"b": 2, "a": 1}
    )
    shared = np.zeros(2)
    assert content_hash([shared, shared]) == content_hash([np.zeros(2), np.zeros(2)])
    assert content_hash({1, "a", None}) == content_hash({None, "a", 1}) != content_hash({1, "a"})
    assert (
        len(
            {content_hash(value) for value in (1, 1.0, True, "1", b"1", np.float64(1), torch.tensor(1), None)}
        )
        == 8
    )


# Files of others


def test_a_folder_is_not_taken_for_another(here, tmp_path):
    quiet(runs.square, [1.0], here, checkpoint=tmp_path)
    with pytest.raises(ValueError, match="holds 1 finished starts already: say resume=True"):
        quiet(runs.square, [1.0], here, checkpoint=tmp_path)
    (tmp_path / "start-0000.npz").write_bytes(b"half a file")
    with pytest.raises(ValueError, match=r"start-0000\.npz is not a finished start"):
        quiet(runs.square, [1.0], here, checkpoint=tmp_path, resume=True)
    with pytest.raises(ValueError, match="must be a folder"):
        quiet(runs.square, [1.0], here, checkpoint=tmp_path / "start-0000.npz", resume=True)


class Planted:
    """Leaves a mark when it is unpickled."""

    def __init__(self, mark):
        self.mark = str(mark)

    def __reduce__(self):
        return os.mkdir, (self.mark,)


@pytest.mark.parametrize("form", ["pickle", "object array", "contents"])
def test_a_planted_file_runs_nothing(form, here, tmp_path):
    kept, mark = tmp_path / "kept", tmp_path / "mark"
    quiet(runs.square, [1.0], here, checkpoint=kept)
    path = kept / "start-0000.npz"
    with np.load(path) as file:
        arrays = dict(file)
    objects = np.array([Planted(mark)], dtype=object)
    if form == "pickle":
        path.write_bytes(pickle.dumps(Planted(mark)))
    elif form == "object array":
        text = arrays["contents"].tobytes().replace(b'"result": 1.0', b'"result": {"array": 0}')
        np.savez(path, contents=np.frombuffer(text, np.uint8), array_0=objects)
    else:
        np.savez(path, contents=objects)
    (kept / "start-0000.pickle").write_bytes(pickle.dumps(Planted(mark)))
    with pytest.raises(ValueError, match=r"start-0000\.npz is not a finished start"):
        quiet(runs.square, [1.0], here, checkpoint=kept, resume=True)
    assert not mark.exists()


@pytest.mark.parametrize(
    "result", ['{"Popen": {"args": "true"}}', '{"tensor": [0, {"dtype": "load", "shape": [1]}, 0]}']
)
def test_data_of_unknown_kinds_is_refused(result, here, tmp_path):
    quiet(partial(returned, (1.0, np.zeros(1, np.uint8))), [1.0], here, checkpoint=tmp_path)
    path = tmp_path / "start-0000.npz"
    with np.load(path) as file:
        arrays = dict(file)
    text = arrays["contents"].tobytes().replace(b'{"array": 0}', result.encode())
    np.savez(path, **{**arrays, "contents": np.frombuffer(text, np.uint8)})
    with pytest.raises(ValueError, match="is not a finished start"):
        quiet(partial(returned, (1.0, np.zeros(1, np.uint8))), [1.0], here, checkpoint=tmp_path, resume=True)
