"""Tests of ms.show in a headless Chromium: a magnet is dragged by the mouse, and the sheet follows on the screen."""

import shutil
import time

import numpy as np
import pytest
import scipy

import magshell as ms

pytest.importorskip("viser")
sync_api = pytest.importorskip("playwright.sync_api")

PATH = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None
)
if PATH is None:
    pytest.skip("there is no Chromium", allow_module_level=True)

WITHOUT_GPU = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
WINDOW = {"width": 640, "height": 420}
TIMEOUT = 120.0  # [s] a busy machine without a graphics card takes long to paint
DRAGGED = 0.012  # [m]


@pytest.fixture
def page():
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=PATH, args=WITHOUT_GPU)
        page = browser.new_page(viewport=WINDOW)
        page.set_default_timeout(1e3 * TIMEOUT)
        yield page
        browser.close()


def until(page, condition):
    """Wait until a condition holds, while the browser goes on."""
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end, "the browser did not answer"
        page.wait_for_timeout(50)


def client_of(page, view):
    page.goto(view.url)
    until(page, view._server.get_clients)
    client = next(iter(view._server.get_clients().values()))
    wanted = view._server.initial_camera
    until(page, lambda: np.allclose(client.camera.position, wanted.position, atol=1e-3))
    return client


def on_screen(camera, points):
    """Return the pixels (n, 2) at which a camera sees points (n, 3) of the browser."""
    rotation = scipy.spatial.transform.Rotation.from_quat(camera.wxyz, scalar_first=True)
    seen = rotation.inv().apply(np.asarray(points) - camera.position)
    focal = 0.5 * WINDOW["height"] / np.tan(0.5 * camera.fov)
    return 0.5 * np.array([WINDOW["width"], WINDOW["height"]]) + focal * seen[:, :2] / seen[:, 2:]


def brightness(picture, pixels):
    """Return the mean brightness 0 to 255 of the darkest pixels within 2 of each of some pixels."""
    grey = np.where(
        picture[..., 3] > 0, picture[..., :3].mean(axis=-1), 255.0
    )  # nothing is drawn where alpha is 0
    darkest = scipy.ndimage.minimum_filter(grey, size=5)
    columns, rows = np.round(pixels).astype(int).T
    return darkest[rows, columns].mean()


def picture_of(client):
    return client.get_render(WINDOW["height"], WINDOW["width"], transport_format="png", timeout=TIMEOUT)


def rested_equilibrium(page, view, since):
    """Wait until the equilibrium is another than `since`, and no newer one comes for three seconds; return it."""
    until(page, lambda: view.equilibrium is not since)
    last = None
    while last is not view.equilibrium:
        last = view.equilibrium
        page.wait_for_timeout(3000)
    return last


def test_sheet_follows_a_magnet_dragged_by_the_mouse(page):
    mesh = ms.meshes.rectangle(0.04, 0.02, cells=(8, 4))
    sheet = ms.Shell(mesh, thickness=0.5e-3, young_modulus=1e6)
    magnet = ms.CylinderMagnet(4e-3, 8e-3, (0, 0, 9e5), center=(0.04, 0.01, -0.06))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=magnet)
    magnetization = {"remanent_magnetization": (0, 0, 5e4)}
    edge, style = mesh.vertices_at(x=0.04), ms.Style(arrows=False)
    edge = edge[
        np.abs(mesh.rest_positions[edge, 1] - 0.01) < 8e-3
    ]  # without corners, where other edges begin
    with ms.show(scene, **magnetization, color=None, view=(20, -70), style=style, browser=False) as view:
        client = client_of(page, view)
        camera, stage, gizmo = client.camera, view._stage, view._gizmos[0]
        before, first = view.equilibrium, picture_of(client)
        [start] = on_screen(camera, np.add([gizmo.handle.position], [0, 0, 0.7 * gizmo.handle.scale]))
        page.mouse.move(*start)
        page.wait_for_timeout(500)  # the arrow lights up in the next frame
        page.mouse.down()
        for pixels in range(4, 200, 4):
            page.mouse.move(start[0], start[1] - pixels)
            page.wait_for_timeout(100)
            if gizmo.movable.center[2] > magnet.center[2] + DRAGGED:
                break
        page.mouse.up()
        after, center = rested_equilibrium(page, view, before), gizmo.movable.center
        second = picture_of(client)
        edges = [on_screen(camera, stage.to_view(each.positions[edge])) for each in (before, after)]
    assert np.allclose(center[:2], magnet.center[:2], atol=1e-6)  # it was drawn along its arrow
    assert center[2] > magnet.center[2] + DRAGGED
    wanted = ms.equilibrium(scene, **magnetization, values={magnet: {"center": center}})
    assert np.abs(after.positions - wanted.positions).max() < 0.02 * np.abs(after.displacements).max()
    # The dark outline of the free edge left its place on the screen, and is where the equilibrium says.
    assert np.linalg.norm(edges[1] - edges[0], axis=1).min() > 8.0
    assert brightness(first, edges[0]) < 150.0 < brightness(first, edges[1])
    assert brightness(second, edges[1]) < 150.0 < brightness(second, edges[0])


def test_state_of_a_motion_is_chosen_by_the_slider(page):
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    rising = np.stack([np.add(mesh.rest_positions, [0, 0, 1e-3 * step]) for step in range(11)])
    with ms.show(mesh, positions=rising, times=0.1 * np.arange(11), browser=False) as view:
        client_of(page, view)
        slider = page.get_by_role("slider").first
        slider.focus()
        for _ in range(3):
            slider.press("ArrowRight")
        until(page, lambda: view.state == 3)
        page.get_by_role("checkbox", name="play").first.check(force=True)
        until(page, lambda: view.state > 4)
