"""Tests of the build's own description, and of thread counts."""

import subprocess
import sys
from pathlib import Path

import pytest

import magshell as ms
from magshell._runtime.instructions import check

CPUINFO = "processor : 0\nflags\t\t: fpu sse2 {}\n"
ALL = "avx avx2 fma bmi2 f16c movbe"


def test_show_config_prints_what_it_returns(capsys):
    config = ms.show_config()
    printed = capsys.readouterr().out
    assert config["magshell"] == ms.__version__
    assert {"supernodal", "eigen"} <= set(config["factorizations"].split(", "))
    assert config["Eigen"].startswith(("3.", "5."))
    for name, value in config.items():
        assert f"{name}: {value}" in printed


def test_the_number_of_threads_is_kept():
    before = ms.num_threads()
    try:
        ms.set_num_threads(3)
        assert ms.num_threads() == 3
        assert ms.show_config()["threads"] == "3"
    finally:
        ms.set_num_threads(before)


@pytest.mark.parametrize("count", [0, -1, 100_000])
def test_an_impossible_number_of_threads_is_refused(count):
    with pytest.raises(ValueError, match="between 1 and 1024"):
        ms.set_num_threads(count)


@pytest.mark.parametrize("count", [1.5, "2", True, None])
def test_threads_are_counted_in_integers(count):
    with pytest.raises(TypeError, match="must be an integer"):
        ms.set_num_threads(count)


def test_python_m_magshell_says_what_it_is_and_that_it_is_right():
    run = subprocess.run([sys.executable, "-m", "magshell"], capture_output=True, text=True, check=True)
    assert f"magshell: {ms.__version__}" in run.stdout and "WRONG" not in run.stdout
    assert "a clamped strip hangs as a beam does: right" in run.stdout
    citation = (Path(__file__).parents[2] / "CITATION.cff").read_text()
    assert "10.1145/3528223.3530142" in run.stdout and "10.1145/3528223.3530142" in citation


def test_a_wheel_refuses_a_processor_that_it_is_not_for():
    check("", CPUINFO.format(""))  # built here
    check("x86-64-v3", CPUINFO.format(ALL))
    check("x86-64-v3", "")  # no such file: nobody knows
    with pytest.raises(
        ImportError, match=r"is for x86-64-v3 processors, and this one has no avx2, fma: build it here"
    ):
        check("x86-64-v3", CPUINFO.format("avx bmi2 f16c movbe"))
