"""Saving and loading of results, with checks of the file's content."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..._core import __version__
from ..._input.path_first import check_path_first
from ..._input.quantity import quantity
from ..._runtime.files import replace_file
from ..._runtime.mixins import register_method
from ..._runtime.npz import open_npz
from ...design.content_hash import content_hash
from ...design.multistart.json_data import from_plain, to_plain
from ...model.scene.scene import Scene
from ...solve.dynamics.trajectory import MotionState, Trajectory
from ...solve.statics.equilibria import EquilibriumSet
from ...solve.statics.equilibrium import Equilibrium


def check_fits(held: dict[Any, Any], scene: Scene) -> None:
    """Raise ValueError if an array of a result does not have the shape that the scene requires, or is not finite."""
    mesh, model = scene.mesh, scene._model
    of_motion = "times" in held
    n = (len(held["times"]),) if of_motion else ()
    shapes = {
        "positions": (*n, mesh.n_vertices, 3),
        "edge_rotations": (*n, len(model.edge_rotations(model.rest_state()))),
        "applied_flux_density": (*n, 3),
    }
    own = 10 * len(scene.rigid_parts) + scene._bodies.n_on_surfaces
    if of_motion:
        shapes |= {"times": n, "velocities": shapes["positions"], "kinetic_energy": n}
        shapes |= {"_field_factors": n, "_load_factors": n, "_directions": (*n, 3 * _n_directions(scene))}
        shapes["_own_velocities"] = (*n, own, 3)
        _check_end(held["end"], model)
    else:
        shapes |= {"_state": (model.size,), "_load_parameters": (scene._load_parameter_layout.size,)}
        _check_angle_branches(held["_angle_branches"])
    shapes["_own_points"] = (*n, own, 3)
    for name, shape in shapes.items():
        optional = name in ("_own_points", "_own_velocities", "applied_flux_density")
        if optional and held[name] is None:
            continue
        quantity(name, "SI", held[name], shape)
        if (kind := np.asarray(held[name]).dtype.kind) != "f":
            raise ValueError(f"{name} holds numbers of kind {kind!r} instead of real ones")
    if of_motion and (np.diff(held["times"]) <= 0.0).any():
        raise ValueError("its times do not rise")
    _check_positions(held, model)


def _check_positions(held: dict[Any, Any], model) -> None:
    """Raise ValueError if the positions are not those of the state in the core, which solves continue from."""
    positions = held["positions"]
    if "times" in held:
        if not len(positions) or abs(held["times"][-1] - held["end"].time) > 1e-9 * abs(held["end"].time):
            return  # the end was not recorded
        positions, state = positions[-1], held["end"].state
    else:
        state = held["_state"]
    there = model.positions(state)
    # Positions of single precision are rounded.
    close = (
        16.0 * np.finfo(np.asarray(positions).dtype).eps * max(float(np.abs(there).max(initial=0.0)), 1e-300)
    )
    if not np.abs(positions - there).max(initial=0.0) <= close:
        raise ValueError("its positions are not those of its state")


def _n_directions(scene: Scene) -> int:
    return len(scene._constraints.directions)


def _check_end(end, model) -> None:
    if not isinstance(end, MotionState):
        raise ValueError(f"its end is a {type(end).__name__}")
    quantity("end.state", "SI", end.state, (model.size,))
    quantity("end.velocity", "SI", end.velocity, (model.size,))
    _check_angle_branches(end.angle_branches)


def _check_angle_branches(branches) -> None:
    """Check that `angle_branches`, the numbers of full turns of angles, is a list of arrays of finite numbers."""
    if not isinstance(branches, list | tuple):
        raise ValueError(f"`angle_branches` is a {type(branches).__name__} instead of a list")
    for k, each in enumerate(branches):
        quantity(f"angle_branches[{k}]", "SI", each, ("n",))


def digests(scene: Scene) -> dict[str, str]:
    """Return the digest of each part of a scene, {name: digest}, the same in every process.

    Raises ValueError for a part that has no digest.
    """
    found = {}
    for name, part in _parts(scene).items():
        try:
            found[name] = content_hash(part)
        except TypeError as error:
            raise ValueError(
                f"a result can be saved only if its scene can be recognized, but {name}, {part!r}, has no digest: {error}"
            ) from error
    return found


def differing(of: dict[str, str], now: dict[str, str]) -> list[str]:
    """Return the names of the parts whose digests differ."""
    return [name for name in {**of, **now} if of.get(name) != now.get(name)]


def _parts(scene: Scene) -> dict[str, object]:
    """Return the parts of a scene by name, such as `bodies[0]`."""
    parts = {}
    for name, part in scene.__getstate__().items():
        if isinstance(part, list | tuple):
            parts |= {f"{name}[{k}]": each for k, each in enumerate(part)}
        else:
            parts[name] = part
    return parts


_FORMAT = 1
_KINDS = {each.__name__: each for each in (Equilibrium, EquilibriumSet, Trajectory)}
_CONTENTS = "contents"
# Fields that have another name in files: that of the property, which returns tensors in torch's graph.
_IN_FILES = {
    f"_{name}": name
    for name in ("energies", "kinetic_energy", "largest_membrane_strain", "largest_bending_strain")
}


@register_method
def save(path: str | Path, result: Equilibrium | EquilibriumSet | Trajectory) -> None:
    """Save a result to an .npz file of arrays and JSON text, from which `load` restores it.

    result: an Equilibrium, an EquilibriumSet or a Trajectory. The points of an EquilibriumPath, `path.equilibrium(k)`, can
        be saved as well. Tensors become arrays, without gradients.

    The file does not contain the scene, only a digest of each of its parts: store the script that makes the scene with it.
    numpy can read the file as well: `np.load(path)["positions"]`, m. An existing file is replaced once the new one is
    complete.

    Raises ValueError for other objects, for a path that does not end in .npz, and for a scene with an object that has no
    digest, such as a function that contains a lock; OSError if the file cannot be written.

    >>> import magshell as ms, numpy as np, tempfile
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> rest = ms.equilibrium(scene)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save(f"{folder}/rest.npz", rest)
    ...     again = ms.load(f"{folder}/rest.npz", scene)
    >>> np.array_equal(again.positions, rest.positions), again.energies == rest.energies
    (True, True)
    """
    check_path_first("save(path, result)", path, result)
    if type(result) not in _KINDS.values():
        points = ": save its points, ms.EquilibriumSet(path.equilibrium(k) for k in ...)"
        why = points if type(result).__name__ == "EquilibriumPath" else ""
        why = ": several are ms.EquilibriumSet([...])" if isinstance(result, list | tuple) else why
        raise ValueError(
            f"result must be an Equilibrium, EquilibriumSet or a Trajectory, got {type(result).__name__}{why}"
        )
    if (suffix := Path(path).suffix) != ".npz":
        raise ValueError(
            f"a result is saved as .npz, got {suffix or 'no ending'}; ms.write_series (.pvd) and ms.write_mesh (.vtu) "
            "write what ParaView reads"
        )
    scene, arrays = result.scene, []
    held = to_plain(_fields(result, scene), arrays, "the result")
    names = dict(_names(held))
    known = {
        "format": _FORMAT,
        "magshell": __version__,
        "kind": type(result).__name__,
        "scene": digests(scene),
        "arrays": [names[k] for k in range(len(arrays))],
        "result": held,
    }
    named = {names[k]: array for k, array in enumerate(arrays)}
    text = np.frombuffer(json.dumps(known).encode(), dtype=np.uint8)
    replace_file(path, lambda file: np.savez_compressed(file, **{_CONTENTS: text}, **named))


def load(path: str | Path, scene: Scene) -> Any:  # which of them, the file tells
    """Load a result that `save` wrote; solves that continue from it give the same bits as from the original.

    path: of the file. scene: made by the same script as the scene that was solved.

    The file contains data only: reading it executes no code, so files from others are safe. Raises ValueError if it is not
    such a file, was written by a later version of magshell, or belongs to another scene (the message says which parts
    differ); OSError if it cannot be read.

    >>> import magshell as ms, tempfile
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save(f"{folder}/rest.npz", ms.equilibrium(scene))
    ...     ms.load(f"{folder}/rest.npz", scene).stable
    True
    """
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
    with Path(path).open("rb") as opened:
        try:
            with open_npz(opened) as file:
                known = json.loads(file[_CONTENTS].tobytes())
                if known["format"] > _FORMAT:
                    raise _Later
                arrays = [file[name] for name in known["arrays"]]
            kind, version, of = _KINDS[known["kind"]], str(known["magshell"]), dict(known["scene"])
            held = from_plain(known["result"], lambda k: arrays[int(k)])
        except _Later:
            raise ValueError(
                f"{path} was written by magshell {known['magshell']}, in a format that {__version__} does not know"
            ) from None
        except Exception as error:
            raise ValueError(f"{path} is not a saved result: {error}") from error
    if differ := differing(of, digests(scene)):
        versions = (
            "" if version == __version__ else f" It was written by magshell {version}, this is {__version__}."
        )
        raise ValueError(
            f"{path} is the result of another scene: {', '.join(differ)} differ. Make the scene as it was made "
            f"then.{versions}"
        )
    try:
        cases = held["_cases"] if kind is EquilibriumSet else [held]
        made = [_made(Equilibrium if kind is EquilibriumSet else kind, case, scene) for case in cases]
    except Exception as error:
        raise ValueError(f"{path} is not a saved result: {error}") from error
    return EquilibriumSet(made) if kind is EquilibriumSet else made[0]


class _Later(Exception):
    pass


def _fields(result, scene: Scene) -> dict[Any, Any]:
    """Return the data of a result, with the scene's objects replaced by their numbers."""
    if isinstance(result, EquilibriumSet):
        return {"_cases": [_fields(case, scene) for case in result]}
    numbers = {id(each): k for k, each in enumerate((scene, *scene.objects))}
    held = {
        _IN_FILES.get(name, name): value
        for name, value in result.__getstate__().items()
        if name not in ("scene", "_balance")
    }
    for name in ("replaced", "paths"):
        if name in held["_values"]:
            held["_values"] = {**held["_values"], name: _numbered(held["_values"][name], numbers)}
    if "_varied" in held:
        held["_varied"] = {(numbers[id(each)], name): rows for (each, name), rows in held["_varied"].items()}
    return held


