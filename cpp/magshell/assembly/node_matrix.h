// A symmetric matrix of the nodes, the same along x, y and z: what Projective Dynamics has for stiffness.
#pragma once

#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// Entries are added in any order, a pair of nodes any number of times; finish() makes columns of them.
class NodeMatrix {
  public:
    explicit NodeMatrix(Index nodes = 0) : nodes_(nodes) {}

    void add_diagonal(Index node, double value) { entries_.push_back({node, node, value}); }
    /// Adds to (i, j) and to (j, i), which are the same place where one node takes two of an element.
    void add_pair(Index i, Index j, double value) {
        entries_.push_back({i < j ? i : j, i < j ? j : i, i == j ? 2.0 * value : value});
    }
    void finish();

    Index nodes() const { return nodes_; }
    /// The lower triangle by columns, every diagonal entry among them, first in its column.
    const std::vector<Index>& column_starts() const { return column_starts_; }
    const std::vector<Index>& rows() const { return rows_; }
    const std::vector<double>& values() const { return values_; }

    /// The product with x, three numbers a node.
    VectorXd times(const VectorXd& x) const;

  private:
    struct Entry {
        Index column, row;
        double value;
    };
    Index nodes_;
    std::vector<Entry> entries_;
    std::vector<Index> column_starts_, rows_;
    std::vector<double> values_;
};

}  // namespace magshell
