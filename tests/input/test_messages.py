"""Tests of the wording of messages: bodies by their kind, admissible shapes, suggested names."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest

import magshell as ms

SHEET_MESH = ms.meshes.rectangle(0.04, 0.02, cells=(4, 2))
BOX = ms.meshes.box((0.04, 0.02, 0.02), cells=(2, 2, 2))


def sheet(**more):
    return ms.Shell(SHEET_MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3, **more)


def solid(**more):
    return ms.Solid(
        BOX,
        material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3),
        mass_density=1e3,
        element="linear",
        **more,
    )


MAKERS = {"the sheet": sheet, "the solid": solid}


@pytest.mark.parametrize("name", MAKERS)
def test_messages_name_the_kind_of_body_that_is_free_or_inside_an_obstacle(name):
    body = MAKERS[name]()
    with pytest.raises(ValueError, match=f"the supports leave {name} free: .* Hold it"):
        ms.Scene(body)
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, 0.015)))
    scene = ms.Scene(body, contacts=[floor], allow_rigid_motions=True, gravity=(0, 0, -9.81))
    with pytest.raises(ValueError, match=f"{name} starts inside Plane"):
        ms.simulate(scene, steps=1, time_step=1e-3)
    half = ms.SymmetryPlane((1, 0, 0), point=(0.02, 0, 0))
    with pytest.raises(ValueError, match=f"{name} lies on both sides of SymmetryPlane"):
        ms.Scene(body, supports=[half])


def test_messages_name_the_body_that_is_inside_an_obstacle_by_its_number_where_there_are_several():
    far = ms.Shell(
        ms.TriangleMesh(SHEET_MESH.rest_positions + np.array([0, 0, 0.1]), SHEET_MESH.faces),
        thickness=1e-3,
        young_modulus=1e6,
        mass_density=1e3,
    )
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, 0.015)))
    scene = ms.Scene([far, solid()], contacts=[floor], allow_rigid_motions=True)
    with pytest.raises(ValueError, match="body 1 starts inside Plane"):
        ms.simulate(scene, steps=1, time_step=1e-3)
    with pytest.raises(ValueError, match=r"the supports leave the bodies free: .* Hold them"):
        ms.Scene([far, solid()])


def test_no_message_about_a_solid_says_sheet():
    """Check every refusal that a scene of a solid alone raises here."""
    body = solid()
    clamped = ms.Scene(body, supports=[ms.Pin(BOX.vertices_at(x=0.0))])
    for call in (
        lambda: ms.linear_buckling(clamped),
        lambda: ms.plot(clamped, color="magnetization"),
        lambda: ms.Scene(body, supports=[ms.SymmetryPlane((1, 0, 0), point=(0.01, 0, 0))]),
        lambda: ms.Scene(body, supports=[ms.Pin([0])]),
    ):
        with pytest.raises(ValueError) as told:
            call()
        assert "sheet" not in str(told.value)
    for shape in (ms.obstacles.Tube([(0, 0, 0), (0, 0, 1)], 0.1), ms.obstacles.Sphere(0.1, inside=True)):
        assert "bodies inside" in repr(shape) and "sheet" not in repr(shape)


@pytest.mark.parametrize("shape", [(2, 4, 3), (4, 2), (2,), ()])
def test_a_field_of_wrong_shape_is_told_that_it_may_be_one_or_one_a_load_case(shape):
    scene = ms.Scene(sheet(), supports=[ms.Clamp(SHEET_MESH.edges_at(x=0.0))], field=ms.UniformField())
    words = rf"applied_flux_density \[T\] must have shape \(3,\), or \(k, 3\) for k load cases, got {re.escape(str(shape))}"
    with pytest.raises(ValueError, match=words):
        ms.equilibrium(scene, remanent_magnetization=(1e4, 0, 0), applied_flux_density=np.zeros(shape))
    with pytest.raises(
        ValueError, match=r"field_factor \[1\] must be a number, or have shape \(k,\) for k load cases"
    ):
        ms.equilibrium(
            scene,
            remanent_magnetization=(1e4, 0, 0),
            applied_flux_density=(0, 0, 0),
            field_factor=np.ones((2, 2)),
        )


def test_quantities_that_may_be_one_or_several_say_both_shapes():
    with pytest.raises(ValueError, match=r"directions \[1\] must have shape \(3,\) or \(k, 3\), got \(2,\)"):
        ms.PrintableSet(1e4, [1.0, 0.0])


def test_a_magnetized_solid_is_told_where_its_magnetization_goes():
    body = solid(remanent_magnetization=(1e4, 0, 0))
    scene = ms.Scene(body, supports=[ms.Pin(BOX.vertices_at(x=0.0))], field=ms.UniformField())
    wanted = r'values=\{solid: \{"remanent_magnetization": ...\}\}'
    for given in ((2e4, 0, 0), np.ones((BOX.n_faces, 3))):
        with pytest.raises(ValueError, match=wanted):
            ms.simulate(
                scene,
                steps=1,
                time_step=1e-3,
                remanent_magnetization=given,
                applied_flux_density=(0, 0, 1e-3),
            )
        with pytest.raises(ValueError, match=wanted):
            ms.equilibrium(scene, remanent_magnetization=given, applied_flux_density=(0, 0, 1e-3))


@pytest.mark.parametrize(
    "call, use",
    [
        (lambda: ms.Shell(SHEET_MESH, thickness=1e-3, youngs_modulus=1e6), "use young_modulus; it has"),
        (lambda: ms.Shell(SHEET_MESH, thickness=1e-3, E=1e6), "use young_modulus; it has"),
        (lambda: ms.Shell(SHEET_MESH, h=1e-3, young_modulus=1e6), "use thickness; it has"),
        (lambda: ms.equilibrium(None, B=(0, 0, 1e-3)), "use applied_flux_density; it has"),
        (lambda: ms.simulate(None, B=(0, 0, 1e-3)), "use applied_flux_density; it has"),
        (lambda: ms.simulate(None, duration=1.0), "use steps and time_step; it has"),
        (lambda: ms.simulate(None, steps=1, dt=1e-3), "use time_step; it has"),
        (lambda: ms.Scene(None, g=(0, 0, -9.81)), "use gravity; it has"),
        (lambda: ms.Solid(BOX, material=None, rho=1e3), "use mass_density; it has"),
        (lambda: ms.NeoHookean(young_modulus=1e5, nu=0.3), "use poisson_ratio; it has"),
        (lambda: ms.simulate(None, stps=1), "most like it first: steps"),
    ],
)
def test_a_name_from_elsewhere_is_answered_with_the_one_to_use(call, use):
    with pytest.raises(TypeError, match=use):
        call()


def test_a_value_by_a_name_from_elsewhere_is_answered_with_the_one_to_use():
    body = sheet()
    scene = ms.Scene(body, supports=[ms.Clamp(SHEET_MESH.edges_at(x=0.0))])
    with pytest.raises(
        ValueError, match="Shell has no value 'E' to be replaced in a solve: use young_modulus; it has "
    ):
        ms.equilibrium(scene, values={body: {"E": 1e5}})


def test_names_in_messages_come_in_the_same_order_in_every_process():
    script = (
        "import magshell as ms\n"
        "from magshell._runtime.keywords import nearest_first\n"
        "print(nearest_first('x', {'beta', 'alpha', 'gamma', 'delta'}))\n"
        "material = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)\n"
        "body = ms.Solid(ms.meshes.box((1, 1, 1), cells=(1, 1, 1)), material=material, element='linear')\n"
        "try: ms.equilibrium(ms.Scene(body, allow_rigid_motions=True), values={body: {'x': 1}})\n"
        "except ValueError as error: print(error)\n"
        "try: ms.plot(body, clor=1)\n"
        "except TypeError as error: print(error)\n"
    )
    told = {
        subprocess.run(
            [sys.executable, "-c", script],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("0", "1", "2")
    }
    assert len(told) == 1 and "it has" in told.pop()


def test_a_point_mass_on_a_slide_needs_no_joint_away_from_its_center():
    """Compare with x(t) = g/w^2 (1 - cos wt) of a mass on a spring, wherever it is."""
    for place in ((0.0, 0.0, 0.0), (0.3, 0.2, 0.0)):
        mass = ms.Link(mass=1.0, center=place)
        slide = ms.Prismatic(mass, origin=place, axis=(1, 0, 0), spring_stiffness=10.0, rest_displacement=0.0)
        scene = ms.Scene(ms.Skeleton([mass], [slide]), gravity=(1.0, 0, 0))
        move = ms.simulate(scene, steps=200, time_step=5e-3)
        assert move[mass].center[-1] - place == pytest.approx(
            (0.1 * (1 - np.cos(np.sqrt(10.0))), 0, 0), abs=3e-5
        )
        assert ms.equilibrium(scene)[mass].center - place == pytest.approx((0.1, 0, 0), abs=1e-9)


def test_a_point_mass_on_a_hinge_through_its_center_is_still_refused():
    mass = ms.Link(mass=1.0, center=(0, 0, 0))
    with pytest.raises(
        ValueError, match=r"does not let it turn \(Prismatic, Fixed\): nothing tells how it turns"
    ):
        ms.Scene(ms.Skeleton([mass], [ms.Revolute(mass, origin=(0, 0, 0), axis=(1, 0, 0))]))


def test_a_motion_as_start_of_a_static_solve_is_refused_with_advice():
    mesh = ms.meshes.rectangle(0.04, 0.02, cells=(4, 2))
    body = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(body, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    motion = ms.simulate(scene, steps=1, time_step=1e-3)
    with pytest.raises(
        TypeError, match=r"Equilibrium or positions, got Trajectory: .* motion.positions\[-1\]"
    ):
        ms.equilibrium(scene, start=motion)
    assert ms.equilibrium(scene, start=motion.positions[-1]).stable


def test_an_object_as_index_of_a_batch_of_motions_is_refused_with_advice():
    mesh = ms.meshes.rectangle(0.04, 0.02, cells=(4, 2))
    body = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(body, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    batch = ms.simulate(scene, steps=1, time_step=1e-3, batch=3, gravity_factor=[0.5, 1.0, 1.5])
    with pytest.raises(TypeError, match=r"takes the number of a member, got Shell; batch\[k\]"):
        batch[body]
    assert batch[np.int64(2)] is batch[-1]
