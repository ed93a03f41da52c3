// SourceTree: boxes of magnetic source points, for sums over distant points whose time grows little faster than their number.
//
// Points belong to groups, those of one edge or of one face, which stay together. A box is split at the median along its longest side. It
// has axes of its own, the third across the sheet, and a grid of Chebyshev points, fewer along shorter sides. Distant boxes see each
// other through their grids g_k, with the Lagrange polynomials L_k of these [Wilson, Vaughn, Krasny 2021]:
//
//   sum_j q_j / |p - p_j|  =  sum_k L_k(p) sum_l w_l / |g_k - g_l|,     w_l = sum_j q_j L_l(p_j)
//
// The energy of the grids is a smooth function of the points, whose gradient and Hessian are exact, as long as the boxes stay in place.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"
#include "magshell/energy/own_field_pairs.h"

namespace magshell {

/// Returns Chebyshev point i of n on [-1, 1].
double chebyshev_point(int n, int i);

class SourceTree {
  public:
    struct Box {
        Index first = 0, last = 0;  // range of order()
        Index parent = -1;
        std::array<Index, 2> children{-1, -1};
        Vec3 center = Vec3::Zero(), half = Vec3::Zero();  // [m], half along the axes
        Mat3 axes = Mat3::Identity();                     // columns
        double radius = 0.0;                              // [m], of all points about the center
        std::array<int, 3> counts{};                      // grid points along the axes
        std::size_t grid = 0;                             // first point of the grid
        int n_grid() const { return counts[0] * counts[1] * counts[2]; }
        bool is_leaf() const { return children[0] < 0; }
    };

    static constexpr int most_counts = 16;  // points of a grid along an axis

    /// points: [m], group by group. accuracy: error of the sums at a distant box, over the sums of their parts.
    SourceTree(const std::vector<Vec3>& points, Index group_size, double accuracy);

    const std::vector<Box>& boxes() const { return boxes_; }
    /// Returns the boxes of each level, the root first.
    const std::vector<std::vector<Index>>& levels() const { return levels_; }
    /// Returns the groups, box by box.
    const std::vector<Index>& order() const { return order_; }
    Index group_size() const { return group_size_; }
    /// Returns the coordinates of the points of all grids [m]; each grid begins at a SIMD vector.
    const std::array<std::vector<double>, 3>& grids() const { return grids_; }

  private:
    Index split(Index first, Index last, Index parent, const Mat3& axes, const std::vector<Vec3>& points);
    void set_grid(Box& box);

    const Index group_size_, leaf_points_;
    const double digits_;
    std::vector<Box> boxes_;
    std::vector<std::vector<Index>> levels_;
    std::vector<Index> order_;
    std::vector<Vec3> middles_;  // of groups
    std::array<std::vector<double>, 3> grids_;
};

/// For each box of a tree the boxes of another that it sees through their grids, and for each leaf the leaves that it sees point by point.
struct BoxPairs {
    std::vector<std::vector<Index>> distant, near;
};

/// Finds the pairs of boxes of two trees. Sets those of the targets, and the same for the sources.
void pair_boxes(const SourceTree& targets, const SourceTree& sources, BoxPairs& of_targets,
                BoxPairs& of_sources);

/// Returns the sums at all target points over all sources except those of the same group if `same`, where both trees are one. Points are
/// in the order of their tree.
template <class T>
std::vector<SourceSums<T>> tree_sums(const SourceTree& targets, const std::vector<SourcePoint<T>>& at,
                                     const SourceTree& sources, const std::vector<SourcePoint<T>>& from,
                                     const BoxPairs& pairs, bool has_currents, bool same);

}  // namespace magshell
