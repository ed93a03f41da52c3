// The graph that orderings work on: nodes with their unknowns, who is coupled with whom, and where they are.
#pragma once

#include <span>
#include <vector>

#include "magshell/linalg/quotient_graph.h"

namespace magshell {

struct NodeGraph {
    std::vector<Index> starts, neighbours;  // both triangles, without the diagonal
    std::vector<Index> weights;             // unknowns of each node
    std::vector<Vec3> points;               // of each node; empty where they are not known

    Index size() const { return static_cast<Index>(weights.size()); }
    std::span<const Index> around(Index node) const {
        return {neighbours.data() + starts[node], neighbours.data() + starts[node + 1]};
    }
};

/// `points` of the unknowns, or none.
NodeGraph node_graph(const Quotient& quotient, const std::vector<Vec3>& points);

/// Nodes worth a place in the search for separators. The others, such as the one rotation of an edge among
/// the three coordinates of each vertex around it, have fewer unknowns than most of their neighbours, and go
/// where these go. Every one of those has a leader beside it.
std::vector<char> leaders(const NodeGraph& graph);

/// The part of a graph that consists of these nodes, in their order. `number` is the place of each node of
/// the graph among them, or -1.
NodeGraph induced(const NodeGraph& graph, const std::vector<Index>& nodes, const std::vector<Index>& number);

}  // namespace magshell
