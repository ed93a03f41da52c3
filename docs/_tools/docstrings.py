"""Converts magshell's docstrings to reStructuredText: descriptions of parameters become lists, code stays code."""

import re

_FIELD = re.compile(
    r"^((?:\*{0,2}[A-Za-z_][\w.]*(?:\([^)]*\))?)(?:, \*{0,2}[A-Za-z_][\w.]*)*): (.*)$"
)
_SECTION = re.compile(r"^(Args|Raises|Returns):$")
# Names for developers of the package, left out of the manual.
_INNER = {"current"}


def process(app, what, name, obj, options, lines) -> None:
    """Replace the lines of a docstring; a handler of Sphinx's autodoc-process-docstring."""
    lines[:] = [each for block in _blocks(lines) for each in [*_converted(block), ""]]


def skip(app, what, name, obj, skipped, options) -> bool | None:
    """Leave private names out of the manual; a handler of Sphinx's autodoc-skip-member."""
    return True if name in _INNER or name.startswith("_") else None


def _blocks(lines: list[str]):
    """Split lines at empty ones into blocks; an example is one block with its output."""
    block: list[str] = []
    for line in [*lines, ""]:
        if line.strip():
            block.append(line)
        elif block:
            yield block
            block = []


def _converted(block: list[str]) -> list[str]:
    """Convert one block of lines to reStructuredText."""
    if block[0].lstrip().startswith(">>>"):
        return ["::", "", *(f"   {line}" for line in block)]
    if all(line.startswith("    ") for line in block):
        return ["::", "", *block]
    found: list[str] = []
    indent = 0
    for line in block:
        text = line.strip()
        depth = len(line) - len(line.lstrip())
        if section := _SECTION.match(text):
            found += ["", f"**{section[1]}**", ""]
            indent = 4
        elif (field := _FIELD.match(text)) and depth <= indent:
            names = ", ".join(f"``{each.strip()}``" for each in field[1].split(", "))
            found += [
                *([] if found and found[-1].startswith(("- ", "  ")) else [""]),
                f"- {names}: {_escaped(field[2])}",
            ]
        elif (
            found
            and found[-1].startswith(("- ", "  "))
            and depth > indent - 4 * (indent > 0)
            and (depth or indent)
        ):
            found.append(f"  {_escaped(text)}")
        else:
            found += [
                *([""] if found and found[-1].startswith(("- ", "  ")) else []),
                _escaped(text),
            ]
    return found


def _escaped(text: str) -> str:
    """Return text with the markup of reStructuredText escaped; text in backticks becomes code."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return _plain(text)
    return "".join(
        f"``{part}``" if k % 2 and part else _plain(part)
        for k, part in enumerate(parts)
    )


def _plain(text: str) -> str:
    return re.sub(r"([\\*|_`])", r"\\\1", text)
