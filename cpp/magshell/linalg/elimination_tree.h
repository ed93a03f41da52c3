// The elimination tree of a symmetric pattern, and how many entries each column of its factor has.
#pragma once

#include <vector>

#include "magshell/linalg/factor.h"

namespace magshell {

/// The strict upper triangle by columns (equally: the strict lower one by rows), for nodes in elimination order.
struct UpperPattern {
    std::vector<Index> starts, rows;  // rows of column j, all smaller than j, in no particular order
};

/// order[k] = the node eliminated k-th.
UpperPattern permuted_upper(const SparsePattern& pattern, const std::vector<Index>& order);

/// parent[j] = the row of the first entry below the diagonal of column j of L; -1 for a root.
std::vector<Index> elimination_tree(const UpperPattern& upper);

/// The nodes with every child before its parent and subtrees contiguous.
std::vector<Index> postorder(const std::vector<Index>& parent);

/// Entries of the first column of L of each node, its diagonal included, where a node is as many unknowns as
/// its weight.
std::vector<Index> column_counts(const UpperPattern& upper, const std::vector<Index>& parent,
                                 const std::vector<Index>& weights);

}  // namespace magshell
