"""The six pictures of the front page, each made from one example in two steps: `compute` and `film`.

`compute` runs the example, or its part that is shown, and returns arrays; `film` says how they are painted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from painter import Body, Camera, Film, boundary

import magshell as ms

SHEET, SOLID, ACCENT = "#4f86c6", "#e8a33d", "#c8442d"


@dataclass(frozen=True)
class Scene:
    """A picture: how to compute its shapes from the example, and how to film them. words: its text for the blind."""

    words: str
    compute: Callable[[], dict[str, Any]]
    film: Callable[[dict[str, Any]], Film]


def colored(
    values: np.ndarray, low: float, high: float, name: str = "viridis"
) -> np.ndarray:
    """Return the colours (n, 3) of values between two limits."""
    from matplotlib import colormaps

    return colormaps[name](np.clip((values - low) / (high - low), 0.0, 1.0))[:, :3]


def between(first: str, last: str, fractions: np.ndarray) -> np.ndarray:
    """Return the colours (n, 3) between two, for fractions (n,) from 0 to 1."""
    from matplotlib.colors import to_rgb

    share = np.clip(fractions, 0.0, 1.0)[:, None]
    return (1.0 - share) * np.array(to_rgb(first)) + share * np.array(to_rgb(last))


def at_vertices(values: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the means (n_v,) at vertices of values on faces (n_f,)."""
    count = np.bincount(faces.ravel())
    return np.bincount(faces.ravel(), np.repeat(values, 3)) / count


def compute_hexagram() -> dict[str, Any]:
    import hexagram
    from _hexagram.design import FLUX_DENSITY, design, from_beam_theory

    star = design(12, 1097)
    best = hexagram.optimized(star, from_beam_theory(star.mesh), 30)
    at_rest = ms.WarmStart(star.scene)
    phases = 2 * np.pi * np.arange(24) / 24
    states = [
        at_rest(
            remanent_magnetization=best["magnetization"],
            applied_flux_density=(0.0, 0.0, FLUX_DENSITY * np.sin(phase)),
        ).positions
        for phase in phases
    ]
    return {
        "faces": star.mesh.faces,
        "strength": np.linalg.norm(best["magnetization"], axis=1),
        "positions": np.stack(states),
    }


def film_hexagram(data: dict[str, Any]) -> Film:
    camera = Camera(26, -75, (0.0, 0.0, -1.5e-3), 76e-3, ground=-17e-3)
    strength = at_vertices(data["strength"], data["faces"])
    lines, colors = (
        boundary(data["faces"]),
        between("#4f86c6", "#f2c14e", strength / 40e3),
    )
    frames = [[Body(x, data["faces"], colors, lines=lines)] for x in data["positions"]]
    return Film(camera, frames)


def compute_letters() -> dict[str, Any]:
    from _letters.designs import designed
    from _letters.task import Task

    found = {}
    for letter in "AS":
        task = Task(letter)
        best = designed(task, "M, Y", 60, progress=False)
        at_rest = ms.WarmStart(task.scene, start=best.positions)
        states = [
            at_rest(
                remanent_magnetization=best.remanent_magnetization,
                applied_flux_density=share * np.array(task.flux_density),
                young_modulus=best.young_modulus,
            ).positions
            for share in np.linspace(1.0, 0.0, 15)
        ]
        found |= {letter: np.stack(states[::-1]), "faces": task.mesh.faces}
    return found


def film_letters(data: dict[str, Any]) -> Film:
    camera = Camera(38, -78, (0.105, 0.05, 0.0), 0.25)
    lines, frames = boundary(data["faces"]), []
    for each in zip(data["A"], data["S"], strict=True):
        moved = [x + np.array([0.11 * k, 0.0, 0.0]) for k, x in enumerate(each)]
        frames.append(
            [
                Body(
                    x,
                    data["faces"],
                    colored(x[:, 2], -1e-3, 5e-3),
                    lines=lines,
                    shadow=False,
                )
                for x in moved
            ]
        )
    return Film(camera, frames, held=16, back=True)


def compute_gripper() -> dict[str, Any]:
    import gripper
    from _gripper.lift import closing_and_lift
    from _gripper.model import Gripper

    best = gripper.designed(Gripper(), 6)["remanent_magnetization"]
    hand = Gripper(ball_cells=4)
    motion = closing_and_lift(hand, best, 150)["motion"]
    return {
        "sheet": hand.mesh.faces,
        "ball": hand.ball.mesh.faces,
        "positions": motion.positions[np.linspace(0, 150, 34).astype(int)],
    }


def film_gripper(data: dict[str, Any]) -> Film:
    camera = Camera(16, -62, (0.0, 0.0, 3.0e-3), 48e-3, ground=-12.5e-3)
    count = data["sheet"].max() + 1
    lines = boundary(data["sheet"])
    frames = [
        [
            Body(x[:count], data["sheet"], SHEET, lines=lines),
            Body(x[count:], data["ball"], SOLID),
        ]
        for x in data["positions"]
    ]
    return Film(camera, frames, held=14)


