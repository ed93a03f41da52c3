// Nested dissection ordering (George 1973): the separator of two halves of a graph is eliminated after both.
#pragma once

#include <functional>
#include <vector>

#include "magshell/linalg/ordering/node_graph.h"

namespace magshell {

/// Returns order, where order[k] is the node to eliminate k-th. The graph is cut in halves, and these again,
/// until a few hundred nodes are left, which minimum degree orders. Cuts use the nodes' positions if these are
/// known. The result is the same for any number of threads. `watch` is called now and then, and may throw.
std::vector<Index> nested_dissection(const NodeGraph& graph, const std::function<void()>& watch);

}  // namespace magshell
