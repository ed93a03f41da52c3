// The numbers of a scene, and the nodes of all its bodies: vertices, then directions.
//
//   q = [ 3 a node | 1 a scalar ]        scalars: edge rotations
//
// A direction is what clamped edges, symmetry planes and couples refer to: it has three components and
// derivatives like a vertex, and is always prescribed.
#pragma once

#include <string>
#include <vector>

#include "magshell/core/renumbering.h"

namespace magshell {

struct Nodes {
    Renumbering vertices;    // of all bodies: the caller's <-> ours
    std::vector<Vec3> rest;  // per node: rest position of a vertex, rest value of a direction
    Index scalars = 0;

    /// Those that are welded count once.
    Index n_vertices() const { return vertices.size(); }
    Index n_user_vertices() const { return vertices.user_size(); }
    Index n_nodes() const { return static_cast<Index>(rest.size()); }
    Index n_unknowns() const { return 3 * n_nodes() + scalars; }
    /// Of the vertices: the first so many unknowns.
    Index n_coordinates() const { return 3 * n_vertices(); }
    /// The unknown that is the first scalar.
    Index first_scalar() const { return 3 * n_nodes(); }
    Index direction_node(Index direction) const { return n_vertices() + direction; }
    /// What the caller calls it.
    Index user_vertex(Index node) const { return vertices.user[node]; }
};

/// Numbers vertices in the order in which bodies come to them.
class NodeNumbering {
  public:
    explicit NodeNumbering(Index n_vertices) { core_.assign(n_vertices, -1); }

    /// Our number of the caller's vertex.
    Index number(Index user, const Vec3& rest_position);
    /// Once all bodies are numbered; directions (n_d, 3). A vertex without a number is a copy, and
    /// `original[vertex]` has one.
    Nodes finish(const Rows3& directions, const std::vector<Index>& original);

  private:
    std::vector<Index> core_, user_;
    std::vector<Vec3> rest_;
};

}  // namespace magshell
