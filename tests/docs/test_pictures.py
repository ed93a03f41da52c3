"""Pictures of the README and the manual: there for every example, small, moving, and not blank."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "docs" / "pictures"
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("[!_]*.py"))
FILE, STRIP, ALL = (
    60_000,
    300_000,
    2_000_000,
)  # bytes: of a picture, of the README's strip, of all in the repository


def shown_in(page: Path) -> list[tuple[str, str]]:
    """Return the path and the text of every <img> of a page."""
    return re.findall(r'<img src="([^"]+)" alt="([^"]+)"', page.read_text())


def frames(path: Path) -> list[np.ndarray]:
    image = pytest.importorskip("PIL.Image").open(path)
    found = []
    for number in range(getattr(image, "n_frames", 1)):
        image.seek(number)
        found.append(np.asarray(image.convert("RGB"), dtype=float))
    return found


def test_readme_begins_with_six_small_pictures_that_move():
    text = (ROOT / "README.md").read_text()
    assert text.index("<img") < text.index("```sh") < 2200
    strip = [ROOT / path for path, _ in shown_in(ROOT / "README.md")]
    assert len(strip) == 6 and sum(path.stat().st_size for path in strip) < STRIP
    assert all(len(frames(path)) > 10 for path in strip)


def test_all_pictures_of_the_repository_are_small():
    kinds = ("*.png", "*.webp", "*.gif", "*.svg", "*.jpg")
    listed = subprocess.run(["git", "ls-files", *kinds], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("no git checkout")
    sizes = [(ROOT / name).stat().st_size for name in listed.stdout.split()]
    assert sum(sizes) < ALL


def test_every_example_has_a_picture_in_its_row():
    rows = {
        re.search(r"`(\w+)\.py`", line)[1]: re.search(r'src="pictures/(\w+)\.webp"', line)[1]
        for line in (ROOT / "docs" / "examples.md").read_text().splitlines()
        if line.startswith("| <img")
    }
    assert rows == {name: name for name in EXAMPLES}


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/examples.md"])
def test_pictures_of_a_page_exist_and_have_texts(page):
    there = shown_in(ROOT / page)
    assert len(there) >= 6 and all(text for _, text in there)
    assert [path for path, _ in there if not ((ROOT / page).parent / path).is_file()] == []


@pytest.mark.parametrize("name", EXAMPLES)
def test_picture_is_small_and_shows_its_body_whole(name):
    path = PICTURES / f"{name}.webp"
    assert path.stat().st_size <= FILE
    for image in frames(path)[::5]:
        inked = (np.abs(image - 255.0).max(axis=2) > 60.0).mean()
        assert 0.01 < inked < 0.7
        edges = [image[0], image[-1], image[:, 0], image[:, -1]]
        assert max((np.abs(each - 255.0).max(axis=1) > 120.0).mean() for each in edges) < 0.1


def test_the_tool_knows_the_picture_of_every_example():
    pytest.importorskip("pyvista")
    tool = ROOT / "docs" / "_tools" / "front_page.py"
    told = subprocess.run([sys.executable, tool, "--help"], capture_output=True, text=True, check=True).stdout
    assert set(EXAMPLES) <= set(re.findall(r"\w+", told))
    wrong = subprocess.run([sys.executable, tool, "octopuss"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "there are no pictures named octopuss" in wrong.stderr
