"""Fits: estimates and intervals against closed forms, coverage, directions that data leave open, predictions, refusals."""

import numpy as np
import pytest
import scipy.stats

import magshell as ms

torch = pytest.importorskip("torch")

TIMES = torch.linspace(0.0, 1.0, 12, dtype=torch.float64)
MESH = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
SCENE = ms.Scene(SHEET, supports=[CLAMP], field=ms.UniformField(), gravity=(0, 0, -9.81))
TIP = MESH.vertices_at(x=0.04)


def line(offset, slope):
    return offset + slope * TIMES


def fitted(model, data, parameters, **options):
    return ms.fit(model, data, parameters, progress=False, **options)


def data_of_line(noise, seed=0):
    return line(1.0, -2.0).numpy() + noise * np.random.default_rng(seed).standard_normal(len(TIMES))


def linear_regression(data, noise):
    matrix = np.stack([np.ones(len(TIMES)), TIMES.numpy()], axis=1)
    covariance = noise**2 * np.linalg.inv(matrix.T @ matrix)
    return covariance @ matrix.T @ data / noise**2, covariance


def test_linear_fit_is_linear_regression():
    data = data_of_line(0.1)
    found = fitted(line, data, {"offset": 0.5, "slope": -1.0}, noise=0.1)
    estimate, covariance = linear_regression(data, 0.1)
    np.testing.assert_allclose([found.values["offset"], found.values["slope"]], estimate, rtol=1e-9)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-9)
    wide = scipy.stats.norm.isf(0.025) * np.sqrt(covariance[1, 1])
    assert found.upper["slope"] - found.values["slope"] == pytest.approx(wide, rel=1e-9)
    assert found.correlation[0, 1] == pytest.approx(
        covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    )


def test_a_perfect_fit_leaves_no_noise():
    found = fitted(lambda a: a.expand(4), np.ones(4), {"a": 2.0})
    assert found.values["a"] == pytest.approx(1.0, rel=1e-12)
    assert found.noise.max() < 1e-12 and found.upper["a"] - found.lower["a"] < 1e-12


def test_directions_that_data_leave_open_use_up_no_degree_of_freedom():
    data = 1.0 + 0.1 * np.random.default_rng(3).standard_normal(6)
    found = fitted(lambda a, b: (a + b).expand(6), data, {"a": 0.3, "b": 0.4})
    np.testing.assert_allclose(found.noise, data.std(ddof=1), rtol=1e-6)


def test_size_of_residuals_counts_priors_as_data():
    """Check a right model whose parameters their priors nearly fix: the mean square is that of the noise."""
    rng, design = np.random.default_rng(5), np.random.default_rng(6).standard_normal((10, 9))
    doubtful = 0
    for _ in range(20):
        truth, noise = rng.standard_normal(9), rng.standard_normal(10)
        parameters = {f"p{k}": ms.FitParameter(0.5, prior=(0.0, 1.0)) for k in range(9)}
        found = fitted(
            lambda **p: torch.tensor(design) @ torch.stack(list(p.values())),
            design @ truth + noise,
            parameters,
            noise=1.0,
        )
        assert found.tests.degrees_of_freedom == 10
        doubtful += found.tests.size < 0.01
    assert doubtful <= 2


def test_estimated_noise_gives_intervals_of_student():
    data = data_of_line(0.1)
    found = fitted(line, data, {"offset": 0.5, "slope": -1.0}, level=0.9)
    estimate, _ = linear_regression(data, 1.0)
    variance = np.sum((line(*estimate).numpy() - data) ** 2) / (len(data) - 2)
    _, covariance = linear_regression(data, np.sqrt(variance))
    wide = scipy.stats.t.isf(0.05, len(data) - 2) * np.sqrt(covariance[0, 0])
    assert found.values["offset"] - found.lower["offset"] == pytest.approx(wide, rel=1e-8)
    np.testing.assert_allclose(found.noise, np.sqrt(variance), rtol=1e-8)
    assert found.tests.size is None


