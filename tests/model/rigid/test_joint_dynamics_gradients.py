"""Derivatives of dynamics in joint coordinates against differences and against identities between them."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

DOWN = (0.0, 0.0, -9.81)
RNG = np.random.default_rng(5)


def machine():
    """Build a free base that carries a revolute, a screw, a slide, a ball and a fixed link: every kind of joint."""
    base, arm, nut, slide, hand, tip = (
        ms.Link(mass=m, inertia=tensor(k), center=0.3 * RNG.standard_normal(3))
        for k, m in enumerate((2.0, 1.1, 0.7, 0.9, 0.4, 0.2))
    )
    joints = [
        ms.Revolute(arm, base, origin=(0.2, 0, 0.1), axis=(0.2, 1, 0)),
        ms.Screw(nut, arm, origin=(0.4, 0, 0.2), axis=(1, 1, 0), pitch=0.05),
        ms.Prismatic(slide, nut, origin=(0.5, 0, 0.2), axis=(0, 1, 2)),
        ms.Ball(hand, slide, origin=(0.7, 0.1, 0.2)),
        ms.Fixed(tip, hand),
    ]
    return ms.Skeleton([base, arm, nut, slide, hand, tip], joints)


def tensor(seed):
    """Return an inertia that some body has."""
    a = np.random.default_rng(seed).standard_normal((3, 3))
    second = 0.02 * (a @ a.T + 0.1 * np.eye(3))
    return np.trace(second) * np.eye(3) - second


SKELETON = machine()
N = 12
Q, Z, A, F = 0.6 * RNG.standard_normal((4, N))
BASE, ARM, NUT, SLIDE, HAND, TIP = SKELETON.links
HINGE, SCREW, RAIL, BALL, FIXED = SKELETON.joints
NUMBERS = {
    (HINGE, "origin"): HINGE.origin,
    (HINGE, "axis"): np.array([0.2, 1.0, 0.1]),
    (SCREW, "origin"): SCREW.origin,
    (SCREW, "axis"): np.array([1.0, 0.9, 0.2]),
    (SCREW, "pitch"): np.array(0.07),
    (RAIL, "axis"): np.array([0.3, 1.0, 2.0]),
    (BALL, "origin"): BALL.origin,
    **{(link, "mass"): np.array(1.3 * link.mass) for link in SKELETON.links},
    **{(link, "inertia"): 1.2 * link.inertia for link in SKELETON.links},
    **{(link, "center"): link.center + 0.01 for link in SKELETON.links},
}


def leaf(value):
    return torch.tensor(np.array(value), dtype=torch.float64, requires_grad=True)


def leaves():
    return {name: leaf(value) for name, value in {"q": Q, "z": Z, "a": A, "f": F, "g": DOWN}.items()}, {
        key: leaf(value) for key, value in NUMBERS.items()
    }


def by_owner(numbers):
    values = {}
    for (owner, name), value in numbers.items():
        values.setdefault(owner, {})[name] = value
    return values


FUNCTIONS = {
    "mass_matrix": lambda s, x, v: ms.mass_matrix(s, x["q"], values=v),
    "bias_forces": lambda s, x, v: ms.bias_forces(s, x["q"], x["z"], gravity=x["g"], values=v),
    "inverse_dynamics": lambda s, x, v: ms.inverse_dynamics(
        s, x["q"], x["z"], x["a"], gravity=x["g"], values=v
    ),
    "forward_dynamics": lambda s, x, v: ms.forward_dynamics(
        s, x["q"], x["z"], x["f"], gravity=x["g"], values=v
    ),
}
READS = {"mass_matrix": "q", "bias_forces": "qzg", "inverse_dynamics": "qzag", "forward_dynamics": "qzfg"}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_gradients_by_every_input_agree_with_differences(name):
    """Compare the gradient of a weighted sum by each input, along itself and along a random direction."""
    state, numbers = leaves()
    found = FUNCTIONS[name](SKELETON, state, by_owner(numbers))
    weights = torch.tensor(np.random.default_rng(1).standard_normal(found.shape))
    (weights * found).sum().backward()

    def at(key, moved):
        plain = {k: v.detach().numpy() for k, v in state.items()}
        others = {k: v.detach().numpy() for k, v in numbers.items()}
        (plain if key in plain else others)[key] = moved
        return float((weights.numpy() * FUNCTIONS[name](SKELETON, plain, by_owner(others))).sum())

    checked = {**{k: state[k] for k in READS[name]}, **numbers}
    for key, value in checked.items():
        gradient, here = value.grad.numpy(), value.detach().numpy()
        for direction in (gradient, symmetric(RNG.standard_normal(here.shape))):
            size = np.linalg.norm(direction)
            if size == 0.0:  # gravity does not change a mass matrix, nor a slide's origin anything
                continue
            step = 1e-3 * direction / size * (1.0 + np.linalg.norm(here))
            samples = [w * at(key, here + k * step) for k, w in ((-2, 1), (-1, -8), (1, 8), (2, -1))]
            difference, slope = sum(samples) / 12.0, float((gradient * step).sum())
            assert slope == pytest.approx(
                difference, rel=1e-6, abs=1e-9 * abs(float(found.detach().norm()))
            ), key


def symmetric(direction):
    return direction + direction.T if direction.ndim == 2 else direction


def test_derivatives_obey_the_identities_of_rigid_dynamics():
    """Check that inverse dynamics is linear in accelerations, and that forward dynamics inverts it.

    By accelerations it changes with M; forward dynamics by forces with 1/M, and by coordinates and rates with -1/M times the
    derivatives of inverse dynamics at its accelerations [Carpentier and Mansard 2018, Analytical derivatives of rigid body
    dynamics algorithms].
    """
    state, _ = leaves()
    mass = ms.mass_matrix(SKELETON, Q)
    forward = FUNCTIONS["forward_dynamics"](SKELETON, state, None)
    accelerations = forward.detach()
    of_forward = torch.autograd.functional.jacobian(
        lambda q, z, f: ms.forward_dynamics(SKELETON, q, z, f, gravity=DOWN),
        (state["q"], state["z"], state["f"]),
    )
    of_inverse = torch.autograd.functional.jacobian(
        lambda q, z, a: ms.inverse_dynamics(SKELETON, q, z, a, gravity=DOWN),
        (state["q"], state["z"], accelerations),
    )
    inverse = np.linalg.inv(mass)
    scale = np.abs(inverse).max()
    assert np.abs(of_inverse[2].numpy() - mass).max() < 1e-12 * np.abs(mass).max()
    assert np.abs(of_forward[2].numpy() - inverse).max() < 1e-11 * scale
    for k in range(2):
        expected = -inverse @ of_inverse[k].numpy()
        assert np.abs(of_forward[k].numpy() - expected).max() < 1e-10 * np.abs(expected).max()


def test_bias_follows_from_the_change_of_the_mass_matrix():
    """Compare with Lagrange's equations: b = (dM/dt) z - d(z . M z / 2)/dq, for coordinates whose rates they are."""
    first, second = (
        ms.Link(mass=m, inertia=tensor(k), center=(0.2, 0.1 * k, 0.3)) for k, m in enumerate((1.3, 0.8))
    )
    joints = [
        ms.Revolute(first, origin=(0, 0.1, 0), axis=(0, 1, 0.3)),
        ms.Screw(second, first, origin=(0.4, 0, 0.2), axis=(1, 1, 0), pitch=0.05),
    ]
    skeleton, q, z = (
        ms.Skeleton([first, second], joints),
        leaf([0.4, -1.1]),
        torch.tensor([2.0, -3.0]).double(),
    )
    by_q = torch.autograd.functional.jacobian(
        lambda x: ms.mass_matrix(skeleton, x), q
    )  # (i, j, k): dM_ij/dq_k
    rising = torch.einsum("ijk,j,k->i", by_q, z, z)
    falling = 0.5 * torch.einsum("ijk,i,j->k", by_q, z, z)
    bias = ms.bias_forces(skeleton, q, z)
    assert (rising - falling - bias).abs().max() < 1e-12 * bias.abs().max()


