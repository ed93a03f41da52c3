#include "magshell/linalg/factor.h"

#include "magshell/linalg/pattern_checks.h"
#include "magshell/linalg/supernodal_ldlt.h"

namespace magshell {

std::unique_ptr<Factor> analyze(const SparsePattern& pattern, const FactorOptions& options) {
    check_pattern(pattern);
    return std::make_unique<SupernodalLdlt>(pattern, options.ordering);
}

}  // namespace magshell