def test_prior_is_combined_by_its_weight():
    data = np.array([2.0, 2.2])
    parameter = ms.FitParameter(1.0, prior=(1.0, 0.1))
    found = fitted(lambda a: a.expand(2), data, {"a": parameter}, noise=0.2)
    weights = np.array([2 / 0.2**2, 1 / 0.1**2])
    assert found.values["a"] == pytest.approx((weights @ [2.1, 1.0]) / weights.sum())
    assert found.deviations["a"] == pytest.approx(weights.sum() ** -0.5)


def test_logarithmic_parameter_has_an_interval_of_factors():
    data = 2.0 * np.exp(-3.0 * TIMES.numpy())
    parameters = {"size": ms.FitParameter(0.1, log=True), "rate": ms.FitParameter(1.0, log=True, unit="1/s")}
    found = fitted(lambda size, rate: size * torch.exp(-rate * TIMES), data, parameters, noise=0.01)
    assert found.values == pytest.approx({"size": 2.0, "rate": 3.0}, rel=1e-8)
    factor = np.exp(scipy.stats.norm.isf(0.025) * found.deviations["rate"])
    assert found.upper["rate"] / found.values["rate"] == pytest.approx(factor)
    assert found.values["rate"] / found.lower["rate"] == pytest.approx(factor)
    assert "rate = 3 1/s, 95%" in repr(found)


def test_arrays_of_parameters_are_labelled():
    found = fitted(lambda a: a, [1.0, 2.0], {"a": np.ones(2)}, noise=1.0)
    assert found.labels == ("a[0]", "a[1]")
    np.testing.assert_allclose(found.values["a"], [1.0, 2.0])
    np.testing.assert_allclose(found.lower["a"], np.array([1.0, 2.0]) - scipy.stats.norm.isf(0.025))


def test_prediction_has_the_band_of_regression():
    data = data_of_line(0.1)
    found = fitted(line, data, {"offset": 0.5, "slope": -1.0}, noise=0.1)
    _, covariance = linear_regression(data, 0.1)
    later = found.predict(lambda offset, slope: (offset + 3.0 * slope)[None])
    exact = np.sqrt(np.array([1.0, 3.0]) @ covariance @ [1.0, 3.0])
    np.testing.assert_allclose(later.deviations, [exact], rtol=1e-9)
    np.testing.assert_allclose(later.upper - later.values, [scipy.stats.norm.isf(0.025) * exact], rtol=1e-9)
    alone = found.predict(lambda offset, slope: offset)
    assert alone.deviations == pytest.approx(np.sqrt(covariance[0, 0]))


def test_product_alone_leaves_its_factors_open():
    """Check a product: the data determine it, and neither of its factors."""
    parameters = {name: ms.FitParameter(1.5, log=True) for name in ("a", "b")}
    found = fitted(lambda a, b: a * b * torch.ones(4).double(), [2.0, 2.1, 1.9, 2.0], parameters, noise=0.1)
    assert np.isinf([found.upper["a"], found.deviations["a"], found.deviations["b"]]).all()
    (told,) = found.undetermined
    assert "a is multiplied by" in told and "b is multiplied by" in told
    with pytest.raises(ValueError, match=r"Jacobian is singular.*a is multiplied"):
        found.covariance  # noqa: B018
    product = found.predict(lambda a, b: a * b)
    assert product.deviations == pytest.approx(0.05, rel=1e-6)
    assert np.isinf(found.predict(lambda a, b: a).deviations)
    assert found.plot().figure is not None


def test_weak_direction_is_told_in_words():
    parameters = {"a": ms.FitParameter(1.0, log=True), "b": ms.FitParameter(1.0, size=0.5, unit="mm")}
    found = fitted(lambda a, b: torch.stack([a, 1e-3 * b + a]), [1.0, 1.0], parameters, noise=0.01)
    (told,) = found.undetermined
    assert "b changes by +0.5 mm" in told and "a" not in told.split(" if ")[1].replace("changes", "")


