// The inner loops of the dense factorization: products of slabs, held in registers.
#pragma once

#include "magshell/linalg/multifrontal/slabs.h"

namespace magshell::slabs {
inline namespace MAGSHELL_FAMILY {

// Number of slabs and columns that a product handles at once: as many as fit in registers. Changes time only;
// fixed by test_definite_matrices_are_solved_to_rounding. plain-words: ok
inline constexpr int group = native_bytes == 64 ? 3 : 1;
// [columns] at once; plain-words: ok
inline constexpr int columns_at_once = native_bytes == 64 ? 8 : native_bytes == 32 ? 4 : 2;

/// Computes sum(8 S, 8) -= rows(8 S, depth) columns(depth, 8); `columns` holds eight numbers every `Stride` for
/// each step.
template <int S, int Stride>
[[gnu::always_inline]] inline void subtract_multiple(Lanes (&sum)[S][width], const double* const (&rows)[S],
                                                     const double* columns, Index depth) {
#pragma GCC unroll 4
    for (int first = 0; first < width; first += columns_at_once) {
        Lanes part[S][columns_at_once];
#pragma GCC unroll 3
        for (int s = 0; s < S; ++s) {
#pragma GCC unroll 8
            for (int j = 0; j < columns_at_once; ++j) part[s][j] = sum[s][first + j];
        }
        for (Index p = 0; p < depth; ++p) {
            Lanes row[S];
#pragma GCC unroll 3
            for (int s = 0; s < S; ++s) row[s] = lanes(rows[s] + width * p);
#pragma GCC unroll 8
            for (int j = 0; j < columns_at_once; ++j) {
                const double value = columns[Stride * p + first + j];
#pragma GCC unroll 3
                for (int s = 0; s < S; ++s) part[s][j] -= row[s] * value;
            }
        }
#pragma GCC unroll 3
        for (int s = 0; s < S; ++s) {
#pragma GCC unroll 8
            for (int j = 0; j < columns_at_once; ++j) sum[s][first + j] = part[s][j];
        }
    }
}

/// Computes target(8 S, columns <= 8) -= rows(8 S, depth) weights(depth, 8), or = - rows weights.
template <int S, bool Overwrite>
[[gnu::noinline]] void subtract_product(double* const (&target)[S], const double* const (&rows)[S],
                                        const double* weights, Index depth, Index columns) {
    Lanes sum[S][width] = {};
    subtract_multiple<S, width>(sum, rows, weights, depth);
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

}  // namespace MAGSHELL_FAMILY
}  // namespace magshell::slabs
