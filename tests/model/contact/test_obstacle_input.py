"""Errors of obstacles for bad input, and how they print."""

import numpy as np
import pytest
from obstacle_shapes import torus

import magshell as ms
from magshell import obstacles as ob

BALL = ms.meshes.spherical_cap(1.0, 0.0, np.pi, cells=(16, 8))
CAP = ms.meshes.spherical_cap(1.0, 0.0, np.pi / 2, cells=(16, 8))
LINE = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]


def two(first, second, shift):
    """Return one mesh of two, the second moved along x [m]."""
    return (
        np.concatenate([first.rest_positions, second.rest_positions + np.array([shift, 0, 0])]),
        np.concatenate([first.faces, second.faces + first.n_vertices]),
    )


def unwelded():
    """Return a cube of six squares that do not share their corners."""
    vertices, faces = ob.Box((1, 1, 1)).surface()
    apart = vertices[faces].reshape(-1, 3)
    return apart, np.arange(len(apart)).reshape(-1, 3)


def with_nan():
    vertices = BALL.rest_positions.copy()
    vertices[7, 2] = np.nan
    return vertices, BALL.faces


def doubled():
    return BALL.rest_positions, np.concatenate([BALL.faces, BALL.faces[:1]])


def three_on_an_edge():
    fin = np.concatenate([BALL.rest_positions, [[3.0, 0, 0]]])
    a, b = BALL.faces[0, :2]
    return fin, np.concatenate([BALL.faces, [[a, b, len(fin) - 1]]])


def flat():
    square = ms.meshes.rectangle(1.0, 1.0, cells=(2, 2))
    back = square.faces[:, ::-1] + square.n_vertices
    vertices = np.concatenate([square.rest_positions, square.rest_positions + np.array([0, 0, 1e-12])])
    return vertices, np.concatenate([square.faces, back])


