// A scene as the caller describes it, in the caller's numbering: what fixes the unknowns, and numbers that
// may change.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "magshell/assembly/motion.h"
#include "magshell/assembly/placed_obstacle.h"
#include "magshell/assembly/reduction.h"
#include "magshell/assembly/sheet.h"
#include "magshell/energy/contact.h"
#include "magshell/energy/material.h"
#include "magshell/field/applied_field.h"
#include "magshell/force/drag.h"

namespace magshell {

/// A couple on a free edge; `direction` is a row of SceneInput::directions.
struct EdgeCoupleInput {
    Index edge, direction;
};

/// A point of the sheet that obstacles keep out: a vertex, or a weighted sum of the corners of a face.
struct ContactPoint {
    std::array<Index, 3> nodes{-1, -1, -1};
    Vec3 weights = Vec3::UnitX();
};

/// What touches what. Points on faces come after vertices.
struct ContactInput {
    std::vector<Index> obstacles;  // of SceneValues::obstacles
    std::vector<ContactPoint> points;
    bool rubs = false,
         lagged = false;  // whether there is friction, and whether with the normal force of before
};

/// What may differ from solve to solve.
struct SceneValues {
    std::vector<SheetMaterial> materials;  // one a face
    VectorXd curvature_scale;              // one an edge
    VectorXd vertex_mass;                  // [kg], for gravity
    Vec3 gravity = Vec3::Zero();           // [m/s2]
    Rows3 vertex_loads;                    // (n_v, 3) [N], or empty
    VectorXd couples;                      // [N m], about the edges with the sheet to their left
    std::vector<Motion> motions;
    std::vector<std::shared_ptr<const AppliedField>> field_sources;
    std::vector<ContactLaw> contacts;
    std::vector<PlacedObstacle> obstacles;
    std::shared_ptr<const Water> water;
};

/// Held nodes count vertices first, then directions.
struct SceneInput {
    explicit SceneInput(TriangleMesh mesh_) : mesh(std::move(mesh_)) {}

    TriangleMesh mesh;
    bool directors = true;  // midedge; false: hinge
    std::vector<DirectedEdge> directed_edges;
    Rows3 directions;  // (n_d, 3), of directed edges and of couples
    std::vector<HeldNode> held;
    std::vector<EdgeCoupleInput> couples;
    bool magnetic = false;
    std::vector<ContactInput> contacts;
    SceneValues values;
};

}  // namespace magshell
