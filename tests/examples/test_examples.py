"""Every example's numbers, on meshes coarser than its own, and its pictures."""

import numpy as np
import pytest
from example_modules import EXAMPLES, load


@pytest.fixture(scope="module")
def bistable() -> dict:
    return load("bistable_beam").main(cells=(48, 8), meshes=((24, 4), (48, 8), (96, 16)))


def test_bistable_beam_height(bistable) -> None:
    assert bistable["height"] == pytest.approx(3.676e-3, rel=0.01)
    assert bistable["convergence"]["height"]["value"] == pytest.approx(3.6757e-3, rel=5e-4)


def test_bistable_beam_critical_field(bistable) -> None:
    critical, limit = bistable["critical"], bistable["convergence"]["limit"]
    assert 5.0e-3 < critical["field"] < 6.26e-3  # no snap at a constant 5 mT; a ramp snaps later than statics
    assert critical["field"] == pytest.approx(5.510e-3, rel=0.02)
    assert limit["value"] == pytest.approx(5.5096e-3, rel=1e-3)
    assert limit["order"] > 1.3


def test_bistable_beam_bifurcation_next_to_the_limit_point(bistable) -> None:
    """Check that both are found, though 0.0001 mT apart on the middle mesh; the finer mesh exchanges them."""
    rows = bistable["convergence"]["rows"]
    assert [row["first"] for row in rows] == ["bifurcation", "bifurcation", "limit"]
    for row in rows:
        assert row["bifurcation"]["field"] < row["limit"]["field"] < 1.02 * row["bifurcation"]["field"]
    assert bistable["critical"]["kind"] == "bifurcation"
    assert not bistable["critical"]["symmetric"]


def test_bistable_beam_has_two_mirrored_states(bistable) -> None:
    up, over, down = bistable["sections"]
    assert (up["stable"], over["stable"], down["stable"]) == (True, False, True)
    assert down["fields"][0] == pytest.approx(-up["fields"][-1], rel=1e-6)
    without_field = np.interp(0.0, down["fields"], down["displacements"])
    assert without_field == pytest.approx(2 * bistable["height"], rel=5e-3)


def test_bistable_beam_snaps_onto_the_other_side(bistable) -> None:
    snapped, down = bistable["snapped"], bistable["sections"][2]
    expected = np.interp(snapped["field"], down["fields"], down["displacements"])
    assert snapped["displacement"] == pytest.approx(expected, rel=1e-3)


def test_bistable_beam_against_the_experiment(bistable) -> None:
    plateau, measured, up = bistable["plateau"], bistable["measured"], bistable["sections"][0]
    assert plateau["measured"] == pytest.approx(8.35e-3, rel=0.02)
    assert plateau["computed"] == pytest.approx(plateau["measured"], rel=0.05)
    before = (measured["fields"] > 2e-3) & (measured["fields"] < 5e-3)
    computed = np.interp(measured["fields"][before], up["fields"], up["displacements"])
    np.testing.assert_allclose(computed, measured["displacements"][before], atol=0.2e-3)


def test_bistable_beam_departs_from_beam_theory_as_said(bistable) -> None:
    rows = [(height, field) for _, height, field in bistable["differences"]["rows"]]
    inextensible, theory, small, true_size, narrow, full, stiffer, longer = np.transpose(
        np.divide(rows, (3.8228592825585976e-3, 5.755627721214172e-3))  # computed independently
    ).T
    np.testing.assert_allclose(theory, 1.0, rtol=1e-9)
    np.testing.assert_allclose(inextensible, (1.253, 1.972), atol=1e-3)
    np.testing.assert_allclose(small, 1.0, atol=3e-3)
    assert 0.002 < small[1] - true_size[1] < 0.01
    assert (full < narrow).all()
    assert full[1] < true_size[1]
    assert stiffer[1] < theory[1]
    assert longer[1] / full[1] == pytest.approx(1.025, abs=0.004)


def test_bistable_beam_pictures(bistable, tmp_path) -> None:
    example = load("bistable_beam")
    example.plot(bistable).savefig(tmp_path / "path.png")
    example.picture(bistable).save(tmp_path / "states.png")
    assert (tmp_path / "path.png").stat().st_size > 20_000
    assert (tmp_path / "states.png").stat().st_size > 20_000
    assert "limit point" in example.summary(bistable)


def test_script_prints_its_numbers_and_writes_pictures(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    load("_run").run(
        lambda: {"height": 3}, "{height} mm high".format_map, lambda found, out: (out / "a.png").touch()
    )
    told = capsys.readouterr().out
    assert told.startswith("3 mm high\n") and "Pictures in out/" in told
    assert (tmp_path / "out" / "a.png").is_file()


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("[!_]*.py")), ids=lambda path: path.stem)
def test_every_example_is_a_script_of_this_kind(path) -> None:
    example = load(path.stem)
    assert callable(example.main) and callable(example.summary) and callable(example.write)
    assert path.read_text().rstrip().endswith("summary, write)")
