// A tree of boxes around things in space: what is far away is passed over in whole branches.
#pragma once

#include <vector>

#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

struct Bounds {
    Vec3 low, high;

    /// Whether they are within `margin` of each other along every axis.
    bool meets(const Bounds& other, double margin) const {
        return ((low - other.high).array() <= margin).all() && ((other.low - high).array() <= margin).all();
    }
};

inline Bounds bounds_around(const Vec3 (&corners)[3]) {
    return {corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]),
            corners[0].cwiseMax(corners[1]).cwiseMax(corners[2])};
}

class BoxTree {
  public:
    struct Node {
        Bounds bounds;
        Index first, count;  // of items() in a leaf; of an inner node, the left child follows it and
        Index right;         // the right one is here; -1 in a leaf
    };

    /// Halves the things at the median of their centers along the longest side, until few are left. A tree of
    /// nothing is one empty leaf.
    BoxTree(const std::vector<Bounds>& boxes, const std::vector<Vec3>& centers);

    /// The root first.
    const std::vector<Node>& nodes() const { return nodes_; }
    /// The numbers of the things, leaf by leaf.
    const std::vector<Index>& items() const { return items_; }

  private:
    Index build(Index first, Index count, const std::vector<Bounds>& boxes, const std::vector<Vec3>& centers);

    std::vector<Index> items_;
    std::vector<Node> nodes_;
};

/// Around faces (n_f, 3) with their vertices at `positions` (n_v, 3).
BoxTree tree_of_faces(const Rows3& positions, const Rows3i& faces);

}  // namespace magshell
