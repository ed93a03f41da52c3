"""Functions that need torch, with arguments that work: objectives, controls, parametrizations, optimizers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from fuzz_calls import Call, Sample

import magshell as ms
from magshell import control, objectives, optim, parametrize


def torch_calls(s: Sample) -> Iterator[Call]:
    own = {"function": _springs, "of": s.mesh.edges, "values": {"stiffness": np.ones(s.mesh.n_edges)}}
    clamped = {"supports": [s.clamp]}
    yield Call(
        "CustomEnergy",
        lambda **a: ms.Scene(s.shell, loads=[ms.CustomEnergy(**a)], **clamped),
        {**own, "body": s.shell, "name": "springs", "is_load": True},
    )
    yield from _objectives(s)
    yield from _controls(s)
    yield from _optimizers()


def _springs(x, stiffness):
    """Return the energy of springs to the center of any number of vertices: errors of the function's own are not sought."""
    return stiffness * (x - x.mean(0)).square().sum()


def _objectives(s: Sample) -> Iterator[Call]:
    n_v, n_f = s.mesh.n_vertices, s.mesh.n_faces
    x, tips = s.positions, np.array([0, 3])
    image = np.arange(12.0).reshape(3, 4)
    extent = (0.0, 0.1, 0.0, 0.05)
    vectors = np.ones((n_f, 3))
    yield Call(
        "objectives.shape_matching",
        objectives.shape_matching,
        {"positions": x, "target": x, "vertices": np.arange(n_v), "weights": np.ones(n_v)},
    )
    yield Call(
        "objectives.height_map",
        objectives.height_map,
        {"positions": x, "rest_positions": x, "image": image, "extent": extent, "weights": np.ones(n_v)},
    )
    yield Call(
        "objectives.bilinear",
        objectives.bilinear,
        {"image": image, "points": x, "extent": extent},
    )
    yield Call(
        "objectives.extension",
        objectives.extension,
        {"positions": x, "vertices": tips, "direction": (1, 0, 0)},
    )
    yield Call("objectives.magnitude", objectives.magnitude, {"values": vectors, "areas": np.ones(n_f)})
    variation = {
        "values": vectors,
        "edge_faces": s.mesh.edge_faces,
        "edge_lengths": np.ones(s.mesh.n_edges),
        "smoothing": 1e-3,
    }
    yield Call("objectives.total_variation", objectives.total_variation, variation)
    yield Call(
        "objectives.limit",
        objectives.limit,
        {"remanent_magnetization": vectors, "limit": 1.0, "sharpness": 4.0},
    )
    yield Call(
        "objectives.printable",
        objectives.printable,
        {
            "remanent_magnetization": vectors,
            "ink": ms.PrintableSet(1.0, np.eye(3)),
            "areas": np.ones(n_f),
            "sharpness": 4.0,
        },
    )
    yield Call(
        "PrintableSet",
        ms.PrintableSet,
        {
            "strength": 1.0,
            "directions": np.eye(3),
            "levels": (0, 1),
            "frames": np.tile(np.eye(3), (n_f, 1, 1)),
        },
    )
    yield Call(
        "parametrize.frames_along", parametrize.frames_along, {"mesh": s.mesh, "direction": (1, 0.1, 0.2)}
    )
    yield Call(
        "parametrize.radial_frames",
        parametrize.radial_frames,
        {"mesh": s.mesh, "center": (-9.0, 0.1, 0.2), "axis": (0, 0, 1)},
    )
    yield Call(
        "minimize_printable",
        ms.minimize_printable,
        {
            "objective": lambda m: (m**2).sum(),
            "remanent_magnetization": vectors,
            "ink": ms.PrintableSet(1.0, np.eye(3)),
            "max_iterations": 2,
            "weights": (0.1,),
            "blocks": 2,
            "stage_iterations": 1,
            "exchanges": 1,
            "tolerance": 1e-3,
            "stateful": (),
            "callback": None,
            "checkpoint": None,
            "resume": False,
            "progress": False,
        },
    )
    yield Call(
        "parametrize.from_regions",
        parametrize.from_regions,
        {"values": np.ones((2, 3)), "regions": np.arange(n_f) % 2},
    )
    yield Call("parametrize.along", parametrize.along, {"amplitude": np.ones(n_f), "directions": vectors})
    yield Call(
        "parametrize.log_scaled",
        parametrize.log_scaled,
        {"shares": np.full(n_f, 0.5), "lower": 1.0, "upper": 10.0},
    )
    yield Call(
        "parametrize.log_shares",
        parametrize.log_shares,
        {"values": np.full(n_f, 2.0), "lower": 1.0, "upper": 10.0},
    )
    border = s.mesh.rest_positions[s.mesh.boundary_vertices]
    yield Call("parametrize.with_boundary", parametrize.with_boundary, {"mesh": s.mesh, "boundary": border})
    yield Call(
        "parametrize.outline",
        parametrize.outline,
        {"mesh": s.mesh, "controls": np.full((5, 3), 0.1), "loop": 0},
    )
    yield from _densities(s)
    yield from _outlines()
    yield Call("parametrize.softly_limited", parametrize.softly_limited, {"vectors": vectors, "limit": 1.0})
    yield Call("parametrize.clip_to_limit", parametrize.clip_to_limit, {"vectors": vectors, "limit": 1.0})


