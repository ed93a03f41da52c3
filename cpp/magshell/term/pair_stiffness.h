// What a pair that touches adds to a stiffness, of what is never negative and does not turn: a small matrix on the
// difference of its closest points.
#pragma once

#include "magshell/contact/proximity.h"

namespace magshell {

/// Between nodes i and j: weights[i] weights[j] stiffness.
struct PairStiffness {
    std::array<Index, 4> nodes;
    int count;
    PairWeights weights;
    Mat3 stiffness;  // [N/m], symmetric, positive semidefinite
};

}  // namespace magshell
