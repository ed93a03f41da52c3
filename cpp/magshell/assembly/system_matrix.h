// The Hessian of a scene before supports remove dofs: lower triangle, compressed columns, in all dofs.
//
// The dofs are numbered node by node (three each), then the edge rotations (one each). Positions of entries are computed once, and
// evaluations add values in place. The position of a 3 x 3 block of nodes (i, j) is one number, because the three columns of a node
// have the same rows and each is shorter by one: the block stands at p, p + L - 1 and p + 2 L - 3, with L the length of the first column.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "magshell/body/stencil.h"
#include "magshell/core/large_memory.h"
#include "magshell/core/types.h"
#include "magshell/core/vector3.h"

namespace magshell {

class SystemMatrix {
  public:
    /// The position of a block of two nodes: twice its index, plus one if the block is stored transposed. Negative: absent.
    using Slot = Index;

    SystemMatrix() = default;
    /// cliques: dofs that are all coupled with each other, in addition to the stencils.
    SystemMatrix(Index nodes, Index rotations, const std::vector<Stencil>& stencils,
                 const std::vector<Clique>& cliques = {});

    Index nodes() const { return nodes_; }
    Index rotations() const { return rotations_; }
    Index size() const { return 3 * nodes_ + rotations_; }
    const std::vector<Index>& column_starts() const { return column_starts_; }
    const std::vector<Index>& rows() const { return rows_; }
    const LargeVector<double>& values() const { return values_; }
    LargeVector<double>& values() { return values_; }
    void clear_columns(Index first, Index last) {
        std::fill(values_.data() + column_starts_[first], values_.data() + column_starts_[last], 0.0);
    }
    std::size_t bytes() const;

    /// Returns the slot of the block with rows at node i and columns at node j, which must be coupled.
    Slot node_slot(Index i, Index j) const;
    /// Returns true if two nodes are coupled.
    bool couples(Index i, Index j) const;
    /// Returns the position of the entry (rotation, first component of node).
    Index rotation_slot(Index rotation, Index node) const;
    /// Returns the position of the entry (a, b) of two rotations.
    Index rotations_slot(Index a, Index b) const;
    /// Returns the length of the first of a node's three columns.
    Index column_length(Index node) const { return column_starts_[3 * node + 1] - column_starts_[3 * node]; }

    /// Computes y = A x with the symmetric matrix.
    void multiply(const double* x, double* y) const {
        std::fill(y, y + size(), 0.0);
        add_product(x, y);
    }
    /// Adds A x to y.
    void add_product(const double* x, double* y) const;
    /// Adds the diagonal of A, of all dofs.
    void add_diagonal(VectorXd& out) const;

    /// Adds one lane of block (i, j), i != j; length: column length of the node whose columns the slot is in.
    void add_block(Slot slot, Index length, const SimdMat3& block, int lane) {
        const double* from = reinterpret_cast<const double*>(&block) + lane;
        const bool transposed = slot & 1;
        const Index row_stride = (transposed ? 1 : 3) * SimdDouble::width,
                    column_stride = (transposed ? 3 : 1) * SimdDouble::width;
        double* to = values_.data() + (slot >> 1);
        for (int column = 0; column < 3; ++column) {
            const double* entry = from + column * column_stride;
            to[0] += entry[0];
            to[1] += entry[row_stride];
            to[2] += entry[2 * row_stride];
            to += length - 1 - column;
        }
    }

    /// Adds one lane of a block that is stored untransposed, at its position, in columns of this length.
    void add_lower_block(Index position, Index length, const SimdMat3& block, int lane) {
        const double* from = reinterpret_cast<const double*>(&block) + lane;
        constexpr int w = SimdDouble::width;
        double* to = values_.data() + position;
        for (int column = 0; column < 3; ++column) {
            to[0] += from[column * w];
            to[1] += from[(3 + column) * w];
            to[2] += from[(6 + column) * w];
            to += length - 1 - column;
        }
    }

    /// Adds one lane of a symmetric diagonal block of a node.
    void add_diagonal_block(Index node, const SimdMat3& block, int lane) {
        const double* from = reinterpret_cast<const double*>(&block) + lane;
        constexpr int w = SimdDouble::width;
        double* to = values_.data() + column_starts_[3 * node];
        const Index length = column_length(node);
        to[0] += from[0];
        to[1] += from[3 * w];
        to[2] += from[6 * w];
        to += length;
        to[0] += from[4 * w];
        to[1] += from[7 * w];
        to[length - 1] += from[8 * w];
    }

    /// Adds a block (i, j), i != j, and a symmetric diagonal block of a node.
    void add_block(Slot slot, Index length, const Mat3& block) {
        const bool transposed = slot & 1;
        double* to = values_.data() + (slot >> 1);
        for (int column = 0; column < 3; ++column) {
            for (int row = 0; row < 3; ++row) to[row] += transposed ? block(column, row) : block(row, column);
            to += length - 1 - column;
        }
    }
    void add_diagonal_block(Index node, const Mat3& block) {
        double* to = values_.data() + column_starts_[3 * node];
        const Index length = column_length(node);
        for (int row = 0; row < 3; ++row) to[row] += block(row, 0);
        to += length;
        to[0] += block(1, 1);
        to[1] += block(2, 1);
        to[length - 1] += block(2, 2);
    }

    /// Adds one lane of the block (i, j) of two places i > j of an element that the same node takes, and of its transpose.
    void add_block_and_transpose(Index node, const SimdMat3& block, int lane) {
        const SimdMat3 sum = block + transpose(block);
        add_diagonal_block(node, sum, lane);
    }

    /// Adds one lane of a row of three entries at a rotation_slot.
    void add_rotation_row(Index slot, Index length, const SimdVec3& row, int lane) {
        double* to = values_.data() + slot;
        to[0] += row.x[lane];
        to[length - 1] += row.y[lane];
        to[2 * length - 3] += row.z[lane];
    }

    void add(Index position, double value) { values_[position] += value; }
    void clear() { std::fill(values_.begin(), values_.end(), 0.0); }

  private:
    Index find(Index column, Index row) const;

    Index nodes_ = 0, rotations_ = 0;
    std::vector<Index> column_starts_, rows_;
    LargeVector<double> values_;
};

/// Calls visit(row, index in the first, index in the second) for the entries of a column of the sum of two matrices. An index is negative
/// if that matrix has no such entry. `other` may be null.
template <class Visit>
void each_entry(const SystemMatrix& matrix, const SystemMatrix* other, Index column, const Visit& visit) {
    Index k = matrix.column_starts()[column], l = other ? other->column_starts()[column] : 0;
    const Index end = matrix.column_starts()[column + 1],
                other_end = other ? other->column_starts()[column + 1] : 0;
    while (k < end || l < other_end) {
        const bool first = k < end && (l == other_end || matrix.rows()[k] <= other->rows()[l]),
                   second = l < other_end && (k == end || other->rows()[l] <= matrix.rows()[k]);
        visit(first ? matrix.rows()[k] : other->rows()[l], first ? k : -1, second ? l : -1);
        k += first;
        l += second;
    }
}

}  // namespace magshell
