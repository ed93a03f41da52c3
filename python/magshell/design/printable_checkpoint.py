"""Checkpoint file of a search for a printable magnetization."""

from __future__ import annotations

import glob
from pathlib import Path
from typing import Any

from .configuration import as_stored, changes, decoded, encoded, load, save
from .printable_set import PrintableSet

_PARTS = ("configuration", "faces", "stateful", "history", "search", "exchanges")


class PrintableCheckpoint:
    """The checkpoint of one search, or none if `path` is None.

    It stores the ink, the number of faces and the options, which must be the same when the search is resumed.
    """

    def __init__(self, path: str | Path | None, ink: PrintableSet, n_faces: int, options: dict[str, Any]):
        self.path: Path | None = None if path is None else Path(path)
        ink_has = {name: getattr(ink, name) for name in ("strength", "directions", "levels", "frames")}
        self._configuration: dict[str, Any] = as_stored({"n_faces": n_faces, **ink_has, **options})

    def save(self, **parts: Any) -> None:
        """Write these parts of the search, and remove the files of stages that they contain."""
        if self.path is not None:
            held = {name: encoded(part, f"the search's {name}") for name, part in parts.items()}
            save(self.path, {**held, "configuration": self._configuration})
            for number in range(len(parts["history"])):
                self.of_stage(number).unlink(missing_ok=True)

    @property
    def there(self) -> bool:
        """Return whether the file exists."""
        return self.path is not None and self.path.exists()

    def load(self) -> dict[str, Any]:
        """Return the parts that were saved. Raises ValueError if they are those of a search with other options."""
        contents = load(self.path, _PARTS)
        if changed := changes(contents["configuration"], self._configuration):
            raise ValueError(
                f"the checkpoint is of a search with other options: {'; '.join(changed)}. Resume with those of the "
                "checkpoint, or begin anew with another file"
            )
        return {name: decoded(contents[name]) for name in _PARTS if name != "configuration"}

    def clear(self) -> None:
        """Remove files that stages of another search have left."""
        if self.path is not None:
            for file in self.path.parent.glob(f"{glob.escape(self.path.name)}.stage*"):
                file.unlink()

    def of_stage(self, number: int) -> Path | None:
        """Return the path of the checkpoint within a stage, in the same folder."""
        return None if self.path is None else self.path.with_name(f"{self.path.name}.stage{number}")
