"""Whether two scenes are the same, part by part."""

from __future__ import annotations

from ..design.digest import digest
from ..scene.scene import Scene


def digests(scene: Scene) -> dict[str, str]:
    """{name of a part: its digest}, the same in every process. Raises ValueError where a part has none."""
    found = {}
    for name, part in _parts(scene).items():
        try:
            found[name] = digest(part)
        except TypeError as error:
            raise ValueError(
                f"a file must tell of which scene it is, and cannot for {name}, {part!r}: {error}"
            ) from error
    return found


def differing(of: dict[str, str], now: dict[str, str]) -> list[str]:
    """The names of what is not the same."""
    return [name for name in {**of, **now} if of.get(name) != now.get(name)]


def _parts(scene: Scene) -> dict[str, object]:
    parts = {}
    for name, part in scene.__getstate__().items():
        if isinstance(part, list | tuple):
            parts |= {f"{name}[{k}]": each for k, each in enumerate(part)}
        else:
            parts[name] = part
    return parts
