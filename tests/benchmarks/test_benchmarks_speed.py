"""Tests of the benchmark parts that measure speed: their output and files for tiny sheets, never their times."""

import json
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pytest
from bench_figures import is_a_picture

import magshell as ms
from benchmarks.__main__ import main
from benchmarks.busy_machine import COMPANY
from benchmarks.core_limits import CORES, front_span, front_work, limits, makespan
from benchmarks.paper import examples_folder
from benchmarks.paper_rows import ROWS
from benchmarks.scaling import MEMORIES, TIMES, fitted_exponent
from benchmarks.statics import strongly_bent
from benchmarks.terms import PARTS, _together
from magshell import _core


@pytest.fixture(autouse=True)
def same_threads_afterwards():
    before = ms.num_threads()
    yield
    ms.set_num_threads(before)


def run(part: str, folder: Path, *options: str, rounds: bool = True, figure: bool = True) -> dict:
    """Run a part and return the numbers of its JSON; check its figure."""
    path, picture = folder / f"{part}.json", folder / f"{part}.png"
    if figure:
        pytest.importorskip("matplotlib")
        options = (*options, "--figure", str(picture))
    assert main([part, *options, *(["--rounds", "1"] if rounds else []), "--json", str(path)]) == 0
    assert not figure or is_a_picture(picture)
    written = json.loads(path.read_text())
    assert written["part"] == part and written["setting"]["threads"] == 1
    return written["results"]


def test_kernels_part_prints_and_writes(tmp_path, capsys) -> None:
    results = run("kernels", tmp_path, "--faces", "8", "32")
    printed = capsys.readouterr().out
    assert "midedge, magnetic" in printed and "times that at 32" in printed and "Two threads" in printed
    assert [cost["faces"] for cost in results["sheets"]["hinge"]] == [8, 32]
    assert all(cost["hessian"][0] > 0 for costs in results["sheets"].values() for cost in costs)
    assert results["two threads"] > 0


def test_statics_part_prints_and_writes(tmp_path, capsys) -> None:
    results = run("statics", tmp_path, "--faces", "32")
    assert "the same to the last bit" in capsys.readouterr().out
    assert results["threads"]["same bits"] is True
    assert results["from flat"]["A1, full load, midedge, mixed"]["factorizations"] <= 12
    assert results["iteration"]["ratio"] > 1.0 and results["iteration"]["worth"] > 1.0
    assert "supernodal" in results["backends"]


def test_gradients_part_prints_and_writes(tmp_path, capsys) -> None:
    pytest.importorskip("torch")
    results = run("gradients", tmp_path, "--faces", "32", "--quick")
    assert "The gradient by all inputs at once" in capsys.readouterr().out
    assert results.keys() == {"midedge", "hinge", "solid, linear"}
    assert all(cost["share"] == cost["gradient"] / cost["equilibrium"] for cost in results.values())


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_dynamics_part_prints_and_writes(tmp_path, capsys) -> None:
    pytest.importorskip("torch")
    results = run("dynamics", tmp_path, "--quick", "--long", "200")
    printed = capsys.readouterr().out
    assert "Energy kept over 2 periods" in printed and "A long run of 24 faces" in printed
    assert results["energies"].keys() == results["errors"].keys()
    assert results["energies"]["TR-BDF2"]["kept"]["0.001"] > 0.999
    assert 0 < results["memory"]["checkpoints, 100"]["bytes"] < 1e6
    assert results["tangent"].keys() == {
        f"{each}, {kept}" for each in ("ImplicitEuler", "TRBDF2") for kept in ("factors", "stages")
    }
    assert all(cost["plain"] > 0.0 for cost in results["tangent"].values())
    assert results["long run"]["TRBDF2"]["steps"] == 200
    assert "With contact and friction" in printed
    assert "A step of implicit Euler" in printed and results["solid steps"][0]["tetrahedra"] == 648
    assert [each["kept"] for each in results["solid gradients"]] == ["factors", "checkpoints"]
    projective = results["projective errors"]["Projective"]
    assert projective["accelerated"]["error"][-1] < projective["accelerated"]["error"][0]
    long, short = results["projective against Newton"]
    assert long["error"] == sorted(long["error"], reverse=True) and short["error"][1] < long["error"][1]
    assert [each["kept"] for each in results["projective memory"]] == ["stages", "checkpoints"]
    bars = results["thrown bars"]
    assert bars["pairs"] > 100 and bars["touching"]["iterations"] > bars["free"]["iterations"] == 1
    (surroundings,) = results["surroundings"].values()
    assert min(row["step"] for row in surroundings.values()) > 0
    assert surroundings["contact"]["way"] != surroundings["contact, friction"]["way"]


