"""The scene: one or several bodies, their supports, and everything that acts on them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.checked_list import checked_list
from ..._input.quantity import quantity
from ..._runtime.mixins import PlotMixin
from ..._runtime.solver_entry_point import grouped
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..actuators.actuator import Actuator
from ..bodies.bodies import Bodies, called
from ..bodies.ties import Tie
from ..contact.attached_obstacles import bodies_of_attached
from ..contact.body_contact import BodyContact
from ..contact.contact import Contact
from ..contact.contacts_to_core import (
    body_contact_inputs,
    check_shapes,
    contact_inputs,
    obstacles_of,
    rigid_bodies_in_contact,
    split_contacts,
)
from ..fields.field import FIELDS, AppliedField, UniformField
from ..loads.custom_energy import CustomEnergy
from ..loads.face_energies import FaceEnergy
from ..loads.loads import AreaLoad, DeadLoad, EdgeCouple, EdgeLoad, PointLoad
from ..loads.pressure import Pressure
from ..loads.springs import Springs
from ..loads.water import Water
from ..rigid.equimomental_points import rigid_body_points
from ..rigid.joints import Joint
from ..rigid.rigid import RigidBody
from ..rigid.skeleton import Skeleton, skeleton_inputs
from ..shells.crease import Crease
from ..shells.obtuse_faces import ObtuseFaces
from ..shells.shell import Shell
from ..solids.solid import Solid
from ..supports.constraints import free_rigid_motions, gather
from ..supports.displacement_ties import DisplacementTie, EqualDisplacement, Periodic
from ..supports.supports import Clamp, Pin, SymmetryPlane
from .core_models import CoreModels
from .own_field import OwnField, own_field_inputs
from .parameter_layout import Layout
from .plausible import check_new_scene
from .scene_to_core import (
    actuator_inputs,
    body_inputs,
    crease_inputs,
    face_inputs,
    moment_directions,
    moment_edges,
    muscle_inputs,
    spring_inputs,
)
from .values import Values

if TYPE_CHECKING:
    from ..._input.kinds import Fielded, Load, Numbers
    from ..supports.supports import Support

_LOADS = (PointLoad, EdgeLoad, AreaLoad, EdgeCouple, FaceEnergy, Pressure, CustomEnergy, Springs)
_SUPPORTS = (Pin, Clamp, SymmetryPlane, EqualDisplacement, Periodic)
_ACTUATORS = "Muscle, Cavity, PneumaticCells and Tendon objects"


class Scene(PlotMixin):
    """A model: bodies, their supports, and the loads, actuators, fields and contacts that act on them.

    A scene can be solved many times. For that it stores the structure of its matrix and, up to 256 MB, the memory of its
    last factorization. Features that a scene does not use cost nothing.

    bodies: a Shell or a Solid, or several of them, rigid bodies and Skeletons; bodies interact through ties and contacts
        only. Positions and faces of a result are those of one body after another, `result[body]` has those of one.
    ties: Tie objects: bodies that are welded to each other.
    supports: Pin, Clamp and SymmetryPlane objects, and the ties EqualDisplacement and Periodic; with several bodies `body=`
        says which one a support holds.
    loads: PointLoad, EdgeLoad, AreaLoad, EdgeCouple, Pressure, SurfaceTension, CustomEnergy, Spring and ElasticFoundation
        objects; with several bodies `body=` says which one a load acts on.
    actuators: Muscle, Cavity, PneumaticCells and Tendon objects.
    field: None, an applied field, or several that superpose. A UniformField takes its value when the scene is solved.
    own_field: an OwnField, with which magnetized bodies act on each other and on themselves. None: only the applied field
        acts on them.
    gravity: (3,), m/s2; needs the mass density of all bodies.
    contacts: Contact objects, each with its obstacles or its bodies, and SelfContact objects. Bodies pass through each
        other, and through themselves, where there is no contact.
    water: a Water that acts on moving shells and solids, in ms.simulate only.
    allow_rigid_motions: accept a scene whose supports leave rigid motions free, because a field or gravity determines them.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e5)
    >>> ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField()).n_dofs
    160

    >>> other = ms.Shell(mesh.transformed(translation=(0, 0, 0.05)), thickness=5e-4, young_modulus=1e5, bending="hinge")
    >>> held = [ms.Clamp(mesh.edges_at(x=0.0), body=body) for body in (sheet, other)]
    >>> pair = ms.Scene([sheet, other], supports=held, field=ms.UniformField())
    >>> rest = ms.equilibrium(
    ...     pair,
    ...     applied_flux_density=(0, 0, 1e-4),
    ...     values={sheet: {"remanent_magnetization": (2e4, 0, 0)}, other: {"remanent_magnetization": (-1e4, 0, 0)}},
    ... )
    >>> rest[other].positions.shape, bool(rest[sheet].displacements[-1, 2] > 0 > rest[other].displacements[-1, 2])
    ((33, 3), True)
    """

    _replaceable = ("gravity", "vertex_loads")
    _shares_directions = True  # whether edges with equal directions across them share one
    _follows_rest_positions = (
        False  # whether numbers of loads that follow from rest positions are values of the core
    )
    _numbered_like: Scene | None = None  # the scene whose numbering of elements and unknowns this one has
    _rigid_like: Scene | None = None  # the scene whose points of rigid bodies this one has
    _stand_ins: dict[int, Any] = {}  # noqa: RUF012 - in a reshaped scene: {id of an original object: the object in its place}

    @grouped()
    def __init__(
        self,
        bodies: Shell | Solid | RigidBody | Skeleton | Iterable[Shell | Solid | RigidBody | Skeleton],
        *,
        ties: Tie | Iterable[Tie] = (),
        supports: Support | Iterable[Support] = (),
        loads: Load | Iterable[Load] = (),
        actuators: Actuator | Iterable[Actuator] = (),
        field: Fielded | None = None,
        own_field: OwnField | None = None,
        gravity: Numbers | None = None,
        contacts: Contact | BodyContact | Iterable[Contact | BodyContact] = (),
        water: Water | None = None,
        allow_rigid_motions: bool = False,
    ):
        self.contacts: tuple[Contact | BodyContact, ...] = checked_list(
            "contacts", contacts, (Contact, BodyContact)
        )
        self._obstacle_contacts, self._body_contacts = split_contacts(self.contacts)
        self._bodies = Bodies(bodies, ties)
        self._bodies.add_surface_nodes(rigid_bodies_in_contact(self._body_contacts))
        self.supports: tuple[Pin | Clamp | SymmetryPlane | EqualDisplacement | Periodic, ...] = checked_list(
            "supports", supports, _SUPPORTS
        )
        self.loads: tuple[Any, ...] = checked_list("loads", loads, _LOADS)
        self.actuators: tuple[Actuator, ...] = checked_list("actuators", actuators, (Actuator,), _ACTUATORS)
        self.fields: tuple[AppliedField, ...] = (
            () if field is None else checked_list("field", field, (AppliedField,), FIELDS)
        )
        self.obstacles: tuple[Any, ...] = obstacles_of(self._obstacle_contacts)
        if water is not None and not isinstance(water, Water):
            raise ValueError(f"water must be a Water, got {type(water).__name__}")
        self.water = water
        if own_field is not None and not isinstance(own_field, OwnField):
            raise ValueError(f"own_field must be an OwnField, got {type(own_field).__name__}")
        self.own_field: OwnField | None = own_field
        _refuse_idle_magnetization(self)
        self.gravity: np.ndarray = (
            np.zeros(3) if gravity is None else quantity("gravity", "m/s2", gravity, (3,))
        )
        if any(f._core is None and not isinstance(f, UniformField) for f in self.fields):
            raise ValueError("field holds an AppliedField without a value: use a CustomField")
        if not isinstance(allow_rigid_motions, bool):
            raise ValueError(f"allow_rigid_motions must be True or False, got {allow_rigid_motions!r}")
        if sum(isinstance(f, UniformField) for f in self.fields) > 1:
            raise ValueError(
                "field holds several UniformFields: one is enough, its value comes when the scene is solved"
            )
        self._allow_rigid_motions = allow_rigid_motions
        self._build(allow_rigid_motions)

    def __getstate__(self) -> dict[Any, Any]:
        """Return the constructor's arguments, from which a copy or another process makes the scene again."""
        return {
            "bodies": self._bodies.listed,
            "ties": self.ties,
            "supports": self.supports,
            "loads": self.loads,
            "actuators": self.actuators,
            "field": self.fields,
            "own_field": self.own_field,
            "gravity": self.gravity,
            "contacts": self.contacts,
            "water": self.water,
            "allow_rigid_motions": self._allow_rigid_motions,
        }

    def __setstate__(self, arguments: dict[Any, Any]) -> None:
        self.__init__(**arguments)

    def _build(self, allow_rigid_motions: bool) -> None:
        bodies = self._bodies
        edges = moment_edges(bodies, self.loads)
        self._moment_directions = moment_directions(bodies, edges)
        constraints = gather(bodies, self.supports, self._moment_directions, self._shares_directions)
        self._rigid = rigid_body_points(bodies)
        if self._rigid_like is not None:
            self._rigid = self._rigid_like._rigid
        check_shapes(self._obstacle_contacts, self.rigid_parts, self._rigid)
        for k, part in enumerate(self.rigid_parts):
            if part.magnetic_moment is not None and not self.fields and not _has_own_field(self, part):
                raise ValueError(
                    f"rigid part {k} has a magnetic_moment, but the scene has no field: Scene(..., field=...)"
                )
        _refuse_support(self._rigid, constraints.held_nodes[:, 0])
        _refuse_ties(self)
        held = np.intersect1d(edges, constraints.directed_edges[:, 0])
        if held.size:
            raise ValueError(f"an EdgeCouple acts on edge {held[0]}, whose direction a support holds")
        free = (
            [] if allow_rigid_motions else free_rigid_motions(bodies, constraints, self._grounded_vertices())
        )
        if not allow_rigid_motions:
            free += [
                f"rigid part {k}, which is free"
                for k, each in enumerate(self.rigid_parts)
                if bodies.is_floating(each)
            ]
        if free:
            it = "it" if len(bodies.listed) == 1 else "them"
            raise ValueError(
                f"the supports leave {called(bodies.listed)} free: {'; '.join(free)}. Hold {it}, or say "
                "allow_rigid_motions=True if a field or gravity does"
            )
        self._constraints, self._moment_edges = constraints, edges
        self._warned_of_obtuse_faces = False
        self._warned_of_strain = 0.0
        self._warned_of_dear_steps = False
        self._warned_of_jumps = False
        self._n_equilibria = 0
        self._warned_of_gains = False
        self._warned_of_units: set[str] = set()
        self._cores = CoreModels(self._new_model(), self._new_model)
        self._value_layout = Layout(self._model.parameters)
        self._load_parameter_layout = Layout(self._model.load_parameters)
        self._values = Values(self)
        with self._values.in_core():
            pass
        check_new_scene(self)

    def _new_model(self) -> _core.Model:
        """Return a new model of the core."""
        bodies, constraints, edges = self._bodies, self._constraints, self._moment_edges
        n_directions, n_moments = len(constraints.directions), len(edges)
        surfaces, body_contacts = body_contact_inputs(self._body_contacts, bodies)
        return _core.Model(
            n_vertices=self.mesh.n_vertices,
            original=bodies.original if bodies.ties else [],
            **body_inputs(self, constraints.directed_edges),
            **skeleton_inputs(bodies, self._labels),
            directions=constraints.directions,
            held_nodes=constraints.held_nodes,
            held_frames=constraints.held_frames,
            tied=[each._asdict() for each in constraints.tied],
            moves=len(constraints.moves),
            couples=np.stack(
                [*bodies.shells_of(edges), n_directions - n_moments + np.arange(n_moments)], axis=1
            ).astype(np.int32),
            gravity=bool(self.gravity.any()),
            **face_inputs(self),
            muscles=muscle_inputs(self),
            **actuator_inputs(self),
            springs=spring_inputs(self),
            creases=crease_inputs(self),
            loads=any(isinstance(load, DeadLoad) for load in self.loads),
            field_sources=[source._core for source in self._sources],
            contacts=contact_inputs(self._obstacle_contacts, bodies),
            contact_surfaces=surfaces,
            body_contacts=body_contacts,
            obstacles=[each._core for each in self.obstacles],
            attached_to=bodies_of_attached(self),
            water=None if self.water is None else self.water._core,
            **own_field_inputs(self),
            **({} if self._numbered_like is None else {"numbered_like": self._numbered_like._model}),
        )

    def _grounded_vertices(self) -> np.ndarray:
        """Return the vertices of links that joints hold to the world."""
        held = [
            points.vertices
            for part, points in zip(self.rigid_parts, self._rigid, strict=True)
            if self._bodies.is_grounded(part)
        ]
        return np.concatenate([np.zeros(0, dtype=np.int64), *held])

    @property
    def _sources(self) -> list[AppliedField]:
        return [field for field in self.fields if not isinstance(field, UniformField)]

    @property
    def _labels(self) -> list[tuple[object, str]]:
        """The objects of the scene, each with the name under which the core has its values."""
        kinds = (
            ("body", self.bodies),
            ("crease", self.creases),
            ("skin", self._bodies.skins),
            ("rigid", self.rigid_parts),
            ("joint", self.joints),
            ("support", self.supports),
            ("load", self.loads),
            ("actuator", self.actuators),
            ("field", self._sources),
            ("contact", self._obstacle_contacts),
            ("body contact", self._body_contacts),
            ("obstacle", self.obstacles),
        )
        labels = [(each, f"{kind} {k}") for kind, objects in kinds for k, each in enumerate(objects)]
        return labels if self.water is None else [*labels, (self.water, "water")]

    @property
    def _model(self) -> _core.Model:
        """The model of the core that this thread uses."""
        return self._cores.current.model

    @property
    def _in_core(self) -> Values | None:
        """The values that are set in the core of this thread."""
        return self._cores.current.values

    @property
    def _solving(self) -> bool:
        return self._cores.current.solving

    def _own(self, item: Any) -> Any:
        """Return the object that takes the place of one of the scene from which this was reshaped; other objects
        unchanged.
        """
        return self._stand_ins.get(id(item), item)

    @cached_property
    def _family(self) -> object:
        """An object that this scene shares with all scenes that differ from it in rest positions only."""
        return object()

    @cached_property
    def _obtuse_faces(self) -> ObtuseFaces:
        return ObtuseFaces(self._values.all_shells, self._model.recut_faces)

    @property
    def bodies(self) -> tuple[Shell | Solid, ...]:
        """The shells and solids, in the order of their vertices."""
        return self._bodies.deformable

    @property
    def ties(self) -> tuple[Tie, ...]:
        """The ties that weld bodies to each other."""
        return self._bodies.ties

    @property
    def creases(self) -> tuple[Crease, ...]:
        """The creases of all shells."""
        return tuple(crease for sheet in self._bodies.shells for crease in sheet.creases)

    @property
    def rigid_parts(self) -> tuple[RigidBody, ...]:
        """The rigid bodies, links of skeletons among them."""
        return self._bodies.rigid

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints of all skeletons."""
        return self._bodies.joints

    @property
    def shell(self) -> Shell:
        """The only body of the scene. Raises ValueError if there are several."""
        if len(self.bodies) != 1:
            raise ValueError(f"the scene has {len(self.bodies)} bodies: say which, scene.bodies[k]")
        return self.bodies[0]

    @property
    def mesh(self) -> TriangleMesh:
        """The mesh of all bodies: their vertices, edges and faces, one body after another."""
        return self._bodies.mesh

    @property
    def objects(self) -> tuple[Any, ...]:
        """The objects that the `values` of a solve may name besides the scene itself, always in the same order."""
        water = () if self.water is None else (self.water,)
        return (
            *self.bodies,
            *self.creases,
            *self._bodies.skins,
            *self.rigid_parts,
            *self.joints,
            *self.supports,
            *self.loads,
            *self.actuators,
            *self.fields,
            *self.contacts,
            *self.obstacles,
            *water,
        )

    @property
    def has_uniform_field(self) -> bool:
        """Return whether the field has a uniform part, so that solves need an applied_flux_density."""
        return any(isinstance(f, UniformField) for f in self.fields)

    @property
    def is_magnetic(self) -> bool:
        """Return whether magnetization acts: in an applied field, in the bodies' own field, or both."""
        return bool(self.fields) or self.own_field is not None

    @property
    def has_forces_of_motion(self) -> bool:
        """Return whether there are forces without an energy, which act on moving bodies only: friction, water."""
        has_friction = any(contact.friction_coefficient is not None for contact in self.contacts)
        return self.water is not None or has_friction

    @property
    def has_susceptible_shells(self) -> bool:
        """Return whether a shell has a susceptibility, so that forces are quadratic in the applied field."""
        return any(sheet.susceptibility is not None for sheet in self._bodies.shells)

    @property
    def n_dofs(self) -> int:
        """The number of free degrees of freedom: position components and edge rotations."""
        return self._model.free_size

    def __repr__(self) -> str:
        several = len(self.bodies) > 1
        lines = [
            f"Scene: {self.bodies[0]!r}" if len(self.bodies) == 1 else f"Scene: {len(self.bodies)} bodies"
        ]
        if several:
            lines += [f"  body {k}: {body!r}" for k, body in enumerate(self.bodies)]
        lines += [f"  welded by {tie!r}" for tie in self.ties]
        lines += [f"  with {part!r}{self._whose(part)}" for part in self.rigid_parts]
        lines += [f"  joined by {joint!r}" for joint in self.joints]
        lines += [f"  held by {support!r}{self._whose(support)}" for support in self.supports]
        lines += [f"  loaded by {type(load).__name__}{self._whose(load)}" for load in self.loads]
        lines += [f"  driven by {each!r}{self._whose(each)}" for each in self.actuators]
        lines += [f"  in {field!r}" for field in self.fields]
        if self.own_field is not None:
            lines.append(f"  with an {self.own_field!r}")
        lines += [f"  kept out by {contact!r}{self._whose(contact)}" for contact in self.contacts]
        if self.water is not None:
            lines.append(f"  in {self.water!r}")
        if self.gravity.any():
            lines.append(f"  under gravity {tuple(self.gravity.tolist())} m/s2")
        lines.append(f"  {self.n_dofs} unknowns")
        return "\n".join(lines)

    def _whose(self, item) -> str:
        """Return the end of a line of the repr that names the body of an item, if the scene has several."""
        if len(self.bodies) < 2 or item.body is None:
            return ""
        return f" (body {self._bodies.number(item.body)})"


