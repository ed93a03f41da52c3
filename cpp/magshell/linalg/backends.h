// Creates the factorizations by other libraries. Each is in a file of its own, so that no library's header is
// included elsewhere.
#pragma once

#include <memory>

#include "magshell/linalg/factor.h"

namespace magshell {

/// Creates CHOLMOD's supernodal L L^T. Throws InvalidInput if magshell was built without CHOLMOD.
std::unique_ptr<Factor> make_cholmod_factor(std::shared_ptr<const SparsePattern> pattern, Ordering ordering);

/// Creates Eigen's simplicial L D L^T with Eigen's own AMD ordering. Throws InvalidInput if magshell was built without
/// MAGSHELL_TESTING.
std::unique_ptr<Factor> make_eigen_factor(std::shared_ptr<const SparsePattern> pattern);

}  // namespace magshell
