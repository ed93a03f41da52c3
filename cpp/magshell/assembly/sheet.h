// A sheet as the core sees it: renumbered for locality, with its folds, its edge rotations and who couples
// whom.
//
// Nodes are the vertices, followed by the directions that clamped edges, symmetry planes and couples refer
// to: a direction has three components and derivatives like a vertex, and is always prescribed.
#pragma once

#include <array>
#include <vector>

#include "magshell/assembly/ordering.h"
#include "magshell/assembly/system_matrix.h"
#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

/// An edge whose angle is measured to a direction: on every face of the edge, no edge rotation, full weight.
struct DirectedEdge {
    Index edge, direction;
};

/// A fold angle between a face and another face or a direction. Node order as in strain/fold_angle.h.
struct FoldStencil {
    std::array<Index, 4> nodes;
    bool right_is_point;
    double rest_angle;
    struct Side {
        Index face = -1, corner = -1;
    } left, right;  // the faces whose strain this fold enters, and the corner it is opposite to

    /// What share of the turn each of them takes: half of it, the whole where it is measured to a direction.
    double weight() const { return right_is_point ? 0.5 : 1.0; }

    Index first_face() const {
        return left.face < 0 || (right.face >= 0 && right.face < left.face) ? right.face : left.face;
    }
};

/// What edge i of a face contributes to its bending strain: weight (theta - theta~) + sign phi.
struct FaceSide {
    Index fold = -1, rotation = -1;
    float weight = 0.0f;  // 0, 1/2 or 1
    std::int8_t sign = 0;
    bool on_left = true;
};

class Sheet {
  public:
    /// directions (n_d, 3); `directors` gives every edge that is not directed a rotation of its own
    /// (midedge).
    Sheet(const TriangleMesh& mesh, const std::vector<DirectedEdge>& directed, const Rows3& directions,
          bool directors);

    Index n_vertices() const { return vertices.size(); }
    Index n_faces() const { return faces.size(); }
    Index n_edges() const { return static_cast<Index>(rotation_of_edge.size()); }
    Index n_nodes() const { return static_cast<Index>(rest.size()); }
    Index n_rotations() const { return static_cast<Index>(edge_of_rotation.size()); }
    Index n_unknowns() const { return 3 * n_nodes() + n_rotations(); }
    Index direction_node(Index direction) const { return n_vertices() + direction; }
    /// The corners of a face at rest [m].
    std::array<Vec3, 3> rest_corners(Index face) const {
        const std::array<Index, 3>& c = corners[face];
        return {rest[c[0]], rest[c[1]], rest[c[2]]};
    }
    /// The largest coordinate at rest of the corners of a face [m]. A unit of its round-off is how exactly
    /// they are known.
    double largest_coordinate(Index face) const;
    /// Where each unknown is at rest [m]: its vertex, or the middle of its edge.
    std::vector<Vec3> unknown_points() const;
    /// The smallest height of a face at rest [m].
    double smallest_height(Index face) const;

    Renumbering vertices, faces;  // caller's <-> ours
    std::vector<Vec3> rest;       // per node: rest position of a vertex, rest value of a direction
    std::vector<std::array<Index, 3>> corners;  // per face, our vertices
    std::vector<std::array<Index, 3>> edges;    // per face, the caller's edges, opposite the corners
    std::vector<FoldStencil> folds;
    std::vector<std::array<FaceSide, 3>> sides;  // per face
    std::vector<Index> edge_of_rotation;         // our rotation -> caller's edge
    std::vector<Index> rotation_of_edge;         // caller's edge -> our rotation, or -1
    std::vector<Stencil> stencils;  // per face: corners, the nodes beyond its edges, its rotations

  private:
    void number(const TriangleMesh& mesh);
    void add_folds(const TriangleMesh& mesh, const std::vector<DirectedEdge>& directed, bool directors);
    Index add_fold(const std::array<Index, 4>& nodes, bool right_is_point);
    void add_stencils();
};

}  // namespace magshell
