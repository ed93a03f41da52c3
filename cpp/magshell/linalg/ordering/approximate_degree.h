// Approximate minimum degree ordering, with upper bounds of degrees instead of exact counts (Amestoy, Davis,
// Duff 1996), for graphs of any size.
#pragma once

#include <functional>
#include <vector>

#include "magshell/linalg/ordering/node_graph.h"

namespace magshell {

/// Returns order, where order[k] is the node to eliminate k-th. A node counts as many degrees of freedom as its
/// weight. `watch` is called now and then, and may throw.
std::vector<Index> approximate_minimum_degree(const NodeGraph& graph, const std::function<void()>& watch);

}  // namespace magshell
