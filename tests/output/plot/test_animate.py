"""A movie shows the motion at its pace with one camera; a file is there whole or not at all."""

import subprocess
import sys

import numpy as np
import pytest
from motions import lifted_strip

import magshell as ms
from magshell.output.plot import films
from magshell.output.plot.colors import FIELD, rgb
from magshell.output.plot.playback import describe_speed, moments, speed_of, state_at
from magshell.output.results.state import states_of, with_times

image = pytest.importorskip("PIL.Image")

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
SMALL = {"style": ms.Style(backend="matplotlib"), "width": 400, "progress": False}


@pytest.fixture(scope="module")
def move() -> ms.Trajectory:
    return lifted_strip(MESH)


def rising(count: int) -> np.ndarray:
    return MESH.rest_positions + np.linspace(0, 0.02, count)[:, None, None] * (0, 0, 1)


def frames_of(gif) -> tuple[list[np.ndarray], list[float]]:
    """Return the frames, and how long each is shown, s."""
    frames, shown = [], []
    with image.open(gif) as file:
        for k in range(file.n_frames):
            file.seek(k)
            frames.append(np.asarray(file.convert("RGB")).astype(int))
            shown.append(file.info.get("duration", 0) / 1e3)
    return frames, shown


def test_a_gif_shows_the_motion_and_its_field(move, tmp_path) -> None:
    frames, shown = frames_of(ms.animate(move, tmp_path / "a.gif", speed=0.04, fps=10, **SMALL))
    assert len(frames) == 11 and shown == pytest.approx([0.1] * 11)  # 0.04 s, in steps of 4 ms
    assert {frame.shape for frame in frames} == {frames[0].shape} and frames[0].shape[1] == 400
    assert all((frame[:2] == 255).all() for frame in frames)  # the paper is white
    bottom = frames[0].shape[0] - 90  # axes, scale bar and colours stay where they are
    assert all(np.array_equal(frame[bottom:], frames[0][bottom:]) for frame in frames)
    green = [(np.abs(frame[:bottom] - 255 * rgb(FIELD)).sum(axis=2) < 40).sum() for frame in frames]
    assert np.diff(green[1::3]).min() > 0 and green[-1] > 2 * green[1]  # the arrow grows with the field
    assert (frames[-1][:bottom] != frames[-2][:bottom]).any()


def test_a_gif_keeps_white_and_many_colors_apart(tmp_path) -> None:
    shades = (
        np.stack(np.meshgrid(*[np.linspace(40, 250, 16)] * 3), axis=-1).reshape(64, 64, 3).astype(np.uint8)
    )
    paper = np.full((64, 64, 3), 255, np.uint8)
    films.write(tmp_path / "a.gif", [np.hstack([shades, paper])], [np.hstack([shades, paper])], 25.0)
    [frame], _ = frames_of(tmp_path / "a.gif")
    assert (frame[:, 64:] == 255).all()
    assert np.abs(frame[:, :64] - shades).mean() < 16 and np.abs(frame[:, :64] - shades).max() < 60


def test_an_mp4_is_a_video(move, tmp_path) -> None:
    program = films.ffmpeg()
    path = ms.animate(move, tmp_path / "a.mp4", speed=0.04, fps=30, **SMALL)
    said = subprocess.run(
        [program, "-i", str(path), "-f", "null", "-"], capture_output=True, text=True
    ).stderr
    assert "h264" in said and "30 fps" in said and "frame=   31" in said
    assert list(tmp_path.iterdir()) == [path]


def test_frames_between_states_lie_on_straight_lines() -> None:
    times = np.array([0.0, 0.1, 0.4])
    states = with_times(states_of(MESH, positions=rising(3), applied_flux_density=np.eye(3)), times)
    shown = moments(states, fps=10, speed=0.5)  # steps of 0.05 s
    assert [m.time for m in shown] == pytest.approx(np.linspace(0, 0.4, 9))
    heights = [state_at(states, moment).positions[0, 2] for moment in shown]
    assert heights == pytest.approx(np.interp(np.linspace(0, 0.4, 9), times, [0, 0.01, 0.02]))
    assert state_at(states, shown[1]).flux_density == pytest.approx([0.5, 0.5, 0])
    assert [m.before for m in moments(states_of(MESH, positions=rising(3)), 10, 1.0)] == [0, 1, 2]


def test_a_motion_that_rests_and_one_that_follows_another() -> None:
    states = with_times(states_of(MESH, positions=rising(4)), [0.0, 0.1, 0.1, 0.2])
    assert [m.before for m in moments(states, fps=10, speed=0.5)] == [0, 0, 2, 2, 2]
    assert len(moments(with_times(states_of(MESH, positions=rising(2)), [1.0, 1.0]), 10, 1.0)) == 2


