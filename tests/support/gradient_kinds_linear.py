"""Kinds of scene with numbers of their stiffness, for gradient_kinds.py: frequencies, buckling factors, critical points."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from adjoint_scenes import DEFAULTS, MESH, everything
from gradient_kinds_own_field import closing_flaps, stiff_pair, stiff_pair_magnetization
from gradient_scenes import Kind
from gradient_world import EXACT, FACTORS, REACH

import magshell as ms

torch = pytest.importorskip("torch")


def frequencies(scene, values, start=None, **given):
    """Return the logarithms of the three lowest squares of frequencies about an equilibrium."""
    rest = ms.equilibrium(scene, values=values, start=start, **given)
    return numbers(ms.vibration_modes(rest.scene, rest, count=3).squares)


def frequencies_at_rest(scene, values, **of_body):
    body = scene.bodies[0]
    values = {**values, body: {**values.get(body, {}), **of_body}}
    return numbers(ms.vibration_modes(scene, values=values, count=3).squares)


def numbers(positive) -> SimpleNamespace:
    """Return positive numbers as results, by their logarithms."""
    return SimpleNamespace(numbers=as_tensor(positive).log().reshape(-1))


def as_tensor(values):
    return values if torch.is_tensor(values) else torch.tensor(np.array(values, dtype=np.float64))


def vibrating_sheet() -> Kind:
    """Build the sheet on which everything acts, vibrating about its equilibrium."""
    return Kind(everything(), {**DEFAULTS, **FACTORS}, solve=frequencies, fixed=EXACT, reach=REACH)


def vibrating_solid() -> Kind:
    """Build a magnetized solid with a skin, vibrating about its equilibrium in a field."""
    block = ms.Solid(
        ms.meshes.box((0.1, 0.03, 0.02), cells=(4, 2, 1)),
        material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.4),
        mass_density=1e3,
        remanent_magnetization=(3e4, 1e3, 2e4),
        skin=ms.Skin(remanent_magnetization=(4e4, 0.0, 1e4), thickness=1e-3, mass_density=2e3),
    )
    pin = ms.Pin(block.mesh.vertices_at(x=0.0))
    scene = ms.Scene(block, supports=[pin], field=ms.UniformField(), gravity=(0.2, 0.1, -9.81))
    inputs = {"applied_flux_density": (2e-3, 1e-3, 2e-2), "gravity_factor": 0.9}
    return Kind(scene, inputs, solve=frequencies, fixed=EXACT, reach=REACH)


def vibrating_at_rest() -> Kind:
    """Build a sheet that vibrates about its rest shape, without loads."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))])
    return Kind(scene, {}, solve=frequencies_at_rest, reach=REACH, keeps_shape=True)


def numbers_of(given):
    """Return tensors without their graphs, and anything else as it is."""
    return {name: value.detach() if torch.is_tensor(value) else value for name, value in given.items()}


def as_values(scene, values, given):
    """Return values with the keywords of ms.equilibrium that other solves take as values, and the other keywords."""
    sheet = scene.bodies[0]
    of_sheet = {name: given[name] for name in OF_SHEET if name in given}
    of_scene = {name: given[name] for name in ("vertex_loads",) if name in given}
    values = {**values, sheet: {**values.get(sheet, {}), **of_sheet}}
    if of_scene:
        values[scene] = {**values.get(scene, {}), **of_scene}
    return values, {
        name: value for name, value in given.items() if name not in (*OF_SHEET, "vertex_loads", "solver")
    }


def buckling(scene, values, **given):
    """Return the lowest buckling factor of the loads."""
    values, given = as_values(scene, values, given)
    return numbers(ms.linear_buckling(scene, values=values, **given).factors)


def buckling_about(scene, values, start=None, **given):
    """Return the lowest buckling factor of the way from half of the loads, by which the sheet is bent, to these."""
    half = {
        name: 0.5 * as_tensor(given[name])
        for name in ("load_factor", "applied_flux_density")
        if name in given
    }
    rest = ms.equilibrium(scene, values=values, start=start, **{**given, **half})
    towards = {name: given[name] for name in (*half, "gravity_factor") if name in given}
    return numbers(ms.linear_buckling(rest.scene, rest, **towards).factors)


def response(scene, values, **given):
    """Return the linear response to all loads."""
    values, given = as_values(scene, values, given)
    return deflection(ms.linear_response(scene, values=values, **given))


