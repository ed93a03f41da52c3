"""Test of python -m benchmarks topology, on very small sheets."""

import json

import pytest
from bench_figures import is_a_picture

import magshell as ms
from benchmarks.__main__ import main


@pytest.fixture(autouse=True)
def same_threads_afterwards():
    before = ms.num_threads()
    yield
    ms.set_num_threads(before)


def test_topology_part_prints_and_writes(tmp_path, capsys) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("matplotlib")
    path, picture = tmp_path / "topology.json", tmp_path / "topology.png"
    assert main(["topology", "--quick", "--json", str(path), "--figure", str(picture)]) == 0
    assert is_a_picture(picture)
    results = json.loads(path.read_text())["results"]
    soft, taken_out = (results["iteration"][name] for name in ("soft", "taken out"))
    assert soft["faces"] == 1024 > taken_out["faces"] > 400
    assert soft["variables"] == taken_out["variables"] == 4 * 1024
    assert all(0.0 < row["solve"] < row["iteration"] for row in (soft, taken_out))
    assert results["void"]["taken out"]["descents"] == 0
    assert results["void"]["taken out"]["factorizations"] < results["void"]["soft, 1e-4"]["factorizations"]
    assert set(results["meshes"]) == {"400", "784", "spread"}
    printed = capsys.readouterr().out
    assert "An iteration on a sheet of 1024 faces" in printed and "stiffest sheet" in printed
