#include "magshell/linalg/factor.h"

#include "magshell/core/errors.h"
#include "magshell/linalg/backends.h"
#include "magshell/linalg/multifrontal/supernodal_ldlt.h"
#include "magshell/linalg/pattern_checks.h"

namespace magshell {

std::unique_ptr<Factor> analyze(std::shared_ptr<const SparsePattern> pattern, const FactorOptions& options) {
    check_pattern(*pattern);
    check_points(*pattern, options.points);
    if (!is_built(options.ordering))
        throw InvalidInput("magshell was built without METIS; use the ordering \"best\"");
    switch (options.backend) {
        case Backend::supernodal:
            return std::make_unique<SupernodalLdlt>(std::move(pattern), options);
        case Backend::cholmod:
            return make_cholmod_factor(std::move(pattern), options.ordering);
        case Backend::eigen:
            return make_eigen_factor(std::move(pattern));
    }
    throw InvalidInput("unknown backend");
}

VectorXd product(const SparsePattern& pattern, const double* values, const VectorXd& x) {
    VectorXd y = VectorXd::Zero(pattern.size);
    for (Index j = 0; j < pattern.size; ++j) {
        Index k = pattern.column_starts[j];
        double row_sum = values[k] * x[j];
        for (++k; k < pattern.column_starts[j + 1]; ++k) {
            row_sum += values[k] * x[pattern.rows[k]];
            y[pattern.rows[k]] += values[k] * x[j];
        }
        y[j] += row_sum;
    }
    return y;
}

#ifdef MAGSHELL_HAS_CHOLMOD
bool is_built(Backend) {
    return true;
}
bool is_built(Ordering) {
    return true;
}
#else
bool is_built(Backend backend) {
#ifdef MAGSHELL_TESTING
    return backend != Backend::cholmod;
#else
    return backend == Backend::supernodal;
#endif
}
bool is_built(Ordering ordering) {
    return ordering != Ordering::metis;
}
#endif

}  // namespace magshell
