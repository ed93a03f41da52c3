// A graph with indistinguishable unknowns joined, which is quicker to order.
#pragma once

#include <span>
#include <vector>

#include "magshell/linalg/factor.h"

namespace magshell {

/// Unknowns with the same neighbours, such as the three coordinates of a vertex, as one node.
struct Quotient {
    SparsePattern pattern;                // of the nodes
    std::vector<Index> starts, unknowns;  // of each node, one after another

    std::span<const Index> members(Index node) const {
        return {unknowns.data() + starts[node], unknowns.data() + starts[node + 1]};
    }
};

/// Every entry of `pattern` stands for a pair of members of an entry of the quotient's, and the other way round.
Quotient quotient_graph(const SparsePattern& pattern);

}  // namespace magshell
