// Fill-reducing orderings of a matrix, and the choice between them.
#pragma once

#include <functional>
#include <vector>

#include "magshell/linalg/multifrontal/assembly_tree.h"
#include "magshell/linalg/ordering/node_graph.h"

namespace magshell {

/// Exact minimum degree of small graphs that border on larger ones: returns the nodes of a piece of a graph in an order of little fill, given that all adjacent nodes outside it
/// are eliminated later: it always takes the node whose elimination couples the fewest unknowns, counted
/// exactly. For up to some hundreds of nodes, because rows of the graph are bit sets.
///
/// piece_of: the piece of each node. number: work space for this piece's nodes; entries of other nodes are
/// neither read nor written.
std::vector<Index> minimum_degree_order(const NodeGraph& graph, const std::vector<Index>& nodes,
                                        const std::vector<Index>& piece_of, std::vector<Index>& number);

/// Approximate minimum degree, for graphs of any size, with upper bounds of degrees instead of exact counts (Amestoy,
/// Davis, Duff 1996): returns order, where order[k] is the node to eliminate k-th. A node counts as many degrees of freedom as its
/// weight. `watch` is called now and then, and may throw.
std::vector<Index> approximate_minimum_degree(const NodeGraph& graph, const std::function<void()>& watch);

/// Nested dissection (George 1973), which eliminates the separator of two halves of a graph after both: returns order,
/// where order[k] is the node to eliminate k-th. The graph is cut in halves, and these again,
/// until a few hundred nodes are left, which minimum degree orders. Cuts use the nodes' positions if these are
/// known. The result is the same for any number of threads. `watch` is called now and then, and may throw.
std::vector<Index> nested_dissection(const NodeGraph& graph, const std::function<void()>& watch);

/// Returns the assembly tree of a fill-reducing ordering. Throws InvalidInput for Ordering::metis if magshell
/// was built without it.
AssemblyTree ordered_assembly_tree(const SparsePattern& pattern, const FactorOptions& options);

}  // namespace magshell
