"""Random drops, throws and squeezes never intersect, are finite, end, and gain no energy, with every integrator.

MAGSHELL_CONTACT_SCENES says how many: 500 take two or three minutes.
"""

import os

import pytest
from contact_scenes import verdict

SCENES = int(os.environ.get("MAGSHELL_CONTACT_SCENES", "30"))


@pytest.mark.parametrize("seed", range(SCENES))
def test_a_random_contact_ends_well(seed) -> None:
    assert verdict(seed) is None
