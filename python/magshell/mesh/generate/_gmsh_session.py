"""A temporary gmsh session that leaves a session of the user, if there is one, unchanged."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..._runtime.broken_pipes import ignore_broken_pipes

# All options that affect the mesh; they replace the user's settings during the session.
_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Geometry.Tolerance": 1e-8,
    "Mesh.Algorithm": 6,  # Frontal-Delaunay
    "Mesh.ElementOrder": 1,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFactor": 1,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromPoints": 1,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.MeshSizeMin": 0,
    "Mesh.Optimize": 1,
    "Mesh.RandomFactor": 1e-9,
    "Mesh.RandomSeed": 1,
    "Mesh.RecombineAll": 0,
    "Mesh.Smoothing": 1,
    "Mesh.SubdivisionAlgorithm": 0,
}


@contextmanager
def gmsh_session(mesh_size: float) -> Iterator[Any]:
    """Yield the gmsh module with a new empty model, without output, on one thread."""
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: a system library that gmsh needs is missing
        raise ImportError(f'this is meshed by gmsh: pip install "magshell[gmsh]" ({error})') from error

    started_here = not gmsh.isInitialized()
    if started_here:
        # not interruptible: otherwise gmsh handles Ctrl-C itself, which works in the main thread only
        gmsh.initialize([], readConfigFiles=False, run=False, interruptible=False)
        ignore_broken_pipes()
    users_model = gmsh.model.getCurrent()
    users_options = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
    for name, value in {**_OPTIONS, "Mesh.MeshSizeMax": mesh_size}.items():
        gmsh.option.setNumber(name, value)
    gmsh.model.add("magshell outline")
    try:
        yield gmsh
    finally:
        gmsh.model.remove()
        if started_here:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(users_model)
            for name, value in users_options.items():
                gmsh.option.setNumber(name, value)
