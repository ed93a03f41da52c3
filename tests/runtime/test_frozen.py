"""Immutability of every public object and of every array in it, also in copies."""

import copy
import pickle
from collections.abc import Iterator

import numpy as np
import pytest
from public_objects import STATEFUL, Arrays, found_results, frozen_classes, made_objects, public_classes

import magshell as ms
from magshell._runtime.frozen import Frozen
from magshell.design.content_hash import content_hash

MADE = made_objects(Arrays())
OBJECTS = {**MADE, **found_results(Arrays(), MADE)}
NO_COPIES = (ms.Picture, ms.shapes.Shape, ms.WarmStart, ms.EquilibriumPath, ms.FitResult)  # no digest
ABSTRACT = {
    "AppliedField",
    "Joint",
    "control.Curve",
    "obstacles.Obstacle",
    "shapes.Shape",
}  # subclasses stand for them


@pytest.fixture(params=OBJECTS.values(), ids=OBJECTS.keys())
def thing(request):
    return request.param


def attributes(thing) -> list[str]:
    """Return the names of attributes that are no methods."""
    names = [name for name in dir(thing) if not name.startswith("_")]
    return [name for name in names if not callable(getattr(type(thing), name, None))]


def stored_values(thing) -> Iterator[tuple[str, object]]:
    """Yield (name, value) of an object's attributes, also inside tuples and dicts, except those computed at each
    access.
    """
    for name in attributes(thing):
        if name in getattr(thing, "_as_given", ()):
            continue
        try:
            value, again = getattr(thing, name), getattr(thing, name)
        except (AttributeError, ValueError, TypeError, IndexError):  # a property that this one does not have
            continue
        yield from _parts(name, value, again)


def _parts(name, value, again) -> Iterator[tuple[str, object]]:
    if isinstance(value, tuple):
        for k, (one, other) in enumerate(zip(value, again, strict=True)):
            yield from _parts(f"{name}[{k}]", one, other)
    elif isinstance(value, dict):
        for key in value:
            yield from _parts(f"{name}[{key!r}]", value[key], again[key])
    if isinstance(value, np.ndarray):
        if np.shares_memory(value, again):
            yield name, value
    elif value is again:
        yield name, value


def test_every_public_class_has_an_object_here() -> None:
    known = {type(each) for each in OBJECTS.values()}
    missing = {
        name
        for name, cls in public_classes().items()
        if name not in {*STATEFUL, *ABSTRACT} and cls not in known
    }
    assert missing == set() or missing == {"MagpylibField"}


def test_every_public_class_is_immutable_or_says_why_not() -> None:
    open_ones = {name for name, cls in public_classes().items() if cls.__setattr__ is not Frozen.__setattr__}
    assert open_ones == {name for name in STATEFUL if name in public_classes()}


def test_every_immutable_class_has_an_object_here() -> None:
    known = tuple({type(each) for each in OBJECTS.values()})
    bases = {base for cls in known for base in cls.__mro__}
    missing = {cls.__name__ for cls in frozen_classes() - bases}
    assert missing - {"NoMesh", "MagpylibField"} == set()  # a scene without sheets has a NoMesh


def test_no_attribute_can_be_assigned(thing) -> None:
    for name in attributes(thing):
        before = vars(thing).get(name) if hasattr(thing, "__dict__") else None
        with pytest.raises(AttributeError, match=f"stays as it was made: {name} cannot be changed. "):
            setattr(thing, name, 1.0)
        with pytest.raises(AttributeError, match="stays as it was made"):
            delattr(thing, name)
        assert before is None or vars(thing)[name] is before
    with pytest.raises(AttributeError, match="stays as it was made"):
        thing.not_there_before = 1.0


def test_no_array_list_or_dict_of_it_can_be_edited(thing) -> None:
    for name, value in stored_values(thing):
        assert not (isinstance(value, np.ndarray) and value.flags.writeable), name
        assert type(value) not in (list, dict, set, bytearray), name


@pytest.mark.parametrize(
    "duplicate", [copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))]
)
def test_copies_are_as_immutable(thing, duplicate) -> None:
    if isinstance(thing, NO_COPIES) and duplicate is not copy.copy:
        pytest.skip("it holds what cannot be copied")
    twin = duplicate(thing)
    test_no_attribute_can_be_assigned(twin)
    test_no_array_list_or_dict_of_it_can_be_edited(twin)


