"""States of a motion: their properties, and several of them in one picture."""

import numpy as np
import pytest
from motions import lifted_strip

import magshell as ms
from magshell.output.plot import colors
from magshell.output.plot.colors import rgb
from magshell.output.plot.panels import Options, draw
from magshell.output.plot.view import view_of
from magshell.output.results.state import states_of
from magshell.output.results.units import length_unit

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 4))


def test_a_motion_fades_towards_its_beginning() -> None:
    """Check that earlier states are paler, and that the fields fan out from one point."""
    mesh, heights = MESH, 0.03 * np.arange(3)[:, None, None]
    lifts = mesh.rest_positions + heights * (0, 0, 1)
    fields = [(0, 0, 1e-3), (1e-3, 0, 0), (0, 0, -1e-3)]
    states = states_of(mesh, positions=lifts, applied_flux_density=fields)
    drawing = draw(
        [states], ["one", "two", "three"], None, view_of(states, None), length_unit(0.1), Options(fade=True)
    )
    [panel] = drawing.panels
    sheets = [solid for solid in panel.solids if len(solid.positions) == mesh.n_vertices]
    lightness = [solid.colors.mean() for solid in sheets]
    assert lightness[0] > lightness[1] > lightness[2] == pytest.approx(rgb(colors.SERIES[0]).mean())
    green = [
        solid for solid in panel.solids if np.argmax(solid.colors[0]) == 1 and len(solid.positions) < 100
    ]
    assert len(green) == 3
    assert [label.text for label in panel.labels] == ["three", "one", "two", "$B$ up to 1 mT"]


def test_a_motion_has_its_times_as_titles() -> None:
    move = lifted_strip(MESH)
    states = states_of(move)
    assert [state.title for state in states[:2]] == ["0.0 ms", "5.0 ms"]
    assert [state.time for state in states] == move.times.tolist()
    assert states[4].flux_density == pytest.approx((0, 0, 2e-3)) and states[4].is_magnetized


def test_equilibria_are_states() -> None:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
    both = ms.equilibrium(
        scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=[(0, 0, 1e-4), (0, 0, 2e-4)]
    )
    states = states_of(both)
    assert [state.flux_density[2] for state in states] == [1e-4, 2e-4] and states[0].is_magnetized


def test_gradients_stay_behind(tmp_path) -> None:
    torch = pytest.importorskip("torch")
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
    fields = torch.linspace(0, 4e-3, 4, dtype=torch.float64)[:, None] * torch.tensor([0.0, 0.0, 1.0]).double()
    move = ms.simulate(
        scene,
        steps=3,
        time_step=5e-3,
        remanent_magnetization=torch.tensor([4e4, 0, 0], requires_grad=True),
        applied_flux_density=fields.requires_grad_(),
    )
    assert [state.flux_density[2] for state in states_of(move)] == pytest.approx(
        [0, 4e-3 / 3, 8e-3 / 3, 4e-3]
    )
    assert move.displacements.requires_grad
    ms.write_page(move, tmp_path / "a.html")
    ms.write_series(tmp_path / "a.pvd", move)