BAD_INPUT = {
    "no normal": (lambda: ob.Plane((0, 0, 0)), "normal must not be zero"),
    "normal in a plane": (lambda: ob.Plane((0, 1)), r"normal \[1\] must have shape \(3,\), got \(2,\)"),
    "vertical slope": (lambda: ob.slope(np.pi / 2), r"angle \[rad\] must lie between -pi/2 and pi/2"),
    "slope that rises nowhere": (lambda: ob.slope(0.1, uphill=(0, 0)), "uphill must not be zero"),
    "center in a plane": (
        lambda: ob.Plane(center=(0, 0)),
        r"center \[m\] must have shape \(3,\), got \(2,\)",
    ),
    "infinite rotation": (
        lambda: ob.Plane(rotation=(0, np.inf, 0)),
        r"rotation \[rad\] must be finite, but rotation\[1\] is inf",
    ),
    "no radius": (lambda: ob.Sphere(0.0), r"radius \[m\] must be positive, got 0"),
    "radius of NaN": (lambda: ob.Sphere(np.nan), r"radius \[m\] must be finite"),
    "inside what": (lambda: ob.Sphere(1.0, inside="yes"), "inside must be True or False, got 'yes'"),
    "flat box": (lambda: ob.Box((1, 0, 1)), r"size \[m\] must be positive, but size\[1\] is 0"),
    "cube by one number": (lambda: ob.Box(1.0), r"size \[m\] must have shape \(3,\), got \(\)"),
    "too round": (
        lambda: ob.Box((1, 0.4, 1), rounding=0.3),
        r"rounding \[m\] must lie between 0 and half the shortest side, 0.2, got 0.3",
    ),
    "negative rounding": (lambda: ob.Box((1, 1, 1), rounding=-0.1), "rounding .* got -0.1"),
    "capsule without a length": (lambda: ob.Capsule([[1, 2, 3]] * 2, 0.1), "ends .* two different points"),
    "capsule of negative length": (lambda: ob.Capsule(-1.0, 0.1), r"ends \[m\] must be positive, got -1"),
    "tube of a point": (lambda: ob.Tube([[0, 0, 0]], 0.1), r"points \[m\] must be at least two, got 1"),
    "tube that stands still": (
        lambda: ob.Tube([*LINE, LINE[-1]], 0.1),
        "points 2 and 3 are the same",
    ),
    "tube with too few radii": (
        lambda: ob.Tube(LINE, [0.1, 0.2]),
        r"radius \[m\] must have shape \(3,\), got \(2,\)",
    ),
    "tube with a negative radius": (lambda: ob.Tube(LINE, [0.1, -0.2, 0.1]), r"but radius\[1\] is -0.2"),
    "tube that closes between its points": (
        lambda: ob.Tube([[x, 0, 0] for x in range(6)], [0.3, 0.3, 0.02, 0.02, 0.3, 0.3]),
        r"the radius of the tube is -0.\d+ m near knot 2.25",
    ),
    "tube that widens faster than it goes": (
        lambda: ob.Tube(LINE, [0.1, 1.3, 2.5], closed=True),
        "changes by 1.2 m a knot while its center advances by 1 m",
    ),
    "ground with a row too few": (
        lambda: ob.HeightField([0, 1, 2], [0, 1], np.zeros((2, 2))),
        r"heights \[m\] must have shape \(3, 2\), got \(2, 2\)",
    ),
    "ground of a line": (lambda: ob.HeightField([0], [0, 1], [[0, 0]]), "x .* at least two entries, got 1"),
    "ground backwards": (
        lambda: ob.HeightField([0, 2, 1], [0, 1], np.zeros((3, 2))),
        r"x \[m\] must rise, but x\[1\] = 2 and x\[2\] = 1",
    ),
    "ground in unequal steps": (
        lambda: ob.HeightField([0, 1], [0, 1, 3], np.zeros((2, 3))),
        r"y \[m\] must rise in equal steps of 1.5, but y\[1\] - y\[0\] is 1",
    ),
    "hole in the ground": (
        lambda: ob.HeightField([0, 1], [0, 1], [[0, 0], [np.nan, 0]]),
        r"heights\[1, 0\] is nan",
    ),
    "bump without a length": (lambda: ob.bump(0.1, 0.0), r"length \[m\] must be positive"),
    "infinite bump": (lambda: ob.bump(np.inf, 1.0), r"height \[m\] must be finite"),
    "open mesh": (
        lambda: ob.MeshObstacle(CAP),
        r"mesh is open: 16 edges have one face only, the first from vertex \d+ at \(.*\) to vertex \d+ .*; close it",
    ),
    "mesh in pieces": (
        lambda: ob.MeshObstacle(*unwelded()),
        r"mesh is open: 36 edges .*; vertices 0 and \d+ are both at \(.*\): make them one",
    ),
    "mesh inside out": (
        lambda: ob.MeshObstacle(BALL.flipped()),
        r"the obstacle's mesh is inside out, near vertex 0 at \(.*\): .* \.flipped\(\)",
    ),
    "one part inside out": (
        lambda: ob.MeshObstacle(*two(BALL, BALL.flipped(), 3.0)),
        "part 1 of the obstacle's mesh is inside out",
    ),
    "part within a part": (
        lambda: ob.MeshObstacle(*two(BALL, BALL.scaled(0.5), 0.1)),
        "part 1 of the obstacle's mesh lies inside another part",
    ),
    "the same body twice": (
        lambda: ob.MeshObstacle(*two(BALL, BALL, 0.0)),
        r"touches itself: vertices 0 and 114 are both at",
    ),
    "flat mesh": (
        lambda: ob.MeshObstacle(torus(ring=1, radius=1e-12, cells=(8, 3))),
        "encloses no volume|degenerate|touches itself",
    ),
    "mesh with NaN": (
        lambda: ob.MeshObstacle(*with_nan()),
        r"rest_positions \[m\] must be finite, but rest_positions\[7, 2\] is nan",
    ),
    "face twice": (lambda: ob.MeshObstacle(*doubled()), "face"),
    "three faces on an edge": (lambda: ob.MeshObstacle(*three_on_an_edge()), "edge"),
    "sheets that nearly touch": (lambda: ob.MeshObstacle(*flat()), "mesh is open: 16 edges"),
    "vertices without faces": (
        lambda: ob.MeshObstacle(np.zeros((4, 3))),
        "vertices .* together with faces, got ndarray",
    ),
    "faces twice": (lambda: ob.MeshObstacle(BALL, BALL.faces), "TriangleMesh has its own"),
    "resolution of a fraction": (
        lambda: ob.MeshObstacle(BALL, resolution=2.5),
        "resolution must be an integer, got 2.5",
    ),
    "resolution of one": (
        lambda: ob.MeshObstacle(BALL, resolution=1),
        "resolution must lie between 4 and 256, got 1",
    ),
    "motion that is an array": (
        lambda: ob.Plane(motion=np.zeros(3)),
        "motion must be None or a function .* ndarray",
    ),
    "motion to a number": (
        lambda: ob.Plane(motion=lambda t: t),
        r"motion\(0\) must return a displacement .*; got 0.0",
    ),
    "motion to nowhere": (lambda: ob.Plane(motion=lambda t: None), "must return a displacement .*; got None"),
    "motion in a plane of four": (lambda: ob.Plane(motion=lambda t: [0, 0, 0, 1]), "got 4 entries"),
    "motion to NaN": (
        lambda: ob.Plane(motion=lambda t: [0, np.nan, 0]),
        r"motion\(0\) \[m\] must be finite, but motion\(0\)\[1\] is nan",
    ),
    "motion with a matrix": (
        lambda: ob.Plane(motion=lambda t: ([0, 0, 0], np.eye(3))),
        r"the rotation vector of motion\(0\) \[rad\] must have shape \(3,\), got \(3, 3\)",
    ),
    "motion of two numbers": (
        lambda: ob.Plane(motion=lambda t: [0, 0]),
        r"the displacement of motion\(0\) \[m\] must have shape \(3,\), got \(\)",
    ),
    "motion that fails later": (
        lambda: ob.Plane(motion=lambda t: [0, 0, 1 if t < 1 else np.inf]).signed_distance([0, 0, 0], time=2),
        r"motion\(2\)\[2\] is inf",
    ),
    "points in a plane": (
        lambda: ob.Plane().signed_distance([[0, 1]]),
        r"points \[m\] must have shape \(..., 3\)",
    ),
    "another radius": (
        lambda: ob.Sphere(1.0).replaced(radius=2.0),
        "center and rotation can be replaced, not radius",
    ),
    "another center of the wrong shape": (
        lambda: ob.Sphere(1.0).replaced(center=1.0),
        r"center \[m\] must have shape",
    ),
}


