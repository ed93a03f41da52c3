"""torch's own optimizers in `ms.minimize`."""

import pytest
import torch
from design_problems import rosenbrock

import magshell as ms

MAKERS = {
    "Adam": lambda p: torch.optim.Adam(p, lr=0.05),
    "SGD": lambda p: torch.optim.SGD(p, lr=1e-3, momentum=0.9),
    "RMSprop": lambda p: torch.optim.RMSprop(p, lr=0.01),
    "LBFGS": lambda p: torch.optim.LBFGS(p, lr=0.5, max_iter=4, line_search_fn="strong_wolfe"),
}


class Plain(torch.optim.Optimizer):
    """An optimizer whose step takes no closure."""

    def __init__(self, params):
        super().__init__(params, {"lr": 1e-3})

    @torch.no_grad()
    def step(self):
        for group in self.param_groups:
            for parameter in group["params"]:
                parameter -= group["lr"] * parameter.grad


def design(*values, dtype=torch.float64):
    return torch.tensor(values, dtype=dtype, requires_grad=True)


def quiet(*arguments, **options):
    return ms.minimize(*arguments, progress=False, **options)


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
@pytest.mark.parametrize("make", [*MAKERS.values(), Plain], ids=[*MAKERS, "Plain"])
def test_takes_the_steps_that_torch_takes(make, dtype):
    x, y = design(-1.2, 1.0, dtype=dtype), design(-1.2, 1.0, dtype=dtype)
    found = quiet(rosenbrock, [x], make, max_iterations=20)
    optimizer = make([y])

    def closure():
        optimizer.zero_grad()
        value = rosenbrock(y)
        value.backward()
        return value

    values = [rosenbrock(y).item()]
    for _ in range(20):
        if isinstance(optimizer, Plain):
            closure()
            optimizer.step()
        else:
            optimizer.step(closure)
        values.append(rosenbrock(y).item())
    assert [record.objective for record in found.history] == values[: found.iterations + 1]
    assert found.iterations == 20 or "no lower design" in found.reason
    assert found.objective == min(values) and x.detach().equal(found.parameters[0])


def test_a_design_is_evaluated_once():
    x = design(-1.2, 1.0)
    found = quiet(rosenbrock, [x], MAKERS["Adam"], max_iterations=20)
    assert found.history[-1].evaluations == 21


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_resumed_from_a_checkpoint_gives_the_same_bits(make, tmp_path):
    def run(iterations, **options):
        return quiet(rosenbrock, [design(-1.2, 1.0)], make, max_iterations=iterations, **options)

    path = tmp_path / "run.pt"
    run(5, checkpoint=path)
    resumed, whole = run(12, checkpoint=path, resume=True), run(12)
    assert resumed.parameters[0].equal(whole.parameters[0])
    assert [r.objective for r in resumed.history] == [r.objective for r in whole.history]
    assert [r.evaluations for r in resumed.history] == [r.evaluations for r in whole.history]


def test_ends_once_the_objective_has_settled():
    found = quiet(lambda x: ((x - 1) ** 2).sum() + 1, [design(0.0)], MAKERS["Adam"], tolerance=1e-4)
    assert found.reason == "the objective has settled" and found.iterations < 100


def test_constraints_are_refused():
    x = design(1.0, 2.0)
    with pytest.raises(ms.ObjectiveFailed, match=r"Adam cannot handle constraints: use ms\.optim\.MMA"):
        quiet(lambda x: (x.sum(), x - 3), [x], MAKERS["Adam"])
    assert x.tolist() == [1.0, 2.0]


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_nan_raises_before_anything_is_changed(make):
    x, optimizers, states = design(-1.2, 1.0), [], []

    def objective(x):
        value = rosenbrock(x)
        return value * float("nan") if len(states) == 3 and not x.detach().equal(states[-1][0]) else value

    def remember(record):
        if len(states) < 3:
            states.append((x.detach().clone(), str(optimizers[0].state_dict())))

    def made(parameters):
        optimizers.append(make(parameters))
        return optimizers[0]

    with pytest.raises(ms.ObjectiveFailed, match="the objective is nan") as caught:
        quiet(objective, [x], made, callback=remember)
    best = min(range(3), key=lambda k: caught.value.last_good.history[k].objective)
    assert x.detach().equal(states[best][0]) and str(optimizers[0].state_dict()) == states[-1][1]


@pytest.mark.parametrize(
    "make",
    [
        lambda p: torch.optim.Adam(p, lr=0.4),
        lambda p: torch.optim.SGD(p, lr=8e-3, momentum=0.9),
        lambda p: torch.optim.LBFGS(p, lr=4.0, max_iter=2),
    ],
    ids=["Adam", "SGD", "LBFGS"],
)
def test_a_rejected_design_halves_the_step(make):
    def objective(x):
        if x[0] > -1.1:
            raise ms.DesignRejected("too far")
        return rosenbrock(x)

    x = design(-1.2, 1.0)
    optimizer = make([x])
    rate = optimizer.param_groups[0]["lr"]
    found = quiet(objective, [x], optimizer, max_iterations=1)
    assert found.history[1].rejected > 0 and found.history[1].objective < found.history[0].objective
    assert -1.2 < x[0] <= -1.1 and optimizer.param_groups[0]["lr"] == rate


def test_a_design_rejected_at_every_rate_leaves_the_optimizer_as_it_was():
    x = design(-1.2, 1.0)

    def objective(x):
        if x.detach()[0] != -1.2:
            raise ms.NotConverged("nowhere")
        return rosenbrock(x)

    optimizer = MAKERS["Adam"]([x])
    with pytest.raises(ms.ObjectiveFailed, match="7 designs rejected: nowhere") as caught:
        quiet(objective, [x], optimizer)
    assert isinstance(caught.value.__cause__, ms.NotConverged)
    assert optimizer.param_groups[0]["lr"] == 0.05 and not optimizer.state_dict()["state"]