def response_about(scene, values, start=None, **given):
    """Return the linear response about an equilibrium at these loads, towards other ones."""
    rest = ms.equilibrium(scene, values=values, start=start, **given)
    towards = {name: 0.8 * as_tensor(given[name]) ** 2 for name in FACTORS}
    field = {"applied_flux_density": 1.1 * as_tensor(given["applied_flux_density"])}
    return deflection(ms.linear_response(rest.scene, rest, **towards, **field))


def deflection(found) -> SimpleNamespace:
    """Return displacements and edge rotations as results."""
    return SimpleNamespace(displacements=found.displacements, numbers=as_tensor(found.edge_rotations))


def responding_sheet(about: bool) -> Kind:
    """Build the sheet on which everything acts; its rest shape or an equilibrium changes by linear theory."""
    inputs = {**DEFAULTS, **FACTORS}
    solve = response_about if about else response
    return Kind(everything(), inputs, solve=solve, fixed=EXACT, reach=REACH, keeps_shape=True)


def column(gravity=(-9.81, 1.0, 0)) -> ms.Scene:
    """Build a clamped strip that is pressed along its length, in its weight and a field."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    press = ms.EdgeLoad(MESH.edges_at(x=0.1), (-0.1, 0.02, 0))
    return ms.Scene(
        sheet,
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        loads=[press],
        gravity=gravity,
        field=ms.UniformField(),
    )


def buckling_column() -> Kind:
    inputs = {
        "load_factor": 0.9,
        "gravity_factor": 0.8,
        "remanent_magnetization": (3e3, 1e3, 0),
        "applied_flux_density": (-1e-3, 3e-4, 0),
    }
    return Kind(column(), inputs, solve=buckling, reach=REACH, keeps_shape=True)


def buckling_six_node_column() -> Kind:
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(4, 1), order=2)
    sheet = ms.Shell(mesh, thickness=2e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    press = ms.EdgeLoad(mesh.edges_at(x=0.1), (-0.1, 0.02, 1e-3))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[press], gravity=(-9.81, 1.0, 0))
    return Kind(
        scene, {"load_factor": 0.9, "gravity_factor": 0.8}, solve=buckling, reach=REACH, keeps_shape=True
    )


def buckling_solid() -> Kind:
    """Build a nearly incompressible column, bent by its weight, that buckles about its equilibrium."""
    block = ms.Solid(
        ms.meshes.box((0.1, 0.02, 0.01), cells=(4, 1, 1)),
        material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.45),
        mass_density=1e3,
    )
    press = ms.AreaLoad((-500.0, 20.0, 10.0), faces=block.mesh.faces_at(x=0.1))
    pin = ms.Pin(block.mesh.vertices_at(x=0.0))
    scene = ms.Scene(block, supports=[pin], loads=[press], gravity=(-1.0, 0.2, -0.1))
    inputs = {"load_factor": 0.9, "gravity_factor": 0.8}
    return Kind(scene, inputs, solve=buckling_about, fixed=EXACT, step=2e-3, reach=REACH)


def snap(scene, values, start=None, solver=None, **given):
    """Return the first limit point of the path on which a field pushes a buckled beam through, as the field grows."""
    values, given = as_values(scene, values, given)
    given["solver"] = solver
    field = as_tensor(given.pop("applied_flux_density"))  # a tensor: the point is located by Newton's method
    pushed = ms.equilibrium(
        scene,
        values={owner: numbers_of(named) for owner, named in values.items()},
        applied_flux_density=(0, 0, -5e-3),
        **numbers_of(given),
    )
    rest = ms.equilibrium(scene, values=values, applied_flux_density=(1e-4, 0, 0), start=pushed, **given)
    middle = scene.mesh.nearest_vertex((0.06, 0.01, 0.0))
    path = ms.follow_path(
        scene,
        values=values,
        applied_flux_density=field,
        start=rest,
        max_step=0.02,
        progress=False,
        until=lambda _, positions: positions[middle, 2] < 0.0,
        **given,
    )
    point = next(each for each in path.critical if each.kind == "limit")
    positions = as_tensor(point.positions) - torch.tensor(np.array(scene.mesh.rest_positions))
    found = numbers(point.parameter)
    found.displacements = positions
    return found


def snap_together(scene, values, start=None, **given):
    """Return the limit point of the path on which a field presses two flaps together that attract each other."""
    field = as_tensor(given.pop("applied_flux_density"))  # a tensor: the point is located by Newton's method
    rest = ms.equilibrium(scene, values=values, applied_flux_density=0.0 * field, **given)
    upper = len(scene.mesh.rest_positions) // 2
    # The path ends beyond its limit point, where the flaps are too near each other for their meshes.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ms.FieldSamplingWarning)
        path = ms.follow_path(
            scene,
            values=values,
            applied_flux_density=field,
            start=rest,
            first_step=0.03,
            max_step=0.02,
            until=lambda _, at: np.min(at[upper:, 2] - at[:upper, 2]) < 1.3e-3,
            progress=False,
            **given,
        )
    point = next(each for each in path.critical if each.kind == "limit")
    found = numbers(point.parameter)
    found.displacements = as_tensor(point.positions) - torch.tensor(np.array(scene.mesh.rest_positions))
    return found


def snapping_flaps() -> Kind:
    """Build two flaps that snap together in a field."""
    scene = closing_flaps()
    n = scene.bodies[0].mesh.n_faces
    magnetization = np.repeat([[2.4e4, 1e3, 0.0], [-2.6e4, 1e3, 0.0]], n, axis=0)
    inputs = {"remanent_magnetization": magnetization, "applied_flux_density": (1e-4, -2e-4, 2e-2)}
    return Kind(scene, inputs, solve=snap_together, fixed=EXACT, reach=REACH)


OF_SHEET = ("thickness", "young_modulus", "poisson_ratio", "mass_density", "curvature_scale")


def snapping_beam() -> Kind:
    """Build a beam, buckled by its clamps, with halves magnetized against each other, in its weight and slightly pushed."""
    mesh = ms.meshes.rectangle(0.12, 0.02, cells=(12, 2))
    sheet = ms.Shell(mesh, thickness=2.5e-3, young_modulus=4.2e6, poisson_ratio=0.45, mass_density=1e3)
    left = ms.Clamp(mesh.edges_at(x=0.0), displacement=(4e-4, 0, 0), rotation=(0.0, 2e-3, 0.0))
    right = ms.Clamp(mesh.edges_at(x=0.12), displacement=(-3e-4, 0, 0), rotation=(0.0, 1e-3, 0.0))
    end = ms.PointLoad(mesh.nearest_vertex((0.03, 0.01, 0.0)), (0, 0, -2e-4))
    scene = ms.Scene(
        sheet, supports=[left, right], loads=[end], gravity=(0.3, 0, -0.1), field=ms.UniformField()
    )
    magnetization = np.zeros((mesh.n_faces, 3))
    magnetization[:, 0] = 5.4e4 * np.sign(mesh.face_barycenters[:, 0] - 0.06)
    inputs = {
        "remanent_magnetization": magnetization,
        "applied_flux_density": (1e-3, 2e-4, 2e-2),
        **FACTORS,
    }
    reach = {**REACH, "displacement": 3e-4, "rotation": 0.01, "center": 1e-3}
    return Kind(scene, inputs, solve=snap, fixed=EXACT, reach=reach)


def vibrating_with_own_field() -> Kind:
    """Build two flaps that vibrate about their equilibrium in each other's field."""
    scene = stiff_pair()
    inputs = {"remanent_magnetization": stiff_pair_magnetization(scene)}
    return Kind(scene, inputs, solve=frequencies, fixed=EXACT, reach=REACH)


def buckling_with_own_field() -> Kind:
    """Build two flaps in each other's field that are pressed along their length."""
    scene = stiff_pair((-5.0, 0.2, 0.1), cells=(2, 1))
    inputs = {"load_factor": 0.9, "remanent_magnetization": stiff_pair_magnetization(scene)}
    return Kind(scene, inputs, solve=buckling_about, fixed=EXACT, step=2e-4, reach=REACH)


LINEAR_MAKERS = {
    "flaps with their own field that buckle": buckling_with_own_field,
    "flaps with their own field that vibrate": vibrating_with_own_field,
    "flaps with their own field that snap together": snapping_flaps,
    "a sheet that vibrates about an equilibrium": vibrating_sheet,
    "a solid that vibrates about an equilibrium": vibrating_solid,
    "a sheet that vibrates about its rest shape": vibrating_at_rest,
    "a beam that snaps at a limit point": snapping_beam,
    "a column that buckles by linear theory": buckling_column,
    "a six-node column that buckles by linear theory": buckling_six_node_column,
    "a solid column that buckles about its equilibrium": buckling_solid,
    "a sheet that responds by linear theory": lambda: responding_sheet(False),
    "a bent sheet that responds by linear theory": lambda: responding_sheet(True),
}
