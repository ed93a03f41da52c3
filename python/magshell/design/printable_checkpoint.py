"""The file from which a search for a printable magnetization goes on."""

from __future__ import annotations

import glob
from pathlib import Path
from typing import Any

from .configuration import changes, decoded, encoded, kept, load, save
from .ink import PrintableSet

_PARTS = ("configuration", "faces", "stateful", "history", "search", "exchanges")


class PrintableCheckpoint:
    """Where it is, if anywhere, and for what: the ink, the number of faces and the options that must be the same."""

    def __init__(self, path: str | Path | None, ink: PrintableSet, n_faces: int, options: dict[str, Any]):
        self.path: Path | None = None if path is None else Path(path)
        ink_has = {name: getattr(ink, name) for name in ("strength", "directions", "levels", "frames")}
        self._configuration: dict[str, Any] = kept({"n_faces": n_faces, **ink_has, **options})

    def save(self, **parts: Any) -> None:
        if self.path is not None:
            held = {name: encoded(part, f"the search's {name}") for name, part in parts.items()}
            save(self.path, {**held, "configuration": self._configuration})
            for number in range(len(parts["history"])):
                self.of_stage(number).unlink(missing_ok=True)

    @property
    def there(self) -> bool:
        """Whether there is such a file."""
        return self.path is not None and self.path.exists()

    def load(self) -> dict[str, Any]:
        """The parts that were saved. Raises ValueError where they are of another search."""
        contents = load(self.path, _PARTS)
        if changed := changes(contents["configuration"], self._configuration):
            raise ValueError(
                f"the checkpoint is of a search with other options: {'; '.join(changed)}. Resume with those of the "
                "checkpoint, or begin anew with another file"
            )
        return {name: decoded(contents[name]) for name in _PARTS if name != "configuration"}

    def clear(self) -> None:
        """Removes what is left of stages of another search."""
        if self.path is not None:
            for file in self.path.parent.glob(f"{glob.escape(self.path.name)}.stage*"):
                file.unlink()

    def of_stage(self, number: int) -> Path | None:
        """The file within a stage, beside it."""
        return None if self.path is None else self.path.with_name(f"{self.path.name}.stage{number}")
