"""Files of scenes, so that another script can go on with one without the code that made it."""

from __future__ import annotations

import io
import pickle
from pathlib import Path
from typing import Any

from ..._core import __version__
from ..._runtime.files import replace_file
from ...model.scene.scene import Scene

_HEADER = b"magshell scene 1\n"
# Names that a file may use besides classes of magshell: arrays and the needs of pickle itself.
_ALLOWED = {
    "magshell._runtime.frozen": {"_fixed"},
    "builtins": {"set", "frozenset", "slice", "range", "complex", "bytearray"},
    "collections": {"OrderedDict"},
    "copyreg": {"_reconstructor"},
    "numpy": {"ndarray", "dtype"},
    "numpy._core.multiarray": {"_reconstruct", "scalar"},
    "numpy._core.numeric": {"_frombuffer"},
    "numpy.core.multiarray": {"_reconstruct", "scalar"},
    "numpy.core.numeric": {"_frombuffer"},
}


def save_scene(path: str | Path, scene: Scene) -> None:
    """Save a scene to a file, from which `load_scene` makes it again.

    path: of the file, by custom ending in .scene.

    The file holds bodies, supports, loads, fields and all other parts with their numbers. Functions are not stored: a scene
    with a CustomField, an obstacle with a motion or anything else that calls one is refused by its name. Tensors lose their
    gradients. An existing file is replaced once the new one is complete.

    Raises ValueError for anything else than a Scene, and for one that cannot be stored; OSError if the file cannot be
    written.

    >>> import magshell as ms, tempfile
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save_scene(f"{folder}/strip.scene", scene)
    ...     again = ms.load_scene(f"{folder}/strip.scene")
    >>> again.n_dofs == scene.n_dofs
    True
    """
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}: results are saved by ms.save")
    try:
        content = pickle.dumps((__version__, scene))
        _read(content)
    except (pickle.PicklingError, AttributeError, TypeError, ValueError) as error:
        raise ValueError(
            f"this scene holds objects that are neither numbers nor of magshell, and cannot be saved: {error}"
        ) from error
    replace_file(Path(path), lambda file: file.write(_HEADER + content))


def load_scene(path: str | Path) -> Scene:
    """Load a scene that `save_scene` saved.

    path: of the file.

    The file can only make objects of magshell and arrays: it is refused if it names anything else, so that it cannot run
    code of its own.

    Raises ValueError for another file, or one of a version whose scenes had other parts; OSError if it cannot be read.

    >>> import magshell as ms, tempfile
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> scene = ms.Scene(ms.Shell(mesh, thickness=1e-3, young_modulus=1e6), allow_rigid_motions=True)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save_scene(f"{folder}/strip.scene", scene)
    ...     ms.load_scene(f"{folder}/strip.scene").mesh.n_faces
    40
    """
    content = Path(path).read_bytes()
    if not content.startswith(_HEADER):
        raise ValueError(f"{path} is no file of a scene")
    try:
        version, scene = _read(content[len(_HEADER) :])
    except Exception as error:  # of whatever a damaged file leads to
        raise ValueError(f"{path} cannot be read by magshell {__version__}: {error}") from error
    if not isinstance(scene, Scene):
        raise ValueError(f"{path} holds a {type(scene).__name__} of magshell {version} instead of a Scene")
    return scene


class _Reader(pickle.Unpickler):
    """Makes objects of magshell and arrays only."""

    def find_class(self, module: str, name: str) -> Any:
        """Return a class that the file names. Raises ValueError for one that does not belong into a scene."""
        if module.split(".")[0] == "magshell":
            found = super().find_class(module, name)
            if (
                isinstance(found, type) and found.__module__ == module
            ):  # not one that the module imports, as pickle.Unpickler
                return found
        if name in _ALLOWED.get(module, ()):
            return super().find_class(module, name)
        raise ValueError(f"it names {module}.{name}")


def _read(content: bytes) -> Any:
    return _Reader(io.BytesIO(content)).load()
