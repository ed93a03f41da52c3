// Quotient: a graph whose indistinguishable unknowns are joined, which makes it faster to order.
#pragma once

#include <span>
#include <vector>

#include "magshell/linalg/factor.h"

namespace magshell {

/// Unknowns with the same neighbours, such as the three coordinates of a vertex, as one node.
struct Quotient {
    SparsePattern pattern;                // of the nodes
    std::vector<Index> starts, unknowns;  // unknowns of each node, one after another

    std::span<const Index> members(Index node) const {
        return {unknowns.data() + starts[node], unknowns.data() + starts[node + 1]};
    }
};

/// Creates the quotient: every entry of `pattern` stands for a pair of members of an entry of the quotient's
/// pattern, and vice versa.
Quotient quotient_graph(const SparsePattern& pattern);

}  // namespace magshell
