// Minimum degree on small graphs that border on larger ones.
#pragma once

#include <vector>

#include "magshell/linalg/node_graph.h"

namespace magshell {

/// The nodes of a piece of a graph, in an order of little fill if all others that they border on are
/// eliminated later: of those that are left, always the one whose elimination couples the fewest unknowns,
/// exactly counted. For some hundreds of nodes: rows of the graph are sets of bits.
///
/// `piece_of` tells whose each node is. `number` is room for the places of this piece's nodes; other nodes'
/// are neither read nor written.
std::vector<Index> minimum_degree_order(const NodeGraph& graph, const std::vector<Index>& nodes,
                                        const std::vector<Index>& piece_of, std::vector<Index>& number);

}  // namespace magshell
