"""Painting of panels by pyvista, off-screen into an image."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from .panels import Panel
from .polygons import AMBIENT, DIFFUSE, LIGHT
from .solids import Solid
from .view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OVERSAMPLING = 2


class Screen:
    """An off-screen window of VTK; a movie uses one for all frames, because it takes long to open."""

    def __init__(self, pixels: tuple[int, int], samples: bool = True):
        import pyvista

        _quiet_without_a_screen()
        self.pixels = pixels
        size = tuple(OVERSAMPLING * each for each in pixels)
        self.plotter: Any = pyvista.Plotter(off_screen=True, window_size=size, lighting="none")
        self.plotter.set_background("white")
        if not samples:
            self.plotter.render_window.SetMultiSamples(0)

    def close(self) -> None:
        """Close the window."""
        self.plotter.close()

    def paint(self, axes: Axes, panel: Panel, view: View, window: np.ndarray) -> None:
        """Add the image of a panel to matplotlib axes whose coordinates are metres on the screen.

        window: (left, right, bottom, top), m.
        """
        fine = render(panel.solids, view, window, self)
        image = np.zeros((fine.shape[0] // OVERSAMPLING, fine.shape[1] // OVERSAMPLING, 3), dtype=np.uint16)
        for i in range(OVERSAMPLING):
            for j in range(OVERSAMPLING):
                image += fine[i::OVERSAMPLING, j::OVERSAMPLING]
        axes.imshow(
            image / np.float32(255 * OVERSAMPLING**2),
            extent=window,
            interpolation="none",
            aspect="auto",
            zorder=0,
        )


def _quiet_without_a_screen() -> None:
    """Turn off VTK's warnings about missing displays if there is none; it then renders without a display."""
    if not os.environ.get("DISPLAY"):
        from vtkmodules.vtkCommonCore import vtkLogger

        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)


def render(solids: list[Solid], view: View, window: np.ndarray, screen: Screen) -> np.ndarray:
    """Draw solids as an image (height, width, 3), 0 to 255, with OVERSAMPLING times the resolution of the screen."""
    import pyvista

    right, up, eye = view.axes
    depths = np.concatenate([view.project(solid.positions)[:, 2] for solid in solids])
    reach = np.ptp(depths) + window[1] - window[0]
    center = (window[0] + window[1]) / 2 * right + (window[2] + window[3]) / 2 * up + depths.mean() * eye
    plotter = screen.plotter
    plotter.suppress_rendering = True  # until all solids are added
    plotter.clear_actors()
    plotter.remove_all_lights()
    plotter.add_light(
        pyvista.Light(position=tuple(LIGHT @ view.axes), light_type="scene light", intensity=1.0)
    )
    for solid in solids:
        _add(plotter, solid, eye)
    plotter.camera.position = tuple(center + 4 * reach * eye)
    plotter.camera.focal_point = tuple(center)
    plotter.camera.up = tuple(up)
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = (window[3] - window[2]) / 2
    plotter.camera.clipping_range = (reach, 8 * reach)
    plotter.suppress_rendering = False
    plotter.render()
    return np.array(plotter.screenshot(return_img=True))[:, :, :3]


def _add(plotter, solid: Solid, eye: np.ndarray) -> None:
    import pyvista

    if not len(solid.faces):
        return
    corners = np.column_stack([np.full(len(solid.faces), 3), solid.faces]).ravel()
    surface = pyvista.PolyData(solid.positions + solid.lift * eye, corners)
    colors = np.round(255 * np.clip(solid.colors, 0.0, 1.0)).astype(np.uint8)
    (surface.cell_data if solid.per_face else surface.point_data)["colors"] = colors
    if solid.smooth:
        surface = surface.compute_normals(cell_normals=False, split_vertices=True, feature_angle=40.0)
    plotter.add_mesh(
        surface,
        scalars="colors",
        rgb=True,
        opacity=solid.opacity,
        lighting=solid.lit,
        smooth_shading=False if not solid.smooth else None,
        interpolation="Phong" if solid.smooth else "Flat",
        ambient=AMBIENT,
        diffuse=DIFFUSE,
        specular=0.0,
        reset_camera=False,
    )
