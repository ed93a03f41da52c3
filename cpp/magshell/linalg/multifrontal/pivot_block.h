// PivotBlock: L D L^T of a small dense symmetric block, with 1x1 and 2x2 pivots chosen inside it (Bunch and
// Kaufman 1977).
#pragma once

#include <array>

#include "magshell/linalg/multifrontal/slabs.h"

namespace magshell {

/// The pivots of some columns of L: D has diagonal[k] and, for a 2x2 pivot in k, k + 1, coupling[k] off the
/// diagonal; coupling is zero elsewhere.
struct Pivots {
    double* diagonal;
    double* coupling;
};

// Solves D z = y for the 1x1 or 2x2 pivot that begins at k; T is a number or eight of them. Returns the number
// of rows of the pivot.
template <class T>
Index divide_by_pivot(const Pivots& d, Index k, T& first, T* second) {
    const double a = d.diagonal[k], b = d.coupling[k];
    if (b == 0.0) {
        first = first / a;
        return 1;
    }
    const double c = d.diagonal[k + 1];
    const double determinant = a * c - b * b;
    const T y = first, z = *second;
    first = (y * c - z * b) / determinant;
    *second = (z * a - y * b) / determinant;
    return 2;
}

struct PivotTally {
    Index negative = 0, perturbed = 0;
    double growth = 0.0;  // max |l_ik w_ik|, w = L D
    void add(const PivotTally& other) {
        negative += other.negative;
        perturbed += other.perturbed;
        growth = growth < other.growth ? other.growth : growth;
    }
};

// The matrix is scaled so that its largest entries are about 1. A pivot below `tiny_pivot` is rounding; it is
// replaced by `perturbed_pivot`, large enough to divide by and small enough for a few steps of refinement to undo.
// Both [-], fixed by test_a_singular_matrix_is_reported and test_a_saddle_point_with_a_small_corner_is_solved.
inline constexpr double tiny_pivot = 1e-14;
// [-] See above; test_a_singular_matrix_is_reported
inline constexpr double perturbed_pivot = 1e-8;

inline namespace MAGSHELL_FAMILY {

struct PivotBlock {
    // [columns] among which pivots are chosen; test_indefinite_matrices_are_solved_and_their_inertia_is_right
    static constexpr Index max_size = 32;
    static constexpr Index stride = max_size;

    Index size = 0;
    bool permuted = false;
    std::array<std::int8_t, max_size> order;  // row k of the factorization is row order[k] of the block
    alignas(64) double entries[max_size *
                               stride];  // by columns; in: both triangles; out: unit lower L, zeros above

    void factorize(Pivots pivots, PivotTally& tally);
};

}  // namespace MAGSHELL_FAMILY

}  // namespace magshell
