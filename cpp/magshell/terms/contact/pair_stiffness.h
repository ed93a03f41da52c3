// PairStiffness: the positive semidefinite stiffness of a contact pair, without the part of rotating normals: a
// 3x3 matrix that acts on the difference of the pair's closest points.
#pragma once

#include "magshell/contact/proximity.h"

namespace magshell {

/// The block between nodes i and j is weights[i] weights[j] stiffness.
struct PairStiffness {
    std::array<Index, 4> nodes;
    int count;
    PairWeights weights;
    Mat3 stiffness;  // [N/m], symmetric, positive semidefinite
};

}  // namespace magshell
