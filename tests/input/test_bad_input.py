"""Messages for bad meshes, shells, scenes, supports and loads, DESIGN.md 5."""

import numpy as np
import pytest
from bad_input import (
    CLAMP,
    END,
    MESH,
    N_E,
    N_F,
    N_V,
    NOT_NUMBERS,
    held_by,
    loaded_by,
    refused,
    scene,
    shell,
    solve,
    with_entry,
)

import magshell as ms

test_shell_is_refused = refused(
    [
        ("bool", lambda: shell(thickness=True), rf"thickness \[m\] {NOT_NUMBERS}, got True"),
        (
            "bools",
            lambda: shell(thickness=np.ones(N_F, bool)),
            rf"thickness \[m\] {NOT_NUMBERS}, got dtype bool",
        ),
        ("string", lambda: shell(thickness="1e-3"), rf"thickness \[m\] {NOT_NUMBERS}, got '1e-3'"),
        ("none", lambda: shell(young_modulus=None), rf"young_modulus \[Pa\] {NOT_NUMBERS}, got None"),
        ("complex", lambda: shell(young_modulus=1j), rf"young_modulus \[Pa\] {NOT_NUMBERS}"),
        (
            "ragged",
            lambda: shell(thickness=[[1, 2], [3]]),
            rf"thickness \[m\] {NOT_NUMBERS}: .*inhomogeneous",
        ),
        (
            "masked",
            lambda: shell(thickness=np.ma.masked_less(np.arange(N_F), 1)),
            r"thickness \[m\] has masked entries",
        ),
        ("negative", lambda: shell(thickness=-1), r"thickness \[m\] must be positive, but entry 0 is -1"),
        ("zero", lambda: shell(thickness=0), r"thickness \[m\] must be positive"),
        ("nan", lambda: shell(thickness=np.nan), r"thickness \[m\] must be finite, but thickness is nan"),
        (
            "an infinite entry",
            lambda: shell(young_modulus=with_entry(N_F, 3, np.inf)),
            r"young_modulus \[Pa\] must be finite, but young_modulus\[3\] is inf",
        ),
        (
            "a negative entry",
            lambda: shell(young_modulus=with_entry(N_F, 5, -2)),
            r"young_modulus \[Pa\] must be positive, but entry 5 is -2",
        ),
        (
            "one too many",
            lambda: shell(thickness=np.ones(N_F + 1)),
            rf"thickness \[m\] must be a number or have shape \(n_f,\) = \({N_F},\), got \({N_F + 1},\)",
        ),
        ("a column", lambda: shell(thickness=np.ones((N_F, 1))), rf"\({N_F},\), got \({N_F}, 1\)"),
        (
            "poisson",
            lambda: shell(poisson_ratio=0.51),
            r"poisson_ratio \[1\] must be in \(-1, 1/2\], .* is 0.51",
        ),
        ("poisson -1", lambda: shell(poisson_ratio=-1), r"must be in \(-1, 1/2\], but entry 0 is -1"),
        ("density", lambda: shell(mass_density=0), r"mass_density \[kg/m3\] must be positive"),
        (
            "curvature scale",
            lambda: shell(curvature_scale=np.ones(N_F)),
            rf"curvature_scale \[1\] must be a number or have shape \(n_e,\) = \({N_E},\), got \({N_F},\)",
        ),
        (
            "bending",
            lambda: shell(bending="quad"),
            r"bending must be one of \('midedge', 'midedge2', 'hinge'\), got 'quad'",
        ),
        (
            "mesh",
            lambda: ms.Shell("mesh", thickness=1, young_modulus=1),
            "mesh must be a TriangleMesh or a QuadraticTriangleMesh, got str",
        ),
    ]
)

test_scene_is_refused = refused(
    [
        (
            "shell",
            lambda: ms.Scene(MESH),
            "bodies must hold Shell, Solid, RigidBody, Skeleton objects, got TriangleMesh",
        ),
        ("no supports", lambda: scene(supports=None), "supports must hold Pin, Clamp, .* got NoneType"),
        ("a string", lambda: scene(supports="clamp"), "supports must hold .* objects, got str"),
        (
            "a load as support",
            held_by(ms.PointLoad([0], (0, 0, 1))),
            "supports must hold Pin, Clamp, SymmetryPlane, EqualDisplacement, Periodic objects, got PointLoad",
        ),
        ("a support as load", lambda: scene(loads=[CLAMP]), "loads must hold PointLoad, .* got Clamp"),
        (
            "a class",
            lambda: scene(field=ms.UniformField),
            "field must hold .* the class UniformField: call it",
        ),
        (
            "two uniform",
            lambda: scene(field=[ms.UniformField(), ms.UniformField()]),
            "field holds several UniformFields",
        ),
        ("a field without value", lambda: scene(field=ms.AppliedField()), "AppliedField without a value"),
        ("gravity without mass", lambda: scene(gravity=(0, 0, -9.81)), r"no mass_density \[kg/m3\]"),
        (
            "gravity's shape",
            lambda: scene(gravity=-9.81),
            r"gravity \[m/s2\] must have shape \(3,\), got \(\)",
        ),
        ("gravity nan", lambda: scene(gravity=(0, 0, np.nan)), r"gravity\[2\] is nan"),
        (
            "not a bool",
            lambda: scene(allow_rigid_motions="no"),
            "allow_rigid_motions must be True or False, got 'no'",
        ),
    ]
)

