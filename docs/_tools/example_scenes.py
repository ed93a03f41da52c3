"""The pictures of the other examples: each function computes one at a size that takes seconds, and says how it is seen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from front_page_scenes import ACCENT, SHEET, SOLID, Scene, between
from painter import Body, Camera, Film, boundary

import magshell as ms
from magshell.output.results.spring_surfaces import tube

_QUARTERS = ((1, 0), (0, 1), (-1, 0), (0, -1))  # cosines and sines of quarter turns
FRAMES = 20  # of a motion


def shown(
    positions: Any,
    parts: list[tuple[np.ndarray, Any]],
    view: tuple[float, float],
    *,
    ground: float | None = None,
    outlined: bool = True,
    opacity: float = 1.0,
    crease: float = 50.0,
    **playback: Any,
) -> dict[str, Any]:
    """Return the shapes of a picture: positions (n, n_v, 3) m, and the faces and colours of its parts.

    view: elevation and azimuth, degrees. ground: z of the ground, m. outlined: whether boundaries of sheets are lines.
    opacity, crease: as of a Body. playback: `held` and `back` of a Film.
    """
    return {
        "positions": np.asarray(positions),
        "parts": parts,
        "view": view,
        "ground": ground,
        "outlined": outlined,
        "look": {"opacity": opacity, "crease": crease},
        **playback,
    }


def film(data: dict[str, Any]) -> Film:
    """Return the film of what `shown` describes, with a camera that contains all of it."""
    camera = Camera.around(
        data["positions"].reshape(-1, 3), *data["view"], data["ground"]
    )
    frames = []
    for positions in data["positions"]:
        bodies = []
        for faces, color in data["parts"]:
            used, numbers = np.unique(faces, return_inverse=True)
            own = numbers.reshape(-1, 3)
            shades = (
                color
                if isinstance(color, str) or len(color) == len(faces)
                else color[used]
            )
            lines = boundary(own) if data["outlined"] else None
            look = data["look"]
            bodies.append(Body(positions[used], own, shades, lines=lines, **look))
        frames.append(bodies)
    return Film(camera, frames, held=data.get("held", 1), back=data.get("back", False))


def some(
    positions: np.ndarray, last: int | None = None, count: int = FRAMES
) -> np.ndarray:
    """Return evenly spaced states of a motion, up to the number `last`."""
    end = len(positions) - 1 if last is None else last
    return positions[np.linspace(0, end, min(count, end + 1)).astype(int)]


def bistable_beam() -> dict[str, Any]:
    from _bistable.model import HIGHEST_FIELD, beam, buckled

    sheet = beam((24, 4))
    start = buckled(sheet)
    path = sheet.follow(HIGHEST_FIELD, start=start, max_step=0.002, min_parameter=-1.0)
    first = path.critical[0]
    snapped = sheet.equilibrium(
        1.05 * HIGHEST_FIELD * first.parameter, start=first.positions
    )
    before = path.positions[: first.after_point + 1]
    states = [*some(before, count=12), first.positions, snapped.positions]
    return shown(states, [(sheet.scene.mesh.faces, SHEET)], (22, -65), held=12)


def bistable_in_time() -> dict[str, Any]:
    from _bistable.model import beam
    from _bistable.motion import ramp

    sheet = beam((24, 4))
    pulled = ramp(sheet, 2e-3)
    near = np.flatnonzero(np.abs(pulled.times - pulled.snap) < 0.06)
    states = pulled.trajectory.positions[near[:: max(1, len(near) // 26)]]
    return shown(states, [(sheet.scene.mesh.faces, SHEET)], (22, -65), held=10)


def snap_design() -> dict[str, Any]:
    import snap_design as example
    import torch

    beam = example.Beam((24, 4))
    design = torch.tensor(example.search(beam)["designs"][-1])
    path = beam.snaps(design).path
    states = some(np.asarray(path.positions)[path.stable], count=24)
    return shown(states, [(beam.mesh.faces, SHEET)], (14, -70), held=4, back=True)


def topology() -> dict[str, Any]:
    import topology as example
    import torch

    arm = example.Arm((48, 24))
    design = example.search(arm, iterations=12)
    tensors = [torch.tensor(design[name]) for name in ("densities", "magnetization")]
    states = [design["positions"][1]]  # without the field
    with torch.no_grad():
        for strength in np.linspace(0.0, 1.0, 20)[1:]:
            arm.heights(
                tensors[0],
                strength * tensors[1],
                torch.tensor(design["angle"]),
                example.SHARPNESSES[-1],
            )
            states.append(np.asarray(arm.equilibria[0].positions))
    size = np.linalg.norm(design["magnetization"][design["faces"]], axis=1)
    colors = between("#3d4f9f", "#f2c14e", size / size.max())
    return shown(states, [(design["mesh"].faces, colors)], (24, -60), held=6, back=True)


def banner() -> dict[str, Any]:
    import banner

    rest = banner.main(word="SHELL", cells=32, iterations=30)["rest"]
    mesh = rest.scene.mesh
    height = rest.positions[:, 2] / 5e-3
    return shown(
        [rest.positions],
        [(mesh.faces, between("#3d4f9f", "#f2c14e", height))],
        (48, -85),
    )


def kirigami_tower() -> dict[str, Any]:
    from _kirigami.checks import solve
    from _kirigami.design import SEARCHES
    from _kirigami.model import kirigami

    sheet = kirigami()
    design = SEARCHES[0].run(sheet, iterations=20)["remanent_magnetization"]
    floor, rest, states = kirigami(with_contact=True), None, []
    for share in np.linspace(0.0, 1.0, 8):
        rest = solve(floor, design, share, start=rest)
        states.append(rest.positions)
    return shown(
        states, [(floor.mesh.faces, SHEET)], (24, -70), ground=-5e-4, held=10, back=True
    )


def kirigami_reaching() -> dict[str, Any]:
    import kirigami_reaching

    found = kirigami_reaching.main(targets=2, each=0.6, delay=0.4, iterations=6)
    states = some(found["found"]["positions"], count=13)
    goals = [_ball(np.array(target), 1.2e-3) for target in found["targets"]]
    return _with_still(
        shown(states, [(found["mesh"].faces, SHEET)], (20, -70), held=8),
        [(points, faces, ACCENT) for points, faces in goals],
    )


def track_fitting() -> dict[str, Any]:
    import track_fitting

    found = track_fitting.main(
        cells=(12, 4), tasks=("C",), methods=("ours",), iterations=25
    )
    fit = found["fits"]["C"]["ours"]
    path = _wire(fit.track[fit.task.first :], 0.3e-3)
    data = shown(
        some(fit.positions),
        [(found["strip"].scene.mesh.faces, SHEET)],
        (14, -62),
        held=8,
    )
    return _with_still(data, [(*path, ACCENT)])


def bending_twisting() -> dict[str, Any]:
    import bending_twisting
    from _bending.strip import strip

    sheet = strip((32, 4))
    move = bending_twisting.twisted(sheet, 5.0)["motion"]
    return shown(
        some(move.positions, count=24),
        [(sheet.mesh.faces, SHEET)],
        (22, -60),
        back=True,
    )


def reptile() -> dict[str, Any]:
    import reptile

    who, move = reptile.walk("flat", 2, 2e-4)
    last = move.positions[len(move.positions) // 2 :]
    return shown(
        some(last), [(who.scene.mesh.faces, "#5f9e6e")], (24, -60), ground=-5e-4
    )


def beating_heart() -> dict[str, Any]:
    from _heart.beating import PERIOD, beating
    from _heart.design import designed
    from _heart.shape import Heart
    from _heart.task import Task

    task = Task(Heart.of(), "lower_half", "linear")
    found = beating(designed(task, 8), 2)
    states = found.motion.positions[
        found.motion.times >= found.motion.times[-1] - PERIOD
    ]
    mesh = task.solid.mesh
    colors = np.tile((0.85, 0.62, 0.52), (len(mesh.faces), 1))
    colors[task.heart.lower_half] = (0.72, 0.25, 0.27)
    return shown(
        some(states), [(mesh.faces, colors)], (12, -20), outlined=False, crease=120.0
    )


def muscle_strip() -> dict[str, Any]:
    import muscle_strip

    move = muscle_strip.swim((18, 4, 2), 100, 2e-2, 0.16)["move"]
    return shown(
        some(move.positions[50:], count=24),
        [(_faces(move, 0), SOLID)],
        (20, -65),
        outlined=False,
    )


def pneumatic_finger() -> dict[str, Any]:
    import pneumatic_finger

    found = pneumatic_finger.main()
    states = some(found["path"].positions, count=12)
    return shown(
        states,
        [(found["solid"].mesh.faces, SOLID)],
        (14, -68),
        outlined=False,
        opacity=0.55,
        held=6,
        back=True,
    )


def tendon_arm() -> dict[str, Any]:
    from tendon_arm import PULLS, arm

    solid, tendons = arm()
    held = ms.Pin(solid.mesh.vertices_at(x=0.0))
    at_rest = ms.WarmStart(ms.Scene(solid, supports=[held], actuators=tendons))
    states = [
        at_rest(values={tendons[0]: {"tension": pull}}).positions
        for pull in np.linspace(0.0, 5.0 * max(PULLS), 14)
    ]
    parts = [(solid.mesh.faces, SOLID)]
    return shown(states, parts, (16, -68), outlined=False, held=4, back=True)


def ball_on_sheet() -> dict[str, Any]:
    from _ball.model import THROWS, scenery

    scene = scenery(THROWS[0], 16, 6)
    move = scene.thrown(THROWS[0], 80)
    ball, sheet = scene.ball.mesh, scene.sheet.mesh
    parts = [(ball.faces, SOLID), (sheet.faces + ball.n_vertices, SHEET)]
    return shown(some(move.positions, count=26), parts, (16, -65), held=4)


def bridges() -> dict[str, Any]:
    from _bridges.search import found_by_gradient
    from _bridges.shape import suspension
    from _bridges.task import Task

    task = Task(suspension())
    found = found_by_gradient(task)
    move = task.motion(found.unknowns)
    return shown(
        move.positions,
        [(task.solid.mesh.faces, SOLID)],
        (16, -62),
        outlined=False,
        held=8,
    )


def humanoid() -> dict[str, Any]:
    from _humanoid.body import Body
    from _humanoid.fall import Figure, fallen, starts

    figure = Figure(Body.of(), "driven")
    move = fallen(figure, starts(1)[0], 100).motion
    states = some(move.positions, count=24)
    return shown(
        states,
        [(figure.body.mesh.faces, SOLID)],
        (10, -70),
        ground=0.0,
        outlined=False,
        crease=120.0,
        held=10,
    )


def fish() -> dict[str, Any]:
    from fish import STARTS, STEPS, TARGET
    from robots.fish import Fish

    return _robot(Fish(), STEPS, TARGET, STARTS[0], (30, -60), "#e39a4a")


def muscle_octopus() -> dict[str, Any]:
    from muscle_octopus import CELLS, STARTS, TARGET
    from robots.muscle_octopus import MuscleOctopus

    return _robot(MuscleOctopus(CELLS), 200, TARGET, STARTS[0], (12, -65), "#b5485d")


def cell_gripper() -> dict[str, Any]:
    from cell_gripper import BALL_CELLS, LEVELS, STARTS, STEPS, TARGET
    from robots.cell_gripper import CellGripper

    return _robot(
        CellGripper(LEVELS, BALL_CELLS), STEPS, TARGET, STARTS[0], (10, -62), SHEET
    )


def pendulum_in_jelly() -> dict[str, Any]:
    import pendulum_in_jelly as example

    hanging = example.pendulum(12)
    move = example.let_go(hanging, np.pi / 2, example.STEPS, example.TIME_STEP)
    return shown(
        some(move.positions, count=24),
        [(hanging.bar.mesh.faces, SOLID)],
        (12, -72),
        outlined=False,
    )


def folding() -> dict[str, Any]:
    from _folding.model import coiling

    strip = coiling(60, 22)
    states = [state.positions for state in strip.states()]
    return shown(states, [(strip.scene.mesh.faces, SHEET)], (14, -70), held=10)


def identify() -> dict[str, Any]:
    from _identify.model import measured, sheet

    fields = np.repeat(measured((20, 12), 0.0, same_mesh=True), 10, axis=0)
    body = sheet((20, 12))
    modulus = np.log10(body.scene.shell.young_modulus)
    share = (modulus - modulus.min()) / np.ptp(modulus)
    return shown(
        fields,
        [(body.mesh.faces, between("#4f86c6", "#c8442d", share))],
        (26, -65),
        held=2,
    )


def relaxation_fit() -> dict[str, Any]:
    from relaxation_fit import PULLED, Test

    test = Test((8, 2, 2), np.array([1.0]))
    pull = test.move(3e5, 0.1, 20.0).positions[test.ends <= PULLED]
    return shown(
        pull,
        [(test.bar.mesh.faces, SOLID)],
        (20, -62),
        outlined=False,
        held=8,
        back=True,
    )


def shell_against_volume() -> dict[str, Any]:
    from _shell_against_volume.deformations import twisted
    from _shell_against_volume.energies import Plate
    from shell_against_volume import LENGTH, THICKNESS, WIDTH

    plate = Plate((LENGTH, WIDTH, THICKNESS), (32, 4), 2)
    states = [
        plate.volume_positions(twisted, angle) for angle in np.linspace(0.0, np.pi, 14)
    ]
    return shown(
        states,
        [(plate.solid.mesh.faces, SOLID)],
        (20, -62),
        outlined=False,
        held=6,
        back=True,
    )


def pinched_cylinder() -> dict[str, Any]:
    import pinched_cylinder as example

    only = {"cylinder": ((6, 6), (8, 8), (16, 16)), "hemisphere": None}
    result = example.main(**only)["cases"]["pinched cylinder"]["found"].result
    mesh, moved = result.scene.mesh, result.displacements
    sizes = np.log(np.repeat(mesh.element_areas, 4))
    shade = (sizes - sizes.min()) / np.ptp(sizes)
    states = [
        mesh.rest_positions + 60.0 * share / np.abs(moved).max() * moved
        for share in np.linspace(0.0, 1.0, 14)
    ]
    return shown(
        states,
        [(mesh.faces, between("#c8553d", "#c9d6e8", shade))],
        (28, 60),
        held=6,
        back=True,
    )


def tapered_arc() -> dict[str, Any]:
    import tapered_arc as example

    found, strip = example.main()["logarithms"], example.Strip((60, 4), 6e-3)
    states = [strip.positions(found, f).numpy() for f in np.linspace(0.0, 1.0, 16)]
    return shown(states, [(strip.mesh.faces, SHEET)], (24, -50), held=6, back=True)


def gripper_outline() -> dict[str, Any]:
    import gripper_outline as example
    import torch

    arm = example.Arm(1e-3)
    found = example.search(arm, True, True, 30)
    numbers = [torch.tensor(found[name]) for name in ("widths", "angles")]
    loads = np.linspace(0.0, 1.0, 16)
    single = [arm.closed(*numbers, f).positions.numpy() for f in loads]
    turns = [np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) for c, s in _QUARTERS]
    out = np.array([0.5 * numbers[0][0], 0, 0])
    states = [np.concatenate([(x + out) @ t.T for t in turns]) for x in single]
    faces = arm.outline.mesh.faces
    four = np.concatenate([faces + k * len(single[0]) for k in range(4)])
    return shown(states, [(four, SHEET)], (24, -60), held=6, back=True)


def _robot(
    robot: Any,
    steps: int,
    target: Any,
    start: dict,
    view: tuple[float, float],
    color: str,
) -> dict[str, Any]:
    """Find the controls of a robot in a few episodes, and show its motion."""
    from _robots.search import found_by_gradient

    found = found_by_gradient(
        robot, start, robot.first_controls(steps, **start), target, 8
    )
    move = robot.motion(found.controls)
    parts, begin = [], 0
    for body, shade in zip(robot.scene.bodies, (color, SOLID, ACCENT), strict=False):
        mesh = getattr(body, "mesh", None)
        if mesh is not None:
            parts.append((mesh.faces + begin, shade))
            begin += mesh.n_vertices
    upright = some(move.positions, count=24)[..., [2, 0, 1]]  # y points up in [Qiao21]
    return shown(
        upright,
        parts,
        view,
        outlined=False,
        crease=120.0,
        held=4,
    )


def _faces(move: ms.Trajectory, body: int) -> np.ndarray:
    return move.scene.bodies[body].mesh.faces


def _with_still(
    data: dict[str, Any], still: list[tuple[np.ndarray, np.ndarray, Any]]
) -> dict[str, Any]:
    """Add parts that do not move: points, faces and colour of each."""
    for points, faces, color in still:
        count = data["positions"].shape[1]
        repeated = np.broadcast_to(points, (len(data["positions"]), *points.shape))
        data["positions"] = np.concatenate([data["positions"], repeated], axis=1)
        data["parts"] = [*data["parts"], (faces + count, color)]
    return data


def _ball(center: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    surface = ms.meshes.ball(radius, cells=3).surface
    return surface.rest_positions + center, surface.faces


def _wire(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface of a tube around a line of points (n, 3) m."""
    return tube(points, radius, sides=8)


