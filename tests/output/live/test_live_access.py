"""Who can read and drive a live view: pages of other origins, without the token or with another Host, cannot; poses that are
none leave it alone."""

import asyncio
import http.client
from urllib.parse import urlsplit

import numpy as np
import pytest

import magshell as ms
from magshell.output.live.guard import Guard

viser = pytest.importorskip("viser")
websockets = pytest.importorskip("websockets")
msgspec = pytest.importorskip("msgspec")

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
SHEET = ms.Shell(MESH, thickness=0.5e-3, young_modulus=1e6)
MAGNET = ms.CuboidMagnet((0.01, 0.01, 0.01), (0, 0, 9e5), center=(0.04, 0.005, -0.045))
SCENE = ms.Scene(SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=MAGNET)
UNIT = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture
def view():
    with ms.show(SCENE, remanent_magnetization=(0, 0, 5e4), browser=False) as view:
        yield view


async def dragged(url, handled, position, wxyz, options):
    message = {
        "type": "TransformControlsUpdateMessage",
        "name": "/sources/0",
        "wxyz": wxyz,
        "position": position,
        "owner": "",
    }
    address = url.replace("http", "ws", 1).rstrip("/")
    protocols = [f"viser-v{viser.__version__}"]
    async with websockets.connect(address, max_size=None, subprotocols=protocols, **options) as socket:
        data = await asyncio.wait_for(socket.recv(), 60.0)
        await socket.send(msgspec.msgpack.encode(message))
        for _ in range(1200):
            if handled():
                break
            await asyncio.sleep(0.05)
        return len(data)


def drag(url, handled, position, wxyz=UNIT, **options):
    """Move the magnet as a browser does, until `handled()`; return the number of bytes that came first."""
    return asyncio.run(dragged(url, handled, position, wxyz, options))


def handle_of(view):
    return np.array(view._gizmos[0].handle.position)


def test_page_of_the_view_drives_it(view):
    wanted, before = handle_of(view) + np.array([0, 0, 0.1]), view.equilibrium
    origin = "http://" + urlsplit(view.url).netloc
    assert drag(view.url, lambda: view.equilibrium is not before, tuple(wanted.tolist()), origin=origin) > 0
    assert view.equilibrium is not before


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "http://127.0.0.1:1"])
def test_page_of_another_origin_is_refused(view, origin):
    before = view.equilibrium
    with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
        drag(view.url, lambda: True, tuple(handle_of(view).tolist()), origin=origin)
    assert view.equilibrium is before


def test_address_without_the_token_is_refused(view):
    address = view.url.replace(view.url.rstrip("/").rpartition("/")[2], "0" * 32)
    for url in (address, "http://" + urlsplit(view.url).netloc):
        with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
            drag(url, lambda: True, (0.0, 0.0, 0.0))


def status(view, path, **headers):
    connection = http.client.HTTPConnection(urlsplit(view.url).netloc, timeout=60)
    connection.request("GET", path, headers=headers)
    found = connection.getresponse().status
    connection.close()
    return found


def test_page_is_served_under_its_own_name_and_token_only(view):
    path = urlsplit(view.url).path
    assert status(view, path) == 200
    assert status(view, "/") == 403
    assert status(view, path, Host="evil.example") == 403
    assert status(view, path, Host="localhost:8080") == 200


@pytest.mark.parametrize(
    ("position", "wxyz", "message"),
    [
        ((1e300, 0.0, 0.0), UNIT, "times their size"),
        ((float("nan"), 0.0, 0.0), UNIT, "position"),
        (None, (0.0, 0.0, 0.0, 0.0), "quaternion of length 1"),
    ],
)
def test_pose_that_is_none_leaves_the_view_alone(view, position, wxyz, message):
    before, at = view.equilibrium, handle_of(view)
    position = tuple(at.tolist()) if position is None else position
    drag(view.url, lambda: message in view.message, position, wxyz)
    assert message in view.message
    assert view.equilibrium is before
    np.testing.assert_array_equal(handle_of(view), at)
    nearer = view.move(MAGNET, center=(0.04, 0.005, -0.044))
    assert view.equilibrium is nearer


def test_move_refuses_a_center_that_is_far_away(view):
    with pytest.raises(ValueError, match="times their size"):
        view.move(MAGNET, center=(1e300, 0, 0))


def test_guard_of_a_view_for_others_takes_their_names_but_no_other_origin():
    guard = Guard("0.0.0.0")
    path = f"/{guard.token}/"
    assert guard.refusal(path, [("Host", "desk.lab:8080"), ("Origin", "http://desk.lab:8080")]) == ""
    assert "another origin" in guard.refusal(
        path, [("Host", "desk.lab:8080"), ("Origin", "http://evil.example")]
    )
    assert "token" in guard.refusal("/", [("Host", "desk.lab:8080")])
    assert "one Host" in guard.refusal(path, [("Host", "a"), ("Host", "b")])
    assert guard.without_token(f"/{guard.token}/assets/a.js") == "/assets/a.js"
    assert guard.without_token(f"/{guard.token}") == "/"