def test_scaling_part_prints_and_writes(tmp_path, capsys) -> None:
    results = run("scaling", tmp_path, "--faces", "512", "128", "--bending", "hinge", "--quick")
    printed = capsys.readouterr().out
    assert "a Newton iteration grows with the faces to the" in printed and "Two threads" in printed
    assert results["sizes"].keys() == {"1", "2"}
    for sizes in results["sizes"].values():
        assert [size["faces"] for size in sizes] == [128, 512]
        assert all(size["processor"].keys() == size["wall"].keys() == TIMES.keys() for size in sizes)
        assert all(min(size["wall"].values()) > 0 for size in sizes)
    small, large = results["sizes"]["1"]
    assert small["entries"] < small["factor"] < large["factor"] and small["model"] < large["model"]
    assert results["exponents"].keys() == TIMES.keys() | MEMORIES.keys()
    assert 0.9 < results["exponents"]["model"] < 1.1
    assert [size["tetrahedra"] for size in results["solids"]] == [192, 1536]
    assert results["busy machine"]["company"].keys() == COMPANY.keys()
    assert all(name in printed for name in COMPANY)
    assert all(min(times.values()) > 0 for times in results["busy machine"]["company"].values())


def test_scaling_without_the_memory_for_it(monkeypatch, tmp_path, capsys) -> None:
    """Check that earlier measurements are kept when the process is killed."""
    size = {
        "faces": 8,
        "unknowns": 9,
        "factorizations": 1,
        "model": 10,
        "entries": 9,
        "factor": 20,
        "peak": None,
        "operations": {"best": 1.0, "amd": 1.0},
        "metis": None,
        "cores": {"work": 2.0, "span": 1.0, "path": 1.0, "gains": {str(cores): 2.0 for cores in CORES}},
    }
    size |= {clock: dict.fromkeys(TIMES, 1.0) for clock in ("processor", "wall")}

    def measured(faces: int, threads: int, options) -> dict:
        if faces > 8:
            raise BrokenProcessPool
        return size

    monkeypatch.setattr("benchmarks.scaling._in_its_own_process", measured)
    results = run("scaling", tmp_path, "--faces", "8", "32", "128", "--quick")
    assert results["ended"] == 32 and results["sizes"]["2"] == [size]
    assert "The process of 32 faces was ended" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="no size was measured: the process of 32 faces was ended"):
        main(["scaling", "--faces", "32"])


def test_exponents_of_power_laws() -> None:
    assert fitted_exponent([10, 100, 1000], [3.0, 30.0 * 10**0.5, 3000.0]) == pytest.approx(1.5)
    assert fitted_exponent([10, 10], [1.0, 2.0]) is None and fitted_exponent([1, 2], [1.0, None]) is None


def test_terms_part_prints_and_writes(tmp_path, capsys) -> None:
    results = run("terms", tmp_path, "--faces", "32")
    assert "+ field of a dipole" in capsys.readouterr().out
    parts = {part["part"]: part for part in results["parts"]}
    assert results["faces"] == 32 and len(parts) == len(PARTS)
    hinge, midedge, *_, last = results["parts"]
    assert hinge["unknowns"] < midedge["unknowns"] == last["unknowns"]
    assert last["assembly"] == parts["viscous damping"]["assembly"]  # a motion's own changes nothing at rest
    assert all(part[name] > 0 for part in parts.values() for name in ("assembly", "iteration", "step"))


def test_parts_of_a_scene_add_up() -> None:
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(2, 2))
    scene, solve, motion = _together(mesh, PARTS, moving=True)
    assert len(scene.loads) == 2 and len(scene.fields) == 3 and scene.gravity.any()
    assert scene.shell.bending == "midedge" and solve["remanent_magnetization"][2] > 0
    assert motion.keys() == {"damping", "stiffness_damping", "maxwell_modulus", "maxwell_time"}
    assert [contact.friction_coefficient for contact in scene.contacts] == [0.6] and scene.water is not None
    at_rest, *_ = _together(mesh, PARTS, moving=False)
    assert [contact.friction_coefficient for contact in at_rest.contacts] == [None] and at_rest.water is None


