// A graph with indistinguishable unknowns joined, which is quicker to order.
#pragma once

#include <vector>

#include "magshell/linalg/factor.h"

namespace magshell {

/// Unknowns with the same neighbours, such as the three coordinates of a vertex, as one node.
struct Quotient {
    SparsePattern pattern;                    // of the nodes
    std::vector<std::vector<Index>> members;  // the unknowns of each node

    /// Whether nearly all nodes have the same number of members. Orderings count nodes, so only then do they
    /// count right.
    bool is_even() const;
};

Quotient quotient_graph(const SparsePattern& pattern);

}  // namespace magshell