def _outlines() -> Iterator[Call]:
    corners = [[0.0, 0], [1, 0], [1, 1], [0, 1]]
    for name in ("Polygon", "ClosedSpline", "Slit"):
        yield Call(f"parametrize.{name}", getattr(parametrize, name), {"points": corners})
    yield Call("parametrize.Circle", parametrize.Circle, {"center": (0.5, 0.5), "radius": 0.3})
    square = parametrize.Polygon(corners)
    slit = parametrize.Slit([(0.2, 0.5), (0.8, 0.5)])
    yield Call(
        "parametrize.MeshedOutline",
        parametrize.MeshedOutline,
        {"borders": square, "slits": slit, "size": 0.25, "most_stretch": 2.0, "on_remesh": None},
    )
    outline = parametrize.MeshedOutline(square, slit, size=0.25)
    controls = [each.detach().numpy() for each in outline.controls()]
    yield Call("parametrize.MeshedOutline.positions", outline.positions, {"controls": controls})
    values = np.ones(outline.first_mesh.n_faces)
    yield Call("parametrize.MeshedOutline.transferred", outline.transferred, {"values": values})


def _densities(s: Sample) -> Iterator[Call]:
    density = parametrize.density
    values = np.linspace(0.1, 0.9, s.mesh.n_faces)
    for kind in (density.HelmholtzFilter, density.ConeFilter):
        yield Call(f"parametrize.density.{kind.__name__}", kind, {"mesh": s.mesh, "radius": 0.06})
        smooth = kind(s.mesh, 0.06)
        yield Call(f"parametrize.density.{kind.__name__}.__call__", smooth, {"density": values})
        yield Call(
            f"parametrize.density.{kind.__name__}.eroded_threshold",
            smooth.eroded_threshold,
            {"least_width": 0.02},
        )
    yield Call(
        "parametrize.density.projected",
        density.projected,
        {"density": values, "sharpness": 4.0, "threshold": 0.4},
    )
    yield Call(
        "parametrize.density.robust",
        density.robust,
        {"density": values, "sharpness": 4.0, "eroded_threshold": 0.6},
    )
    yield Call(
        "parametrize.density.interpolated",
        density.interpolated,
        {"density": values, "full": 2.0, "void": 0.01, "power": 3.0, "least_density": 0.1},
    )
    yield Call("parametrize.density.fixed", density.fixed, {"density": values, "solid": (0, 1), "void": (2,)})
    for name in ("volume_fraction", "perimeter"):
        yield Call(f"parametrize.density.{name}", getattr(density, name), {"mesh": s.mesh, "density": values})
    holding = np.array((0, 1))
    yield Call(
        "parametrize.density.Matter",
        density.Matter,
        {"mesh": s.mesh, "density": values, "holding": holding, "least_density": 0.0},
    )
    matter = density.Matter(s.mesh, values, holding, 0.0)
    full = {"young_modulus": 1e6, "mass_density": 1e3, "remanent_magnetization": s.magnetization}
    voids = {"void_stiffness": 1e-2, "void_mass": 1e-2, "power": 3.0}
    powers = {"mass_power": 1.0, "magnetization_power": 1.0}
    yield Call("parametrize.density.Matter.values", matter.values, {**full, **voids, **powers})
    yield Call(
        "parametrize.density.Matter.on_all_faces", matter.on_all_faces, {"values": values, "fill": 0.0}
    )
    yield Call("parametrize.density.Matter.start", matter.start, {"before": matter, "positions": s.positions})


