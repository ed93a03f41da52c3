"""Tests of ms.minimize_printable: an interrupted search continues with the same bits; a callback sees its stages."""

import numpy as np
import pytest
import torch

import magshell as ms

SIX = np.vstack([np.eye(3), -np.eye(3)])
INK = ms.PrintableSet(1.0, SIX, levels=(1,))
numbers = np.random.default_rng(0)
MIX = torch.from_numpy(numbers.normal(size=(6, 12)))
WANTED = torch.from_numpy(numbers.normal(size=(6, 3)))
START = np.full((12, 3), 0.1)
SHORT = {"max_iterations": 8, "stage_iterations": 4, "blocks": 4, "exchanges": 12, "progress": False}


def mixed(m):
    return ((MIX @ m - WANTED) ** 2).sum()


class StoppedAt:
    """An objective with a state, which says stop at one of its evaluations."""

    def __init__(self, stop=None, error=KeyboardInterrupt):
        self.stop, self.error, self.calls, self.turns = stop, error, 0, 0

    def state_dict(self):
        return {"turns": self.turns}

    def load_state_dict(self, state):
        self.turns = state["turns"]

    def __call__(self, m):
        self.calls += 1
        self.turns += 1
        if self.calls == self.stop:
            raise self.error
        return mixed(m)


def searched(objective, ink=INK, **options):
    stateful = [objective] if hasattr(objective, "state_dict") else []
    return ms.minimize_printable(objective, START, ink, stateful=stateful, **{**SHORT, **options})


@pytest.mark.parametrize("levels", [(1,), None])
def test_resumed_search_gives_the_same_bits(levels, tmp_path):
    """Stop at evaluations throughout the search: in stages, between them, among the exchanges."""
    ink = ms.PrintableSet(1.0, SIX, levels=levels)
    whole = searched(counted := StoppedAt(), ink)
    total = counted.calls
    assert whole.not_printable == 0 and total > 60
    for stop in (2, 5, 15, total // 3, total // 2, total - 14, total - 3, total):
        file = tmp_path / f"{stop}.pt"
        with pytest.raises(ms.Interrupted):
            searched(StoppedAt(stop), ink, checkpoint=file, resume=True)
        again = searched(gone_on := StoppedAt(), ink, checkpoint=file, resume=True)
        assert torch.equal(again.remanent_magnetization, whole.remanent_magnetization)
        assert again.objective == whole.objective and again.rounded_at_once == whole.rounded_at_once
        assert [stage.name for stage in again.history] == [stage.name for stage in whole.history]
        assert gone_on.calls < total if stop > 15 else gone_on.calls <= total + 2
        assert list(tmp_path.glob(f"{stop}.pt*")) == [file]  # what was beside it is gone


def test_a_finished_search_is_only_checked(tmp_path):
    whole = searched(mixed, checkpoint=tmp_path / "a.pt")
    again = searched(counted := StoppedAt(), checkpoint=tmp_path / "b.pt")
    again = ms.minimize_printable(
        lambda m: counted(m), START, INK, **SHORT, checkpoint=tmp_path / "a.pt", resume=True
    )
    assert again.objective == whole.objective and again.reason == whole.reason
    calls = counted.calls
    searched(mixed, checkpoint=tmp_path / "a.pt", resume=True)
    assert counted.calls == calls


def test_last_good_design_has_the_stated_objective(tmp_path):
    """Check also during the exchanges, where the design was the best one but the objective that before them."""
    searched(counted := StoppedAt())
    lower = []
    for stop in range(3, counted.calls + 1, 5):
        for error, raised in ((KeyboardInterrupt, ms.Interrupted), (ZeroDivisionError, ms.ObjectiveFailed)):
            with pytest.raises(raised) as told:
                searched(StoppedAt(stop, error))
            left = told.value.last_good
            assert mixed(left.remanent_magnetization).item() == pytest.approx(left.objective, rel=1e-9)
        lower.append(left.objective)
    assert len(set(lower)) > 3


def test_begun_anew_it_takes_nothing_from_an_old_file(tmp_path):
    file = tmp_path / "run.pt"
    with pytest.raises(ms.Interrupted):
        searched(StoppedAt(30), checkpoint=file)
    with pytest.raises(ms.Interrupted):  # the file is of this one now, which has nothing yet
        searched(StoppedAt(1), ms.PrintableSet(2.0, SIX, levels=(1,)), checkpoint=file)
    with pytest.raises(ValueError, match="strength was 2 and is 1"):
        searched(mixed, checkpoint=file, resume=True)
    assert searched(mixed, checkpoint=file).objective == searched(mixed).objective


def test_a_callback_sees_each_stage_and_stops(tmp_path):
    seen = []
    whole = searched(mixed, callback=seen.append)
    assert tuple(seen) == whole.history
    file = tmp_path / "run.pt"
    stopped = searched(mixed, callback=lambda stage: stage.name == "hold", checkpoint=file)
    assert stopped.reason == "callback" and stopped.not_printable > 0
    assert [stage.name for stage in stopped.history] == ["free", "weight", "weight", "weight", "hold"]
    rest = []
    again = searched(mixed, callback=rest.append, checkpoint=file, resume=True)
    assert torch.equal(again.remanent_magnetization, whole.remanent_magnetization)
    assert [stage.name for stage in rest] == [stage.name for stage in whole.history[5:]]
    with pytest.raises(ms.ObjectiveFailed, match="division by zero") as told:
        searched(mixed, callback=lambda stage: 1 / 0)
    assert len(told.value.last_good.history) == 1


def test_resuming_with_another_search_is_refused(tmp_path):
    file = tmp_path / "run.pt"
    with pytest.raises(ms.Interrupted):
        searched(StoppedAt(40), checkpoint=file)
    begun = file.read_bytes()
    for change, message in (
        ({"ink": ms.PrintableSet(1.0, SIX, levels=(0, 1))}, "levels .*was"),
        ({"blocks": 5}, "blocks was 4 and is 5"),
        ({"exchanges": 13}, "exchanges was 12 and is 13"),
    ):
        with pytest.raises(ValueError, match=f"of a search with other options: {message}"):
            searched(StoppedAt(), checkpoint=file, resume=True, **change)
    with pytest.raises(ValueError, match=r"has the objective .* there and .* now"):
        ms.minimize_printable(
            lambda m: 2 * mixed(m), START, INK, stateful=[StoppedAt()], **SHORT, checkpoint=file, resume=True
        )
    with pytest.raises(ValueError, match="n_faces was 12 and is 1"):
        ms.minimize_printable(mixed, START[:1], INK, **SHORT, checkpoint=file, resume=True)
    with pytest.raises(ValueError, match="is not a checkpoint"):
        (tmp_path / "other.pt").write_text("no")
        searched(mixed, checkpoint=tmp_path / "other.pt", resume=True)
    with pytest.raises(ValueError, match="resume needs the checkpoint"):
        searched(mixed, resume=True)
    with pytest.raises(ValueError, match="callback must be a function"):
        searched(mixed, callback=3)
    assert file.read_bytes() == begun
