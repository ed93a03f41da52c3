"""The hand, with few iterations: shape, gestures, designs, and the transfer of designs between meshes."""

import numpy as np
import pytest
import torch
from example_modules import load

import magshell as ms

GESTURE = "pinch"


@pytest.fixture(scope="module")
def parts():
    load("gesturing_hand")
    from _hand import design, gestures, shape

    return design, gestures, shape


@pytest.fixture(scope="module")
def body(parts):
    return parts[0].Body(4975, "linear")


@pytest.fixture(scope="module")
def design(parts, body):
    return parts[0].designed(body, GESTURE, 12)


def test_the_hand_has_the_papers_counts(parts, body) -> None:
    """Check the number of tetrahedra, and the finer mesh that has the paper's number of faces."""
    mesh = body.solid.mesh
    assert mesh.n_tetrahedra == pytest.approx(4975, rel=0.03)
    assert mesh.n_components == 1
    example = load("gesturing_hand")
    fine = parts[0].Body(example.OF_ITS_FACES, "linear").solid.mesh
    assert fine.n_faces == pytest.approx(3320, rel=0.03)
    for each in (mesh, fine):  # a ball with no handles: no fingers grew together
        surface = each.surface
        assert surface.n_vertices - surface.n_edges + surface.n_faces == 2


def test_curled_fingers_keep_their_length_and_sections(parts) -> None:
    _, gestures, shape = parts
    finger = shape.FINGERS[2]
    along, to_palm, aside = finger.frame
    s = np.linspace(0, finger.length, 400)
    axis = gestures.curled(finger.root + s[:, None] * along, finger, np.pi / 2, 0.0)
    assert np.linalg.norm(np.diff(axis, axis=0), axis=1).sum() == pytest.approx(finger.length, rel=1e-5)
    last = axis[-1] - axis[-2]
    np.testing.assert_allclose(last / np.linalg.norm(last), to_palm, atol=5e-3)  # turned by 90 degrees
    rim = finger.root + 0.7 * finger.length * along + 0.003 * np.stack([to_palm, aside, -to_palm, -aside])
    curled = gestures.curled(rim, finger, 1.2, 0.3)
    np.testing.assert_allclose(np.linalg.norm(curled - curled.mean(axis=0), axis=1), 0.003, rtol=1e-9)
    np.testing.assert_array_equal(gestures.curled(rim, finger, 0.0, 0.0), rim)


def test_the_design_reaches_its_anchors(parts, body, design) -> None:
    anchors = body.anchors(GESTURE)
    rest = body.solid.mesh.rest_positions[anchors.vertices]
    way = parts[0].rms(np.linalg.norm(rest - anchors.targets, axis=1))
    assert way > 5e-3
    assert design.rms_distance < 1.6e-3  # 0.97 mm after 40 iterations
    assert np.linalg.norm(design.remanent_magnetization, axis=1).max() < 3e5
    assert design.rms_distance == pytest.approx(design.rms_history.min(), rel=1e-3)
    assert (anchors.fingers[:, None] == np.arange(5)).sum(axis=0).min() >= 8


def test_gradient_against_differences(parts, body) -> None:
    """Compare the gradient of the anchors' distances by the skin's magnetization with differences along a random
    direction.
    """
    anchors, skin = body.anchors(GESTURE), body.solid.skin
    generator = torch.Generator().manual_seed(1)
    shape = (len(skin.faces), 3)
    at, direction = (3e4 * torch.randn(shape, generator=generator, dtype=torch.float64) for _ in "ab")

    def objective(magnetization):
        rest = ms.equilibrium(
            body.scene,
            applied_flux_density=parts[0].FLUX_DENSITY,
            values={skin: {"remanent_magnetization": magnetization}},
        )
        positions = torch.as_tensor(rest.positions)
        return ms.objectives.shape_matching(positions, torch.tensor(anchors.targets), anchors.vertices)

    (gradient,) = torch.autograd.grad(objective(at.requires_grad_()), at)
    step = 1e-3
    with torch.no_grad():
        values = [float(objective(at + sign * step * direction)) for sign in (1, -1)]
    slope = float((gradient * direction).sum())
    assert (values[0] - values[1]) / (2 * step) == pytest.approx(slope, rel=1e-5)


def test_a_magnetization_carried_to_another_mesh(parts, body) -> None:
    from _solid_designs.transfer import face_centers, transferred

    quadratic = parts[0].Body(4975, "quadratic")
    centers = face_centers(body.solid)
    there = transferred(centers, body.solid, quadratic.solid)
    assert there.shape == (4 * len(centers), 3)
    gap = np.linalg.norm(there - face_centers(quadratic.solid), axis=1)
    assert gap.max() < body.solid.mesh.surface.edge_lengths.max()
    middle = quadratic.faces[
        np.arange(len(there))
    ]  # each quarter has the nearest face: its own or a neighbour
    assert (np.linalg.norm(centers[middle] - there, axis=1) < 1e-12).mean() > 0.6
    with pytest.raises(ValueError, match="a row for each of"):
        transferred(centers[:5], body.solid, quadratic.solid)


def test_the_report_and_its_pictures(parts, design, monkeypatch) -> None:
    """Use states on the same mesh in place of a converged one, whose solve takes long."""
    example = load("gesturing_hand")
    state = parts[0].on(design.body, design)
    assert state.rms_distance == pytest.approx(
        design.rms_distance, rel=1e-6
    )  # the same mesh, the field raised from zero
    names = ("linear", "linear, the paper's faces", "quadratic")
    result = {
        GESTURE: {
            "designs": dict.fromkeys(names, design),
            "converged": {"linear": state, "quadratic": state},
            "way": 7e-3,
        }
    }
    assert "on the converged mesh" in example.summary(result)
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    assert len(example.plot(result).axes) == 2
    assert len(example.hands(result).axes) == 4


def test_main_returns_every_design() -> None:
    result = load("gesturing_hand").main(
        gestures=(GESTURE,), of_its_faces=4975, converged=4975, iterations=(1, 1)
    )
    entry = result[GESTURE]
    assert list(entry["designs"]) == ["linear", "linear, the paper's faces", "quadratic"]
    assert list(entry["converged"]) == ["linear", "quadratic"]
    for design in entry["designs"].values():
        assert design.rms_distance < 0.95 * entry["way"]
