// Exact minimum degree ordering of small graphs that border on larger ones.
#pragma once

#include <vector>

#include "magshell/linalg/ordering/node_graph.h"

namespace magshell {

/// Returns the nodes of a piece of a graph in an order of little fill, given that all adjacent nodes outside it
/// are eliminated later: it always takes the node whose elimination couples the fewest unknowns, counted
/// exactly. For up to some hundreds of nodes, because rows of the graph are bit sets.
///
/// piece_of: the piece of each node. number: work space for this piece's nodes; entries of other nodes are
/// neither read nor written.
std::vector<Index> minimum_degree_order(const NodeGraph& graph, const std::vector<Index>& nodes,
                                        const std::vector<Index>& piece_of, std::vector<Index>& number);

}  // namespace magshell
