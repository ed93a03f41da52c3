// The blocks of an element Hessian: all blocks follow from those of the nodes except the first, by translation invariance.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/core/simd_functions.h"

namespace magshell {

/// Sets, or adds, the blocks tangent.block(k, l) of an integration point.
template <int N, class Tangent>
void add_blocks(const Tangent& tangent, bool first, SimdMat3 h[]) {
    for (int k = 1; k < N; ++k)
        for (int l = 1; l <= k; ++l) {
            SimdMat3& into = h[lower_index(k, l)];
            if (first)
                into = tangent.block(k, l);
            else
                into += tangent.block(k, l);
        }
}

/// Computes the blocks of the first node: a translation causes no force, so the blocks of each row sum to zero.
template <int N>
void complete_blocks(SimdMat3 h[]) {
    for (int k = 1; k < N; ++k) {
        SimdMat3 sum = h[lower_index(k, k)];
        for (int l = 1; l < k; ++l) sum += h[lower_index(k, l)];
        for (int l = k + 1; l < N; ++l) sum += transpose(h[lower_index(l, k)]);
        h[lower_index(k, 0)] = -sum;
    }
    SimdMat3 sum = h[lower_index(1, 0)];
    for (int k = 2; k < N; ++k) sum += h[lower_index(k, 0)];
    h[0] = -sum;
}

/// Transposes a block in the lanes whose bit is set.
inline void transpose_in(unsigned lanes, SimdMat3& block) {
    const auto chosen = lanes_with_bits(lanes);
    for (int r = 1; r < 3; ++r)
        for (int c = 0; c < r; ++c) {
            const SimdDouble::Lanes below = block.at[3 * r + c].lanes, above = block.at[3 * c + r].lanes;
            block.at[3 * r + c].lanes = chosen ? above : below;
            block.at[3 * c + r].lanes = chosen ? below : above;
        }
}

}  // namespace magshell
