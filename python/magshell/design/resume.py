"""Checks that a minimization continues with the problem that its checkpoint is of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .configuration import changes

if TYPE_CHECKING:
    from .run import Run

_SAME_OBJECTIVE = (
    1e-6  # [-] relative difference that counts as equal: thread count or release may change rounding
)
_ROUNDING = 1e-12  # [-] difference relative to the largest objective so far that counts as round-off


def check_same(run: Run, snapshot: dict[Any, Any]) -> None:
    """Raise ValueError if parameters, method or options differ from the snapshot's."""
    shapes, now = ([tuple(each.shape) for each in of] for of in (snapshot["parameters"], run.parameters))
    if shapes != now:
        raise ValueError(f"the checkpoint holds parameters of shapes {shapes}, not those of this problem")
    dtypes, now = ([str(each.dtype) for each in of] for of in (snapshot["parameters"], run.parameters))
    if dtypes != now:
        raise ValueError(f"the checkpoint holds parameters of {dtypes}, and this problem has {now}")
    if snapshot["method"] != run.method:
        raise ValueError(
            f"the checkpoint is of {snapshot['method']}, and cannot be resumed with {run.method}"
        )
    if len(snapshot["stateful"]) != len(run.stateful):
        raise ValueError(
            f"the checkpoint holds the state of {len(snapshot['stateful'])} objects, "
            f"but `stateful` has {len(run.stateful)}"
        )
    if changed := changes(snapshot["configuration"], run.configuration):
        raise ValueError(
            f"the checkpoint is of a run with other options: {'; '.join(changed)}. Resume with those of the "
            "checkpoint, or begin anew with another file"
        )


def check_objective(run: Run, snapshot: dict[Any, Any]) -> None:
    """Evaluate the snapshot's best design again, from the same states, and compare.

    Raises ValueError if its objective or violation has changed; parameters and states are then as before.
    """
    best = snapshot["best"]
    values, states = run.values(), run.states()
    try:
        found, violation = _evaluated(run, best)
        largest = max(abs(record["objective"]) for record in snapshot["history"])
        for what, was, is_ in (
            ("objective", best["objective"], found),
            ("violation", best["violation"], violation),
        ):
            if not abs(is_ - was) <= _SAME_OBJECTIVE * abs(was) + _ROUNDING * largest:
                raise ValueError(
                    f"the best design of the checkpoint has the {what} {was:.9g} there and {is_:.9g} now: `objective`, "
                    "or something that it uses, is another one. Resume with that of the checkpoint, or begin anew with "
                    "another file"
                )
    except BaseException:
        run.set(values)
        run.load_states(states)
        raise


def _evaluated(run, best: dict[Any, Any]) -> tuple[float, float]:
    """Return objective and violation of the best design. Raises ValueError if it cannot be evaluated."""

    def closure():
        answer = run.answer()
        return answer.objective, answer.constraints

    run.set(best["parameters"])
    run.load_states(best["stateful"])
    try:
        with run.accepting_jumps(best["jumped"]):
            trial = run.optimizer.trial_of(closure)
    except Exception as error:
        raise ValueError(f"the best design of the checkpoint cannot be evaluated: {error}") from error
    return trial.objective, float(trial.constraints.max(initial=0.0))