def _numbered(of_objects: dict[Any, Any], numbers: dict[int, int]) -> dict[Any, Any]:
    return {numbers[id(each)]: value for each, value in of_objects.items()}


def _made(kind: type[Any], held: dict[Any, Any], scene: Scene):
    """Restore a result from the data of `_fields`. Raises an error if they do not fit the scene."""
    objects = (scene, *scene.objects)
    if held.keys() != _expected(kind):
        raise ValueError("it has missing or unknown fields")
    values = dict(held["_values"])
    for name in ("replaced", "paths"):
        if name in values:
            values[name] = {objects[number]: value for number, value in values[name].items()}
    held = {**held, "_values": values}
    if "_varied" in held:
        held["_varied"] = {(objects[number], name): rows for (number, name), rows in held["_varied"].items()}
    check_fits(held, scene)
    fields = {name: held[_IN_FILES.get(name, name)] for name in kind.__dataclass_fields__.keys() - {"scene"}}
    result = object.__new__(kind)
    result.__setstate__({"scene": scene, **fields})
    return result


def _expected(kind: type[Any]) -> set[str]:
    return {_IN_FILES.get(name, name) for name in kind.__dataclass_fields__.keys() - {"scene"}}


def _names(held, prefix: str = "") -> Iterator[tuple[int, str]]:
    """Yield (number of an array, its path in the result) for each array."""
    if not isinstance(held, dict):
        return
    ((kind, content),) = held.items()
    if kind in ("array", "number"):
        yield content, prefix
    elif kind in ("list", "tuple"):
        for k, each in enumerate(content):
            yield from _names(each, f"{prefix}.{k}" if prefix else str(k))
    elif kind == "dict":
        for k, (key, each) in enumerate(content):
            name = key if isinstance(key, str | int) else k
            yield from _names(each, f"{prefix}.{name}" if prefix else str(name))
    elif isinstance(content, dict):
        for name, each in content.items():
            yield from _names(each, f"{prefix}.{name}")
