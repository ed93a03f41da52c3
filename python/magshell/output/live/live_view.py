"""The class LiveView: a scene or the states of a result in a browser."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ..._input.quantity import quantity
from ...model.fields.field import AppliedField, UniformField
from ...solve.statics.equilibrium import Equilibrium
from ..plot import colors
from ..plot.colors import Scalar
from ..plot.moving_parts import STATES_PER_SECOND
from ..results.state import State, states_of
from .follower import Follower
from .library import quiet
from .movable import Movable, values_of
from .panel import Panel
from .stage import SHOWN_SIZE, Stage, bytes_of

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_FRAME = 1.0 / 30.0  # [s] between two states while playing

Coloring = Callable[[list[State]], tuple[list[State], Scalar | None]]


_FARTHEST = 1e4  # [-] distance of a source from the bodies over their size: its field is not felt long before
_GIZMO = 0.22  # [-] length of a handle's arrows over the size of the bodies


class LiveView:
    """A view in a browser, served by the package viser, which `ms.show` opens and which follows what is dragged there.

    The reader turns, zooms and moves the view with the mouse. The states of a result are chosen by a slider, or played.
    In a scene with magnets, placed fields or up to eight dipoles, each has handles that drag and turn it; a uniform
    field has sliders. The bodies follow: each new pose is solved from the last equilibrium, as by ms.WarmStart, and only the
    newest one is solved. Where the equilibrium jumps, the view shows the new one and says so. Where a solve fails, it
    says why and keeps the last equilibrium. An obstacle that has the center of a magnet moves with it.

    url: the address of the view, with its secret token. It serves only this machine, unless ms.show was given another
    host. equilibrium: the last one of a scene with a field, otherwise None. message: the note beside the view.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    >>> sheet = ms.Shell(mesh, thickness=0.5e-3, young_modulus=1e6)
    >>> magnet = ms.CuboidMagnet((0.01, 0.01, 0.01), (0, 0, 9e5), center=(0.04, 0.005, -0.04))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=magnet)
    >>> with ms.show(scene, remanent_magnetization=(0, 0, 5e4), browser=False) as view:
    ...     nearer = view.move(magnet, center=(0.04, 0.005, -0.03))
    >>> bool(nearer.displacements[:, 2].min() < -1e-3)
    True
    """

    def __init__(
        self,
        server: Any,
        token: str,
        states: list[State],
        scalar: Scalar | None,
        stage: Stage,
        speed: float | None,
    ):
        self._server, self._stage = server, stage
        self._states, self._scalar = states, scalar
        self._speed = speed
        self._panel = Panel(server)
        self._drawing = threading.RLock()
        self._closed = threading.Event()
        self._number = 0
        self._gizmos: list[Gizmo] = []
        self._follower: Follower | None = None
        self._player: threading.Thread | None = None
        self.url: str = f"http://{server.get_host()}:{server.get_port()}/{token}/"
        self.equilibrium: Equilibrium | None = None
        self.message: str = ""
        if len(states) > 1:
            self._panel.add_states(len(states), speed, self.show_state)
            self._player = threading.Thread(target=self._play, name="magshell-play", daemon=True)
            self._player.start()
        self._draw(0)

    @property
    def n_states(self) -> int:
        """The number of states; 1 of a scene."""
        return len(self._states)

    @property
    def state(self) -> int:
        """The number of the state that is shown, from 0."""
        return self._number

    @property
    def frames_per_second(self) -> float:
        """The equilibria per second that were shown while something was dragged, over the last 20; 0 without any."""
        return 0.0 if self._follower is None else self._follower.frames_per_second

    def show_state(self, number: int) -> None:
        """Show a state; negative numbers count from the last. Raises ValueError if there is no such state."""
        if not isinstance(number, int | np.integer) or not -self.n_states <= number < self.n_states:
            raise ValueError(f"number must be that of one of the {self.n_states} states, got {number!r:.60}")
        self._check_open()
        self._draw(int(number) % self.n_states)
        if self._panel.slider is not None:
            self._panel.slider.value = self._number

    def play(self) -> None:
        """Show the states one after another, the first one again after the last. Raises ValueError if there is only one."""
        self._check_open()
        if self._panel.playing is None:
            raise ValueError("there is one state only: nothing to play")
        self._panel.playing.value = True

    def pause(self) -> None:
        """Stop the playing of states."""
        if self._panel.playing is not None:
            self._panel.playing.value = False

    def move(
        self,
        source: AppliedField,
        *,
        center: Numbers | None = None,
        rotation: Numbers | None = None,
        index: int = 0,
    ) -> Equilibrium:
        """Move a magnet, a placed field or a dipole, as dragging does, and return the equilibrium there.

        center: (3,) m, of a dipole its position. rotation: rotation vector (3,) rad, of a dipole from its first direction.
        Both stay as they are by default. index: the number of the dipole. Raises the errors of ms.equilibrium, but no
        EquilibriumJumped: the new equilibrium is taken.
        """
        gizmo = self._gizmo_of(source, index)
        if center is not None:
            center = np.array(quantity("center", "m", center, (3,)))
            gizmo.check_reachable(center)
            gizmo.movable.center = center
        if rotation is not None:
            gizmo.movable.rotation = np.array(quantity("rotation", "rad", rotation, (3,)))
        gizmo.show()
        return self._ask().result()

    def set_flux_density(self, applied_flux_density: Numbers) -> Equilibrium:
        """Change the uniform field to (3,) T, as its sliders do, and return the equilibrium there."""
        flux_density = np.array(quantity("applied_flux_density", "T", applied_flux_density, (3,)))
        if not self._panel.field:
            raise ValueError("this view has no uniform field: show a scene with an ms.UniformField")
        self._panel.show_field(flux_density)
        return self._changed_field(flux_density).result()

    def wait(self) -> None:
        """Wait until the view is closed, or until Ctrl-C, which closes it: at the end of a script."""
        print(f"live view at {self.url} - Ctrl-C ends it")
        try:
            while not self._closed.wait(0.2):
                pass
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """End the view and its server; what a browser shows stays, but answers no more."""
        if self._closed.is_set():
            return
        self._closed.set()
        for thread in (self._follower, self._player):
            if isinstance(thread, Follower):
                thread.close()
            elif thread is not None:
                thread.join()
        with quiet():
            self._server.stop()

    def __enter__(self) -> LiveView:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        ended = "closed" if self._closed.is_set() else f"at {self.url}"
        count = "" if self.n_states == 1 else f", {self.n_states} states"
        return f"LiveView({ended}{count})"

    def _repr_html_(self) -> str:
        """Return the view as part of a notebook."""
        return f'<iframe src="{self.url}" width="100%" height="560" frameborder="0"></iframe>'

    def _follow(
        self, follower: Follower, design: dict[str, Any], movables: list[Movable], coloring: Coloring
    ) -> None:
        """Find the first equilibrium, and follow the controls from then on."""
        self._design, self._coloring, self._movables = design, coloring, movables
        flux_density = design.get("applied_flux_density")
        scene = follower.scene
        self._movable_sources = {id(each.source) for each in movables}
        self._sources = [each for each in scene.fields if not isinstance(each, UniformField)]
        follower.begin(self._current())
        self._follower = follower
        names = [f"/sources/{number}" for number in range(len(movables))]
        self._gizmos = [
            Gizmo(self._server, self._stage, each, name, self._ask, self._failed)
            for name, each in zip(names, movables, strict=True)
        ]
        if flux_density is not None:
            self._first_flux_density = flux_density
            self._panel.add_field(flux_density, self._changed_field)
        if self._gizmos or flux_density is not None:
            self._panel.add_reset(self._reset)

    def _current(self) -> dict[str, Any]:
        """Return the design at the present controls."""
        given = self._design.get("values") or {}
        values = {owner: dict(named) for owner, named in given.items()}
        for owner, named in values_of(self._movables).items():
            values[owner] = {**values.get(owner, {}), **named}
        return {**self._design, "values": values or None}

    def _ask(self) -> Future[Equilibrium]:
        self._check_open()
        return self._follower.ask(self._current())

    def _changed_field(self, flux_density: np.ndarray) -> Future[Equilibrium]:
        self._design = {**self._design, "applied_flux_density": flux_density}
        return self._ask()

    def _reset(self) -> None:
        for gizmo in self._gizmos:
            gizmo.reset()
        if self._panel.field:
            self._panel.show_field(self._first_flux_density)
            self._design = {**self._design, "applied_flux_density": self._first_flux_density}
        self._ask()

    def _found(self, equilibrium: Equilibrium, note: str) -> None:
        """Show an equilibrium. Called in the thread of the follower."""
        states, scalar = self._coloring(states_of(equilibrium))
        [state] = states
        pairs = zip(self._sources, state.fields, strict=True)
        stay = tuple(field for source, field in pairs if id(source) not in self._movable_sources)
        self.equilibrium = equilibrium
        with self._drawing:
            self._states, self._scalar = [replace(state, fields=stay)], scalar
            self._draw(0)
        rate = self.frames_per_second
        said = f"{1e3 * equilibrium.wall_time:.0f} ms" + (f", {rate:.0f} frames a second" if rate else "")
        self._say("\n\n".join(filter(None, [said, note])))

    def _failed(self, error: Exception) -> None:
        self._say(f"**{type(error).__name__}**: {error}")

    def _say(self, text: str) -> None:
        self.message = text
        self._panel.note(text)

    def _draw(self, number: int) -> None:
        with self._drawing:
            self._number = number
            self._stage.draw(self._states[number], self._scalar, number)
            self._panel.legend(self._scalar)
            if self.n_states > 1:
                self._say(self._states[number].title)

    def _play(self) -> None:
        """Show one state after another while playing is switched on."""
        times = [state.time for state in self._states]
        if times[0] is None:
            times = [k / STATES_PER_SECOND for k in range(len(times) + 1)]
        else:
            times = [each - times[0] for each in times]
        at, before = 0.0, time.perf_counter()
        while not self._closed.wait(_FRAME):
            now = time.perf_counter()
            passed, before = now - before, now
            if not self._panel.playing.value:
                at = times[self._number]
                continue
            at += passed * float(self._panel.factor.value) * (self._speed or 1.0)
            if at >= times[-1]:
                at = 0.0
            number = int(np.searchsorted(times, at, side="right")) - 1
            if number != self._number:
                self.show_state(number)

    def _gizmo_of(self, source: AppliedField, index: int) -> Gizmo:
        found = [each for each in self._gizmos if each.movable.source is source]
        if not found:
            names = ", ".join(type(each.movable.source).__name__ for each in self._gizmos) or "none"
            raise ValueError(f"source must be one that this view moves ({names}), got {source!r:.80}")
        if not isinstance(index, int | np.integer) or not 0 <= index < len(found):
            raise ValueError(f"index must be from 0 to {len(found) - 1}, got {index!r:.60}")
        return found[index]

    def _check_open(self) -> None:
        if self._closed.is_set():
            raise RuntimeError("this live view is closed")


class Gizmo:
    """The handle of one source: it moves the source's pose and calls `moved`."""

    def __init__(
        self,
        server: Any,
        stage: Stage,
        movable: Movable,
        name: str,
        moved: Callable[[], None],
        refused: Callable[[Exception], None],
    ):
        self.movable = movable
        self._stage = stage
        self._first = movable.center.copy(), movable.rotation.copy()
        self.handle: Any = server.scene.add_transform_controls(
            name, scale=_GIZMO * SHOWN_SIZE, depth_test=False, **self._pose()
        )
        for number, (points, faces, color) in enumerate(movable.surfaces(stage.size)):
            shade = bytes_of(colors.rgb(color))
            stage.put_fixed(f"{name}/surface_{number}", points * stage.scale, faces, shade)

        @self.handle.on_update
        async def _(event: Any) -> None:  # in the server's loop, so that poses keep their order
            try:
                movable.center, movable.rotation = self._pose_in_view()
            except ValueError as error:
                self.show()  # where the source still is
                refused(error)
                return
            moved()

    def check_reachable(self, center: np.ndarray) -> None:
        """Raise ValueError for a center that is too far away for a field."""
        far = float(np.abs(center - self._stage.middle).max())
        if not far <= _FARTHEST * self._stage.size:
            raise ValueError(
                f"center is {far:.3g} m from the bodies, more than {_FARTHEST:g} times their size of "
                f"{self._stage.size:.3g} m"
            )

    def _pose_in_view(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the center and the rotation of the handle. Raises ValueError if they are none of a source."""
        center = self._stage.from_view(quantity("position", "1", self.handle.position, (3,)))
        self.check_reachable(center)
        turned = np.array(quantity("wxyz", "1", self.handle.wxyz, (4,)))
        length = np.linalg.norm(turned)
        if not 0.5 < length < 2.0:  # 1 up to round-off
            raise ValueError(f"wxyz must be a quaternion of length 1, got one of length {length:.3g}")
        return center, scipy.spatial.transform.Rotation.from_quat(turned, scalar_first=True).as_rotvec()

    def show(self) -> None:
        """Move the handle to the pose of its source."""
        for name, value in self._pose().items():
            setattr(self.handle, name, value)

    def reset(self) -> None:
        """Put the source and the handle back to where they were at first."""
        self.movable.center, self.movable.rotation = (each.copy() for each in self._first)
        self.show()

    def _pose(self) -> dict[str, tuple[float, ...]]:
        turned = scipy.spatial.transform.Rotation.from_rotvec(np.array(self.movable.rotation)).as_quat(
            scalar_first=True
        )
        return {
            "position": tuple(self._stage.to_view(self.movable.center).tolist()),
            "wxyz": tuple(turned.tolist()),
        }
