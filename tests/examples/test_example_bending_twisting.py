"""The example of bending and twisting on 384 faces: alignment, energies, the belt that comes undone."""

import numpy as np
import pytest
from example_modules import load

example = load("bending_twisting")
model = load("_bending.strip")


@pytest.fixture(scope="module")
def result() -> dict:
    return example.main(cells=(24, 4), bending_time=12.0, turning_time=5.0, undamped_time=0.6)


def test_mesh_has_the_papers_faces_and_vertices() -> None:
    mesh = model.strip().mesh
    assert (mesh.n_faces, mesh.n_vertices) == (2048, 1097)


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_damping_is_the_papers_on_its_mesh_and_the_same_in_all_on_another(result) -> None:
    assert model.strip().damping == 1e-4
    assert result["strip"].damping * result["strip"].mesh.n_vertices == pytest.approx(1e-4 * 1097, rel=1e-12)


def test_alignment_grows_with_the_field(result) -> None:
    for name in ("alignment", "alignment_at_rest"):
        cosines = [state[name] for state in result["bent"]]
        assert (np.diff(cosines) > 0).all()
        assert cosines[0] > -np.sqrt(0.5)
    assert result["bent"][-1]["alignment_at_rest"] == pytest.approx(0.986, abs=0.002)


def test_magnet_turns_as_far_as_a_beam_says(result) -> None:
    """Compare with beam theory: the torque M V B sin(angle left) bends the strip evenly up to the magnet, and a
    third of that.
    """
    state = result["bent"][2]
    volume = model.MAGNETIZED * model.LENGTH * model.WIDTH * model.THICKNESS
    stiffness = model.YOUNG_MODULUS * model.WIDTH * model.THICKNESS**3 / 12  # free to bend sideways
    left = np.arccos(state["alignment_at_rest"])
    torque = model.REMANENT_MAGNETIZATION * volume * state["field"] * np.sin(left)
    turned = torque / stiffness * (1 - 2 / 3 * model.MAGNETIZED) * model.LENGTH
    assert left + turned == pytest.approx(np.radians(135), rel=0.05)


def test_energy_balance_is_closed(result) -> None:
    for state in result["bent"]:
        assert state["balance"].error < 2e-3
    twisted = result["twisted"]["balance"]
    assert twisted.error < 5e-3
    assert twisted.received[-1] > 100e-6
    assert (np.diff(twisted.lost) >= 0).all()


def test_balance_tells_a_wrong_damping(result) -> None:
    sheet, twisted = result["strip"], result["twisted"]
    wrong = model.Strip(sheet.scene, sheet.remanent_magnetization, 1.1 * sheet.damping)
    assert model.balance(wrong, twisted["motion"], twisted["fields"]).error > 0.03


def test_strip_follows_both_turns_and_then_comes_undone(result) -> None:
    twisted = result["twisted"]
    times, turned = twisted["motion"].times, twisted["motion"].times <= example.TURNING - 0.1
    assert twisted["alignment"][turned].min() > 0.9
    assert twisted["end"][turned, 0].min() > 0.93 * model.LENGTH
    elastic = sum(twisted["motion"].energies[name] for name in ("membrane", "bending"))
    assert elastic[np.searchsorted(times, 1.9)] > 50e-6
    assert elastic[-1] < 1e-6  # flat, though the magnet has been turned twice
    assert twisted["end"][:, 0].min() < 0.6 * model.LENGTH  # the loop


def test_little_is_lost_without_damping_and_less_in_shorter_steps(result) -> None:
    lost = [run["lost"][-1] for run in result["undamped"]]
    assert 0 < lost[0] < 0.01
    assert lost[2] < lost[1] / 2 < lost[0] / 4
    for run in result["undamped"]:
        assert run["kinetic"] > 0.2  # it does move


def test_pictures_and_movie(result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "figure.png")
    example.bent_picture(result).save(tmp_path / "bent.png")
    example.twisted_picture(result).save(tmp_path / "twisted.png")
    example.movie(result, tmp_path / "twisting.gif", fps=2)
    for name in ("figure.png", "bent.png", "twisted.png", "twisting.gif"):
        assert (tmp_path / name).stat().st_size > 20_000
    assert "turned over" in example.summary(result)