test_free_rigid_motions_are_named = refused(
    [
        ("nothing", held_by(), r"translation along \(1, 0, 0\); .*rotation about \(0, 1, 0\)"),
        (
            "one pin",
            held_by(ms.Pin([0])),
            r"^(?!.*translation).*rotation about .*rotation about .*rotation about",
        ),
        (
            "pinned along a line",
            held_by(ms.Pin(END)),
            r"leave the sheet free: rotation about \(0, 1, 0\) through \(0, 0.25, 0\) m\. Hold it",
        ),
        (
            "lying on a table",
            held_by(ms.Pin(np.arange(N_V), "z")),
            r"(?=.*rotation about \(0, 0, -?1\))(?=.*along \(-?1, 0, 0\))(?=.*along \(0, -?1, 0\))",
        ),
        (
            "on a symmetry plane",
            held_by(ms.SymmetryPlane((1, 0, 0))),
            r"(?=.*rotation about \(-?1, 0, 0\))(?=.*along \(0, -?1, 0\))(?=.*along \(0, 0, -?1\))",
        ),
    ]
)


def test_free_motions_name_the_part():
    apart = MESH.transformed(translation=(3, 0, 0))
    both = ms.TriangleMesh(
        np.concatenate([MESH.rest_positions, apart.rest_positions]),
        np.concatenate([MESH.faces, apart.faces + N_V]),
    )
    sheet = ms.Shell(both, thickness=1e-2, young_modulus=1e6)
    with pytest.raises(ValueError, match=rf"translation along \(1, 0, 0\) of part 1 \(with vertex {N_V}\)"):
        ms.Scene(sheet, supports=[ms.Clamp(both.edges_at(x=0.0))])


test_support_is_refused = refused(
    [
        ("empty", lambda: ms.Pin([]), "Pin vertices are empty"),
        ("empty clamp", lambda: ms.Clamp(np.zeros(0, int)), "Clamp edges are empty"),
        (
            "empty mask",
            lambda: ms.Pin(np.zeros(N_V, bool)),
            "Pin vertices are empty: the mask is False everywhere",
        ),
        (
            "a mask's shape",
            held_by(ms.Pin(np.ones(3, bool))),
            rf"a mask must have shape \({N_V},\), got \(3,\)",
        ),
        ("out of range", held_by(ms.Pin([N_V])), rf"Pin vertices must be in \[0, {N_V}\), got {N_V}"),
        ("negative", held_by(ms.Pin([-1])), rf"Pin vertices must be in \[0, {N_V}\), got -1"),
        ("edge out of range", held_by(ms.Clamp([N_E])), rf"Clamp edges must be in \[0, {N_E}\), got {N_E}"),
        ("repeated", held_by(ms.Pin([4, 4])), "Pin vertices must not repeat, but 4 does"),
        (
            "floats",
            lambda: ms.Pin([0.0]),
            r"Pin vertices must be integer indices of shape \(k,\), got float64",
        ),
        ("string", lambda: ms.Pin("all"), r"Pin vertices must be integer indices of shape \(k,\), got 'all'"),
        ("ragged", lambda: ms.Pin([[0], [1, 2]]), "Pin vertices must be integer indices .*inhomogeneous"),
        (
            "a table",
            lambda: ms.Pin([[0, 1]]),
            r"integer indices of shape \(k,\), got int64 of shape \(1, 2\)",
        ),
        ("components", lambda: ms.Pin([0], "w"), 'components must be some of "x", "y", "z", got \'w\''),
        ("a component twice", lambda: ms.Pin([0], "xx"), "components must be some of .* got 'xx'"),
        ("no string", lambda: ms.Pin([0], ["x", "y"]), "components must be some of"),
        (
            "displacement",
            lambda: ms.Pin([0], displacement=1.0),
            r"displacement \[m\] must have shape \(3,\), got \(\)",
        ),
        ("nan", lambda: ms.Pin([0], displacement=(0, np.nan, 0)), r"displacement\[1\] is nan"),
        (
            "moved where it is free",
            lambda: ms.Pin([0], "xy", displacement=(0, 0, 1e-3)),
            r"displacement \[m\] moves along z, but the Pin holds only xy",
        ),
        (
            "rotation",
            lambda: ms.Clamp([0], rotation=1.0),
            r"rotation \[rad\] must have shape \(3,\), got \(\)",
        ),
        (
            "center",
            lambda: ms.Pin([0], center=(0, 0, 0)),
            r"center is that of a rotation: give a rotation \[rad\]",
        ),
        ("held twice", held_by(CLAMP, CLAMP.replaced()), "two supports hold the direction across edge 0"),
        (
            "still and moved",
            held_by(CLAMP, ms.Pin(END[:1], displacement=(0, 0, 1e-3))),
            "one support holds vertex 0 along a direction in which another moves it",
        ),
        (
            "still and turned all the way round",
            held_by(CLAMP, ms.Pin(END, rotation=(2 * np.pi, 0, 0))),
            "one support holds vertex 0 along a direction in which another moves it",
        ),
        (
            "moved two ways",
            held_by(*(ms.Clamp(CLAMP.edges[k : k + 1], displacement=(0, 0, 1e-3 * k)) for k in (0, 1))),
            "two supports move vertex 1 to different places",
        ),
        ("plane's normal", lambda: ms.SymmetryPlane((0, 0, 0)), "normal must not be zero"),
        (
            "plane's tolerance",
            lambda: ms.SymmetryPlane((1, 0, 0), tolerance=-1),
            r"tolerance \[m\] must not be neg",
        ),
        (
            "nothing in the plane",
            held_by(CLAMP, ms.SymmetryPlane((1, 0, 0), (0.13, 0, 0))),
            r"no vertex lies in SymmetryPlane\(normal \(1, 0, 0\).* the nearest is 0.12 m away",
        ),
        (
            "a sheet on both sides",
            held_by(CLAMP, ms.SymmetryPlane((1, 0, 0), (0.5, 0, 0))),
            r"the sheet lies on both sides of SymmetryPlane.*model one half",
        ),
        (
            "a sheet in the plane",
            held_by(ms.SymmetryPlane((0, 0, 1))),
            "the sheet lies in SymmetryPlane.* at edge",
        ),
    ]
)

