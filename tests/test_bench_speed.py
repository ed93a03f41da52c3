"""The parts of the bench that measure speed: what they print and write on tiny sheets. Never how fast."""

import json

import pytest

from magshell.bench.__main__ import main


def test_kernels(tmp_path, capsys) -> None:
    path = tmp_path / "kernels.json"
    assert main(["kernels", "--faces", "8", "32", "--rounds", "1", "--json", str(path)]) == 0
    printed = capsys.readouterr().out
    assert "midedge, magnetic" in printed and "times that at 32" in printed
    results = json.loads(path.read_text())["results"]
    assert [cost["faces"] for cost in results["hinge"]] == [8, 32]
    assert all(cost["hessian"][0] > 0 for costs in results.values() for cost in costs)


def test_statics(tmp_path, capsys) -> None:
    path = tmp_path / "statics.json"
    assert main(["statics", "--faces", "32", "--rounds", "1", "--json", str(path)]) == 0
    assert "the same to the last bit" in capsys.readouterr().out
    results = json.loads(path.read_text())["results"]
    assert results["threads"]["same bits"] is True
    assert results["from flat"]["A1, full load, midedge, mixed"]["factorizations"] <= 12
    assert results["iteration"]["ratio"] > 1.0
    assert "supernodal" in results["backends"]


def test_gradients(tmp_path, capsys) -> None:
    pytest.importorskip("torch")
    path = tmp_path / "gradients.json"
    assert main(["gradients", "--faces", "32", "--rounds", "1", "--json", str(path)]) == 0
    assert "The gradient by all inputs at once" in capsys.readouterr().out
    results = json.loads(path.read_text())["results"]
    assert results.keys() == {"midedge", "hinge"}
    assert all(cost["share"] == cost["gradient"] / cost["equilibrium"] for cost in results.values())


def test_dynamics(tmp_path, capsys) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("matplotlib")
    path, picture = tmp_path / "dynamics.json", tmp_path / "dynamics.png"
    quick = ["dynamics", "--quick", "--rounds", "1", "--long", "200", "--figure", str(picture)]
    assert main([*quick, "--json", str(path)]) == 0
    printed = capsys.readouterr().out
    assert "for comparison" in printed and "A long run of 24 faces" in printed
    results = json.loads(path.read_text())["results"]
    assert results["energies"]["TR-BDF2"]["kept"]["0.001"] > 0.999
    assert 0 < results["memory"]["checkpoints, 100"]["bytes"] < 1e6
    assert results["long run"]["TRBDF2"]["steps"] == 200
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "arguments",
    [
        ["kernels", "--faces", "1"],
        ["statics", "--rounds", "0"],
        ["gradients", "--faces", "0"],
        ["dynamics", "--rounds", "0"],
    ],
)
def test_sizes_that_make_no_sense(arguments) -> None:
    with pytest.raises(SystemExit, match="must be at least"):
        main(arguments)
