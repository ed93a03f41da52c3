// A scene as the caller describes it, in the caller's numbering: everything that no solve can change.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/assembly/reduction.h"
#include "magshell/body/sheet.h"
#include "magshell/field/applied_field.h"
#include "magshell/force/drag.h"
#include "magshell/term/contact_term.h"

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
    bool directors = true;        // midedge; false: hinge
    bool magnetic = false;
    std::vector<DirectedEdge> directed_edges;  // directions are rows of SceneInput::directions
};

/// Held nodes count the scene's vertices first, then directions.
struct SceneInput {
    Index n_vertices = 0;
    std::vector<SheetInput> sheets;
    Rows3 directions;  // (n_d, 3), of directed edges and of couples
    std::vector<HeldNode> held;
    Index moves = 0;  // that held nodes refer to
    std::vector<EdgeCoupleInput> couples;
    bool gravity = false, loads = false;
    std::vector<std::shared_ptr<const AppliedField>> field_sources;
    std::vector<ContactInput> contacts;
    std::vector<std::shared_ptr<const Obstacle>> obstacles;
    std::shared_ptr<const Water> water;
};

}  // namespace magshell