def test_message_names_the_way_to_another_value() -> None:
    for thing, name, way in (
        (
            MADE["shell"],
            "thickness",
            r'values={shell: {"thickness": ...}}; else make another, shell.replaced\(thick',
        ),
        (
            MADE["shell"],
            "mesh",
            r"Make another, Shell\(\.\.\.\)\. values={shell: {\.\.\.}} and shell\.replaced\(\.\.\.\)",
        ),
        (
            MADE["scene"],
            "gravity",
            r'values={scene: {"gravity": \.\.\.}}; else make another, Scene\(\.\.\.\)',
        ),
        (
            MADE["body contact"],
            "activation_distance",
            r'values={body_contact: {"activation_distance": \.\.\.}}',
        ),
        (MADE["flat"], "faces", r"Make another, TriangleMesh\(\.\.\.\)"),
        (MADE["Newton"], "tolerance", r"dataclasses\.replace\(newton, tolerance=\.\.\.\)"),
        (OBJECTS["trajectory"], "positions", "start="),
        (OBJECTS["equilibrium"], "positions", "start="),
    ):
        with pytest.raises(AttributeError, match=way):
            setattr(thing, name, 1.0)


def test_a_result_whose_positions_are_edited_says_so_and_start_takes_a_changed_copy() -> None:
    rest, move = OBJECTS["equilibrium"], OBJECTS["trajectory"]
    with pytest.raises(ValueError, match="read-only"):
        rest.positions[-1] += 1e-3
    with pytest.raises(ValueError, match="read-only"):
        move.positions[-1] += 1e-3
    with pytest.raises(TypeError, match=r"edit a copy, dict\(\.\.\.\)"):
        rest.energies["membrane"] = 0.0
    asked = {"remanent_magnetization": (1e3, 0, 0), "applied_flux_density": (0, 0, 1e-4)}
    there = ms.equilibrium(rest.scene, start=rest.positions + 1e-5 * np.sin(50 * rest.positions), **asked)
    assert there.stable


def test_a_changed_array_of_the_caller_changes_nothing() -> None:
    given = Arrays()
    made = made_objects(given)
    things = {**made, **found_results(given, made)}
    before = {name: content_hash(each) for name, each in things.items() if not isinstance(each, NO_COPIES)}
    moved = things["moved"]([[0.1, 0, 0]])
    given.change()
    assert {name for name in before if content_hash(things[name]) != before[name]} == set()
    np.testing.assert_array_equal(things["moved"]([[0.1, 0, 0]]), moved)


def test_a_solve_leaves_the_arrays_of_its_caller_writable() -> None:
    given = Arrays()
    made = made_objects(given)
    found_results(given, made)
    assert all(array.flags.writeable for array in given.made)


def one_more(name: str, thing, **others) -> ms.Scene:
    """Build a scene with the object twice in one of its lists."""
    bodies = others.pop("bodies", MADE["shell"])
    return ms.Scene(bodies, **{"allow_rigid_motions": True, **others, name: [thing, thing]})


TWICE = {
    **{
        name: ("loads", name)
        for name in (
            "point load",
            "edge load",
            "area load",
            "couple",
            "pressure",
            "tension",
            "spring",
            "foundation",
        )
    },
    **{name: ("supports", name) for name in ("pin", "clamp", "symmetry", "equal displacement", "periodic")},
    **{
        name: ("field", name)
        for name in ("uniform", "dipoles", "sampled", "custom", "placed", "cuboid", "cylinder")
    },
    **{name: ("contacts", name) for name in ("contact", "body contact", "self contact")},
    **{name: ("actuators", name) for name in ("muscle", "cavity", "cells", "tendon")},
    "tie": ("ties", "tie"),
}