def compute_octopus() -> dict[str, Any]:
    from _octopus.channels import CHANNELS
    from _octopus.task import EVEN, TIME_STEP, Swim

    swim = Swim.of(CHANNELS["pipe I"], 1400, noise=1e-12)
    move = swim.move(
        10e-3 / EVEN * swim.swing()
    )  # a swing of 10 mT passes after 1.26 s
    last = min(swim.passed(move.positions)[0] + round(0.02 / TIME_STEP), swim.steps)
    chosen = np.linspace(0, last, 44).astype(int)
    return {
        "faces": swim.body.mesh.faces,
        "tentacle": swim.body.tentacle,
        "outline": swim.channel.outline(),
        "positions": move.positions[chosen],
    }


def film_octopus(data: dict[str, Any]) -> Film:
    camera = Camera(20, -72, (20e-3, 0.0, 0.0), 118e-3)
    colors = np.where(
        data["tentacle"][:, None] >= 0, (0.71, 0.28, 0.36), (0.91, 0.62, 0.47)
    )
    tube = _tube(data["outline"])
    lines = boundary(data["faces"])
    frames = [
        [Body(x, data["faces"], colors, smooth=False, lines=lines), tube]
        for x in data["positions"]
    ]
    return Film(camera, frames, held=6)


def _tube(outline: np.ndarray, around: int = 64) -> Body:
    """Return the wall of a tube of revolution. outline: (2, n) m, x and the radius there."""
    x, radius = outline[:, ::3]
    angles = 2 * np.pi * np.arange(around) / around
    rings = np.stack(
        [
            np.repeat(x, around),
            np.outer(radius, np.cos(angles)).ravel(),
            np.outer(radius, np.sin(angles)).ravel(),
        ],
        axis=1,
    )
    i, j = np.meshgrid(np.arange(len(x) - 1), np.arange(around), indexing="ij")
    a, b = (i * around + j).ravel(), (i * around + (j + 1) % around).ravel()
    faces = np.concatenate(
        [
            np.stack([a, b, a + around], axis=1),
            np.stack([b, b + around, a + around], axis=1),
        ]
    )
    return Body(rings, faces, "#6fb3d9", opacity=0.22, shadow=False)


def compute_starfish() -> dict[str, Any]:
    import jumping_starfish

    found = jumping_starfish.main(("light",), spacings=(None, None, None))["light"][
        "found"
    ]
    return {
        "faces": found["jump"].solid.mesh.faces,
        "positions": found["positions"][::10],
    }


def film_starfish(data: dict[str, Any]) -> Film:
    from _starfish.jump import BAR, BAR_HEIGHT, BAR_WIDTH

    camera = Camera(16, -72, (18e-3, 0.0, 11.5e-3), 70e-3, ground=0.0)
    box = ms.meshes.box((BAR_WIDTH, 28e-3, BAR_HEIGHT), cells=(1, 4, 1))
    bar = Body(
        box.rest_positions + np.array([BAR - 0.5 * BAR_WIDTH, -14e-3, 0.0]),
        box.faces,
        ACCENT,
        smooth=False,
    )
    frames = [
        [Body(x, data["faces"], SOLID, crease=120.0), bar] for x in data["positions"]
    ]
    return Film(camera, frames, held=8)


def compute_hand() -> dict[str, Any]:
    from _hand.design import FLUX_DENSITY, designed
    from _hand.design import Body as Hand

    hand = Hand(4975, "quadratic")
    best = designed(hand, "victory", 25)
    at_rest = ms.WarmStart(hand.scene, start=best.positions)
    states = [
        at_rest(
            applied_flux_density=share * np.array(FLUX_DENSITY),
            values={
                hand.solid.skin: {"remanent_magnetization": best.remanent_magnetization}
            },
        ).positions
        for share in np.linspace(1.0, 0.0, 15)
    ]
    return {"faces": hand.solid.mesh.faces, "positions": np.stack(states[::-1])}


def film_hand(data: dict[str, Any]) -> Film:
    low, high = data["positions"][0].min(axis=0), data["positions"][0].max(axis=0)
    camera = Camera(12, -62, 0.5 * (low + high), 1.55 * (high - low)[2])
    frames = [
        [Body(x, data["faces"], "#d9a58c", shadow=False, crease=120.0)]
        for x in data["positions"]
    ]
    return Film(camera, frames, held=14, back=True)


SCENES = {
    "hexagram": Scene(
        "A star of six arms curls down and up in a field",
        compute_hexagram,
        film_hexagram,
    ),
    "letters": Scene(
        "The letters A and S rise from flat sheets", compute_letters, film_letters
    ),
    "gripper": Scene(
        "A sheet closes around a ball and lifts it", compute_gripper, film_gripper
    ),
    "octopus": Scene(
        "A soft octopus swims through a pipe", compute_octopus, film_octopus
    ),
    "jumping_starfish": Scene(
        "A soft starfish jumps over a bar", compute_starfish, film_starfish
    ),
    "gesturing_hand": Scene("A soft hand shows a V", compute_hand, film_hand),
}
