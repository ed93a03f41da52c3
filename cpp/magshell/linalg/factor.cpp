#include "magshell/linalg/factor.h"

#include "magshell/core/errors.h"
#include "magshell/linalg/backends.h"
#include "magshell/linalg/pattern_checks.h"
#include "magshell/linalg/supernodal_ldlt.h"

namespace magshell {

std::unique_ptr<Factor> analyze(const SparsePattern& pattern, const FactorOptions& options) {
    check_pattern(pattern);
    switch (options.backend) {
        case Backend::supernodal:
            return std::make_unique<SupernodalLdlt>(pattern, options.ordering);
        case Backend::cholmod:
            return make_cholmod_factor(pattern, options.ordering);
        case Backend::eigen:
            return make_eigen_factor(pattern);
    }
    throw InvalidInput("unknown backend");
}

bool is_built(Backend backend) {
#ifdef MAGSHELL_HAS_CHOLMOD
    (void)backend;
    return true;
#else
    return backend != Backend::cholmod;
#endif
}

}  // namespace magshell
