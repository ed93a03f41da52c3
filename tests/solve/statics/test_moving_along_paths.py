"""Field sources, obstacles and supports that move along a path of equilibria."""

import numpy as np
import pytest

import magshell as ms
from magshell import obstacles as ob

MESH = ms.meshes.rectangle(0.05, 0.02, cells=(5, 2))


def test_a_path_of_equilibria_along_which_things_move():
    """Check that the end is an equilibrium after a magnet approaches and rotates, a clamp lifts and a floor rises."""
    # So far away that no face samples its field finely, which a path would not begin to do on its way.
    magnet = ms.CuboidMagnet((0.12, 0.144, 0.096), (0, 1e4, 2e5), center=(0.05, 0.01, 0.36))
    floor = ob.Plane(center=(0, 0, -0.01))
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 0), rotation=(0, 0, 0))
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, remanent_magnetization=(2e4, 0, 0))
    near = ms.Contact(floor, contact_stiffness=10.0)
    scene = ms.Scene(sheet, supports=[clamp], field=magnet, contacts=[near])
    far = ms.equilibrium(scene)
    values = {
        magnet: {"center": (0.05, 0.01, 0.3), "rotation": (0.3, 0.2, 0)},
        clamp: {"displacement": (0, 0, 1e-3), "rotation": (0, -0.1, 0)},
        floor: {"center": (0, 0, -0.004)},
    }
    path = ms.follow_path(scene, start=far, values=values, progress=False)
    assert (
        path.parameters[0] == 0
        and path.parameters[-1] == 1
        and np.array_equal(path.positions[0], far.positions)
    )
    there = ms.equilibrium(scene, start=path.positions[-1], values=values)
    np.testing.assert_allclose(path.positions[-1], there.positions, atol=1e-9)
    middle = len(path) // 2
    share = path.parameters[middle]
    half = {
        owner: {name: (1 - share) * begin + share * np.array(named[name]) for name, begin in at_start.items()}
        for (owner, named), at_start in zip(
            values.items(),
            (
                {"center": magnet.center, "rotation": magnet.rotation},
                {"displacement": np.zeros(3), "rotation": np.zeros(3)},
                {"center": floor.center},
            ),
            strict=True,
        )
    }
    known = path.equilibrium(middle)
    again = ms.equilibrium(scene, start=path.positions[middle], values=half, require_stable=False)
    np.testing.assert_allclose(known.positions, path.positions[middle], atol=1e-12)
    np.testing.assert_allclose(again.positions, path.positions[middle], atol=1e-9)
    assert known.iterations <= 2 and np.array_equal(ms.equilibrium(scene).positions, far.positions)
    with pytest.raises(
        ValueError, match="start has another thickness than the path, which cannot change on its way"
    ):
        ms.follow_path(scene, start=far, values={sheet: {"thickness": 1.1e-3}}, progress=False)
