"""Tests the script that records what compiling takes: rooms of objects, times of a build, and what it names."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))
import compile_seconds

CORE = "CMakeFiles/magshell_core.dir"


@pytest.mark.parametrize(
    ("made", "room"),
    [
        (f"{CORE}/Unity/unity_magshell_terms_joint_0_cxx.cxx.o", "terms/joint"),
        (f"{CORE}/cpp/magshell/energy/own_field.cpp.o", "energy"),
        ("CMakeFiles/_core.dir/Unity/unity_bindings_testing_0_cxx.cxx.o", "bindings/testing"),
        (f"{CORE}/cmake_pch.hxx.gch", "headers of the core"),
        ("CMakeFiles/_core.dir/cmake_pch.hxx.gch", "headers of the bindings"),
    ],
)
def test_room_of_an_object(made, room):
    assert compile_seconds.room_of(made) == room


def test_a_compile_is_recorded_and_read(tmp_path):
    times = tmp_path / "times.txt"
    for name in ("compile_calibration.cpp.o", "cpp/magshell/energy/a.cpp.o", "cpp/magshell/energy/b.cpp.o"):
        made = tmp_path / name
        made.parent.mkdir(parents=True, exist_ok=True)
        write = f"import sys; open({str(made)!r}, 'w')"
        command = [sys.executable, "-c", write, "-o", str(made)]
        assert compile_seconds.timed(times, command) == 0
    lines = times.read_text().splitlines()
    assert [line.split(" ", 1)[1].rpartition("/")[2] for line in lines] == [
        "compile_calibration.cpp.o",
        "a.cpp.o",
        "b.cpp.o",
    ]
    rooms, calibration, together = compile_seconds.read(times)
    assert set(rooms) == {"energy"}
    assert calibration >= 0.0
    assert not together


def test_a_failed_compile_is_not_recorded(tmp_path):
    times = tmp_path / "times.txt"
    command = [sys.executable, "-c", "raise SystemExit(3)", "-o", str(tmp_path / "a.o")]
    assert compile_seconds.timed(times, command) == 3
    assert not times.exists()


def test_growth_is_named():
    recorded = {"energy": 20.0, "scene": 10.0, "mesh": 1.0}
    assert compile_seconds.growth({"energy": 20.9, "scene": 10.0, "mesh": 1.0}, recorded) == []
    assert [
        line.split(" from")[0]
        for line in compile_seconds.growth({"energy": 21.1, "scene": 10.0, "mesh": 1.5}, recorded)
    ] == ["GREW: all rooms together", "GREW: energy"]
