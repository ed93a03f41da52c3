// The description of a scene by the caller, in the caller's numbering: everything that a solve cannot change.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/body/shell.h"
#include "magshell/body/six_node_shell.h"
#include "magshell/body/solid.h"
#include "magshell/dofs/dof_map.h"
#include "magshell/dofs/joint.h"
#include "magshell/dofs/linear_ties.h"
#include "magshell/energy/magnetization_law.h"
#include "magshell/field/applied_field.h"
#include "magshell/force/drag.h"
#include "magshell/terms/actuator/muscle_fibres.h"
#include "magshell/terms/actuator/tendon_term.h"
#include "magshell/terms/actuator/volume_term.h"
#include "magshell/terms/contact/body_contact_input.h"
#include "magshell/terms/contact/contact_term.h"
#include "magshell/terms/load/face_energy.h"
#include "magshell/terms/load/group_energy_term.h"
#include "magshell/terms/load/pressure_term.h"
#include "magshell/terms/load/spring_input.h"
#include "magshell/terms/shell/crease_input.h"
#include "magshell/terms/shell/shell_growth.h"
#include "magshell/terms/solid/solid_term.h"

namespace magshell {

/// A moment on a free edge of a shell; `direction` is a row of SceneInput::directions.
struct EdgeMomentInput {
    Index shell, edge, direction;
};

struct ShellInput {
    std::string owner;  // name of the owner of its parameters
    std::shared_ptr<const TriangleMesh> mesh;
    std::vector<Index> vertices;  // the scene vertex of each vertex of the mesh
    VectorXd curvature_scale;     // of each edge when the scene was made; it tells where hinges are
    GrowthForm growth;
    bool directors = true;  // true: midedge elements; false: hinge elements
    bool magnetic = false;
    MagnetizationLaw magnetization_law = MagnetizationLaw::stretches;
    bool susceptible = false;                  // whether it has a magnetic susceptibility
    std::vector<DirectedEdge> directed_edges;  // directions are rows of SceneInput::directions
};

/// A shell of six-node faces.
struct SixNodeShellInput {
    std::string owner;  // name of the owner of its parameters
    SixNodeInput mesh;
    GrowthForm growth;
    std::vector<DirectedEdge>
        directed_edges;    // of mesh.corners; directions are rows of SceneInput::directions
    SolidSurface surface;  // four flat triangles per face
    bool magnetic = false;
    MagnetizationLaw magnetization_law = MagnetizationLaw::stretches;
    bool surface_acts = false;  // whether water or a face energy acts on its surface
};

struct SolidInput {
    std::string owner;     // name of the owner of its parameters
    Rows3 rest_positions;  // (n, 3) [m]
    std::vector<Index> elements;
    int nodes_per_element = 4;    // or 10
    std::vector<Index> vertices;  // the scene vertex of each row
    SolidSurface surface;
    SolidResponse response;
    bool magnetic = false;
    MagnetizationLaw magnetization_law = MagnetizationLaw::stretches;
    bool surface_acts = false;  // whether water or a face energy acts on its surface
};

/// Magnetized triangles on the nodes of solids.
struct SkinInput {
    std::string owner;  // name of the owner of its parameters
    SolidSurface surface;
    MagnetizationLaw magnetization_law = MagnetizationLaw::stretches;
};

/// An energy of a body's faces in addition to its elastic and magnetic ones.
struct FaceEnergyInput {
    std::string owner;  // name of the owner of its parameters
    Index body;         // shells first, then solids
    std::shared_ptr<const FaceEnergy> energy;
};

/// A rigid body: vertices of bodies that move together, and ten points of its own, the corners and edge midpoints of a regular
/// tetrahedron.
struct RigidInput {
    std::string owner;
    Rows3
        points;  // (10, 3) at rest [m], then the points of its surface; in the scene the tens of all rigid bodies come first
    std::vector<Index> vertices;  // of the scene
    bool magnetic = false, has_force = false, has_torque = false;

    static constexpr Index own = 10;
};

/// Rigid bodies joined in a tree: joints[k] connects the body links[k] to its parent; parents come first.
struct SkeletonInput {
    std::vector<Index> links;  // indices of SceneInput::rigid
    std::vector<Joint> joints;
    std::vector<std::string> owners;  // of joints with a spring, damper, motor or limit; empty for all others
    std::vector<std::string> labels;  // of all joints; empty if there is none
};

/// A loop closure: a point of one rigid body that a spring pulls to a point of another, or of the world if negative.
struct ClosureInput {
    std::string owner;
    Index parent, child;  // parent, child: indices of SceneInput::rigid
    Vec3 place;           // at rest [m]
};

/// The shells, solids, skins and rigid bodies with a moment whose own magnetic field acts, by their numbers in SceneInput; none: it does not act.
struct OwnFieldInput {
    std::vector<Index> shells, six_node_shells, solids, skins, rigid;
    Index max_points = 0;
    double accuracy = 0.0;  // [-] of sums over many points; 0: they are direct

    bool acts() const {
        return !(shells.empty() && six_node_shells.empty() && solids.empty() && skins.empty() &&
                 rigid.empty());
    }
};

/// The whole scene. Nodes of supports count the vertices first, then directions.
struct SceneInput {
    Index n_vertices = 0;  // of shells and solids
    std::vector<Index>
        original;  // of each vertex: itself, or the one that it is welded to; empty without welds
    std::vector<ShellInput> shells;
    std::vector<SixNodeShellInput> six_node_shells;
    std::vector<SolidInput> solids;  // numbered after the shells
    std::vector<SkinInput> skins;
    std::vector<MuscleInput> muscles;
    std::vector<RigidInput> rigid;
    std::vector<SkeletonInput> skeletons;
    std::vector<ClosureInput> closures;
    Rows3 directions;  // (n_d, 3), of clamped edges and edge moments
    std::vector<PrescribedNode> held;
    std::vector<TiedDof> tied;  // a dof is three times its vertex, plus an axis of the vertex' frame
    Index moves = 0;            // number of support moves that `held` and `tied` refer to
    std::vector<EdgeMomentInput> couples;
    std::vector<FaceEnergyInput> face_energies;
    std::vector<PressureInput> pressures;
    std::vector<VolumeInput> volumes;
    std::vector<TendonInput> tendons;
    std::vector<GroupEnergyInput> group_energies;
    std::vector<SpringsInput> springs;
    std::vector<CreaseInput> creases;
    bool gravity = false, loads = false;
    std::vector<std::shared_ptr<const AppliedField>> field_sources;
    std::vector<ContactInput> contacts;
    std::vector<ContactSurfaceInput> contact_surfaces;
    std::vector<BodyContactInput> body_contacts;
    std::vector<std::shared_ptr<const Obstacle>> obstacles;
    std::vector<Index>
        attached_to;  // per obstacle: the index in `rigid` of the body that carries it; negative: none
    std::shared_ptr<const Water> water;
    OwnFieldInput own_field;
};

}  // namespace magshell