@pytest.mark.parametrize("case", BAD_INPUT)
def test_bad_input_is_named(case):
    make, message = BAD_INPUT[case]
    with pytest.raises(ValueError, match=message):
        make()


def test_missing_file_is_missing(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"rock\.ply"):
        ob.MeshObstacle(tmp_path / "rock.ply")


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_a_mesh_from_a_file(tmp_path):
    ms.write_mesh(tmp_path / "ball.ply", BALL)
    points = np.array([[0.5, 0, 0], [1.2, 0, 0]])
    read, given = ob.MeshObstacle(tmp_path / "ball.ply", resolution=16), ob.MeshObstacle(BALL, resolution=16)
    np.testing.assert_allclose(read.signed_distance(points), given.signed_distance(points), atol=1e-12)


@pytest.mark.parametrize(
    ("obstacle", "text"),
    [
        (ob.Plane(), "Plane(normal (0, 0, 1))"),
        (ob.slope(np.pi / 6, uphill=(0, 2)), "Plane(normal (0, -0.5, 0.866))"),
        (
            ob.Sphere(0.5, inside=True, center=(0, 0, 1)),
            "Sphere(radius 0.5 m, bodies inside, center (0, 0, 1) m)",
        ),
        (ob.Box((1, 2, 3), rounding=0.1), "Box(1 x 2 x 3 m, edges rounded by 0.1 m)"),
        (
            ob.Capsule(0.2, 0.1, rotation=(0, 0, 1), motion=lambda t: [t, 0, 0]),
            "Capsule(length 0.2 m, radius 0.1 m, rotation (0, 0, 1) rad, moving)",
        ),
        (ob.Tube(LINE, [0.1, 0.2, 0.1]), "Tube(3 points, radius 0.1 to 0.2 m, open, bodies inside)"),
        (
            ob.Tube(LINE, 0.1, inside=False, closed=True),
            "Tube(3 points, radius 0.1 m, closed, bodies outside)",
        ),
        (ob.bump(0.1, 1.0), "HeightField(97 x 2 heights on 1.5 x 1.5 m, 0 to 0.1 m)"),
        (
            ob.MeshObstacle(BALL, resolution=8),
            "MeshObstacle(224 faces, 2 x 2 x 2 m, 8 cells along the longest side)",
        ),
    ],
)
def test_obstacles_print_what_they_are(obstacle, text):
    assert repr(obstacle) == text


def test_obstacles_keep_their_own_copies():
    center = np.zeros(3)
    plane = ob.Plane(center=center)
    center[2] = 1.0
    assert plane.signed_distance([0, 0, 0]) == 0
    with pytest.raises(ValueError, match="read-only"):
        plane.center[2] = 1.0