def _controls(s: Sample) -> Iterator[Call]:
    fields, times, track = np.ones((6, 3)), s.times, s.track
    line = control.Polyline([(0, 0, 0), (1, 0, 0)])
    waves = {
        "angular_frequencies": (1.0, 2.0),
        "cosine_amplitudes": np.ones((2, 3)),
        "sine_amplitudes": np.ones((2, 3)),
    }
    yield Call(
        "control.Arc",
        lambda **a: control.Arc(**a).at((0.5,)),
        {"center": (0, 0, 0), "start": (1, 0, 0), "axis": (0, 0, 1), "angle": 1.0},
    )
    yield Call("control.Polyline", lambda **a: control.Polyline(**a).at((0.5,)), {"points": np.eye(3)})
    yield Call(
        "control.Chain",
        lambda **a: control.Chain(**a).at((0.5,)),
        {"pieces": [line, control.Polyline([(1, 0, 0), (2, 0, 0)])]},
    )
    yield Call("Polyline.nearest", line.nearest, {"points": track})
    yield Call("Polyline.at", line.at, {"fractions": (0.0, 0.5)})
    yield Call("Curve.squared_distance", line.squared_distance, {"points": track})
    yield Call(
        "control.curve_distance", control.curve_distance, {"track": track, "curve": line, "smoothing": 1e-3}
    )
    yield Call(
        "control.low_frequency_penalty",
        control.low_frequency_penalty,
        {"flux_density": fields, "times": times, **waves},
    )
    yield Call(
        "control.field_limit", control.field_limit, {"flux_density": fields, "limit": 1.0, "sharpness": 4.0}
    )
    yield Call("control.field_excess", control.field_excess, {"flux_density": fields, "limit": 1.0})
    yield Call("control.field_rate", control.field_rate, {"flux_density": fields, "time_step": 0.1})
    yield Call("control.field_strength", control.field_strength, {"flux_density": fields})
    yield Call(
        "control.fit_fourier",
        control.fit_fourier,
        {"values": fields, "times": times, "angular_frequencies": (1.0,)},
    )
    fit = {
        "values": fields,
        "times": times,
        "number": 5,
        "duration": 1.0,
        "degree": 3,
        "periodic": False,
        "limit": 2.0,
    }
    yield Call("control.fit_spline", control.fit_spline, fit)
    yield Call("control.fourier", control.fourier, {"times": times, **waves, "mean": (0, 0, 0)})
    yield Call("control.frames_at", control.frames_at, {"times": times, "wanted": (0.2, 0.4)})
    travelling = {"times": times, "places": (0.1, 0.2), "speed": 0.3, "amplitude": 0.5, "delay": (0.0, 0.1)}
    yield Call("control.wave", control.wave, {**travelling, "wavelength": 0.2, "mean": 0.5, "ramp": 0.1})
    yield Call("control.pulse", control.pulse, {**travelling, "width": 0.2, "period": 1.0})
    yield Call("control.harmonics", control.harmonics, {"number": 2, "duration": 1.0})
    windows = {
        "controls": np.zeros((4, 2)),
        "lengths": (2, 4),
        "lower": -1.0,
        "upper": (1.0, 2.0),
        "depth": 2,
    }
    windows |= {"smoothings": (2.0, 1.0), "max_iterations": 2, "tolerance": 1e-3, "hold": True}
    yield Call(
        "control.time_windows",
        lambda **a: control.time_windows(lambda rows, window: ((rows - 0.5) ** 2).sum(), progress=False, **a),
        windows,
    )
    receding = {
        "controls": np.zeros((6, 2)),
        "prediction_horizon": 4,
        "control_horizon": 2,
        "lower": -1.0,
        "upper": (1.0, 2.0),
    }
    receding |= {
        "trials": 2,
        "trial_amplitude": (0.1, 0.2),
        "trial_periods": (2, 3),
        "max_iterations": 2,
        "tolerance": 1e-3,
    }
    yield Call(
        "control.receding_horizon",
        lambda **a: control.receding_horizon(
            lambda rows, part, state: ((rows - 0.5) ** 2).sum(),
            lambda rows, part, state: None,
            progress=False,
            **a,
        ),
        {**receding, "seed": 1},
    )
    yield Call("control.zero_order_hold", control.zero_order_hold, {"values": fields, "steps": 12})
    frames = {
        "positions": np.ones((6, 4, 3)),
        "frames": (1, 5),
        "targets": np.ones((2, 2, 3)),
        "vertices": (0, 1),
        "weights": np.ones((2, 2)),
    }
    yield Call("control.key_frames", control.key_frames, frames)
    yield Call(
        "control.path_following",
        control.path_following,
        {"track": track, "targets": track, "weights": np.ones(6)},
    )
    turning = {
        "times": times,
        "magnitude": 1.0,
        "axis": (0, 0, 1),
        "angular_frequency": 1.0,
        "start": (1, 0, 0),
    }
    yield Call("control.rotating", control.rotating, turning)
    spline = {"times": times, "control_points": fields, "duration": 1.0, "degree": 3, "periodic": False}
    yield Call("control.spline", control.spline, spline)
    yield Call("control.step_times", control.step_times, {"steps": 5, "time_step": 0.1})
    yield Call(
        "control.successive_targets",
        control.successive_targets,
        {"targets": np.eye(3), "begin": (0.0, 0.3, 0.6), "times": times, "delay": 0.1},
    )
    yield Call(
        "control.track",
        control.track,
        {"positions": np.ones((6, 4, 3)), "vertices": (0, 1), "weights": (1.0, 1.0)},
    )
    fitting = {
        "track": track,
        "curve": line,
        "start_frame": 0,
        "end_frame": 5,
        "weights": (1.0, 1.0, 1.0),
        "smoothing": 1e-3,
    }
    yield Call("control.track_fitting", control.track_fitting, fitting)


