"""Files of scenes: round trips, and what they refuse."""

import pickle
import sys

import numpy as np
import pytest

import magshell as ms
from magshell.output.results import saved_scene

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))


def scene(**more) -> ms.Scene:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], gravity=(0, 0, -9.81), **more)


def test_a_loaded_scene_solves_to_the_same_bits(tmp_path) -> None:
    before = scene()
    ms.save_scene(tmp_path / "strip.scene", before)
    after = ms.load_scene(tmp_path / "strip.scene")
    assert after.mesh.rest_positions.tobytes() == before.mesh.rest_positions.tobytes()
    one, other = ms.equilibrium(before), ms.equilibrium(after)
    np.testing.assert_array_equal(one.positions, other.positions)


def test_solids_skeletons_and_fields_come_back(tmp_path) -> None:
    arm = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    hinge = ms.Revolute(arm, origin=(0, 0, 0), axis=(0, 1, 0))
    block = ms.Solid(
        ms.meshes.box((0.02, 0.01, 0.01), cells=(2, 1, 1)),
        material=ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.3),
    )
    held = ms.Pin(block.mesh.vertices_at(x=0.0), body=block)
    made = ms.Scene(
        [block, ms.Skeleton([arm], [hinge])],
        supports=[held],
        field=[ms.UniformField(), ms.Dipoles([[0, 0, 0.5]], [[0, 0, 1.0]])],
    )
    ms.save_scene(tmp_path / "arm.scene", made)
    again = ms.load_scene(tmp_path / "arm.scene")
    assert repr(again) == repr(made)
    assert ms.load_scene(tmp_path / "arm.scene").n_dofs == made.n_dofs


def test_scenes_with_functions_are_refused(tmp_path) -> None:
    field = ms.CustomField(lambda x: 0.0 * x, length_scale=1.0)
    with pytest.raises(ValueError, match="neither numbers nor of magshell, and cannot be saved"):
        ms.save_scene(tmp_path / "f.scene", scene(field=field))
    assert not (tmp_path / "f.scene").exists()
    with pytest.raises(ValueError, match="scene must be a Scene, got Equilibrium"):
        ms.save_scene(tmp_path / "f.scene", ms.equilibrium(scene()))


class Evil:
    def __reduce__(self):
        return sys.setrecursionlimit, (100,)


@pytest.mark.parametrize(
    "content", [b"", b"magshell scene 1\n", b"magshell scene 1\n" + pickle.dumps(Evil())]
)
def test_files_of_other_classes_are_refused_without_running_code(tmp_path, content) -> None:
    limit = sys.getrecursionlimit()
    (tmp_path / "x.scene").write_bytes(content)
    with pytest.raises(ValueError, match=r"is no file of a scene|cannot be read by magshell"):
        ms.load_scene(tmp_path / "x.scene")
    assert sys.getrecursionlimit() == limit


def test_a_class_that_a_module_of_magshell_imports_is_refused() -> None:
    """Write pickle's STACK_GLOBAL by hand, as no object has such a name: it would lead to subprocess.Popen alike."""
    module, name = b"magshell.output.results.saved_scene", b"pickle.Unpickler"
    text = b"".join(b"\x8c" + bytes([len(each)]) + each for each in (module, name))
    with pytest.raises(ValueError, match=r"it names magshell.output.results.saved_scene.pickle.Unpickler"):
        saved_scene._read(b"\x80\x04" + text + b"\x93.")


def test_a_file_that_names_a_function_of_magshell_is_refused() -> None:
    with pytest.raises(ValueError, match=r"it names magshell.output.results.saved_scene.load_scene"):
        saved_scene._read(pickle.dumps(ms.load_scene))
