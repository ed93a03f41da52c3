"""The part of an error message that follows a name which does not exist."""

from __future__ import annotations

from collections.abc import Iterable


def nearest_names(name: object, names: Iterable[str]) -> str:
    """Return the names nearest to one that does not exist, and up to twenty of all names, for the end of a message."""
    import difflib  # for errors alone

    lowered: dict[str, str] = {each.lower(): each for each in names}
    close = difflib.get_close_matches(str(name).lower(), lowered, n=3, cutoff=0.5)
    nearest = f"; the nearest names are {', '.join(repr(lowered[each]) for each in close)}" if close else ""
    listed = ", ".join(map(repr, list(lowered.values())[:20])) or "none"
    return f"{nearest}. Its names are {listed}"
