"""Tests of how the benchmarks measure times."""

import time

import pytest

import magshell as ms
from benchmarks import timing


@pytest.fixture(autouse=True)
def same_threads_afterwards():
    before = ms.num_threads()
    yield
    ms.set_num_threads(before)


@pytest.mark.parametrize("long", [True, False])
def test_a_long_call_is_measured_in_one_round(monkeypatch, long: bool) -> None:
    calls = []
    monkeypatch.setattr(timing, "LONG", -1.0 if long else 1e9)
    measured = timing.clocked(lambda: calls.append(time.sleep(2e-3)), rounds=2, seconds=6e-3)
    assert 1 < len(calls) <= 1 + (1 if long else 2) * 3
    assert measured.wall >= 2e-3 and 0 <= measured.processor < measured.wall


def test_share_of_the_processor() -> None:
    ms.set_num_threads(1)
    slept, share = timing.with_processor_fraction(lambda: time.sleep(0.05))
    assert slept is None and share < 0.5
    assert timing.with_processor_fraction(lambda: None)[1] == 1.0
    ms.set_num_threads(2)
    assert timing.with_processor_fraction(lambda: time.sleep(0.01))[1] == 1.0


def test_solves_measure_the_processor_if_told_to():
    walls = time.perf_counter
    for threads, clock in ((1, time.process_time), (2, walls)):
        ms.set_num_threads(threads)
        with pytest.raises(RuntimeError, match="stopped"), timing.processor_clock():
            assert time.perf_counter is clock
            raise RuntimeError("stopped")
        assert time.perf_counter is walls
