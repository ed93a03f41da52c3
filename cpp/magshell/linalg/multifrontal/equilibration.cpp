#include "magshell/linalg/multifrontal/equilibration.h"

#include <algorithm>
#include <cmath>

#include "magshell/linalg/pattern_checks.h"

namespace magshell {

// Ruiz (2001): divides rows and columns by the square root of their largest entry, repeatedly; two sweeps are
// enough for pivoting.
double equilibrate(const SparsePattern& pattern, LargeVector<double>& values, std::vector<double>& scale) {
    check_finite(values);
    std::fill(scale.begin(), scale.end(), 1.0);
    std::vector<double> largest(pattern.size);
    for (int sweep = 0; sweep < 2; ++sweep) {
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
        for (Index j = 0; j < pattern.size; ++j) {
            if (largest[j] > 0.0) scale[j] *= std::ldexp(1.0, -std::ilogb(largest[j]) / 2);
        }
    }
    double largest_of_all = 0.0;
    for (Index j = 0; j < pattern.size; ++j) {
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            values[k] *= scale[j] * scale[pattern.rows[k]];
            largest_of_all = std::max(largest_of_all, std::abs(values[k]));
        }
    }
    return largest_of_all;
}

}  // namespace magshell