def test_entry_at_a_bound_is_told_and_counts_as_known():
    parameters = {"offset": ms.FitParameter(0.2, upper=0.3), "slope": -1.0}
    found = fitted(line, data_of_line(0.1), parameters, noise=0.1)
    assert found.at_bounds == ("offset",) and found.values["offset"] == 0.3
    assert found.deviations["offset"] == 0.0
    assert found.deviations["slope"] == pytest.approx(0.1 / float((TIMES**2).sum()) ** 0.5)


def test_several_sets_of_data_have_noises_of_their_own():
    data = {"first": np.array([1.0, 1.2]), "second": np.array([1.6])}
    found = fitted(
        lambda a: {"first": a.expand(2), "second": a.expand(1)},
        data,
        {"a": 1.0},
        noise={"first": 0.1, "second": 0.2},
    )
    weights = np.array([100.0, 100.0, 25.0])
    assert found.values["a"] == pytest.approx(weights @ [1.0, 1.2, 1.6] / weights.sum())


@pytest.mark.parametrize(
    "disturbed, doubt",
    [
        (lambda data: data + 3.0 * np.sin(6 * np.linspace(0, 1, data.size)), "misses something"),
        (lambda data: np.where(np.arange(data.size) == 5, data + 1.0, data), "outliers: entries 5"),
        (lambda data: 1e-4 * (data - data.mean()), "noise is smaller"),
    ],
)
def test_residuals_unlike_the_noise_raise_doubts(disturbed, doubt):
    times = torch.linspace(0, 1, 100, dtype=torch.float64)
    data = disturbed(0.1 * np.random.default_rng(2).standard_normal(100))
    found = fitted(lambda a: a + 0 * times, data, {"a": 1.0}, noise=0.1)
    assert any(doubt in each for each in found.tests.doubts), found.tests.doubts


def test_residuals_like_the_noise_raise_no_doubt():
    found = fitted(line, data_of_line(0.1), {"offset": 0.5, "slope": -1.0}, noise=0.1)
    assert found.tests.doubts == [] and "look like the noise" in repr(found.tests)


