// The blocks of an element's Hessian, from those of all its nodes but the first, and the way round that the matrix
// takes them.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/core/pack_functions.h"

namespace magshell {

/// Puts in place, or adds, tangent.block(k, l) of a point of integration.
template <int N, class Tangent>
void add_blocks(const Tangent& tangent, bool first, Pack33 h[]) {
    for (int k = 1; k < N; ++k)
        for (int l = 1; l <= k; ++l) {
            Pack33& into = h[lower_index(k, l)];
            if (first)
                into = tangent.block(k, l);
            else
                into += tangent.block(k, l);
        }
}

/// Those of the first node: a translation changes nothing, so the blocks of a row add up to zero.
template <int N>
void complete_blocks(Pack33 h[]) {
    for (int k = 1; k < N; ++k) {
        Pack33 sum = h[lower_index(k, k)];
        for (int l = 1; l < k; ++l) sum += h[lower_index(k, l)];
        for (int l = k + 1; l < N; ++l) sum += transpose(h[lower_index(l, k)]);
        h[lower_index(k, 0)] = -sum;
    }
    Pack33 sum = h[lower_index(1, 0)];
    for (int k = 2; k < N; ++k) sum += h[lower_index(k, 0)];
    h[0] = -sum;
}

/// Transposes a block in these lanes, a bit each.
inline void transpose_in(unsigned lanes, Pack33& block) {
    const auto chosen = lanes_with_bits(lanes);
    for (int r = 1; r < 3; ++r)
        for (int c = 0; c < r; ++c) {
            const Pack::Lanes below = block.at[3 * r + c].lanes, above = block.at[3 * c + r].lanes;
            block.at[3 * r + c].lanes = chosen ? above : below;
            block.at[3 * c + r].lanes = chosen ? below : above;
        }
}

}  // namespace magshell
