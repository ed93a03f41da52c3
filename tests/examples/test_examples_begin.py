"""Every example and notebook builds its scene and takes a first solve or iteration; nightly tests compare their results."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

import nbformat
import pytest
import tqdm
from example_modules import EXAMPLES, load
from matplotlib import pyplot

from magshell._runtime.progress import SolveBar

NAMES = sorted(path.stem for path in EXAMPLES.glob("*.py") if not path.stem.startswith("_"))
NOTEBOOKS = sorted((EXAMPLES.parent / "notebooks").glob("*.ipynb"))


pytestmark = pytest.mark.filterwarnings(
    "ignore::magshell.StepErrorWarning", "ignore::magshell.LargeStrainWarning"
)


class Begun(BaseException):
    """Ends an example as soon as a solve or a search reports progress: a solve at its end at the latest."""


@pytest.fixture(autouse=True)
def _figures_are_closed() -> Iterator[None]:
    yield
    pyplot.close("all")


@pytest.fixture(autouse=True)
def _solves_end_at_their_first_report(monkeypatch) -> None:
    def report(*_) -> None:
        raise Begun

    monkeypatch.setattr(SolveBar, "to", report)
    monkeypatch.setattr(tqdm.tqdm, "update", report)


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
@pytest.mark.parametrize("name", NAMES)
def test_an_example_begins(name: str) -> None:
    with contextlib.suppress(Begun):  # examples without a solve that reports end by themselves
        load(name).main()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_begins(path: Path, monkeypatch) -> None:
    monkeypatch.chdir(path.parent)
    names: dict = {"__name__": "__main__"}
    with pytest.raises(Begun):
        for cell in nbformat.read(path, as_version=4).cells:
            if cell.cell_type == "code":
                exec(compile(cell.source, str(path), "exec"), names)
