// Nested dissection (George 1973): what separates two halves of a graph is eliminated after both.
#pragma once

#include <functional>
#include <vector>

#include "magshell/linalg/node_graph.h"

namespace magshell {

/// order[k] = the node to eliminate k-th. The graph is cut in halves, and these again, until a few hundred
/// nodes are left, which minimum degree orders. Cuts follow the nodes' points where these are known.
/// The same for any number of threads. `watch` is called now and then, and may throw.
std::vector<Index> nested_dissection(const NodeGraph& graph, const std::function<void()>& watch);

}  // namespace magshell
