// BoxTree: a tree of bounding boxes around items in space, which lets searches skip whole branches that are far
// away.
#pragma once

#include <vector>

#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

struct Bounds {
    Vec3 low, high;

    /// Returns true if both boxes are within `margin` of each other along every axis.
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
        // range of items() of a leaf; the left child of an inner node follows it, the right one
        Index first, count;
        Index right;  // is at this index; -1 in a leaf
    };

    /// Builds the tree by splitting the items at the median of their centers along the longest side, until few
    /// are left. Without items the tree is one empty leaf.
    BoxTree(const std::vector<Bounds>& boxes, const std::vector<Vec3>& centers);

    /// Returns the nodes, the root first.
    const std::vector<Node>& nodes() const { return nodes_; }
    /// Returns the numbers of the items, leaf by leaf.
    const std::vector<Index>& items() const { return items_; }

  private:
    Index build(Index first, Index count, const std::vector<Bounds>& boxes, const std::vector<Vec3>& centers);

    std::vector<Index> items_;
    std::vector<Node> nodes_;
};

/// Builds a tree around the faces (n_f, 3) of a mesh with vertices at `positions` (n_v, 3) [m].
BoxTree tree_of_faces(const Rows3& positions, const Rows3i& faces);

}  // namespace magshell
