// Maps the node numbers of a dihedral stencil to those of the quadratic triangles on its two sides.
#pragma once

#include "magshell/strain/six_nodes.h"

namespace magshell {

// The nodes of a dihedral stencil that belong to the face on one side, and those across the edge.
struct SideNodes {
    std::array<int, 6>
        own;     // stencil nodes of the face's nodes i + 1, i + 2, middle(i), i, middle(i + 1), middle(i + 2)
    int beyond;  // first of the three stencil nodes across the edge
};
constexpr SideNodes left_side = {{0, 1, 2, 3, 4, 5}, 6}, right_side = {{1, 0, 2, 6, 8, 7}, 3};

constexpr std::array<int, 6> face_order(int i) {
    using six_nodes::middle;
    return {(i + 1) % 3, (i + 2) % 3, middle(i), i, middle((i + 1) % 3), middle((i + 2) % 3)};
}

/// Returns the position of stencil node a among the six nodes of its side.
constexpr int index_on_side(int a) {
    return a < 6 ? a : a - 3;
}

/// Returns the stencil node at a position of the left or the right side.
constexpr int node_on_side(int index, bool on_left) {
    return on_left || index < 3 ? index : index + 3;
}

}  // namespace magshell