test_load_is_refused = refused(
    [
        (
            "rows",
            loaded_by(lambda: ms.PointLoad([0, 1], np.ones((3, 3)))),
            r"force \[N\] must have shape \(3,\) or \(2, 3\), got \(3, 3\)",
        ),
        (
            "a number",
            loaded_by(lambda: ms.PointLoad([0], 1.0)),
            r"force \[N\] must have shape \(3,\) or \(k, 3\), got \(\)",
        ),
        ("nan", loaded_by(lambda: ms.PointLoad([0], (0, 0, np.nan))), r"force\[2\] is nan"),
        ("bools", loaded_by(lambda: ms.PointLoad([0], (True, False, True))), rf"force \[N\] {NOT_NUMBERS}"),
        ("nowhere", loaded_by(lambda: ms.PointLoad([], (0, 0, 1))), "PointLoad vertices are empty"),
        (
            "an edge",
            loaded_by(lambda: ms.EdgeLoad([N_E], (0, 0, 1))),
            rf"EdgeLoad edges must be in \[0, {N_E}\)",
        ),
        (
            "a face",
            loaded_by(lambda: ms.AreaLoad((0, 0, 1), [N_F])),
            rf"AreaLoad faces must be in \[0, {N_F}\)",
        ),
        ("no faces", loaded_by(lambda: ms.AreaLoad((0, 0, 1), [])), "AreaLoad faces are empty"),
        (
            "a couple inside",
            loaded_by(lambda: ms.EdgeCouple(MESH.interior_edges[:1], 1.0)),
            f"EdgeCouple edges must be on the boundary, but edge {MESH.interior_edges[0]} is not",
        ),
        (
            "a couple at a clamp",
            loaded_by(lambda: ms.EdgeCouple(CLAMP.edges, 1.0)),
            f"EdgeCouple acts on edge {CLAMP.edges[0]}, whose direction a support holds",
        ),
        (
            "a couple's shape",
            loaded_by(lambda: ms.EdgeCouple([0], (1, 2))),
            r"couple_per_length \[N\] must be a number or have shape \(3,\), got \(2,\)",
        ),
    ]
)

test_mesh_is_refused = refused(
    [
        (
            "ragged",
            lambda: ms.TriangleMesh(MESH.rest_positions, [[0, 1], [2]]),
            "faces must hold integer indices",
        ),
        (
            "bools",
            lambda: ms.TriangleMesh(np.ones((3, 3), bool), [[0, 1, 2]]),
            rf"rest_positions \[m\] {NOT_NUMBERS}",
        ),
    ]
)

test_unknown_keywords_are_named = refused(
    [
        ("shell", lambda: shell(poisons_ratio=0.3), "'poisons_ratio'"),
        ("scene", lambda: scene(load=[]), "'load'"),
        ("solve", lambda: solve(magnetization=1), "'magnetization'"),
        ("missing", lambda: ms.Shell(MESH, young_modulus=1e6), "'thickness'"),
    ],
    TypeError,
)