_COMPUTED: dict[str, tuple[str, Callable[[], dict[str, Any]]]] = {
    "bistable_beam": ("A buckled beam snaps to the other side", bistable_beam),
    "banner": ("A row of letters in one sheet", banner),
    "kirigami_tower": ("A cut disk rises to a tower", kirigami_tower),
    "track_fitting": ("The end of a strip follows an arc", track_fitting),
    "kirigami_reaching": ("The tip of a tower reaches two targets", kirigami_reaching),
    "bending_twisting": ("A strip follows a field that turns", bending_twisting),
    "bistable_in_time": ("The snap of the beam in slow motion", bistable_in_time),
    "snap_design": ("A beam snaps there and back at given fields", snap_design),
    "topology": ("An arm of found topology lifts a load", topology),
    "reptile": ("A sheet with eight legs crawls", reptile),
    "beating_heart": ("A hollow heart beats", beating_heart),
    "muscle_strip": ("A strip with two muscles swims", muscle_strip),
    "pneumatic_finger": ("A finger bends when it is inflated", pneumatic_finger),
    "tendon_arm": ("A soft bar is bent by a tendon", tendon_arm),
    "ball_on_sheet": ("A soft ball bounces off a sheet", ball_on_sheet),
    "bridges": ("A soft bridge sags", bridges),
    "humanoid": ("A soft figure lands on its feet and raises its arms", humanoid),
    "fish": ("A soft fish swims", fish),
    "muscle_octopus": ("An octopus with muscles swims", muscle_octopus),
    "cell_gripper": ("Arms of pneumatic cells carry a ball", cell_gripper),
    "pendulum_in_jelly": ("Two bones in jelly swing", pendulum_in_jelly),
    "folding": ("A strip coils up", folding),
    "identify": ("A sheet of uneven stiffness in three fields", identify),
    "relaxation_fit": ("A bar of silicone is pulled and held", relaxation_fit),
    "shell_against_volume": ("A plate of tetrahedra is twisted", shell_against_volume),
    "pinched_cylinder": ("A pinched cylinder on small elements", pinched_cylinder),
    "tapered_arc": ("A tapered strip bends to an arc", tapered_arc),
    "gripper_outline": ("Four arms of a designed outline close", gripper_outline),
}
SCENES = {
    name: Scene(words, compute, film) for name, (words, compute) in _COMPUTED.items()
}
