#include "magshell/linalg/residual.h"

#include <vector>

namespace magshell {

VectorXd residual(const SparsePattern& pattern, const double* values, const VectorXd& x, const VectorXd& b) {
    std::vector<long double> left(b.begin(), b.end());
    for (Index j = 0; j < pattern.size; ++j) {
        Index k = pattern.column_starts[j];
        const long double own = x[j];
        long double row_sum = values[k] * own;
        for (++k; k < pattern.column_starts[j + 1]; ++k) {
            const long double value = values[k];
            row_sum += value * x[pattern.rows[k]];
            left[pattern.rows[k]] -= value * own;
        }
        left[j] -= row_sum;
    }
    VectorXd rounded(pattern.size);
    for (Index j = 0; j < pattern.size; ++j) rounded[j] = static_cast<double>(left[j]);
    return rounded;
}

}  // namespace magshell
