"""The function ms.write_usd, which writes states as an OpenUSD scene with time samples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.path_first import check_path_first
from ..._input.quantity import quantity
from ..._runtime.files import check_replaceable, replacing
from ..._runtime.solver_entry_point import grouped
from .moving_parts import Motion, Part, moving_parts
from .style import Color

if TYPE_CHECKING:
    from types import ModuleType

    from ..._input.kinds import Fielded, FilePath, Numbers, Shown
    from ...model.contact.obstacles.obstacle import Obstacle

ENDINGS = (".usd", ".usda", ".usdc")


@grouped(color=Color)
def write_usd(
    path: FilePath,
    what: Shown,
    *,
    positions: Numbers | None = None,
    times: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    field: Fielded | None = None,
    obstacles: Obstacle | Sequence[Obstacle] | None = None,
    color: Any = "auto",
    speed: float | None = None,
    fps: float = 24.0,
) -> Path:
    """Write bodies as an OpenUSD scene, which Blender, Omniverse, Houdini and newton open.

    It needs OpenUSD's package pxr (the extra `usd`). The scene has meshes of the bodies, of obstacles, magnets, links,
    tendons and rigid bodies, with time samples of their points, in metres with z up.
    Colours are the primvar displayColor; bodies have two sides. Points have single precision.

    path: ends in .usd or .usdc (binary) or in .usda (text).
    what, color: as in `plot`; all states must have the same mesh.
    positions, times, remanent_magnetization, applied_flux_density, field, obstacles: as in `animate`.
    speed: seconds of the motion per second of the scene, by default as in `animate`. States without times are shown at ten
        per second.
    fps: time codes per second, frames for most programs. Samples need not lie on whole frames.

    An existing file is replaced once the new one is complete. Raises ValueError on bad input, ImportError without OpenUSD,
    OSError if the file cannot be written.

    >>> import magshell as ms, numpy as np, tempfile
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> rising = np.stack([mesh.rest_positions + np.array([0, 0, height]) for height in (0, 0.01)])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.write_usd(f"{folder}/rise.usda", mesh, positions=rising).name
    'rise.usda'
    """
    check_path_first("write_usd(path, what)", path, what)
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(f"cannot write {path.name!r}: the ending must be {', '.join(ENDINGS)}")
    fps = float(quantity("fps", "1/s", fps, ()))
    if not fps > 0.0:
        raise ValueError(f"fps [1/s] must be positive, got {fps:g}")
    check_replaceable(path)
    pxr = _require_usd()
    motion = moving_parts(
        what,
        positions=positions,
        times=times,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
        obstacles=obstacles,
        color=color,
        speed=speed,
    )
    with replacing(path) as part:
        part.unlink()  # OpenUSD makes its files itself
        try:
            _write(pxr, part, motion, fps)
        except pxr.Tf.ErrorException as error:
            raise OSError(str(error)) from error
    return path


def _write(pxr: ModuleType, path: Path, motion: Motion, fps: float) -> None:
    codes = (fps * motion.times).tolist()
    stage = pxr.Usd.Stage.CreateNew(str(path))
    pxr.UsdGeom.SetStageUpAxis(stage, pxr.UsdGeom.Tokens.z)
    pxr.UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(fps)
    stage.SetFramesPerSecond(fps)
    stage.SetStartTimeCode(codes[0])
    stage.SetEndTimeCode(codes[-1])
    world = pxr.UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(world.GetPrim())
    pxr.Usd.ModelAPI(world.GetPrim()).SetKind(pxr.Kind.Tokens.component)
    for part in motion.parts:
        _define(pxr, stage, part, codes)
    stage.GetRootLayer().Save()


def _define(pxr: ModuleType, stage: Any, part: Part, codes: list[float]) -> None:
    """Define the mesh of one part."""
    mesh = pxr.UsdGeom.Mesh.Define(stage, f"/World/{part.name}")
    mesh.CreateFaceVertexCountsAttr(pxr.Vt.IntArray.FromNumpy(np.full(len(part.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(pxr.Vt.IntArray.FromNumpy(part.faces.ravel().astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(pxr.UsdGeom.Tokens.none)  # as it is, not smoothed
    mesh.CreateDoubleSidedAttr(True)
    points = [pxr.Vt.Vec3fArray.FromNumpy(each.astype(np.float32)) for each in part.points]
    _set(mesh.CreatePointsAttr(), points, codes)
    ends = [np.stack([each.min(axis=0), each.max(axis=0)]) for each in part.points]
    boxes = [pxr.Vt.Vec3fArray.FromNumpy(each.astype(np.float32)) for each in ends]
    _set(mesh.CreateExtentAttr(), boxes, codes)
    per_face = len(part.colors[0]) == len(part.faces)
    tokens = pxr.UsdGeom.Tokens
    shades = mesh.CreateDisplayColorPrimvar(tokens.uniform if per_face else tokens.vertex)
    colors = [pxr.Vt.Vec3fArray.FromNumpy(np.array(each, dtype=np.float32)) for each in part.colors]
    _set(shades.GetAttr(), colors, codes)
    if part.opacity < 1.0:
        mesh.CreateDisplayOpacityPrimvar(tokens.constant).Set(pxr.Vt.FloatArray([part.opacity]))


def _set(attribute: Any, values: list[Any], codes: list[float]) -> None:
    """Set an attribute: one value for all times, or a sample at each time code."""
    if len(values) == 1:
        attribute.Set(values[0])
        return
    for value, code in zip(values, codes, strict=True):
        attribute.Set(value, code)


def _require_usd() -> ModuleType:
    """Return the package pxr of OpenUSD. Raises ImportError with the command that installs it."""
    try:
        import pxr
        from pxr import Kind, Usd, UsdGeom, Vt  # noqa: F401 - attributes of pxr from now on
    except ImportError as error:
        raise ImportError('a USD file needs OpenUSD: pip install "magshell[usd]"') from error
    return pxr