@pytest.mark.parametrize("name", TWICE)
def test_duplicates_in_a_scene_are_refused(name) -> None:
    argument, thing = TWICE[name][0], MADE[TWICE[name][1]]
    message = (
        rf"{argument} must differ, but {argument}\[0\] and {argument}\[1\] are one {type(thing).__name__}"
    )
    with pytest.raises(ValueError, match=message):
        one_more(argument, thing)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ms.Scene([MADE["shell"]] * 2, allow_rigid_motions=True), "bodies 0 and 1 are one Shell"),
        (lambda: ms.Scene([MADE["rigid"]] * 2), "rigid parts 0 and 1 are one Rigid"),
        (lambda: ms.Scene([MADE["skeleton"]] * 2), "rigid parts 0 and 2 are one Rigid"),
        (lambda: ms.Contact([MADE["plane"]] * 2), r"obstacles\[0\] and obstacles\[1\] are one Plane"),
        (lambda: ms.Skeleton([MADE["link"]] * 2), r"links\[0\] and links\[1\] are one Link"),
        (lambda: ms.Skeleton(MADE["skeleton"].links, [MADE["hinge"]] * 2), r"joints\[1\] are one Revolute"),
        (lambda: ms.Cavity([MADE["balloon"]] * 2, pressure=1.0), "names each body once"),
    ],
)
def test_duplicates_in_other_lists_are_refused(make, message) -> None:
    with pytest.raises(ValueError, match=message):
        make()


def test_a_result_of_one_body_has_its_stresses_and_strains() -> None:
    rest, move, path, of_solid = (
        OBJECTS[name] for name in ("equilibrium", "trajectory", "path", "solid result")
    )
    for result in (rest, move, path, OBJECTS["equilibria"]):
        body = result.scene.bodies[0]
        assert content_hash(result.stresses()) == content_hash(result[body].stresses())
        assert content_hash(result.strains()) == content_hash(result[body].strains())
    whole = of_solid._result
    assert (
        content_hash(whole.stresses()) == content_hash(of_solid.stresses()) == content_hash(whole.strains())
    )


def test_stresses_of_several_bodies_are_asked_of_one_of_them() -> None:
    sheets = [MADE["tie"].a, MADE["tie"].b]
    both = ms.Scene(
        sheets, supports=[ms.Pin([0, 1, 2, 3, 4, 5], body=each) for each in sheets], field=ms.UniformField()
    )
    rest = ms.equilibrium(both, remanent_magnetization=(1e3, 0, 0), applied_flux_density=(0, 0, 0))
    with pytest.raises(ValueError, match=r"has 2 bodies: say which, result\[body\]\.stresses\(\)"):
        rest.stresses()


PRIVATE = {
    *(
        "add_numbers",
        "gradients",
        "by_thickness",
        "for_all",
        "grown_by",
        "has_grown",
        "filling",
        "is_spring",
        "riding",
    ),
    *(
        "directed",
        "distance_given",
        "has_axis",
        "in_order",
        "joint_to",
        "parent_of",
        "wave_modulus",
        "weighed_masses",
    ),
    *(
        "nearly_incompressible",
        "face_thickness",
        "face_magnetization",
        "edge_couples",
        "pressure_at",
        "tension_at",
    ),
    *("check_in", "courses", "at_start", "acts", "resting", "driven", "drifts", "moved_by", "tree"),
}


def test_names_of_the_inside_are_not_offered(thing) -> None:
    """Check that help() and tab completion show the public names only."""
    assert PRIVATE & {name for name in dir(thing) if not name.startswith("_")} == set()


@pytest.mark.parametrize(
    "module", ["objectives", "parametrize", "control", "optim", "shapes", "obstacles", "meshes"]
)
def test_a_module_offers_its_public_names_alone(module) -> None:
    found = getattr(ms, module)
    assert dir(found) == sorted(found.__all__)
    for name in found.__all__:
        member = getattr(found, name)  # a class, a function or a module
        assert getattr(member, "__module__", member.__name__).startswith("magshell")


def test_replaced_makes_another_with_every_value_that_the_message_names() -> None:
    """Check the objects whose values a solve may override; the message refers users to `replaced`."""
    for name, each in MADE.items():
        replaceable = [value for value in getattr(each, "_replaceable", ()) if hasattr(each, value)]
        values = {value: getattr(each, value) for value in replaceable if not callable(getattr(each, value))}
        given = {value: now for value, now in values.items() if now is not None}
        if not given or not hasattr(each, "replaced"):
            continue
        other = each.replaced(**given)
        assert type(other) is type(each) and other is not each, name
        test_no_attribute_can_be_assigned(other)
        for value, now in given.items():
            np.testing.assert_array_equal(getattr(other, value), now, err_msg=f"{name}.{value}")


def test_a_list_that_contains_itself_is_refused() -> None:
    endless: list = []
    endless.append(endless)
    with pytest.raises(ValueError, match="angle_branches must not contain itself"):
        ms.MotionState(0.0, np.zeros(6), velocity=np.zeros(6), angle_branches=endless)
