"""Builds the gallery: pictures that the examples draw of small versions of themselves, with links to their code.

Pictures are made once for each state of the examples and of the package's Python, and stored in docs/_gallery,
which is not committed.
"""

import ast
import hashlib
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]
ROOT = HERE.parent
EXAMPLES = ROOT / "examples"
MADE = HERE / "_gallery"
PICTURES = HERE / "pictures"  # of every example, made by front_page.py

# Arguments of `main` with which an example takes seconds, the longest ones first. Other examples take minutes and have no
# figure here.
SMALL = {
    "gripper": "iterations=4, steps=60",
    "hexagram": "edges_per_side=6, n_vertices=280, iterations=25",
    "muscle_strip": "cells=(12, 2, 2), steps=40, time_step=2e-2",
    "folding": "cells=(21, 20), angles=(4, 5)",
    "snapping_flaps": "step=0.5e-3",
    "self_folding": "",
    "bead_chain": "",
    "hu_sheet": "(12, 4)",
    "tendon_arm": "",
    "pendulum_in_jelly": "cells=6",
    "bistable_beam": "cells=(24, 4), meshes=((12, 2), (24, 4), (48, 8))",
    "bending_twisting": "cells=(16, 2), bending_time=10.0, turning_time=5.0, undamped_time=0.3",
    "pneumatic_finger": "",
    "snap_design": "cells=(24, 4)",
    "topology": "cells=(24, 12), iterations=8",
    "tapered_arc": "cells=(40, 2)",
    "gripper_outline": "size=1.3e-3, solves=12",
    "shell_against_volume": "cells=(32, 4), layers=(2, 6), angles=(1.0, 3.14159)",
    "pinched_cylinder": "((6, 6), (8, 8), (16, 16)), ((8, 8), (8, 8), (16, 16))",
}
_SCRIPT = """
import sys; sys.path.insert(0, {examples!r})
import magshell as ms, {name} as example
drawn = example.plot(example.main({arguments}))
getattr(drawn, "save", None) or (drawn := ms.Picture(drawn))
drawn.save({picture!r}, **({{}} if not hasattr(drawn.figure, "savefig") else {{"dpi": 80}}))
"""


def make(app) -> None:
    """Write docs/_gallery/*.md, with pictures of the examples that are new or have changed."""
    MADE.mkdir(exist_ok=True)
    names = sorted(
        path.stem for path in EXAMPLES.glob("*.py") if not path.stem.startswith("_")
    )
    if os.environ.get("MAGSHELL_GALLERY") != "none":
        old = [name for name in SMALL if not _is_new(MADE / f"{name}.png", name)]
        # Each example runs in a process of its own, on one thread.
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(lambda name: _draw(name, MADE / f"{name}.png"), old))
    for name in names:
        _write(MADE / f"{name}.md", _page(name))
    _write(MADE / "index.md", _index(names))


def _draw(name: str, picture: Path) -> None:
    """Run an example in a process of its own, and save its picture."""
    script = _SCRIPT.format(
        examples=str(EXAMPLES), name=name, arguments=SMALL[name], picture=str(picture)
    )
    paths = [
        str(Path(sys.modules["magshell"].__file__).parents[1]),
        os.environ.get("PYTHONPATH", ""),
    ]
    environment = {
        **os.environ,
        "MPLBACKEND": "Agg",
        "MAGSHELL_NUM_THREADS": "1",
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
    }
    run = [sys.executable, "-c", script]
    found = subprocess.run(
        run, cwd=MADE, env=environment, capture_output=True, text=True, timeout=600
    )
    if found.returncode:
        raise RuntimeError(
            f"the example {name} failed for the gallery:\n{found.stderr[-3000:]}"
        )
    picture.with_suffix(".txt").write_text(_source_hash(name))


def _is_new(picture: Path, name: str) -> bool:
    """Return whether a picture was made from the present sources."""
    hash_file = picture.with_suffix(".txt")
    return (
        picture.exists()
        and hash_file.exists()
        and hash_file.read_text() == _source_hash(name)
    )


def _source_hash(name: str) -> str:
    """Return the hash of all sources that an example's picture depends on."""
    found = hashlib.blake2b(SMALL[name].encode() + _SCRIPT.encode())
    sources = [
        EXAMPLES / f"{name}.py",
        *EXAMPLES.glob("_*/*.py"),
        *(ROOT / "python" / "magshell").rglob("*.py"),
    ]
    for path in sorted(sources):
        found.update(path.read_bytes())
    return found.hexdigest()


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def _title(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _words(name: str) -> list[str]:
    """Return the first line of an example's docstring, and the rest."""
    text = ast.get_docstring(ast.parse((EXAMPLES / f"{name}.py").read_text())) or ""
    first, _, rest = text.partition("\n\n")
    return [" ".join(first.split()), rest]


def _image(path: str, name: str, width: str) -> str:
    return f"```{{image}} {path}\n:alt: {_title(name)}\n:width: {width}\n```\n\n"


def _picture(name: str) -> str:
    """Return the small picture of an example, which moves."""
    there = (PICTURES / f"{name}.webp").exists()
    return _image(f"../pictures/{name}.webp", name, "320px") if there else ""


def _figure(name: str) -> str:
    """Return the figure that an example draws, if it is fast enough for this manual."""
    if not (MADE / f"{name}.png").exists():
        return ""
    small = f"The figure is of `main({SMALL[name]})`, smaller than what the script computes.\n\n"
    return _image(f"{name}.png", name, "100%") + small


def _page(name: str) -> str:
    first, rest = _words(name)
    code = f"## The code\n\n```{{literalinclude}} ../../examples/{name}.py\n:language: python\n```\n"
    shown = f"{_picture(name)}{_markdown(first)}\n\n{_figure(name)}"
    return f"# {_title(name)}\n\n{shown}{_markdown(rest)}\n\n{code}"


def _markdown(text: str) -> str:
    return (
        text.replace("*", "\\*")
        .replace("[", "\\[")
        .replace("<", "\\<")
        .replace("$", "\\$")
    )


def _index(names: list[str]) -> str:
    parts = [
        f"### [{_title(name)}]({name}.md)\n\n{_picture(name)}{_markdown(_words(name)[0])}\n"
        for name in names
    ]
    listed = "\n".join(names)
    return (
        "# Gallery\n\nEvery picture is computed by its example, some at a smaller size; the title leads to the code. "
        "`python examples/NAME.py` computes the full version, and writes its pictures and movies to `out/`.\n\n"
        + "\n".join(parts)
        + f"\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n"
    )
