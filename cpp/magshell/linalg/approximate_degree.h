// Minimum degree with degrees that are bounded instead of counted (Amestoy, Davis, Duff 1996), for graphs of any size.
#pragma once

#include <functional>
#include <vector>

#include "magshell/linalg/node_graph.h"

namespace magshell {

/// order[k] = the node to eliminate k-th. Nodes count as many unknowns as they weigh. `watch` is called now and then, and may
/// throw.
std::vector<Index> approximate_minimum_degree(const NodeGraph& graph, const std::function<void()>& watch);

}  // namespace magshell
