"""Tests of the build with pip (scripts/build_backend.py): objects are kept where they are still right, options are not."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("scikit_build_core", reason="the build's backend is not installed")

SCRIPTS = Path(__file__).parents[2] / "scripts"
PROJECT = '[project]\nname = "small"\nversion = "1"\n'
CMAKE = """
cmake_minimum_required(VERSION 3.18)
project(small LANGUAGES CXX)
option(OPTION "" OFF)
message(STATUS "OPTION is ${OPTION}")
add_library(small MODULE small.cpp)
install(TARGETS small DESTINATION small)
"""
BUILD = "import build_backend, json, sys; build_backend.build_wheel('.', json.loads(sys.argv[1]))"


@pytest.fixture
def project(tmp_path):
    for name, text in {"pyproject.toml": PROJECT, "CMakeLists.txt": CMAKE, "small.cpp": "int small;"}.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def built(project, *, compiler=None, **settings):
    """Build a wheel; return the output and the time of the object, ns."""
    environment = os.environ | {"PYTHONPATH": str(SCRIPTS)} | ({"CXX": str(compiler)} if compiler else {})
    done = subprocess.run(
        [sys.executable, "-c", BUILD, json.dumps(settings)],
        cwd=project,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    objects = list(project.glob("build/*/CMakeFiles/small.dir/small.cpp.o"))
    return done.stdout, objects[0].stat().st_mtime_ns if objects else None


def test_objects_are_kept_for_another_isolated_environment_and_options_are_not(project):
    said, first = built(project, **{"cmake.define.OPTION": "ON"})
    assert "OPTION is ON" in said
    [note] = project.glob("build/*/.skbuild-info.json")
    note.write_text(note.read_text().replace("scikit_build_core", "elsewhere"))
    said, second = built(project)
    assert "OPTION is OFF" in said
    assert second == first


def test_objects_of_another_compiler_are_not_kept(project):
    """Replace the compiler under the same name, which leaves all commands as they are."""
    compiler = project / "compiler"
    compiler.write_text('#!/bin/sh\nexec c++ "$@"\n')
    compiler.chmod(0o755)
    _, first = built(project, compiler=compiler)
    _, second = built(project, compiler=compiler)
    compiler.write_text('#!/bin/sh\nexec c++ -DANOTHER "$@"\n')
    _, third = built(project, compiler=compiler)
    assert first == second != third


def test_sources_that_cannot_be_written_are_built_elsewhere(project):
    (project / "build").write_text("a file where the folder would be")
    assert built(project)[1] is None
    assert list(project.glob("small-1-*.whl"))