@pytest.mark.parametrize(
    ("duration", "speed", "text"),
    [
        (0.04, 0.005, "200 times slower"),
        (0.8, 0.1, "10 times slower"),
        (5, 1, "real time"),
        (500, 50, "50 times faster"),
    ],
)
def test_the_speed_makes_a_movie_one_can_watch(duration, speed, text) -> None:
    states = with_times(states_of(MESH, positions=rising(2)), [0, duration])
    assert speed_of(states, None) == pytest.approx(speed)
    assert describe_speed(speed_of(states, None)) == text


def test_states_without_times_are_a_frame_each(tmp_path) -> None:
    frames, shown = frames_of(ms.animate(MESH, tmp_path / "a.gif", positions=rising(4), fps=5, **SMALL))
    assert len(frames) == 4 and shown == pytest.approx([0.2] * 4)


def test_fields_that_vary_keep_their_places(move, tmp_path) -> None:
    field = ms.Dipoles([[0.025, 0.005, -0.03]], [[0.0, 0.0, 1.0]])
    frames, _ = frames_of(
        ms.animate(MESH, tmp_path / "a.gif", positions=rising(3), field=field, color=None, **SMALL)
    )
    green = [np.abs(frame - 255 * rgb(FIELD)).sum(axis=2) < 60 for frame in frames]
    assert green[0].sum() > 200
    assert (green[0] & green[2]).sum() > 0.6 * green[0].sum()  # all but what the sheet hides


class Stop(Exception):
    pass


@pytest.mark.parametrize("ending", ["gif", "mp4"])
@pytest.mark.parametrize("reason", [KeyboardInterrupt, Stop])
def test_failed_movie_leaves_the_older_file(tmp_path, monkeypatch, ending, reason) -> None:
    path = tmp_path / f"a.{ending}"
    path.write_bytes(b"the older one")
    images = iter([np.zeros((64, 64, 3), np.uint8)] * 3)

    def three():
        yield from images
        raise reason

    with pytest.raises(reason):
        films.write(path, three(), [np.zeros((64, 64, 3), np.uint8)], 25.0)
    assert list(tmp_path.iterdir()) == [path] and path.read_bytes() == b"the older one"


def test_a_full_disk_says_so(move, tmp_path, monkeypatch) -> None:
    def full(*_) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(films, "_write_gif", full)
    with pytest.raises(OSError, match=r"cannot write '.*a\.gif': No space left on device"):
        ms.animate(MESH, tmp_path / "a.gif", positions=rising(2), **SMALL)
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_the_error_says_what_to_install(tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ImportError, match=r'pip install "magshell\[movie\]"'):
        ms.animate(MESH, tmp_path / "a.mp4", positions=rising(2), **SMALL)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"fps": 0}, r"fps \[1/s\] must be positive, from 0.01 to 1000, got 0"),
        ({"fps": 1e-4}, "fps .* from 0.01 to 1000"),
        ({"width": 20_000}, "at least 400 pixels and at most 8000, got 20000"),
        (
            {"times": [0.0, 1.0, 1e6], "speed": 1.0},
            r"would have 2.5e\+07 frames, and at most 20000 .* `speed`",
        ),
        ({"times": [0.0, 1.0, 2.0], "speed": 1e-300}, "would have .* frames"),
        ({"fps": 60}, "at most 50 frames a second"),
        ({"fps": np.nan}, r"fps \[1/s\] must be finite"),
        ({"speed": -1.0}, "speed must be positive, got -1"),
        ({"width": 100}, "at least 400 pixels"),
        ({"positions": None}, "at least two states, got one; ms.plot"),
        ({"times": [0.0]}, r"times \[s\] must be 3 numbers"),
        ({"times": [0.0, 1.0, 0.5]}, "must not fall, but 1 is followed by 0.5"),
        ({"color": "colour"}, "color must be"),
        ({"style": 3}, "style must be an ms.Style, got 3"),
    ],
)
def test_bad_input_is_refused(tmp_path, arguments, message) -> None:
    given = {**SMALL, "positions": rising(3), **arguments}
    with pytest.raises(ValueError, match=message):
        ms.animate(MESH, tmp_path / "a.gif", **given)
    assert list(tmp_path.iterdir()) == []


def test_bad_places_are_refused(tmp_path) -> None:
    for name, message in (
        ("a.avi", r"saved as \.gif or \.mp4, got 'a\.avi'$"),
        ("a.html", r"ms\.write_page"),
    ):
        with pytest.raises(ValueError, match=message):
            ms.animate(MESH, tmp_path / name, positions=rising(2), **SMALL)
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        ms.animate(MESH, tmp_path / "none" / "a.gif", positions=rising(2), **SMALL)
    with pytest.raises(ValueError, match="different faces"):
        ms.animate([MESH, MESH.flipped()], tmp_path / "a.gif", **SMALL)