def test_second_derivatives_and_forward_mode_agree_with_gradients():
    arm = ms.Skeleton(
        [ARM, NUT], [ms.Ball(ARM, origin=(0, 0, 0)), ms.Revolute(NUT, ARM, origin=(1, 0, 0), axis=(0, 1, 0))]
    )
    q, z, f = (leaf(0.5 * RNG.standard_normal(4)) for _ in range(3))
    function = lambda q, z, f: ms.forward_dynamics(arm, q, z, f, gravity=DOWN)  # noqa: E731
    assert torch.autograd.gradcheck(function, (q, z, f), atol=1e-6)
    assert torch.autograd.gradgradcheck(function, (q, z, f), atol=1e-5)
    plain, along = (q.detach(), z.detach(), f.detach()), tuple(torch.ones(4).double() for _ in range(3))
    _, forwards = torch.func.jvp(function, plain, along)
    rows = torch.autograd.functional.jacobian(function, plain)
    expected = sum(row @ direction for row, direction in zip(rows, along, strict=True))
    assert (forwards - expected).abs().max() < 1e-12 * expected.abs().max()


def test_rotations_by_small_and_large_angles_have_derivatives():
    """Compare at zero, on both sides of the limit of the series, and beyond half a turn."""
    bob = ms.Link(mass=1.0, inertia=(0.1, 0.2, 0.25), center=(0.3, 0, 0.1))
    ball = ms.Skeleton([bob], [ms.Ball(bob, origin=(0, 0, 0))])
    for size in (0.0, 1e-9, 0.4999999, 0.5000001, 3.5):
        q = torch.tensor([0.6, 0.0, 0.8]).double() * size
        assert torch.autograd.gradcheck(
            lambda x: ms.mass_matrix(ball, x), q.requires_grad_(True), eps=1e-5, atol=1e-8
        )


