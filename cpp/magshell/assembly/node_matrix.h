// A symmetric matrix between nodes, the same along x, y and z: the projective stiffness of Projective Dynamics.
//
// An edge rotation (a scalar) is represented by a point after the nodes. Of its three components only the one along the normal
// of the shell is a dof.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// Entries may be added in any order and repeatedly; finish() compresses them to columns.
class NodeMatrix {
  public:
    explicit NodeMatrix(Index nodes = 0, Index scalars = 0) : nodes_(nodes), points_(nodes + scalars) {}

    void add_diagonal(Index point, double value) { entries_.push_back({point, point, value}); }
    /// Adds to (i, j) and (j, i). These coincide if one node takes two places of an element; the entry then counts twice.
    void add_pair(Index i, Index j, double value) {
        entries_.push_back({i < j ? i : j, i < j ? j : i, i == j ? 2.0 * value : value});
    }
    void finish();

    Index nodes() const { return nodes_; }
    /// The nodes come first, then the scalars.
    Index points() const { return points_; }
    Index scalars() const { return points_ - nodes_; }
    Index point(Index scalar) const { return nodes_ + scalar; }

    /// A face adjacent to a scalar, by its corners: the normal of the scalar is the mean of those of its faces.
    struct AdjacentFace {
        Index scalar;
        std::array<Index, 3> corners;
    };
    void add_adjacent_face(Index scalar, const std::array<Index, 3>& corners) {
        adjacent_faces_.push_back({scalar, corners});
    }
    const std::vector<AdjacentFace>& adjacent_faces() const { return adjacent_faces_; }

    /// The lower triangle by columns; every diagonal entry is present and first in its column.
    const std::vector<Index>& column_starts() const { return column_starts_; }
    const std::vector<Index>& rows() const { return rows_; }
    const std::vector<double>& values() const { return values_; }

    /// Returns the product with x, three components per point.
    VectorXd times(const VectorXd& x) const;

  private:
    struct Entry {
        Index column, row;
        double value;
    };
    Index nodes_, points_;
    std::vector<Entry> entries_;
    std::vector<AdjacentFace> adjacent_faces_;
    std::vector<Index> column_starts_, rows_;
    std::vector<double> values_;
};

/// Linear combinations of the positions of a few points, as the rows J of an element: its stiffness C contributes J^T C J.
class NodeRows {
  public:
    explicit NodeRows(std::size_t count) : rows_(count) {}
    void add(std::size_t row, Index point, double value) { rows_[row].push_back({point, value}); }
    /// Adds J^T C J, where stiffness(r, s) returns C.
    template <class Stiffness>
    void add_to(NodeMatrix& out, const Stiffness& stiffness) const {
        for (std::size_t r = 0; r < rows_.size(); ++r)
            for (std::size_t s = 0; s <= r; ++s) {
                const double factor = stiffness(static_cast<int>(r), static_cast<int>(s));
                if (r == s)
                    add_square(out, rows_[r], factor);
                else
                    for (const Part& a : rows_[r])
                        for (const Part& b : rows_[s])
                            out.add_pair(a.point, b.point, factor * a.value * b.value);
            }
    }

  private:
    struct Part {
        Index point;
        double value;
    };
    static void add_square(NodeMatrix& out, const std::vector<Part>& row, double factor) {
        for (std::size_t a = 0; a < row.size(); ++a) {
            out.add_diagonal(row[a].point, factor * row[a].value * row[a].value);
            for (std::size_t b = 0; b < a; ++b)
                out.add_pair(row[a].point, row[b].point, factor * row[a].value * row[b].value);
        }
    }
    std::vector<std::vector<Part>> rows_;
};

}  // namespace magshell
