"""The loop around the optimizers: history, stops, checkpoints, and the best design after every kind of end."""

import numpy as np
import pytest
import torch
from design_problems import rosenbrock, two_balls

import magshell as ms


def design(*values):
    return torch.tensor(values, dtype=torch.float64, requires_grad=True)


def lbfgs(parameters):
    return ms.optim.LBFGS(parameters, lower=-2.0, upper=2.0)


def quiet(*arguments, **options):
    return ms.minimize(*arguments, progress=False, **options)


def test_history_begins_with_the_start_and_ends_with_the_best():
    x = design(-1.2, 1.0)
    found = quiet(rosenbrock, [x], lbfgs, max_iterations=60)
    first, last = found.history[0], found.history[-1]
    assert first.iteration == 0 and first.objective == pytest.approx(24.2)
    assert first.gradient_norm == pytest.approx(232.87, rel=1e-4)
    assert [record.iteration for record in found.history] == list(range(found.iterations + 1))
    assert found.objective < 1e-12 and last.evaluations >= found.iterations
    assert x.detach().equal(found.parameters[0]) and "objective" in repr(found)


def test_terms_and_constraints_are_recorded():
    x = design(4.0, 3.0, 2.0)

    def objective(x):
        value, constraints = two_balls(x)
        return {"first": 0.25 * value, "rest": 0.75 * value}, {"note": x[0]}, constraints

    found = quiet(objective, [x], ms.optim.MMA([x], lower=0.0, upper=5.0), max_iterations=30, tolerance=1e-9)
    last = found.history[-1]
    assert found.objective == pytest.approx(8.770245902791997, rel=1e-6) and found.violation <= 1e-6
    assert last.terms["first"] + last.terms["rest"] == pytest.approx(last.objective)
    assert last.terms["note"] == pytest.approx(2.0175, abs=1e-3)
    assert found.reason == "the objective has settled"


def test_the_best_design_is_feasible_where_one_is_known():
    x = design(3.0, 2.0, 3.0)
    found = quiet(two_balls, [x], ms.optim.MMA([x], lower=0.0, upper=5.0), max_iterations=2)
    feasible = [record.objective for record in found.history if record.violation <= 1e-6]
    assert found.objective == min(feasible) if feasible else found.violation > 0


def test_callback_can_stop():
    x = design(-1.2, 1.0)
    found = quiet(rosenbrock, [x], lbfgs, callback=lambda record: record.iteration == 3)
    assert found.iterations == 3 and "callback" in found.reason


@pytest.mark.parametrize("method", [ms.optim.MMA, ms.optim.GCMMA, ms.optim.LBFGS])
def test_resumed_from_a_checkpoint_gives_the_same_bits(method, tmp_path):
    def run(iterations, **options):
        x = design(-1.2, 1.0)
        found = quiet(
            rosenbrock, [x], method([x], lower=-2.0, upper=2.0), max_iterations=iterations, **options
        )
        return x.detach(), found

    whole, _ = run(12)
    path = tmp_path / "run.pt"
    run(5, checkpoint=path, resume=True)
    x, found = run(12, checkpoint=path, resume=True)
    assert x.equal(whole) and found.iterations == 12 and len(found.history) == 13
    assert [file.name for file in tmp_path.iterdir()] == ["run.pt"]


def test_a_file_that_is_no_checkpoint_is_refused(tmp_path):
    path = tmp_path / "run.pt"
    path.write_bytes(b"something else")
    x = design(0.0, 0.0)
    with pytest.raises(ValueError, match="not a checkpoint"):
        quiet(rosenbrock, [x], lbfgs, checkpoint=path, resume=True)


@pytest.mark.parametrize(
    ("error", "kind"), [(KeyboardInterrupt(), ms.Interrupted), (RuntimeError("broke"), ms.ObjectiveFailed)]
)
def test_an_end_by_force_keeps_the_best(error, kind):
    x, calls = design(-1.2, 1.0), []

    def objective(x):
        calls.append(x.detach().clone())
        if len(calls) == 9:
            raise error
        return rosenbrock(x)

    with pytest.raises(kind) as caught:
        quiet(objective, [x], lbfgs)
    best = caught.value.last_good
    assert best.objective == min(record.objective for record in best.history) < 24.2
    assert rosenbrock(x).item() == best.objective and caught.value.__cause__ is error