def test_results_of_tensors_keep_their_dtype_and_numbers():
    exact = ms.forward_dynamics(SKELETON, Q, Z, F, gravity=DOWN)
    double = ms.forward_dynamics(SKELETON, torch.tensor(Q), Z, F, gravity=DOWN)
    single = ms.forward_dynamics(SKELETON, Q, torch.tensor(Z).float(), F, gravity=DOWN)
    assert double.dtype == torch.float64 and not double.requires_grad
    assert double.numpy() == pytest.approx(exact, rel=1e-12, abs=1e-12 * np.abs(exact).max())
    assert single.dtype == torch.float32
    assert single.numpy() == pytest.approx(exact, rel=1e-4, abs=1e-4 * np.abs(exact).max())


def test_values_replace_those_of_the_skeleton():
    """Compare with a skeleton that was made with the other numbers."""
    bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    other = ms.Link(mass=3.0, center=(1.5, 0, 0))
    hinge = ms.Revolute(other, origin=(0.2, 0, 0), axis=(0, -3, 1))
    expected = ms.mass_matrix(ms.Skeleton([other], [hinge]), [0.3])
    values = {
        bob: {"mass": 3.0, "center": (1.5, 0, 0)},
        arm.joints[0]: {"origin": (0.2, 0, 0), "axis": (0, -3, 1)},
    }
    assert ms.mass_matrix(arm, [0.3], values=values) == pytest.approx(expected, rel=1e-14)


def test_values_without_effect_are_refused():
    with pytest.raises(ValueError, match=r"torque of Revolute.* has no effect"):
        ms.mass_matrix(SKELETON, Q, values={HINGE: {"torque": 1.0}})
    with pytest.raises(ValueError, match=r"origin of Fixed.* has no effect"):
        ms.mass_matrix(SKELETON, Q, values={FIXED: {"origin": (0, 0, 0)}})
    with pytest.raises(ValueError, match=r"mass \[kg\] must be positive"):
        ms.mass_matrix(SKELETON, Q, values={BASE: {"mass": torch.tensor(-1.0, requires_grad=True)}})
    with pytest.raises(ValueError, match=r"neither a link nor a joint of the skeleton"):
        ms.mass_matrix(SKELETON, Q, values={ms.Link(mass=1.0, center=(0, 0, 0)): {"mass": 1.0}})
    with pytest.raises(ValueError, match=r"values must be a dictionary"):
        ms.mass_matrix(SKELETON, Q, values=[1.0])
    with pytest.raises(ValueError, match=r"inside torch.vmap"):
        torch.vmap(lambda q: ms.mass_matrix(SKELETON, q))(torch.zeros(2, N).double())
