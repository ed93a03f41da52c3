// How a six-node face and a fold about one of its edges number the same nodes.
#pragma once

#include "magshell/strain/six_nodes.h"

namespace magshell {

// A fold's first six and last three nodes as a face beside it numbers its own six and what is beyond: [on its left][...].
struct SideNodes {
    std::array<int, 6>
        own;     // of the fold, for the face's nodes i + 1, i + 2, middle(i), i, middle(i + 1), middle(i + 2)
    int beyond;  // the first of three
};
constexpr SideNodes left_side = {{0, 1, 2, 3, 4, 5}, 6}, right_side = {{1, 0, 2, 6, 8, 7}, 3};

constexpr std::array<int, 6> face_order(int i) {
    using six_nodes::middle;
    return {(i + 1) % 3, (i + 2) % 3, middle(i), i, middle((i + 1) % 3), middle((i + 2) % 3)};
}

/// Of a side's six nodes one after another, the place of the fold's node a.
constexpr int index_on_side(int a) {
    return a < 6 ? a : a - 3;
}

/// The fold's node at a place of its left side, or its right one.
constexpr int node_on_side(int index, bool on_left) {
    return on_left || index < 3 ? index : index + 3;
}

}  // namespace magshell
