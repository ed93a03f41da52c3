#include "magshell/linalg/multifrontal/equilibration.h"

#include <algorithm>
#include <cmath>

#include "magshell/linalg/pattern_checks.h"

namespace magshell {

namespace {

// One sweep of Ruiz (2001): divides rows and columns by the square root of their largest entry. Returns whether
// the scale has changed.
bool sweep(const SparsePattern& pattern, const LargeVector<double>& values, std::vector<double>& scale,
           std::vector<double>& largest) {
    std::fill(largest.begin(), largest.end(), 0.0);
    for (Index j = 0; j < pattern.size; ++j) {
        double largest_in_column = largest[j];
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            const double size = std::abs(values[k]) * (scale[j] * scale[pattern.rows[k]]);
            largest_in_column = std::max(largest_in_column, size);
            largest[pattern.rows[k]] = std::max(largest[pattern.rows[k]], size);
        }
        largest[j] = largest_in_column;
    }
    bool changed = false;
    for (Index j = 0; j < pattern.size; ++j) {
        const int half = largest[j] > 0.0 ? std::ilogb(largest[j]) / 2 : 0;
        if (half == 0) continue;
        scale[j] *= std::ldexp(1.0, -half);
        changed = true;
    }
    return changed;
}

// Applies a scale to the values. Returns the largest of them.
double apply(const SparsePattern& pattern, const std::vector<double>& scale, LargeVector<double>& values) {
    double largest_of_all = 0.0;
    for (Index j = 0; j < pattern.size; ++j) {
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            values[k] *= scale[j] * scale[pattern.rows[k]];
            largest_of_all = std::max(largest_of_all, std::abs(values[k]));
        }
    }
    return largest_of_all;
}

}  // namespace

// Two sweeps are enough for pivoting inside fronts.
double equilibrate(const SparsePattern& pattern, LargeVector<double>& values, std::vector<double>& scale) {
    check_finite(values);
    std::fill(scale.begin(), scale.end(), 1.0);
    std::vector<double> largest(pattern.size);
    for (int k = 0; k < 2; ++k) sweep(pattern, values, scale, largest);
    return apply(pattern, scale, values);
}

double equilibrate_further(const SparsePattern& pattern, LargeVector<double>& values,
                           std::vector<double>& scale) {
    // [sweeps] Each of them halves the exponents of the largest entries, so that this many are never needed
    // unless the scale has no limit. plain-words: ok
    constexpr int most_sweeps = 20;
    std::vector<double> more(pattern.size, 1.0), largest(pattern.size);
    for (int k = 0; k < most_sweeps && sweep(pattern, values, more, largest); ++k) continue;
    for (Index j = 0; j < pattern.size; ++j) scale[j] *= more[j];
    return apply(pattern, more, values);
}

}  // namespace magshell
