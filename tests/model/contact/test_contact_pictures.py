"""Contact in pictures and files: pressures that integrate to the normal forces, forces as arrows."""

import meshio
import numpy as np
import pytest
from body_contact_scenes import DOWN, PLATE, SOFT, above, two_sheets

import magshell as ms
from magshell.output.plot import colors
from magshell.output.plot.drawing import plot
from magshell.output.results.state import states_of

SMALL = {"width": 400, "style": ms.Style(backend="matplotlib")}
FORCES = ms.Style(contacts=True, backend="matplotlib")


def ball_on_sheet():
    mesh = ms.meshes.ball(0.005, 2).transformed(translation=(0.0108, 0.0097, 0.0056))
    ball = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), mass_density=1e3)
    sheet = ms.Shell(PLATE, **SOFT)
    clamp = ms.Clamp(PLATE.edges_at(x=0.0), body=sheet)
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, -1e-4)), body=sheet, friction_coefficient=0.2)
    touch = ms.Contact(ball, sheet, friction_coefficient=0.3)
    scene = ms.Scene(
        [ball, sheet], supports=[clamp], contacts=[touch, floor], gravity=DOWN, allow_rigid_motions=True
    )
    return scene, ms.simulate(scene, steps=5, time_step=2e-3, velocities=(0, 0, -0.02))  # until it rebounds


def integral(positions, faces, pressures):
    """Integrate a function that is linear on every face."""
    x0, x1, x2 = np.moveaxis(positions[faces], 1, 0)
    areas = 0.5 * np.linalg.norm(np.cross(x1 - x0, x2 - x0), axis=1)
    return float(areas @ pressures[faces].mean(axis=1))


@pytest.fixture(scope="module")
def fallen():
    return ball_on_sheet()


def test_a_pressure_integrates_to_the_normal_forces(fallen):
    scene, motion = fallen
    touch, floor = scene.contacts
    state = states_of(motion)[-1]
    on_ball, on_floor = (motion.contact_state(each) for each in (touch, floor))
    assert on_ball.normal_force > 0 and on_floor.normal_force > 0
    of_bodies = []
    for body, span in zip(scene.bodies, scene._bodies.spans, strict=True):
        positions, pressures = state.positions[span.vertices], state.contact_pressures[span.vertices]
        of_bodies.append(integral(positions, body.mesh.faces, pressures))
    assert of_bodies[0] == pytest.approx(on_ball.normal_force, rel=1e-12)
    assert of_bodies[1] == pytest.approx(on_ball.normal_force + on_floor.normal_force, rel=1e-12)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_a_uniform_pressure_is_the_weight_over_the_area():
    """Check m g/A at every vertex of a sheet flat on a plate, at borders and corners too."""
    lower, upper = ms.Shell(PLATE, **SOFT), above(1.05e-3, ms.meshes.rectangle(0.01, 0.01, cells=(4, 4)))
    held = [ms.Pin(np.arange(PLATE.n_vertices), body=lower), ms.Pin([0, 4], "xy", body=upper)]
    scene = ms.Scene(
        [lower, upper],
        supports=held,
        contacts=[ms.Contact(lower, upper)],
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    rest = ms.equilibrium(scene)
    pressures = states_of(rest)[0].contact_pressures[PLATE.n_vertices :]
    weight = 9.81 * upper.vertex_masses.sum()
    assert integral(rest[upper].positions, upper.mesh.faces, pressures) == pytest.approx(weight, rel=1e-8)


def test_files_contain_the_contact_pressure(fallen, tmp_path):
    _, motion = fallen
    ms.write_series(tmp_path / "fall.pvd", motion, progress=False)
    written = meshio.read(tmp_path / "fall" / "fall_5.vtu").point_data["contact_pressure"]
    np.testing.assert_allclose(written, states_of(motion)[-1].contact_pressures)
    two = ms.equilibrium(two_sheets())
    ms.write_series(tmp_path / "rest.pvd", two, progress=False)
    written = meshio.read(tmp_path / "rest" / "rest_0.vtu").point_data["contact_pressure"]
    assert written.max() > 0
    strip = ms.meshes.rectangle(0.1, 0.02, cells=(2, 2))
    ms.write_series(tmp_path / "strip.pvd", strip, progress=False)
    assert "contact_pressure" not in meshio.read(tmp_path / "strip" / "strip_0.vtu").point_data


def test_pictures_show_pressure_and_forces(fallen):
    _, motion = fallen
    with_forces = plot(motion, states=[5], color="contact_pressure", **{**SMALL, "style": FORCES})
    without = plot(motion, states=[5], color="contact_pressure", **SMALL)
    red = colors.rgb(colors.CONTACT)

    def reddish(picture):
        picture.figure.canvas.draw()
        image = np.asarray(picture.figure.canvas.buffer_rgba())[:, :, :3] / 255.0
        return int((np.abs(image - red).max(axis=2) < 0.15).sum())

    assert reddish(with_forces) > 20 and reddish(without) == 0
    assert any("contact force" in text.get_text() for text in with_forces.figure.axes[-1].texts)


def test_forces_of_the_arrows_balance(fallen):
    """Check that the forces between two bodies sum to zero, and those of the floor to its load."""
    scene, motion = fallen
    state = states_of(motion)[-1]
    on_floor = motion.contact_state(scene.contacts[1])
    sums = state.loads().forces.sum(axis=0)
    np.testing.assert_allclose(sums, (on_floor.forces + on_floor.friction).sum(axis=0), atol=1e-12)


def test_a_film_and_a_page_take_the_pressure(fallen, tmp_path):
    _, motion = fallen
    ms.animate(
        motion,
        tmp_path / "a.gif",
        color="contact_pressure",
        width=400,
        fps=4,
        style=FORCES,
    )
    ms.write_page(motion, tmp_path / "a.html", color="contact_pressure")
    assert "contact pressure" in (tmp_path / "a.html").read_text()


def test_contact_pictures_without_contacts_are_refused():
    sheet = ms.Scene(ms.Shell(PLATE, **SOFT), supports=[ms.Clamp(PLATE.edges_at(x=0.0))])
    for what in (PLATE, ms.equilibrium(sheet)):
        with pytest.raises(ValueError, match="scene with contacts"):
            plot(what, **{**SMALL, "style": FORCES})
        with pytest.raises(ValueError, match="scene with contacts"):
            plot(what, color="contact_pressure", **SMALL)
    with pytest.raises(ValueError, match="contacts must be True or False"):
        ms.Style(contacts=3)
