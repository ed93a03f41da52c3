"""Every hard case reaches its answer, or raises its error; `python tests/hard/table.py` prints them."""

from collections import Counter

import pytest
from registry import TIME_LIMIT, all_cases, judge

CASES = all_cases()


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning", "ignore::magshell.StepErrorWarning")
@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")  # limits of theory, far beyond any material
@pytest.mark.parametrize("case", [pytest.param(case, id=case.id) for case in CASES])
def test_hard_case_reaches_its_answer(case):
    verdict = judge(case)
    assert verdict.answer.right, f"expected {verdict.answer.expected}, got {verdict.answer.got}"
    assert verdict.seconds < TIME_LIMIT


def test_table_has_enough_distinct_cases():
    assert sum(case.family not in ("contact", "water") for case in CASES) >= 60
    assert max(Counter(case.id for case in CASES).values()) == 1
