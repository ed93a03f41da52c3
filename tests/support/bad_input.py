"""Cases of bad input: a small scene to modify, and tables of the message that each mistake must give."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(1.0, 0.5, cells=(4, 2))
N_F, N_E, N_V = MESH.n_faces, MESH.n_edges, MESH.n_vertices
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
END = MESH.vertices_at(x=0.0)


def with_entry(shape, index, value):
    array = np.ones(shape)
    array[index] = value
    return array


def shell(**changes):
    return ms.Shell(MESH, **{"thickness": 1e-2, "young_modulus": 1e6, **changes})


def scene(**changes):
    return ms.Scene(shell(), **{"supports": [CLAMP], **changes})


def solve(what=None, **changes):
    return ms.equilibrium(scene() if what is None else what, **changes)


def solve_magnetic(**changes):
    inputs = {"remanent_magnetization": (1e4, 0, 0), "applied_flux_density": (0, 0, 1e-3), **changes}
    return ms.equilibrium(scene(field=ms.UniformField()), **inputs)


def held_by(*supports):
    return lambda: scene(supports=supports)


def loaded_by(make):
    """Return a call that makes a load and its scene; the load may be refused at once, or where it meets its mesh."""
    return lambda: scene(loads=[make()])


def refused(cases, errors=ValueError):
    """Return a test of the cases (name, call, expected message), one case each."""

    def test(act, message):
        with pytest.raises(errors, match=message):
            act()

    rows = [pytest.param(act, message, id=name) for name, act, message in cases]
    return pytest.mark.parametrize(("act", "message"), rows)(test)


NOT_NUMBERS = r"must be an array of real numbers"
