"""Arguments of functions that write files, in the wrong order or with the wrong ending."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(2, 1))


def at_rest():
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    return ms.equilibrium(ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], gravity=(0, 0, -9.81)))


@pytest.mark.parametrize("name", ["rest.vtu", "rest", "rest.npz.txt"])
def test_a_result_is_saved_as_npz_only(name, tmp_path):
    """Check that a VTU file is not replaced by an archive that no viewer reads."""
    path = tmp_path / name
    path.write_text("before")
    with pytest.raises(ValueError, match=r"saved as \.npz.*write_series"):
        at_rest().save(path)
    assert path.read_text() == "before"


def test_a_path_that_comes_second_is_told(tmp_path):
    result = at_rest()
    for write, what, name in (
        (ms.save, result, "a.npz"),
        (ms.write_mesh, MESH, "a.vtu"),
        (ms.write_series, result, "a.pvd"),
    ):
        with pytest.raises(ValueError, match=rf"the path comes first, ms\.{write.__name__}\(path, "):
            write(what, str(tmp_path / name))


def test_arguments_without_a_name_are_told():
    with pytest.raises(
        TypeError, match=r"plot takes what without a name, got 'a\.png' too.*\.save\('a\.png'\)"
    ):
        ms.plot(MESH, "a.png")
    with pytest.raises(TypeError, match=r"plot takes what without a name.*\.save\("):
        at_rest().plot("a.png")
    with pytest.raises(
        TypeError, match=r"Shell takes mesh without a name, got 0\.001 too: name it, as in thickness="
    ):
        ms.Shell(MESH, 1e-3, 1e6)


def test_loads_say_what_they_act_on():
    assert repr(ms.PointLoad([0, 1], (0, 0, 1))) == "PointLoad(2 vertices)"
    assert repr(ms.EdgeLoad(np.array([True, False, True]), (0, 0, 1))) == "EdgeLoad(2 edges)"
    assert repr(ms.AreaLoad((0, 0, 1))) == "AreaLoad(all faces)"
    assert repr(ms.EdgeCouple([0], 1e-4)) == "EdgeCouple(1 edges)"
