"""Bad input to scenes of several shells, and the messages that refuse it."""

import numpy as np
import pytest
from two_strips import STRONG, strip

import magshell as ms
from magshell import obstacles as ob

A, B, STRANGER = strip(0, remanent_magnetization=None), strip(1, remanent_magnetization=None), strip(2)
HELD = [ms.Clamp(each.mesh.edges_at(x=0.0), body=each) for each in (A, B)]
IN_FIELD = ms.Scene([A, B], supports=HELD, field=ms.UniformField())
M = (1e4, 0, 0)
HEAVY = ms.Scene([A, B], supports=HELD, gravity=(0, 0, -1))


@pytest.mark.parametrize(
    "act, words",
    [
        (lambda: ms.Scene([A, A]), "bodies 0 and 1 are one Shell"),
        (lambda: ms.Scene([]), "at least one Shell"),
        (
            lambda: ms.Scene([A, A.mesh]),
            "bodies must hold Shell, Solid, RigidBody, Skeleton objects, got TriangleMesh",
        ),
        (lambda: ms.Scene([A, B], supports=[ms.Pin([0])]), r"2 bodies, so a Pin must say.*body="),
        (lambda: ms.Scene([A, B], supports=HELD, loads=[ms.PointLoad([0], M)]), "a PointLoad must say"),
        (
            lambda: ms.Scene([A, B], loads=[ms.AreaLoad(M, [0])], allow_rigid_motions=True),
            "an? AreaLoad must",
        ),
        (lambda: ms.Scene([A, B], loads=[ms.EdgeCouple([0], 1.0)]), "an? EdgeCouple must say"),
        (
            lambda: ms.Scene(
                [A, B], contacts=[ms.Contact(ob.Plane(), vertices=[0])], allow_rigid_motions=True
            ),
            "a Contact must say",
        ),
        (lambda: ms.Scene(A, supports=[ms.Pin([0], body=B)]), "about a body that is not in the scene"),
        (lambda: ms.Scene([A, B], supports=[ms.Pin([99], body=A)]), r"Pin vertices must be in \[0, 27\)"),
        (lambda: ms.Pin([0], body=A.mesh), "body must be a Shell or Solid of the scene, got TriangleMesh"),
        (lambda: ms.Clamp([0], body=0), "body must be a Shell or Solid of the scene, got 0"),
        (lambda: IN_FIELD.shell, r"2 bodies: say which"),
        (lambda: ms.equilibrium(HEAVY, thickness=1e-3), r"2 bodies: say whose.*values=\{body"),
        (
            lambda: ms.equilibrium(HEAVY, values={STRANGER: {"thickness": 1e-3}}),
            "not the scene, nor an object of it",
        ),
        (lambda: ms.equilibrium(IN_FIELD, applied_flux_density=STRONG), "remanent_magnetization of body 0"),
        (
            lambda: ms.equilibrium(
                IN_FIELD, applied_flux_density=STRONG, values={A: {"remanent_magnetization": M}}
            ),
            r"remanent_magnetization of body 1 \[A/m\] is needed",
        ),
        (
            lambda: ms.equilibrium(
                IN_FIELD,
                applied_flux_density=STRONG,
                remanent_magnetization=M,
                values={A: {"remanent_magnetization": M}},
            ),
            "given twice",
        ),
        (
            lambda: ms.equilibrium(HEAVY, values={A: {"remanent_magnetization": M}}),
            "the scene has no field",
        ),
        (
            lambda: ms.equilibrium(
                IN_FIELD,
                applied_flux_density=STRONG,
                values={A: {"remanent_magnetization": [M, M]}, B: {"remanent_magnetization": M}},
            ),
            r"remanent_magnetization \[A/m\] must have shape \(n_f, 3\) = \(32, 3\)",
        ),
        (
            lambda: ms.equilibrium(
                IN_FIELD, applied_flux_density=STRONG, remanent_magnetization=np.ones((32, 3))
            ),
            r"must have shape \(n_f, 3\) = \(64, 3\)",
        ),
        (lambda: ms.equilibrium(HEAVY)[STRANGER], "a Shell that is not in it"),
        (lambda: ms.equilibrium(HEAVY)["A"], "one of scene.bodies, got 'A'"),
        (
            lambda: ms.Scene([A, strip(3, mass_density=None)], gravity=(0, 0, -1), allow_rigid_motions=True),
            "body 1 of the scene has no mass_density",
        ),
        (lambda: strip(0, remanent_magnetization=(1, 2)), r"remanent_magnetization \[A/m\] must have shape"),
    ],
)
def test_scenes_of_several_sheets_refuse_bad_input(act, words):
    with pytest.raises(ValueError, match=words):
        act()


def test_a_couple_across_its_edges_is_refused():
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    supports = [ms.Clamp(mesh.edges_at(x=0.0))]
    with pytest.raises(ValueError, match=r"has no component along them\. A RigidBody"):
        ms.equilibrium(
            ms.Scene(sheet, supports=supports, loads=[ms.EdgeCouple(mesh.edges_at(x=0.04), (1e-2, 0, 0))])
        )
    zero = ms.EdgeCouple(mesh.edges_at(x=0.04), (0, 0, 0))
    assert ms.equilibrium(ms.Scene(sheet, supports=supports, loads=[zero])).stable