def test_an_error_at_the_start_comes_through_as_it_is():
    def objective(x):
        raise RuntimeError("broke at once")

    x = design(0.0, 0.0)
    with pytest.raises(RuntimeError, match="broke at once") as caught:
        quiet(objective, [x], lbfgs)
    assert not isinstance(caught.value, ms.ObjectiveFailed)


@pytest.mark.parametrize(
    ("objective", "options", "error", "message"),
    [
        (lambda x: x, {}, ValueError, "real scalar"),
        (lambda x: torch.tensor(1.0), {}, ValueError, "does not depend"),
        (lambda x: {}, {}, ValueError, "no terms"),
        (lambda x: (x.sum(), 3), {}, TypeError, "one of each at most"),
        (None, {}, ValueError, "function of the parameters"),
        (rosenbrock, {"max_iterations": -1}, ValueError, "max_iterations"),
        (rosenbrock, {"max_iterations": float("nan")}, ValueError, "max_iterations must be an integer"),
        (rosenbrock, {"patience": float("nan")}, ValueError, "patience must be an integer"),
        (rosenbrock, {"tolerance": -1.0}, ValueError, "tolerance"),
        (lambda x: (x.sum(), x - 1, x - 2), {}, TypeError, "one of each at most"),
        (lambda x: {"a": x.sum(), "b": x}, {}, ValueError, "term 'b' must be a number or a scalar"),
        (lambda x: x.sum() / 0 * 0, {}, FloatingPointError, "the objective is nan"),
        (lambda x: x.detach().sum(), {}, ValueError, "does not depend"),
        (rosenbrock, {"resume": True}, ValueError, "needs the checkpoint"),
        (rosenbrock, {"patience": 0}, ValueError, "patience"),
        (rosenbrock, {"checkpoint_every": 0}, ValueError, "checkpoint_every"),
        (rosenbrock, {"on_jump": "leap"}, ValueError, "on_jump"),
        (rosenbrock, {"stateful": [3]}, ValueError, r"int has none"),
    ],
)
def test_bad_input_is_refused(objective, options, error, message):
    x = design(0.0, 0.0)
    with pytest.raises(error, match=message):
        quiet(objective, [x], lbfgs, **options)


@pytest.mark.parametrize(
    ("parameters", "optimizer", "message"),
    [
        ([], lbfgs, "no parameters"),
        ([[0.0, 0.0]], lbfgs, "must be a torch tensor"),
        ([torch.zeros(2)], lbfgs, "requires a gradient"),
        ([2 * torch.zeros(2, requires_grad=True)], lbfgs, "tensor of its own"),
        ([design(0.0, 0.0)], lambda p: ms.optim.LBFGS([design(1.0)]), "same tensors"),
        ([design(0.0, 0.0)], lambda p: ms.optim.LBFGS(p, lower=2.0, upper=1.0), "cross"),
        ([design(0.0, 0.0)], lambda p: ms.optim.LBFGS(p, lower=[[1.0, 2.0, 3.0]]), "fit its shape"),
        ([design(0.0, 0.0)], 0.1, r"ms\.optim or torch\.optim"),
    ],
)
def test_bad_parameters_and_optimizers_are_refused(parameters, optimizer, message):
    with pytest.raises(ValueError, match=message):
        quiet(rosenbrock, parameters, optimizer)


@pytest.mark.parametrize(
    ("broken", "cause", "message"),
    [
        (lambda x: x * float("nan"), FloatingPointError, "the objective is nan"),
        (lambda x: torch.stack([x, x]), ValueError, "real scalar"),
        (lambda x: x.detach(), ValueError, "does not depend"),
        (lambda x: x.item(), TypeError, "scalar tensor"),
    ],
)
@pytest.mark.parametrize("make", [lbfgs, lambda p: ms.optim.MMA(p, lower=-2.0, upper=2.0), torch.optim.SGD])
def test_an_objective_that_breaks_later_keeps_the_best(broken, cause, message, make):
    x, calls = design(-1.2, 1.0), []

    def objective(x):
        calls.append(x)
        value = 1e-3 * rosenbrock(x)
        return value if len(calls) < 4 else broken(value)

    with pytest.raises(ms.ObjectiveFailed, match=message) as caught:
        quiet(objective, [x], make)
    best = caught.value.last_good
    assert isinstance(caught.value.__cause__, cause)
    assert best.objective == min(record.objective for record in best.history)
    assert 1e-3 * rosenbrock(x).item() == pytest.approx(best.objective, rel=1e-12)


