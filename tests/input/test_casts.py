"""Every numeric argument of everything public, as what is no real number: refused by its name, never cast to one.

The list is that of the fuzzing in tests/hard, which a new function joins by being there.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("torch")
sys.path.insert(0, str(Path(__file__).parents[1] / "hard"))

from fuzz_calls import Sample, calls

OF_OTHER_NAMES = {  # what the message calls them
    "holes": "hole 0",
    "slits": "slit 0",
    "index": "range indices",
    "count": "the number of threads|count",
}
NOT_NUMBERS = {  # anything; Python's own indices; a truth as well as a count
    ("multistart", "starts"),
    ("EquilibriumPath.equilibrium", "index"),
    ("Style", "arrows"),
}
SLOW = 30  # pictures and films


def spoiled(value):
    array = np.array(value.detach() if hasattr(value, "detach") else value)
    if array.ndim == 0:
        number = array.item()
        return {
            "complex": complex(number, 1),
            "numpy's complex": np.complex128(complex(number, 1)),
            "of no axes": np.array(complex(number, 1)),
            "text": str(number),
            "object": object(),
            "truth": True,
        }
    return {
        "complex": array + 1j,
        "text": array.astype(str),
        "objects": np.full(array.shape, object()),
        "truths": np.ones(array.shape, dtype=bool),
    }


def is_numeric(value) -> bool:
    if isinstance(value, bool | str | Path | dict | None):
        return False
    try:
        array = np.asarray(value.detach() if hasattr(value, "detach") else value)
    except (TypeError, ValueError, RuntimeError):
        return False
    return array.dtype.kind in "iuf" and array.size > 0


def test_all_of_them(tmp_path):
    found, missed = 0, []
    for call in calls(Sample(tmp_path)):
        if call.cost >= SLOW:
            continue
        for name, value in call.arguments.items():
            if not is_numeric(value) or (call.name, name) in NOT_NUMBERS:
                continue
            for kind, bad in spoiled(value).items():
                found += 1
                reason = refusal(call, name, bad)
                if reason is not None:
                    missed.append(f"{call.name}({name}: {kind}) {reason}")
    assert found > 500
    assert not missed, "\n".join(missed)


def refusal(call, name, bad) -> str | None:
    """Return None where a call was refused by the argument's name, or the fault as text."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", np.exceptions.ComplexWarning)
        try:
            call.function(**{**call.arguments, name: bad})
        except (TypeError, ValueError) as error:
            names = OF_OTHER_NAMES.get(name, name).split("|")
            return None if any(each in str(error) for each in names) else f"said: {error}"
        except Exception as error:
            return f"raised {error!r}"
    return "was taken"


@pytest.mark.parametrize("name", ["first_step", "max_step", "min_parameter", "max_points"])
@pytest.mark.parametrize("value", [1j, "1", None, [1.0, 2.0], object()])
def test_options_of_a_path(name, value):
    mesh = ms.meshes.rectangle(0.1, 0.05, cells=(2, 1))
    scene = ms.Scene(
        ms.Shell(mesh, thickness=1e-3, young_modulus=1e6), supports=[ms.Clamp(mesh.edges_at(x=0.0))]
    )
    with pytest.raises(ValueError, match=name):
        ms.follow_path(scene, **{name: value})


def nothing(parameters):
    raise AssertionError("was called")


@pytest.mark.parametrize("value", [1j, np.complex128(1j), "1", True, -1.0])
def test_feasibility_must_be_a_real_number(value):
    torch = pytest.importorskip("torch")
    parameter = torch.ones(2, dtype=torch.float64, requires_grad=True)
    optimizer = lambda given: ms.optim.LBFGS(given, lower=0.0, upper=2.0)  # noqa: E731
    with pytest.raises(ValueError, match="feasibility"):
        ms.minimize(nothing, [parameter], optimizer, feasibility=value)
    with pytest.raises(ValueError, match="feasibility"):
        ms.multistart(nothing, [1.0], feasibility=value)


@pytest.mark.parametrize("value", [1j, np.full(2, 1j), "1", True])
def test_bounds_and_terms(value):
    torch = pytest.importorskip("torch")
    parameter = torch.ones(2, dtype=torch.float64, requires_grad=True)
    with pytest.raises(ValueError, match="lower of parameter 0"):
        ms.optim.LBFGS([parameter], lower=value, upper=2.0)
    optimizer = lambda given: ms.optim.LBFGS(given, lower=0.0, upper=2.0)  # noqa: E731
    with pytest.raises(ValueError, match="the term 'height' must be a number"):
        ms.minimize(lambda x: (x.sum(), {"height": value}), [parameter], optimizer, progress=False)
