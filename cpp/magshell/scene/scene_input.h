// A scene as the caller describes it, in the caller's numbering: everything that no solve can change.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/assembly/reduction.h"
#include "magshell/body/joint.h"
#include "magshell/body/sheet.h"
#include "magshell/body/six_node_sheet.h"
#include "magshell/body/solid.h"
#include "magshell/field/applied_field.h"
#include "magshell/force/drag.h"
#include "magshell/term/body_contact_input.h"
#include "magshell/term/contact_term.h"
#include "magshell/term/face_energy.h"
#include "magshell/term/muscle_fibres.h"
#include "magshell/term/pressure_term.h"
#include "magshell/term/shell_growth.h"
#include "magshell/term/solid_term.h"
#include "magshell/term/tendon_term.h"
#include "magshell/term/volume_term.h"

namespace magshell {

/// A couple on a free edge of a sheet; `direction` is a row of SceneInput::directions.
struct EdgeCoupleInput {
    Index sheet, edge, direction;
};

struct SheetInput {
    std::string owner;  // under which its parameters are registered
    std::shared_ptr<const TriangleMesh> mesh;
    std::vector<Index> vertices;  // the scene's vertex of each vertex of the mesh
    VectorXd curvature_scale;     // of each edge, as the scene was made with: where hinges are
    GrowthForm growth;
    bool directors = true;  // midedge; false: hinge
    bool magnetic = false;
    std::vector<DirectedEdge> directed_edges;  // directions are rows of SceneInput::directions
};

/// A sheet of six-node faces.
struct SixNodeSheetInput {
    std::string owner;  // under which its parameters are registered
    SixNodeInput mesh;
    GrowthForm growth;
    std::vector<DirectedEdge>
        directed_edges;    // of mesh.corners; directions are rows of SceneInput::directions
    SolidSurface surface;  // four flat triangles a face
    bool magnetic = false;
    bool surface_acts = false;  // whether water, or a face energy, acts on its surface
};

struct SolidInput {
    std::string owner;     // under which its parameters are registered
    Rows3 rest_positions;  // (n, 3) [m]
    std::vector<Index> elements;
    int nodes_per_element = 4;    // or 10
    std::vector<Index> vertices;  // the scene's vertex of each row
    SolidSurface surface;
    SolidResponse response;
    bool magnetic = false;
    bool surface_acts = false;  // whether water, or a face energy, acts on its surface
};

/// Magnetized triangles on nodes of solids.
struct SkinInput {
    std::string owner;  // under which its parameters are registered
    SolidSurface surface;
};

/// An energy of a body's faces beside its elastic and magnetic ones.
struct FaceEnergyInput {
    std::string owner;  // under which its inputs are registered
    Index body;         // sheets first, then solids
    std::shared_ptr<const FaceEnergy> energy;
};

/// Vertices of bodies that move as one, with ten points of its own: the four corners of a regular tetrahedron, and the
/// middles of its edges.
struct RigidInput {
    std::string owner;
    Rows3 points;                 // (10, 3) at rest, then its surface's: the tens of all parts come first
    std::vector<Index> vertices;  // the scene's
    bool magnetic = false;

    static constexpr Index own = 10;
};

/// Rigid parts that are joined in a tree: joints[k] leads to the part links[k], parents first.
struct SkeletonInput {
    std::vector<Index> links;  // of SceneInput::rigid
    std::vector<Joint> joints;
    std::vector<std::string> owners;  // of joints in which something acts; empty where nothing does
    std::vector<std::string> labels;  // of all joints; empty where there is none
};

/// A point of one rigid part that is pulled to a point of another, or of the world (negative).
struct ClosureInput {
    std::string owner;
    Index parent, child;  // of SceneInput::rigid
    Vec3 place;           // at rest
};

/// Held nodes count the scene's vertices first, then directions.
struct SceneInput {
    Index n_vertices = 0;         // of sheets and solids
    std::vector<Index> original;  // of each vertex: itself, or the one that it is welded to; empty if none is
    std::vector<SheetInput> sheets;
    std::vector<SixNodeSheetInput> six_node_sheets;
    std::vector<SolidInput> solids;  // numbered on after the sheets
    std::vector<SkinInput> skins;
    std::vector<MuscleInput> muscles;
    std::vector<RigidInput> rigid;
    std::vector<SkeletonInput> skeletons;
    std::vector<ClosureInput> closures;
    Rows3 directions;  // (n_d, 3), of directed edges and of couples
    std::vector<HeldNode> held;
    Index moves = 0;  // that held nodes refer to
    std::vector<EdgeCoupleInput> couples;
    std::vector<FaceEnergyInput> face_energies;
    std::vector<PressureInput> pressures;
    std::vector<VolumeInput> volumes;
    std::vector<TendonInput> tendons;
    bool gravity = false, loads = false;
    std::vector<std::shared_ptr<const AppliedField>> field_sources;
    std::vector<ContactInput> contacts;
    std::vector<ContactSurfaceInput> contact_surfaces;
    std::vector<BodyContactInput> body_contacts;
    std::vector<std::shared_ptr<const Obstacle>> obstacles;
    std::shared_ptr<const Water> water;
};

}  // namespace magshell
