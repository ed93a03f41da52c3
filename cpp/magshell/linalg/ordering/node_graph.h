// NodeGraph: the graph that orderings work on: nodes with their unknowns, adjacency and positions.
#pragma once

#include <span>
#include <vector>

#include "magshell/linalg/ordering/quotient_graph.h"

namespace magshell {

struct NodeGraph {
    std::vector<Index> starts, neighbours;  // both triangles, without the diagonal
    std::vector<Index> weights;             // number of unknowns of each node
    std::vector<Vec3> points;               // position of each node [m]; empty if unknown

    Index size() const { return static_cast<Index>(weights.size()); }
    std::span<const Index> around(Index node) const {
        return {neighbours.data() + starts[node], neighbours.data() + starts[node + 1]};
    }
};

/// Creates the graph; `points` are the positions of the unknowns, or none.
NodeGraph node_graph(const Quotient& quotient, const std::vector<Vec3>& points);

/// Selects the nodes ("leaders") among which separators are searched. The others, such as the single rotation
/// of an edge among the three coordinates of each vertex around it, have fewer unknowns than most of their
/// neighbours and follow those. Each of them has an adjacent leader.
std::vector<char> leaders(const NodeGraph& graph);

/// Returns the subgraph of these nodes, in their order. `number` is the index of each node of the graph among
/// them, or -1.
NodeGraph induced(const NodeGraph& graph, const std::vector<Index>& nodes, const std::vector<Index>& number);

}  // namespace magshell
