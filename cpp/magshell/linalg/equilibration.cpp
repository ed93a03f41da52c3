#include "magshell/linalg/equilibration.h"

#include <algorithm>
#include <cmath>

#include "magshell/linalg/pattern_checks.h"

namespace magshell {

// Ruiz (2001): divide rows and columns by the square root of their largest entry, repeatedly; twice is enough
// for pivoting.
double equilibrate(const SparsePattern& pattern, const double* values, std::vector<double>& scale,
                   std::vector<double>& scaled) {
    check_finite(values, pattern.rows.size());
    std::copy_n(values, pattern.rows.size(), scaled.begin());
    std::fill(scale.begin(), scale.end(), 1.0);
    std::vector<double> largest(pattern.size), factor(pattern.size);
    for (int sweep = 0; sweep < 2; ++sweep) {
        std::fill(largest.begin(), largest.end(), 0.0);
        for (Index j = 0; j < pattern.size; ++j) {
            double largest_in_column = largest[j];
            for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
                const double size = std::abs(scaled[k]);
                largest_in_column = std::max(largest_in_column, size);
                largest[pattern.rows[k]] = std::max(largest[pattern.rows[k]], size);
            }
            largest[j] = largest_in_column;
        }
        for (Index j = 0; j < pattern.size; ++j) {
            factor[j] = largest[j] > 0.0 ? std::ldexp(1.0, -std::ilogb(largest[j]) / 2) : 1.0;
            scale[j] *= factor[j];
        }
        for (Index j = 0; j < pattern.size; ++j) {
            for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
                scaled[k] *= factor[j] * factor[pattern.rows[k]];
            }
        }
    }
    double largest_of_all = 0.0;
    for (const double value : scaled) largest_of_all = std::max(largest_of_all, std::abs(value));
    return largest_of_all;
}

}  // namespace magshell
