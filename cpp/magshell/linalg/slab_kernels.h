// The inner loops of the dense factorization: products of slabs, held in registers.
#pragma once

#include "magshell/linalg/slabs.h"

namespace magshell::slabs {

// How many slabs a product handles at once: as many as leave their sums in registers, eight columns each.
#if defined(__AVX512F__)
inline constexpr int group = 3;
#else
inline constexpr int group = 1;
#endif

/// sum(8 S, 8) += sign * rows(8 S, depth) columns(depth, 8); `columns` holds eight numbers every `Stride` for each step.
template <int S, int Stride, int Sign>
[[gnu::always_inline]] inline void multiply(Lanes (&sum)[S][width], const double* const (&rows)[S],
                                            const double* columns, Index depth) {
    for (Index p = 0; p < depth; ++p) {
        Lanes row[S];
#pragma GCC unroll 3
        for (int s = 0; s < S; ++s) row[s] = lanes(rows[s] + width * p);
#pragma GCC unroll 8
        for (int j = 0; j < width; ++j) {
            const double value = columns[Stride * p + j];
#pragma GCC unroll 3
            for (int s = 0; s < S; ++s) {
                if constexpr (Sign > 0) sum[s][j] += row[s] * value;
                else sum[s][j] -= row[s] * value;
            }
        }
    }
}

/// target(8 S, columns <= 8) -= rows(8 S, depth) weights(depth, 8), or = - rows weights.
template <int S, bool Overwrite>
[[gnu::noinline]] void subtract_product(double* const (&target)[S], const double* const (&rows)[S],
                                        const double* weights, Index depth, Index columns) {
    Lanes sum[S][width] = {};
    multiply<S, width, -1>(sum, rows, weights, depth);
    if (columns == width) {
#pragma GCC unroll 3
        for (int s = 0; s < S; ++s) {
#pragma GCC unroll 8
            for (int j = 0; j < width; ++j) {
                Lanes& to = lanes(target[s] + width * j);
                to = Overwrite ? sum[s][j] : to + sum[s][j];
            }
        }
    } else {
        for (int s = 0; s < S; ++s) {
            for (Index j = 0; j < columns; ++j) {
                Lanes& to = lanes(target[s] + width * j);
                to = Overwrite ? sum[s][j] : to + sum[s][j];
            }
        }
    }
}

/// Calls body.operator()<S>(i) for groups of slabs i ... i + S - 1 that together are [first, last).
template <class Body>
[[gnu::always_inline]] inline void for_groups(Index first, Index last, Body&& body) {
    if constexpr (group == 3) {
        while (last - first > 4 || last - first == 3) {
            body.template operator()<3>(first);
            first += 3;
        }
        while (last - first >= 2) {
            body.template operator()<2>(first);
            first += 2;
        }
    }
    for (; first < last; ++first) body.template operator()<1>(first);
}

}  // namespace magshell::slabs
