// The inner loops of the dense factorization: products of slabs, held in registers.
#pragma once

#include "magshell/linalg/slabs.h"

namespace magshell::slabs {

// The widest vector of the processor: a slab's eight rows are one, two or four of them.
#if defined(__AVX512F__)
using Native = Lanes;
inline constexpr int group = 3;             // slabs multiplied at once: 3 x 8 sums fill the registers
inline constexpr int columns_at_once = 8;
#elif defined(__AVX__)
using Native [[gnu::vector_size(32), gnu::may_alias]] = double;
inline constexpr int group = 1;
inline constexpr int columns_at_once = 4;
#else
using Native [[gnu::vector_size(16), gnu::may_alias]] = double;
inline constexpr int group = 1;
inline constexpr int columns_at_once = 2;
#endif
inline constexpr int natives = sizeof(Lanes) / sizeof(Native);  // of a slab

/// sum(8 S, 8) -= rows(8 S, depth) columns(depth, 8); `columns` holds eight numbers every `Stride` for each step.
template <int S, int Stride>
[[gnu::always_inline]] inline void subtract_multiple(Lanes (&sum)[S][width], const double* const (&rows)[S],
                                                     const double* columns, Index depth) {
    for (int first = 0; first < width; first += columns_at_once) {
        Native part[S][columns_at_once][natives];
        const auto at = [&](int s, int j, int n) -> Native& { return reinterpret_cast<Native*>(&sum[s][first + j])[n]; };
        const auto each = [&](auto&& visit) __attribute__((always_inline)) {
#pragma GCC unroll 3
            for (int s = 0; s < S; ++s) {
#pragma GCC unroll 8
                for (int j = 0; j < columns_at_once; ++j) {
#pragma GCC unroll 4
                    for (int n = 0; n < natives; ++n) visit(s, j, n);
                }
            }
        };
        each([&](int s, int j, int n) __attribute__((always_inline)) { part[s][j][n] = at(s, j, n); });
        for (Index p = 0; p < depth; ++p) {
            Native row[S][natives];
#pragma GCC unroll 3
            for (int s = 0; s < S; ++s) {
#pragma GCC unroll 4
                for (int n = 0; n < natives; ++n) row[s][n] = reinterpret_cast<const Native*>(rows[s] + width * p)[n];
            }
            const double* value = columns + Stride * p + first;
            each([&](int s, int j, int n) __attribute__((always_inline)) { part[s][j][n] -= row[s][n] * value[j]; });
        }
        each([&](int s, int j, int n) __attribute__((always_inline)) { at(s, j, n) = part[s][j][n]; });
    }
}

/// target(8 S, columns <= 8) -= rows(8 S, depth) weights(depth, 8), or = - rows weights.
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

}  // namespace magshell::slabs
