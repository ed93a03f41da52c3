"""Tests of the public docstrings: every public name has one, names its parameters, gives units, and its example
runs.
"""

import doctest
import importlib
import inspect
import pkgutil
import pydoc
import re
import sys
import types
import warnings

import numpy as np
import pytest
from public_names import public_names

import magshell as ms

# Errors, warnings and results are not made by a user, and what is abstract cannot be.
sys.path.insert(0, str(__import__("pathlib").Path(__file__).parents[1] / "hard"))
from fuzz_not_called import NOT_CALLED

GIVEN = {"a result", "an error", "a warning", "abstract"}
MADE = sorted(public_names() - {name for name, why in NOT_CALLED.items() if why in GIVEN})
LIBRARIES = (
    "torch",
    "gmsh",
    "magpylib",
    "yourdfpy",
    "meshio",
    "gymnasium",
    "matplotlib",
    "pandas",
    "xarray",
    "viser",
    "pxr",
)


def named(name: str):
    found = ms
    for part in name.split("."):
        found = getattr(found, part)
    return found


def own_docstring(each) -> str:
    return (each.__dict__.get("__doc__") if inspect.isclass(each) else inspect.getdoc(each)) or ""


def parameters(each) -> list[str]:
    try:
        found = inspect.signature(each).parameters.values()
    except (ValueError, TypeError):
        return []
    several = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    return [one.name for one in found if one.kind not in several and not one.name.startswith("_")]


def docstring_with_references(name: str, seen: frozenset = frozenset()) -> str:
    """Return a docstring with those that it refers to: "as in `equilibrium`"."""
    text = own_docstring(named(name))
    for other in set(re.findall(r"\b[as]s (?:in|of|an?) `?(?:ms\.)?([\w.]+)`?", text)) - seen - {name}:
        other = other.rstrip(".")
        if other in public_names():
            text += docstring_with_references(other, seen | {name})
    return text


def members(each):
    """Yield (name, function) of the methods and properties that a user sees."""
    for name, value in vars(each).items():
        function = (
            getattr(value, "fget", None) or getattr(value, "__func__", None) or getattr(value, "func", value)
        )
        if not name.startswith("_") and isinstance(function, types.FunctionType):
            yield name, function


@pytest.mark.parametrize("name", sorted(public_names()))
def test_public_name_has_a_docstring(name):
    assert own_docstring(named(name)).strip()


@pytest.mark.parametrize("name", MADE)
def test_parameters_are_named(name):
    missing = [
        each
        for each in parameters(named(name))
        if not re.search(rf"\b{each}\b", docstring_with_references(name))
    ]
    assert missing == []


@pytest.mark.parametrize("name", MADE)
def test_a_line_runs(name):
    assert ">>> " in own_docstring(named(name))


def test_members_have_one():
    """Check all but those that override a documented one, and those that only magshell itself calls."""
    inner = {
        "add_numbers",
        "gradients",
        "replaced",
        "held",
        "directed",
        "sides",
        "riding",
        "nearly_incompressible",
    }
    found = [
        f"{name}.{member}"
        for name in sorted(public_names())
        if inspect.isclass(named(name))
        for member, function in members(named(name))
        if member not in inner and not (inspect.getdoc(function) or "").strip()
    ]
    assert found == []


def modules():
    for found in pkgutil.walk_packages(ms.__path__, "magshell."):
        if not found.name.startswith(("benchmarks", "magshell._core", "magshell.__main__")):
            yield importlib.import_module(found.name)


def examples():
    finder = doctest.DocTestFinder(exclude_empty=True)
    seen = set()
    for module in modules():
        for test in finder.find(module, module.__name__, globs={**vars(module), "ms": ms, "np": np}):
            if test.examples and test.name not in seen:
                seen.add(test.name)
                yield pytest.param(test, id=test.name.removeprefix("magshell."))


@pytest.mark.parametrize("test", list(examples()))
def test_docstring_examples_run(test, tmp_path, monkeypatch):
    for library in LIBRARIES:
        if library in test.docstring:
            pytest.importorskip(library)
    monkeypatch.chdir(tmp_path)
    told = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        failed = doctest.DocTestRunner(verbose=False).run(test, out=told.append).failed
    assert not failed, "".join(told)


@pytest.mark.parametrize("name", ["LBFGS", "MMA", "GCMMA", "GaussNewton", "NewtonCG"])
def test_help_of_an_optimizer_is_ours(name):
    """Check that the help of torch's own methods stands under its own heading, after everything of ours."""
    told = pydoc.plain(pydoc.render_doc(getattr(ms.optim, name))).split("inherited from torch")[0]
    assert "load_state_dict" in told and "add_param_group" in told and "step(self, closure" in told
    assert not re.search(r"lr_scheduler|Args:|:class:|fine tuning|Helper for pickle", told)
