"""docs/map.md and docs/adding agree with the tree: rooms, floors, the order of imports, files and tests."""

import ast
import re
from pathlib import Path

import pytest

from benchmarks.cases import CASES, SOLID_CASES

ROOT = Path(__file__).parents[2]
MAP = ROOT / "docs" / "map.md"
PAGES = [MAP, *sorted((ROOT / "docs" / "adding").glob("*.md"))]
PATH = re.compile(r"`((?:cpp|python|tests|docs|benchmarks|examples|scripts)/[\w./-]+)`")


def constant(name: str):
    """Return a table of test_architecture.py."""
    tree = ast.parse((ROOT / "tests" / "house" / "test_architecture.py").read_text())
    for node in tree.body:
        if isinstance(node, ast.Assign) and node.targets[0].id == name:
            return ast.literal_eval(node.value)
    raise AssertionError(f"test_architecture.py has no {name}")


def rows(title: str) -> list[list[str]]:
    """Return the cells of the table under a title, without its head."""
    part = MAP.read_text().split(f"\n## {title}\n")[1].split("\n## ")[0]
    lines = [line for line in part.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[1:]]


def names(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def test_every_room_of_the_core_is_on_the_map_with_its_floor():
    floors = {cells[1].strip("`").removeprefix("cpp/"): int(cells[0]) for cells in rows("The C++ core")}
    assert floors == constant("FLOORS")


def test_rooms_of_the_package_are_on_the_map_in_their_order():
    packages = ("model", "solve", "output", "__init__", "__main__")  # hold rooms, or stand beside them
    listed = [cells[0].strip("`") for cells in rows("The Python package")]
    assert listed == [room for room in constant("ROOMS") if room not in packages]


def test_first_files_for_a_reader_are_in_their_room():
    missing = []
    for cells in rows("The C++ core"):
        folder = ROOT / cells[1].strip("`")
        missing += [f"{folder.name}/{name}" for name in names(cells[3]) if not (folder / name).is_file()]
    for cells in rows("The Python package"):
        folder = ROOT / "python" / "magshell" / cells[0].strip("`").replace(".", "/")
        missing += [f"{folder.name}/{name}" for name in names(cells[2]) if not (folder / name).is_file()]
    assert missing == []


def test_every_case_of_the_accuracy_tables_is_listed_with_a_file_that_names_it():
    listed = {code: cells[2] for cells in rows("Codes of cases") for code in cells[0].split(", ")}
    cases = {case.name.split()[0].split("-")[0] for case in (*CASES, *SOLID_CASES)}
    assert cases - set(listed) == set()
    for code, file in listed.items():
        assert re.search(rf"\b{code}\b", (ROOT / names(file)[0]).read_text()), code


def test_each_room_has_tests():
    for title in ("The C++ core", "The Python package"):
        for cells in rows(title):
            folders = names(cells[-1])
            assert folders and all(any((ROOT / name).rglob("test_*.py")) for name in folders), cells[0]


def test_every_folder_of_tests_is_on_the_map():
    text = MAP.read_text()
    folders = [path for path in (ROOT / "tests").iterdir() if path.is_dir() and any(path.glob("*.py"))]
    assert [path.name for path in folders if f"`tests/{path.name}`" not in text] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_files_that_a_page_names_exist(page):
    named = PATH.findall(page.read_text())
    assert [name for name in named if not (ROOT / name).exists()] == []
    assert named or page is not MAP


def test_functions_on_the_way_of_the_magnetization_exist_in_their_files():
    stays = rows("One input there and back: `remanent_magnetization`")
    assert len(stays) == 5
    for _, there, back, files in stays:
        sources = "".join((ROOT / each).read_text() for each in names(files))
        for function in (names(there)[0], names(back)[0]):
            assert re.search(rf"\b(?:def|void) {function}\(", sources), function
