"""What the build says of itself, and thread counts."""

import pytest

import magshell as ms


def test_show_config_prints_what_it_returns(capsys):
    config = ms.show_config()
    printed = capsys.readouterr().out
    assert config["magshell"] == ms.__version__
    assert {"supernodal", "eigen"} <= set(config["factorizations"].split(", "))
    assert config["Eigen"].startswith(("3.", "5."))
    for name, value in config.items():
        assert f"{name}: {value}" in printed


def test_the_number_of_threads_is_kept():
    before = ms.num_threads()
    try:
        ms.set_num_threads(3)
        assert ms.num_threads() == 3
        assert ms.show_config()["threads"] == "3"
    finally:
        ms.set_num_threads(before)


@pytest.mark.parametrize("count", [0, -1, 100_000])
def test_an_impossible_number_of_threads_is_refused(count):
    with pytest.raises(ValueError, match="between 1 and 1024"):
        ms.set_num_threads(count)


@pytest.mark.parametrize("count", [1.5, "2", True, None])
def test_threads_are_counted_in_integers(count):
    with pytest.raises(TypeError, match="must be an integer"):
        ms.set_num_threads(count)