# The banner alone would take as long as all others.
PAPER = ["bending_twisting", "hexagram", "kirigami_reaching", "kirigami_tower", "letters"]


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning", "ignore::magshell.StepErrorWarning")
def test_paper_part_prints_and_writes(tmp_path, capsys) -> None:
    pytest.importorskip("torch")
    results = run("paper", tmp_path, "--iterations", "2", "--only", *PAPER, rounds=False)
    printed = capsys.readouterr().out
    assert "Kirigami at rest" in printed and "not comparable" in printed
    rows = {row["name"]: row for row in results["rows"]}
    assert [row["example"] for row in rows.values()] == [row.example for row in ROWS if row.example in PAPER]
    assert all(row["wall"] > 0 and row["seconds"] > 0 and not row["absent"] for row in rows.values())
    tower = rows["Kirigami at rest"]
    assert tower["paper"] == pytest.approx(390 / 95) and tower["ratio"] == tower["paper"] / tower["seconds"]
    assert tower["iterations"] == 2 and -0.04 < tower["objective"] < 0
    assert rows["Bending and twisting"]["ratio"] is None  # the paper does not time it
    assert 0 < rows["Letters"]["objective"] < 1 and 0 < rows["Hexagram"]["objective"] < 0.1


def test_every_row_of_the_paper_has_its_example() -> None:
    folder = examples_folder(None)
    assert all((folder / f"{row.example}.py").is_file() for row in ROWS)
    assert all((row.seconds is None) == (row.iterations is None) for row in ROWS)


def test_paper_without_an_example(monkeypatch, tmp_path, capsys) -> None:
    """Check that other rows are still run."""
    pytest.importorskip("torch")
    pending = ROWS[0]._replace(name="Squid", example="squid", seconds=10.0, iterations=5)
    monkeypatch.setattr("benchmarks.paper.ROWS", (pending, *ROWS[1:]))
    results = run("paper", tmp_path, "--only", "squid", rounds=False, figure=False)
    assert results["rows"][0]["absent"] and results["rows"][0]["paper"] == 2.0
    assert "Not in examples/: squid.py" in capsys.readouterr().out


def test_paper_without_examples(tmp_path) -> None:
    with pytest.raises(SystemExit, match="Give --examples FOLDER"):
        main(["paper", "--examples", str(tmp_path)])


@pytest.mark.parametrize(
    "arguments",
    [
        ["kernels", "--faces", "1"],
        ["statics", "--rounds", "0"],
        ["gradients", "--faces", "0"],
        ["dynamics", "--rounds", "0"],
        ["scaling", "--faces", "100", "1"],
        ["scaling", "--company", "-1"],
        ["terms", "--rounds", "0"],
        ["paper", "--iterations", "0"],
        ["accuracy", "--rounds", "0"],
    ],
)
def test_sizes_that_make_no_sense(arguments) -> None:
    with pytest.raises(SystemExit, match="must be at least"):
        main(arguments)


def test_span_of_fronts_known_by_hand() -> None:
    assert makespan([3.0, 3.0, 2.0, 2.0, 2.0], 2) == 7.0 and makespan([], 4) == 0.0
    assert front_work(1, 0) == 1.0 and front_work(2, 3) == 5.0 + 12.0 + 24.0
    for pivots, below in ((1, 0), (40, 0), (200, 700), (7, 300)):
        assert front_span(pivots, below, 1) == pytest.approx(front_work(pivots, below), rel=1e-12)
        assert front_span(pivots, below, 2) <= front_span(pivots, below, 1)
    # Two equal subtrees of one front each, and a small root above them.
    fronts = {
        "pivots": np.array([100, 100, 10]),
        "below": np.array([10, 10, 0]),
        "parent": np.array([2, 2, -1]),
        "task": np.array([0, 1, -1]),
    }
    found = limits(fronts)
    each, root = front_work(100, 10), front_work(10, 0)
    assert found["work"] == 2 * each + root and found["path"] == each + root
    assert found["span"] == each + front_span(10, 0, 1)
    assert found["gains"]["4"] == pytest.approx((2 * each + root) / found["span"])


def test_fronts_of_a_matrix_hold_all_its_operations() -> None:
    scene, inputs = strongly_bent(512, "midedge")
    found = ms.equilibrium(scene, **inputs)
    n, starts, rows, _ = scene._model.hessian(found._state, found._load_parameters)
    points = scene._model.free_points
    fronts = _core.elimination_fronts(n, starts, rows, points)
    assert fronts["pivots"].sum() == n and fronts["parent"][-1] == -1
    assert all(up == -1 or up > k for k, up in enumerate(fronts["parent"].tolist()))
    assert limits(fronts)["work"] == pytest.approx(
        _core.analyze(n, starts, rows, points=points).flops, rel=1e-12
    )