def _refuse_support(parts, held: np.ndarray) -> None:
    """Raise ValueError if a support holds a vertex of a rigid body."""
    for k, points in enumerate(parts):
        both = np.intersect1d(points.vertices, held)
        if both.size:
            raise ValueError(
                f"a support holds vertex {both[0]}, which rigid part {k} carries: leave it out of the part's vertices; for "
                "vertices that do not move at all a support is enough, without a RigidBody"
            )


def _refuse_ties(scene: Scene) -> None:
    """Raise ValueError if displacements are tied in a scene with rigid bodies."""
    ties = [each for each in scene.supports if isinstance(each, DisplacementTie)]
    if ties and scene.rigid_parts:
        raise ValueError(f"{ties[0]!r} cannot be in a scene with rigid bodies or skeletons yet")


def _has_own_field(scene: Scene, body: Any) -> bool:
    """Return whether a body has a part in the own field of a scene."""
    given = scene.own_field
    return given is not None and (given.bodies is None or any(body is each for each in given.bodies))


def _refuse_idle_magnetization(scene: Scene) -> None:
    """Raise ValueError for a skin, a magnetized solid or a susceptible shell that has no effect because the scene has no
    field.

    Without a field a skin still adds mass if it has a mass density.
    """
    if scene.fields:
        return
    for k, body in enumerate(scene.bodies):
        if not isinstance(body, Solid):
            if body.susceptibility is not None:
                raise ValueError(
                    f"body {k} has a susceptibility, but the scene has no applied field: Scene(..., field=...)"
                )
            continue
        if _has_own_field(scene, body):
            continue
        idle = body.skin is not None and (
            body.skin.mass_density is None or body.skin.remanent_magnetization is not None
        )
        if idle or body.remanent_magnetization is not None:
            what = "a skin" if idle else "a remanent_magnetization"
            raise ValueError(f"body {k} has {what}, but the scene has no field: Scene(..., field=...)")