def _optimizers() -> Iterator[Call]:
    box = {"lower": -1.0, "upper": 1.0, "scale": 1.0}
    asymptotes = {
        "move": 1.0,
        "asymptote_initial": 0.5,
        "asymptote_shrink": 0.7,
        "asymptote_grow": 1.2,
        "penalty": 1e3,
        "max_backtracks": 2,
    }

    def stepped(kind):
        def run(**arguments):
            x = torch.ones(3, dtype=torch.float64, requires_grad=True)
            return kind([x], **arguments).step(lambda: (x**2).sum())

        return run

    yield Call("optim.MMA", stepped(optim.MMA), {**box, **asymptotes})
    yield Call("optim.GCMMA", stepped(optim.GCMMA), {**box, **asymptotes})
    limits = {"memory": 3, "first_step": 1.0, "max_evaluations": 5, "max_backtracks": 2}
    yield Call("optim.LBFGS", stepped(optim.LBFGS), {**box, **limits})

    def least_squares(**arguments):
        x = torch.ones(3, dtype=torch.float64, requires_grad=True)
        return optim.GaussNewton([x], **arguments).step(lambda: x**2)

    del limits["memory"]
    yield Call("optim.GaussNewton", least_squares, {**box, **limits, "jacobian": "auto"})
    yield Call("optim.NewtonCG", stepped(optim.NewtonCG), {**box, **limits, "max_products": 5})

    x = torch.ones(3, dtype=torch.float64, requires_grad=True)
    options = {
        "max_iterations": 2,
        "tolerance": 0.0,
        "patience": 1,
        "feasibility": 1e-6,
        "on_jump": "cross",
        "stateful": (),
        "callback": None,
        "progress": False,
        "checkpoint": None,
        "checkpoint_every": 1,
        "resume": False,
    }
    yield Call(
        "minimize",
        ms.minimize,
        {
            "objective": lambda x: (x**2).sum(),
            "parameters": [x],
            "optimizer": lambda parameters: optim.MMA(parameters, scale=1.0),
            **options,
        },
        cost=2,
    )

    fitting = {"max_iterations": 3, "first_step": 1.0, "jacobian": "auto", "level": 0.9, "stateful": ()}
    files = {"checkpoint": None, "resume": False, "progress": False}
    data = {"data": [1.0, 1.2], "parameters": {"a": 1.0}, "noise": 0.1}
    yield Call("fit", ms.fit, {"model": lambda a: a.expand(2), **data, **fitting, **files}, cost=2)
    known = {"lower": 0.0, "upper": 2.0, "log": False, "size": 1.0, "prior": (1.0, 0.1), "unit": "m"}
    yield Call("FitParameter", ms.FitParameter, {"start": 1.0, **known})
