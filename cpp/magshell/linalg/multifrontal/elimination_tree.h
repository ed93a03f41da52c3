// The elimination tree of a symmetric pattern, and the number of entries of each column of its factor.
#pragma once

#include <vector>

#include "magshell/linalg/factor.h"

namespace magshell {

/// The strict upper triangle by columns (equivalently: the strict lower one by rows), for nodes in elimination
/// order.
struct UpperPattern {
    std::vector<Index> starts, rows;  // rows of column j, all smaller than j, in any order
};

/// Permutes a pattern; order[k] is the node eliminated k-th.
UpperPattern permuted_upper(const SparsePattern& pattern, const std::vector<Index>& order);

/// Returns parent, where parent[j] is the row of the first entry below the diagonal of column j of L; -1 for a
/// root.
std::vector<Index> elimination_tree(const UpperPattern& upper);

/// Returns the nodes with every child before its parent and subtrees contiguous.
std::vector<Index> postorder(const std::vector<Index>& parent);

/// Returns the number of entries, diagonal included, of the first column of L of each node; a node stands for
/// as many unknowns as its weight.
std::vector<Index> column_counts(const UpperPattern& upper, const std::vector<Index>& parent,
                                 const std::vector<Index>& weights);

}  // namespace magshell
