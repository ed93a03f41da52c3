"""The sheet of [Hu18] in a vertical field, with and without its own field."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("hu_sheet")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main((12, 4))


def test_own_field_takes_part_of_the_bending_away(result) -> None:
    own, without = (1e3 * result[each]["heights"] for each in (True, False))
    np.testing.assert_allclose(own, [0.029, 0.273, 0.450, 0.692], atol=5e-3)
    np.testing.assert_allclose(without, [0.0, 0.285, 0.491, 0.766], atol=5e-3)
    assert all(state.stable for each in result.values() for state in each["states"])


def test_ends_rise_alike(result) -> None:
    for each in result.values():
        last = each["states"][-1]
        mesh, raised = last.scene.mesh, np.asarray(last.displacements)[:, 2]
        left, right = (raised[mesh.vertices_at(x=x)].mean() for x in (0.0, 3.7e-3))
        assert left == pytest.approx(right, rel=1e-6)


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "sheet.png")
    assert (tmp_path / "sheet.png").stat().st_size > 50_000
    assert "4 mT: 0.69" in example.summary(result)