def test_a_parameter_that_nothing_depends_on_is_refused():
    x, y = design(0.0, 0.0), design(1.0)
    with pytest.raises(ValueError, match=r"parameter 1 of shape \(1,\)"):
        quiet(lambda x, y: rosenbrock(x), [x, y], lambda p: ms.optim.LBFGS(p, upper=2.0))


def test_terms_belong_to_the_design_of_their_record():
    x = design(-1.2, 1.0)

    def objective(x):
        return rosenbrock(x), {"same": rosenbrock(x)}

    history = quiet(objective, [x], lbfgs, max_iterations=30).history
    assert history[-1].evaluations > len(history)  # some line searches asked for more than one design
    assert all(record.terms["same"] == record.objective for record in history)


class Noise:
    """A generator of random numbers whose state a checkpoint can hold; numpy's, in arrays and plain values."""

    def __init__(self):
        self.state = np.array([7, 1], dtype=np.uint8)
        self.generator = torch.Generator().manual_seed(3)

    def __call__(self):
        self.state[1] += 1
        return torch.rand((), generator=self.generator, dtype=torch.float64) + float(self.state[1])

    def state_dict(self):
        return {"state": self.state, "generator": self.generator.get_state(), "nested": [(1, None), "a"]}

    def load_state_dict(self, state):
        assert state["nested"] == [(1, None), "a"]
        self.state = state["state"]
        self.generator.set_state(state["generator"])


def test_a_checkpoint_of_something_else_is_refused(tmp_path):
    path = tmp_path / "run.pt"
    quiet(rosenbrock, [design(0.0, 0.0)], torch.optim.SGD, max_iterations=1, checkpoint=path)
    with pytest.raises(ValueError, match="is of SGD, and cannot be resumed with LBFGS"):
        quiet(rosenbrock, [design(0.0, 0.0)], lbfgs, checkpoint=path, resume=True)
    with pytest.raises(ValueError, match=r"parameters of shapes \[\(2,\)\]"):
        quiet(rosenbrock, [design(0.0, 0.0, 0.0)], torch.optim.SGD, checkpoint=path, resume=True)


def test_stateful_objects_are_resumed_too(tmp_path):
    def run(iterations, noise, **options):
        x = design(-1.2, 1.0)
        return quiet(
            lambda x: rosenbrock(x) + 1e-3 * noise(),
            [x],
            ms.optim.MMA([x], lower=-2.0, upper=2.0),
            max_iterations=iterations,
            stateful=[noise],
            **options,
        )

    whole = run(12, Noise())
    path = tmp_path / "run.pt"
    run(5, Noise(), checkpoint=path)
    found = run(12, Noise(), checkpoint=path, resume=True)
    assert [record.objective for record in found.history] == [record.objective for record in whole.history]
    with pytest.raises(ValueError, match="state of 1 objects"):
        x = design(0.0, 0.0)
        quiet(rosenbrock, [x], ms.optim.MMA([x], lower=-2.0, upper=2.0), checkpoint=path, resume=True)


def test_a_state_that_no_checkpoint_can_hold_is_refused_before_any_work(tmp_path):
    class Odd:
        def state_dict(self):
            return {"list": [1, object()]}

        def load_state_dict(self, state):
            raise AssertionError

    with pytest.raises(TypeError, match=r"state of Odd\['list'\]\[1\] is a object"):
        quiet(pytest.fail, [design(0.0, 0.0)], lbfgs, stateful=[Odd()], checkpoint=tmp_path / "run.pt")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("every", [1, 4, 100])
def test_the_last_iteration_is_saved_however_it_ends(every, tmp_path):
    x, path = design(-1.2, 1.0), tmp_path / "run.pt"
    options = {"checkpoint": path, "checkpoint_every": every}
    found = quiet(rosenbrock, [x], lbfgs, callback=lambda record: record.iteration == 6, **options)
    again = quiet(rosenbrock, [x], lbfgs, max_iterations=found.iterations, resume=True, **options)
    assert again.iterations == 6 and again.history == found.history
    assert again.history[-1].evaluations == found.history[-1].evaluations