def test_picture_has_four_panels(tmp_path):
    found = fitted(line, data_of_line(0.1), {"offset": 0.5, "slope": -1.0}, noise=0.1)
    found.plot().save(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 20_000


def tips(solve, modulus, strength):
    """Return the heights of a sheet's tip in mm, without a field and in two."""
    magnetization = torch.stack([strength, 0 * strength, 0 * strength])
    fields = [(0, 0, 0), (0, 0, 4e-3), (0, 0, -3e-3)]
    shapes = solve(young_modulus=modulus, remanent_magnetization=magnetization, applied_flux_density=fields)
    return 1e3 * shapes.positions[:, TIP, 2].mean(dim=1)


def test_intervals_cover_the_truth_as_often_as_they_say():
    """Check 200 noisy fits of modulus and magnetization of a known sheet: 95 % intervals cover 93 to 97 % of them."""
    truth = {"modulus": 1e6, "strength": 30e3}
    solve, noise, rng = ms.WarmStart(SCENE), 0.05, np.random.default_rng(12)
    exact = tips(solve, *(torch.tensor(each).double() for each in truth.values())).numpy()
    covered = []
    for _ in range(200):
        data = exact + noise * rng.standard_normal(exact.shape)
        parameters = {name: ms.FitParameter(1.02 * each, log=True) for name, each in truth.items()}
        found = fitted(lambda **u: tips(solve, **u), data, parameters, noise=noise, jacobian="backward")
        covered += [found.lower[name] <= each <= found.upper[name] for name, each in truth.items()]
    assert 0.93 <= np.mean(covered) <= 0.97


def test_sheet_without_weight_tells_the_ratio_only():
    scene = ms.Scene(SHEET, supports=[CLAMP], field=ms.UniformField())
    solve = ms.WarmStart(scene)
    parameters = {"modulus": ms.FitParameter(0.9e6, log=True), "strength": ms.FitParameter(30e3, log=True)}
    exact = tips(solve, torch.tensor(1e6).double(), torch.tensor(30e3).double()).numpy()
    found = fitted(lambda **u: tips(solve, **u), exact, parameters, noise=0.01)
    (told,) = found.undetermined
    assert "modulus is multiplied by 2.03" in told and "strength is multiplied by 2.03" in told
    ratio = found.predict(lambda modulus, strength: strength / modulus)
    assert ratio.values == pytest.approx(0.03, rel=1e-6) and ratio.deviations < 1e-3 * ratio.values


def test_motion_is_fitted_by_its_gradients():
    def heights(modulus):
        motion = ms.simulate(
            SCENE,
            steps=10,
            time_step=4e-3,
            young_modulus=modulus,
            remanent_magnetization=(30e3, 0, 0),
            applied_flux_density=(0, 0, 3e-3),
            progress=False,
        )
        return 1e3 * motion.positions[:, TIP, 2].mean(dim=1)

    data = heights(torch.tensor(1e6).double().requires_grad_()).detach().numpy()
    found = fitted(heights, data, {"modulus": ms.FitParameter(1.3e6, log=True)}, noise=0.01)
    assert found.values["modulus"] == pytest.approx(1e6, rel=1e-6)


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"data": [1.0, np.nan]}, "data"),
        ({"data": {"x": [1.0, 2.0]}}, "must return a dict"),
        ({"parameters": {}}, "parameters must be"),
        ({"parameters": {"a b": 1.0}}, "name of a parameter"),
        ({"parameters": {"a": 0.0}}, "starts at zero"),
        (
            {"parameters": {"a": ms.FitParameter(1.0, prior=(1.0, 0.1))}, "noise": None},
            "priors need the noise",
        ),
        ({"data": [1.0], "noise": None}, "need 2 data"),
        ({"noise": 0.0}, "noise must be positive"),
        ({"noise": [1.0]}, "noise must be a number or have shape"),
        ({"noise": {"x": 1.0}}, "noise must have the names"),
        ({"level": 1.0}, "level"),
        ({"model": 3}, "model must be a function"),
        ({"model": lambda a: 1.0}, "must return a tensor"),
        ({"model": lambda a: a}, "must return the shape of data"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    good = {"model": lambda a: a.expand(2), "data": [1.0, 2.0], "parameters": {"a": 1.0}, "noise": 1.0}
    with pytest.raises(ValueError, match=message):
        ms.fit(**{**good, **arguments}, progress=False)


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"start": -1.0, "log": True}, "start must be positive"),
        ({"start": 1.0, "lower": 2.0}, "start must be within"),
        ({"start": 1.0, "lower": 2.0, "upper": 1.0}, "lower must be below"),
        ({"start": 1.0, "size": 0.0}, "size must be positive"),
        ({"start": 1.0, "prior": 1.0}, "prior must be"),
        ({"start": 1.0, "prior": (1.0, 0.0)}, "standard deviation of the prior"),
        ({"start": 1.0, "prior": (-1.0, 1.0), "log": True}, "median of the prior"),
        ({"start": 1.0, "lower": [1.0, 2.0]}, "lower must be a number"),
        ({"start": 1.0, "unit": 3}, "unit must be a text"),
        ({"start": np.nan}, "start"),
    ],
)
def test_bad_parameters_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        ms.FitParameter(**arguments)


def test_a_negative_bound_of_a_logarithm_is_refused():
    with pytest.raises(ValueError, match="lower must be 0 or more where log=True, got -1"):
        ms.FitParameter(1.0, lower=-1.0, log=True)
    assert ms.FitParameter(1.0, lower=0.0, log=True).log
