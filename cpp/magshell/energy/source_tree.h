// SourceTree: balls of magnetic source points, for sums over distant points whose time grows little faster than their number.
//
// Points belong to groups, those of one edge or of one face, which stay together. The groups of a box are split at the median along the
// longest side of the box; differences of round-off do not change the boxes of a regular mesh. Distant boxes see each other through
// expansions in solid harmonics about their centers (energy/solid_harmonics.h), up to a degree p:
//
//   sum_j q_j / |c + u - p_j|  =  sum L_l^m conj R_l^m(u),      L_l^m = (-1)^l sum M_k^n I_(l+k)^(m+n)(c - c'),  l + k <= p,
//                                                               M_k^n = sum_j q_j conj R_k^n(p_j - c')
//
// The energy of the expansions is a smooth function of the points, whose gradient and Hessian are exact, as long as the boxes stay in place.
// Two boxes act on each other alike.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"
#include "magshell/energy/own_field_pairs.h"

namespace magshell {

class SourceTree {
  public:
    struct Box {
        Index first = 0, last = 0;  // range of order()
        Index parent = -1;
        std::array<Index, 2> children{-1, -1};
        Vec3 center = Vec3::Zero();  // [m]
        double radius = 0.0;         // [m], of all points about the center
        bool is_leaf() const { return children[0] < 0; }
    };

    /// points: [m], group by group. accuracy: error of the sums at a distant box, over the sums of their parts.
    SourceTree(const std::vector<Vec3>& points, Index group_size, double accuracy);

    const std::vector<Box>& boxes() const { return boxes_; }
    /// Returns the boxes of each level, the root first.
    const std::vector<std::vector<Index>>& levels() const { return levels_; }
    /// Returns the groups, box by box.
    const std::vector<Index>& order() const { return order_; }
    Index group_size() const { return group_size_; }
    /// Returns the degree p of the expansions.
    int degree() const { return degree_; }

  private:
    Index split(Index first, Index last, Index parent, const std::vector<Vec3>& points);

    const Index group_size_;
    const int degree_;
    std::vector<Box> boxes_;
    std::vector<std::vector<Index>> levels_;
    std::vector<Index> order_;
    std::vector<Vec3> middles_;  // of groups
};

/// For each box of a tree the boxes of another that it sees through expansions, and for each leaf the leaves that it sees point by point.
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
