"""Every input of every object in every kind of scene against differences; one that is new is here by being there.

A gradient that forgets a way from an input to the shape is a wrong number that nobody notices. All inputs together are
compared along one direction, in both modes. `make nightly` also takes each input alone, where everything else is as it was
made, defaults too, and each among the others.
"""

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_net import (
    agrees,
    at,
    dual_tangent,
    gradients,
    loss,
    moved,
    one_direction,
    rounding,
    size_of,
    unit,
)
from gradient_scenes import OF_SMALL_SCENES, admissible, label, subject, subjects
from gradient_shapes import is_bound

import magshell as ms

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

PRECISION = 2e-5  # of the steepest slope
PRECISION_OF_ONE = 1e-3  # of the share of one input in the slope along the one direction
PRECISION_OF_TANGENTS = 1e-6  # of that share


# Tangents of responses are differences of stiffness matrices. Near the dipoles the field at the finely sampled faces of this
# sheet leaves 6e-6 of them; its adjoint agrees with extrapolated differences to 1e-10.
LESS_PRECISE_TANGENTS = {"a bent sheet that responds by linear theory": 1e-5}


@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning", "ignore::magshell.StepErrorWarning")
def test_all_inputs_along_one_direction(name):
    """Compare slopes along one direction by adjoint, tangent and difference.

    Every input has the same share in the slope, however little it matters, as long as it is not moved by more than LONGEST
    steps. So it is seen if the gradient by one input is zero, of the other sign, or off by a percent, and if one entry that
    makes more than some percents of its square is. It is not seen which input it was: the rows below say.
    """
    of, start = one_direction(name)
    for key, each in of.by.items():
        assert each.shape == of.given[key].shape and np.isfinite(each).all(), label(kind(name), key)

    def loss_at(t):
        return loss(name, moved(of.given, of.way, t), start)

    tolerance = PRECISION_OF_ONE * of.share + of.noise
    assert agrees(loss_at, of.exact(of.given), tolerance, kind(name).step)
    precision = LESS_PRECISE_TANGENTS.get(name, PRECISION_OF_TANGENTS)
    same = pytest.approx(of.exact(of.forward), rel=0.0, abs=precision * of.share)
    assert of.tangent == same
    if kind(name).function is ms.simulate:
        assert dual_tangent(name) == same


# Nothing depends on these.
WITHOUT_EFFECT = {(ms.obstacles.Sphere, "rotation"), (ms.Prismatic, "origin"), (ms.Fixed, "origin")}


def test_no_input_is_forgotten_and_each_matters_somewhere():
    """Check that each value of an object and each keyword of a solve has an effect in some kind of scene."""
    seen = set(WITHOUT_EFFECT)
    for name in MAKERS:
        of, _ = one_direction(name)
        for key in kind(name).entries:
            if key not in of.given or (
                size_of(name, key, of.given[key]) * np.linalg.norm(of.by[key]) > 1e2 * of.noise
            ):
                seen.add(subject(kind(name), key))
    missing = sorted(f"{what.__name__}: {name}" for what, name in subjects() - seen)
    assert not missing, missing


KEEP_THEIR_SHAPES = {
    # NoGradient, where supports have turned.
    "from an equilibrium",
    "a sheet that responds by linear theory",
    "a bent sheet that responds by linear theory",
    "a sheet in a batch of linear responses",
    # These solves refuse rest positions.
    "a sheet that vibrates about its rest shape",
    "a column that buckles by linear theory",
    "a six-node column that buckles by linear theory",
}


def test_every_other_kind_takes_rest_positions_of_all_its_bodies():
    for name in MAKERS:
        scene, values = kind(name).scene, kind(name).of_objects
        owners = [owner for owner, value in values if value == "rest_positions"]
        bodies = 1 if is_bound(scene) else len(scene.bodies)
        assert len(owners) == (0 if name in KEEP_THEIR_SHAPES else bodies), name


# The tests below say which input it is that has a wrong gradient: for `make nightly`.


def check(name, given, key, by, along, start, of_differences):
    """Compare the gradient by one input along a direction, scaled to the input's size, with differences.

    start: where searches start, so that differences are of the equilibrium whose gradient this is. of_differences: the
    error of differences by round-off.
    """
    size = size_of(name, key, given[key])
    direction = {key: size * along}
    exact = float((by * direction[key]).sum())
    tolerance = PRECISION * size * np.linalg.norm(by) + of_differences

    def loss_at(t):
        return loss(name, moved(given, direction, t), start)

    assert agrees(loss_at, exact, tolerance, kind(name).step), label(kind(name), key)


ROWS = [
    pytest.param(name, key, id=f"{name}: {label(kind(name), key)}")
    for name in MAKERS
    for key in kind(name).entries
]


@pytest.mark.parametrize("name, key", ROWS)
def test_an_input_alone(name, key):
    given = {key: kind(name).entries[key]}
    by = gradients(name, given)[key]
    assert by.shape == given[key].shape and np.isfinite(by).all()
    some = admissible(key, np.random.default_rng(5).standard_normal(by.shape))
    for along in (by, some) if by.size > 1 and by.any() else (some,):
        check(name, given, key, by, unit(along), at(name), rounding(name))


@pytest.mark.parametrize("name", MAKERS)
def test_all_inputs_one_by_one(name):
    of, start = one_direction(name)
    for key, each in of.by.items():
        some = admissible(key, np.random.default_rng(6).standard_normal(each.shape))
        check(name, of.given, key, each, unit(unit(each) + 0.5 * unit(some)), start, of.noise)
