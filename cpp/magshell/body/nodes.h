// The dofs of a scene, and the nodes of all its bodies: vertices first, then given directions.
//
//   q = [ 3 per node | 1 per scalar ]        scalars: edge rotations
//
// A direction is a given unit vector across an edge, to which clamped edges, symmetry planes and edge moments refer. It is stored as a node,
// with three components and derivatives like a vertex, and is always prescribed.
#pragma once

#include <string>
#include <vector>

#include "magshell/core/renumbering.h"

namespace magshell {

struct Nodes {
    Renumbering vertices;    // of all bodies: the caller's <-> ours
    std::vector<Vec3> rest;  // per node: rest position of a vertex [m], or rest value of a direction
    Index scalars = 0;

    /// Returns the number of vertices; welded ones count once.
    Index n_vertices() const { return vertices.size(); }
    Index n_user_vertices() const { return vertices.user_size(); }
    Index n_nodes() const { return static_cast<Index>(rest.size()); }
    Index n_dofs() const { return 3 * n_nodes() + scalars; }
    /// Returns the number of dofs that are coordinates of vertices; they come first.
    Index n_coordinates() const { return 3 * n_vertices(); }
    /// Returns the index of the first scalar dof.
    Index first_scalar() const { return 3 * n_nodes(); }
    Index direction_node(Index direction) const { return n_vertices() + direction; }
    /// Returns the caller's number of a vertex.
    Index user_vertex(Index node) const { return vertices.user[node]; }
};

/// Numbers vertices in the order in which the bodies are added, so that neighbours have near numbers.
class NodeNumbering {
  public:
    explicit NodeNumbering(Index n_vertices) { core_.assign(n_vertices, -1); }

    /// Returns our number of the caller's vertex, which it gets on the first call.
    Index number(Index user, const Vec3& rest_position);
    /// Finishes the numbering once all bodies are added; directions (n_d, 3). A vertex without a number is welded to the vertex
    /// original[vertex], which has one.
    Nodes finish(const Rows3& directions, const std::vector<Index>& original);

  private:
    std::vector<Index> core_, user_;
    std::vector<Vec3> rest_;
};

}  // namespace magshell
