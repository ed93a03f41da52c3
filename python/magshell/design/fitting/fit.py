"""Fits of a model to data by weighted least squares: ms.fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensors import detached, is_tensor, require_torch
from ..minimize import minimize
from .fit_parameter import FitParameter
from .fit_result import FitResult, quantile
from .residual_tests import tested
from .uncertainty import Uncertainty

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers

_SETTLED = 1e-7  # [-] relative change of the sum of squares that ends a search: far below what noise changes


def fit(
    model: Callable[..., Any],
    data: Numbers | dict[str, Any],
    parameters: dict[str, Any],
    *,
    noise: Numbers | dict[str, Any] | None = None,
    level: float = 0.95,
    max_iterations: int = 50,
    first_step: float = 1.0,
    jacobian: str = "auto",
    stateful: Sequence[Any] = (),
    progress: bool = True,
    checkpoint: str | Path | None = None,
    resume: bool = False,
) -> FitResult:
    """Fit the parameters of a model to data, and estimate their intervals.

    Minimized is the sum of ((model - data) / noise)^2, with priors as further terms, by ms.optim.GaussNewton. The intervals
    are those of a normal distribution with the covariance (J^T J)^-1 (Laplace's approximation): exact for a linear model,
    good where the model is nearly linear over the interval. Compare with a fit to resampled data if in doubt.

    model: function of the parameters by name, as tensors; returns a tensor of the shape of `data`. It may solve equilibria
        (with ms.WarmStart, or load cases), follow paths, or simulate motions.
    data: an array of any shape, or {name: array}; the model then returns a dict with these names.
    parameters: {name: ms.FitParameter, or the start of one}.
    noise: standard deviation of the data: a number, or an array of its shape, or {name: ...} of these. By default it is the
        same everywhere, and estimated from the residuals; intervals are then Student's.
    level: probability of the intervals. first_step, jacobian: as in ms.optim.GaussNewton.
    max_iterations, stateful, progress, checkpoint, resume: as in ms.minimize.

    Raises ValueError on bad input, for a model whose result does not fit the data, and for fewer data than parameters; and
    what ms.minimize raises.

    >>> import magshell as ms, numpy as np, torch
    >>> times = torch.linspace(0, 2, 20, dtype=torch.float64)
    >>> data = 3.0 * np.exp(-0.7 * times.numpy()) + 0.01 * np.cos(40 * times.numpy())
    >>> decay = lambda amplitude, rate: amplitude * torch.exp(-rate * times)
    >>> fitted = ms.fit(decay, data, {"amplitude": 1.0, "rate": ms.FitParameter(1.0, log=True)}, noise=0.01, progress=False)
    >>> bool(fitted.lower["rate"] < 0.7 < fitted.upper["rate"])
    True
    """
    torch = require_torch("fit")
    task = _Task(model, data, parameters, noise)
    if not 0.0 < float(quantity("level", "", level, ())) < 1.0:
        raise ValueError(f"level must be between 0 and 1, got {level}")
    from ..optim.gauss_newton import GaussNewton

    coordinates = task.start(torch)
    optimizer = GaussNewton(
        coordinates,
        lower=[torch.tensor(each) for each in task.of_each(lambda u: u.coordinate(u.lower))],
        upper=[torch.tensor(each) for each in task.of_each(lambda u: u.coordinate(u.upper))],
        scale=[torch.tensor(each) for each in task.of_each(lambda u: u.size)],
        jacobian=jacobian,
        first_step=first_step,
    )
    minimum = minimize(
        task.residuals,
        coordinates,
        optimizer,
        max_iterations=max_iterations,
        tolerance=_SETTLED,
        patience=1,
        stateful=stateful,
        progress=progress,
        checkpoint=checkpoint,
        resume=resume,
    )
    return _result(task, coordinates, minimum, float(level))


class _Task:
    """The arguments of a fit, checked."""

    def __init__(self, model, data, parameters, noise):
        if not callable(model):
            raise ValueError(f"model must be a function of the parameters, got {model!r:.60}")
        if not isinstance(parameters, dict) or not parameters:
            raise ValueError(
                "parameters must be a dict {name: ms.FitParameter, or its start}, of one or more"
            )
        for name in parameters:
            if not (isinstance(name, str) and name.isidentifier()):
                raise ValueError(
                    f"the name of a parameter must be one of an argument of the model, got {name!r:.60}"
                )
        self.model = model
        self.parameters: dict[str, FitParameter] = {
            name: each if isinstance(each, FitParameter) else FitParameter(each)
            for name, each in parameters.items()
        }
        self.data: dict[str, np.ndarray] = {
            name: quantity(f"data{_of(name)}", "", detached(each), ("...",))
            for name, each in _named(data).items()
        }
        self.n_data: int = sum(each.size for each in self.data.values())
        self.is_dict: bool = isinstance(data, dict)
        self.estimated: bool = noise is None
        self.noise: dict[str, np.ndarray] = self._noise(noise)
        self.labels: tuple[str, ...] = tuple(
            label
            for name, parameter in self.parameters.items()
            for label in _labels(name, parameter.start.shape)
        )
        n_priors = sum(parameter.start.size for parameter in self.parameters.values() if parameter.prior)
        if self.estimated and n_priors:
            raise ValueError(
                "priors need the noise of the data: without it, their weight against the data is not known"
            )
        least = len(self.labels) + self.estimated
        if self.n_data + n_priors < least:
            raise ValueError(f"{len(self.labels)} parameters need {least} data or more, got {self.n_data}")

    def _noise(self, noise) -> dict[str, np.ndarray]:
        if noise is None:
            return {name: np.ones(each.shape) for name, each in self.data.items()}
        given = noise if isinstance(noise, dict) else dict.fromkeys(self.data, noise)
        if given.keys() != self.data.keys():
            raise ValueError(f"noise must have the names of data, {list(self.data)}, got {list(given)}")
        found = {}
        for name, each in given.items():
            values = quantity(f"noise{_of(name)}", "", detached(each), ("...",))
            shape = self.data[name].shape
            if values.shape not in ((), shape):
                raise ValueError(
                    f"noise{_of(name)} must be a number or have shape {shape}, got {values.shape}"
                )
            if not (values > 0).all():
                raise ValueError(f"noise{_of(name)} must be positive")
            found[name] = np.broadcast_to(values, shape)
        return found

    def of_each(self, function: Callable[[FitParameter], np.ndarray]) -> list[np.ndarray]:
        return [np.array(function(parameter)) for parameter in self.parameters.values()]

    def start(self, torch) -> list[torch.Tensor]:
        """Return the coordinates at the start, as tensors that require a gradient."""
        return [
            torch.tensor(each, requires_grad=True) for each in self.of_each(lambda u: u.coordinate(u.start))
        ]

    def values(self, coordinates: Sequence[torch.Tensor]) -> dict[str, torch.Tensor]:
        named = zip(self.parameters.items(), coordinates, strict=True)
        return {name: parameter.value(each) for (name, parameter), each in named}

    def predictions(self, coordinates: Sequence[torch.Tensor]) -> dict[str, torch.Tensor]:
        """Return what the model predicts for all data. Raises ValueError if it does not fit them."""
        torch = require_torch("fit")
        found = self.model(**self.values(coordinates))
        if self.is_dict != isinstance(found, dict):
            wanted = "a dict" if self.is_dict else "a tensor"
            raise ValueError(f"the model must return {wanted}, as data is one, got {type(found).__name__}")
        found = _named(found)
        if found.keys() != self.data.keys():
            raise ValueError(f"the model must return the names of data, {list(self.data)}, got {list(found)}")
        for name, each in found.items():
            if not is_tensor(each):
                raise ValueError(f"the model{_of(name)} must return a tensor, got {type(each).__name__}")
            if tuple(each.shape) != self.data[name].shape:
                raise ValueError(
                    f"the model{_of(name)} must return the shape of data, {self.data[name].shape}, got {tuple(each.shape)}"
                )
        return {name: found[name].to(torch.float64) for name in self.data}

    def residuals(self, *coordinates: torch.Tensor) -> torch.Tensor:
        """Return the residuals of the data over their noise, then those of the priors."""
        torch = require_torch("fit")
        parts = [
            ((each - torch.tensor(self.data[name])) / torch.tensor(self.noise[name])).reshape(-1)
            for name, each in self.predictions(coordinates).items()
        ]
        for parameter, coordinate in zip(self.parameters.values(), coordinates, strict=True):
            if parameter.prior is not None:
                mean, deviation = map(torch.tensor, parameter.prior)
                parts.append(((coordinate - mean) / deviation).reshape(-1))
        return torch.cat(parts)


def _result(task: _Task, coordinates: Sequence[torch.Tensor], minimum, level: float) -> FitResult:
    """Return the result at the coordinates that the search has left."""
    flat = np.concatenate([each.detach().numpy().ravel() for each in coordinates])
    sizes = np.concatenate([each.ravel() for each in task.of_each(lambda u: u.size)])
    bounds = [
        np.concatenate([each.ravel() for each in task.of_each(pick)])
        for pick in (lambda u: u.coordinate(u.lower), lambda u: u.coordinate(u.upper))
    ]
    at_bounds = (flat <= bounds[0]) | (flat >= bounds[1])
    residuals, jacobian = _with_jacobian(task.residuals, coordinates)
    # Directions that the data leave open use up no degree of freedom.
    rank = int(np.linalg.matrix_rank(jacobian[:, ~at_bounds])) if (~at_bounds).any() else 0
    freedom = len(residuals) - rank
    spread = float(np.sqrt(residuals @ residuals / freedom)) if task.estimated else 1.0
    if task.estimated:  # a perfect fit leaves no noise: round-off of the data stands for it
        largest = max(np.abs(each).max(initial=0.0) for each in task.data.values())
        spread = max(spread, float(np.finfo(float).eps * (largest or 1.0)))
    residuals, jacobian = (each / spread for each in (residuals, jacobian))
    uncertainty = Uncertainty(jacobian, sizes, at_bounds)
    deviations = uncertainty.deviations_of(np.eye(flat.size))
    wide = quantile(level, freedom if task.estimated else None) * deviations
    of_data = residuals[: task.n_data]
    noise = spread * np.concatenate([each.ravel() for each in task.noise.values()])
    data = np.concatenate([each.ravel() for each in task.data.values()])
    return FitResult(
        values=_by_name(task, flat),
        deviations=_by_name(task, deviations, transform=False),
        lower=_by_name(task, flat - wide),
        upper=_by_name(task, flat + wide),
        level=level,
        labels=task.labels,
        at_bounds=tuple(label for label, held in zip(task.labels, at_bounds, strict=True) if held),
        data=data,
        predictions=data + noise * of_data,
        noise=noise,
        residuals=of_data,
        tests=tested(residuals, task.n_data, rank, task.estimated),
        minimum=minimum,
        uncertainty=uncertainty,
        parameters=task.parameters,
        _quantile=quantile(level, freedom if task.estimated else None),
        _coordinates=flat,
        _jacobian_of=partial(_predicted, task),
    )


def _predicted(task: _Task, function: Callable[..., Any], flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the values of a function of the parameters, and its Jacobian by all coordinates, (k, n)."""
    torch = require_torch("fit")
    if not callable(function):
        raise ValueError(f"function must be one of the parameters, got {function!r:.60}")
    sizes = [parameter.start.size for parameter in task.parameters.values()]
    parts = zip(np.split(flat, np.cumsum(sizes)[:-1]), task.parameters.values(), strict=True)
    at = [torch.tensor(part.reshape(u.start.shape), requires_grad=True) for part, u in parts]
    shape = None

    def values(*coordinates):
        nonlocal shape
        found = function(**task.values(coordinates))
        if not is_tensor(found) or not found.is_floating_point():
            raise ValueError(f"function must return a tensor of real numbers, got {type(found).__name__}")
        shape = tuple(found.shape)
        none = 0.0 * sum(
            each.sum() for each in coordinates
        )  # connects it to all, also those that it does not use
        return found.reshape(-1).to(torch.float64) + none

    found, jacobian = _with_jacobian(values, at)
    return found.reshape(shape), jacobian


def _with_jacobian(
    function: Callable[..., Any], coordinates: Sequence[torch.Tensor]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the values of a function and its Jacobian by all coordinates, by columns or rows, whichever are fewer."""
    from ..optim.residual_sample import ResidualTrial

    trial = ResidualTrial(lambda: function(*coordinates), list(coordinates), "auto")
    return trial.values, trial.matrix()


def _by_name(task: _Task, flat: np.ndarray, transform: bool = True) -> dict[str, Any]:
    """Return {name: number or array} of all parameters from one vector of coordinates."""
    found, first = {}, 0
    for name, parameter in task.parameters.items():
        part = flat[first : first + parameter.start.size].reshape(parameter.start.shape)
        first += parameter.start.size
        with np.errstate(over="ignore"):
            value = parameter.value(part) if transform else part
        found[name] = float(value) if parameter.start.ndim == 0 else value
    return found


def _labels(name: str, shape: tuple[int, ...]) -> list[str]:
    if shape == ():
        return [name]
    return [f"{name}[{', '.join(map(str, index))}]" for index in np.ndindex(shape)]


def _named(given) -> dict[str, Any]:
    return given if isinstance(given, dict) else {"": given}


def _of(name: str) -> str:
    return f" of {name!r}" if name else ""
